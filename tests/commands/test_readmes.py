"""The READMEs: links, lengths, and the tables made from the code.

`python tests/commands/test_readmes.py` writes these tables anew.
"""

import ast
import re
import shutil
import sys

import pytest
from cases import integrated
from command import ROOT, run
from golf_physics.variables import VARIABLES
from scipy.integrate import solve_ivp

from golf_impact.document import tables as document_tables

FOLDERS = ("", "fmu_src", "fmu_src/golf_physics/companions", "build", "scenarios", "tests")


def markdown(columns, rows):
    """A table as Markdown."""
    lines = ["| " + " | ".join(cells) + " |" for cells in (columns, *rows)]
    return "\n".join((lines[0], "|" + "---|" * len(columns), *lines[1:]))


def variables():
    """The table of variables as Markdown."""
    rows = []
    for v in VARIABLES:
        start = "" if v.start is None else f"{v.start:g}"
        allowed = "" if v.causality == "output" else v.allowed
        unit = "" if v.unit in ("", "1") else v.unit.replace(".", "·")
        kind = "Boolean" if v.type == "Boolean" else unit
        rows.append([f"`{v.name}`", v.causality, kind, start, allowed, v.description])
    return markdown(("name", "causality", "unit", "start", "allowed", "meaning"), rows)


def document():
    """What the document says and how it is read, as Markdown."""
    parts = []
    for n, (title, columns, cells) in enumerate(document_tables()):
        rows = [[*row[:-1], f"`{row[-1]}`"] if n == 0 else row for row in cells]
        parts.append(f"{title}:\n\n{markdown(columns, rows)}")
    return "\n\n".join(parts)


README = ROOT / "fmu_src" / "README.md"

#: By the name in the comment before a table in it.
TABLES = {"variables": variables, "document": document}


def updated(text):
    """The README with these tables as they are now."""
    pattern = r"(<!-- (\w+):[^>]*-->\n).*?(<!-- end -->)"
    text, number = re.subn(
        pattern, lambda found: f"{found[1]}{TABLES[found[2]]()}\n{found[3]}", text, flags=re.DOTALL
    )
    assert number == len(TABLES)
    return text


def test_tables_are_those_of_the_code():
    text = README.read_text("utf-8")
    assert updated(text) == text, "run `python tests/commands/test_readmes.py`"


def test_what_is_implemented_where_exists():
    for row in document_tables()[0][2]:
        path, _, symbol = row[-1].partition(": ")
        tree = ast.parse((ROOT / path).read_text("utf-8"))
        for name in symbol.split("."):
            names = {getattr(node, "name", None): node for node in tree.body}
            assert name in names, row
            tree = names[name]


def test_the_first_page_is_one_page():
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= 80


def anchors(file):
    """The anchors of a file's headings, as GitHub makes them."""
    headings = re.findall(r"(?m)^#+ (.*)$", file.read_text("utf-8"))
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("folder", FOLDERS)
def test_links_lead_somewhere(folder):
    readme = ROOT / folder / "README.md"
    for target in re.findall(r"\]\(([^)]+)\)", readme.read_text("utf-8")):
        if not target.startswith(("http://", "https://")):
            path, _, anchor = target.partition("#")
            file = readme.parent / path if path else readme
            assert file.exists(), target
            assert not anchor or anchor in anchors(file), target


# Programs in them


def programs(folder, heading):
    """Text of a section of a README, and the one Python program in it."""
    text = (ROOT / folder / "README.md").read_text("utf-8").partition(f"{heading}\n")[2]
    text = re.split(r"(?m)^##+ ", text)[0]
    (program,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    return text, program


def test_the_drive_by_fmpy(ssp, tmp_path):
    """What it prints is in the comment."""
    _, program = programs("build", "## SSP")
    shutil.copy(ssp, tmp_path / "GolfSwing.ssp")
    (tmp_path / "drive.py").write_text(program)
    printed = [
        line.split()[1]
        for line in run(sys.executable, "drive.py", cwd=tmp_path).stdout.splitlines()
    ]
    comment = re.findall(r"(?m)# (.*)$", program)[0]
    promised = [part.split()[0].rstrip("…") for part in comment.split(", ")]
    assert len(promised) == 4
    for number, start in zip(printed, promised, strict=True):
        assert number.startswith(start)


#: The head's mass (kg), the grip's speed (m/s) and the shaft's stiffness and damping in the text.
HEAD, GRIP, STIFFNESS, DAMPING = 0.2, 40.0, 2e5, 5.0


def constant(t, x, v):
    return 400.0


def shaft(t, x, v):
    return STIFFNESS * (GRIP * t - 0.5 - x) + DAMPING * (GRIP - v)


def speed_of_the_ball(push):
    """After an impact with a head that starts at -0.5 m with 40 m/s, by DOP853, m/s."""

    def touch(t, y):
        return y[0]

    touch.terminal = True
    options = {"events": touch, "rtol": 1e-13, "atol": 1e-15, "max_step": 1e-4}
    start = (lambda t, y: [y[1], push(t, *y) / HEAD]), (0.0, 1.0), [-0.5, GRIP], "DOP853"
    path = solve_ivp(*start, **options)
    values = {"law": 2, "m_club": HEAD, "club_speed": path.y[1, -1]}
    return integrated(values, push=push, touch=path.t[-1])["ball_velocity"]


@pytest.mark.parametrize(("push", "tolerance"), [(constant, 1e-12), (shaft, 3e-6)])
def test_a_host_for_a_club(fmu_path, tmp_path, push, tolerance):
    """As it stands there, and with the shaft in the text as its force."""
    folder, heading = "fmu_src/golf_physics/companions", "### A host for a club of your own"
    text, program = programs(folder, heading)
    if push is shaft:
        (body,) = re.findall(r"`(return 2e5 .*?)`", text)
        program = program.replace("return 400.0", body)
        program = program.replace("[1e-3, 3e-4, 1e-4]", "[2e-5, 1e-5]")
        assert body in program
    shutil.copy(fmu_path, tmp_path / "ClubBallImpact.fmu")
    (tmp_path / "host.py").write_text(f"import random\nrandom.seed(1)\n{program}")
    done = run(sys.executable, "host.py", cwd=tmp_path)
    ball = float(re.findall(r"ball (\S+) m/s", done.stdout)[0])
    assert ball == pytest.approx(speed_of_the_ball(push), rel=tolerance)


if __name__ == "__main__":
    README.write_text(updated(README.read_text("utf-8")), "utf-8")
