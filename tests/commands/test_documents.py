"""READMEs, the lesson and import contracts: links, lengths, tables, and programs that run."""

import ast
import importlib.metadata
import re
import shutil
import sys
from itertools import chain
from pathlib import Path
from pkgutil import resolve_name

import nbformat
import pytest
import readmes
from cases import integrated
from command import ROOT, run
from nbclient import NotebookClient
from packaging.requirements import Requirement
from scipy.integrate import solve_ivp

from golf_impact.data.document import tables
from golf_impact.data.files import read_toml
from golf_impact.report.scripts import BY_NAME, FOLDER, SCENARIOS

PROJECT = read_toml(ROOT / "pyproject.toml")["project"]

PACKAGES = ("scenarios/golf_impact/studies", "scenarios/golf_impact/evidence")
FOLDERS = ("fmu_src", "fmu_src/golf_physics/companions", "build", "scenarios", *PACKAGES, "tests")
DOCUMENTS = "README.md", ".github/CONTRIBUTING.md", *(f"{one}/README.md" for one in FOLDERS)


def test_tables_are_those_of_the_code():
    text = readmes.README.read_text("utf-8")
    assert readmes.updated(text) == text, "run `python tests/tools/readmes.py`"


def test_what_is_implemented_where_exists():
    for row in tables()[0][2]:
        path, _, symbol = row[-1].partition(": ")
        tree = ast.parse((ROOT / path).read_text("utf-8"))
        for name in symbol.split("."):
            names = {getattr(node, "name", None): node for node in tree.body}
            assert name in names, row
            tree = names[name]


def test_the_first_page_is_one_page():
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= 110


def anchors(file):
    """The anchors of a file's headings, as GitHub makes them."""
    headings = re.findall(r"(?m)^#+ (.*)$", file.read_text("utf-8"))
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("file", DOCUMENTS)
def test_links_lead_somewhere(file):
    document = ROOT / file
    for target in re.findall(r"\]\(([^)]+)\)", document.read_text("utf-8")):
        if not target.startswith(("http://", "https://")):
            path, _, anchor = target.partition("#")
            there = document.parent / path if path else document
            assert there.exists(), target
            assert not anchor or anchor in anchors(there), target


@pytest.mark.parametrize("file", DOCUMENTS)
def test_modules_and_tests_that_they_name_exist(file):
    text = (ROOT / file).read_text("utf-8")
    for dotted in {*re.findall(r"\bgolf_(?:physics|impact|build)(?:\.\w+)+\b(?!/)", text)}:
        if not dotted.endswith((".py", ".toml")):
            resolve_name(dotted)
    for name in {*re.findall(r"\btest_\w+\.py\b", text)}:
        assert [*(ROOT / "tests").rglob(name)], name


# Programs in them


def programs(folder, heading):
    """Text of a section of a README, and the one Python program in it."""
    text = (ROOT / folder / "README.md").read_text("utf-8").partition(f"{heading}\n")[2]
    text = re.split(r"(?m)^##+ ", text)[0]
    (program,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    return text, program


def check_comment(program, printed):
    """Assert that the numbers printed begin as those in the program's last comment."""
    comment = re.findall(r"(?m)# (.*)$", program)[-1]
    promised = [part.split()[0].rstrip("…") for part in comment.split(", ")]
    assert promised
    for number, start in zip(printed, promised, strict=True):
        assert number.startswith(start)


#: What the first page's programs write.
PLOTS = [["force.png"], ["stiffness.png"], []]


@pytest.mark.parametrize("number", range(3))
def test_programs_of_the_first_page(fmu_path, tmp_path, number):
    text = (ROOT / "README.md").read_text("utf-8")
    programs = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(programs) == len(PLOTS)
    (tmp_path / "build").mkdir()
    shutil.copy(fmu_path, tmp_path / "build" / "ClubBallImpact.fmu")
    done = run(sys.executable, "-c", programs[number], cwd=tmp_path)
    assert [file.name for file in tmp_path.glob("*.png")] == PLOTS[number]
    if "# " in programs[number]:
        check_comment(programs[number], done.stdout.split())


def test_the_drive_by_fmpy(ssp, tmp_path):
    _, program = programs("build", "## SSP")
    shutil.copy(ssp, tmp_path / "GolfSwing.ssp")
    lines = run(sys.executable, "-c", program, cwd=tmp_path).stdout.splitlines()
    check_comment(program, [line.split()[1] for line in lines])


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
    program = f"import random\nrandom.seed(1)\n{program}"
    done = run(sys.executable, "-c", program, cwd=tmp_path)
    ball = float(re.findall(r"ball (\S+) m/s", done.stdout)[0])
    assert ball == pytest.approx(speed_of_the_ball(push), rel=tolerance)


# The lesson

LESSON = FOLDER / "first_impact.ipynb"


def printed(notebook):
    """What its code cells print; figures and values are left out."""
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return "".join(output["text"] for output in outputs if output["output_type"] == "stream")


# Of jupyter_client, about a kernel on this machine.
@pytest.mark.filterwarnings("ignore")
@pytest.mark.ci  # a kernel takes its time
def test_the_lesson_runs_from_any_folder(tmp_path):
    notebook = nbformat.read(LESSON, as_version=4)
    stored = printed(notebook)
    where = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, kernel_name="python3", timeout=120, resources=where).execute()
    assert printed(notebook) == stored
    assert list(tmp_path.iterdir()) == []


def test_what_is_stored_of_the_lesson():
    notebook = nbformat.read(LESSON, as_version=4)
    nbformat.validate(notebook)
    assert notebook.metadata.kernelspec.name == "python3"
    assert LESSON.stat().st_size < 300_000
    counts = [cell.execution_count for cell in notebook.cells if cell.cell_type == "code"]
    assert counts == list(range(1, len(counts) + 1))
    text = LESSON.read_text("utf-8")
    assert text.count("<details>") == 5
    assert not re.search(r"/(home|root|work|tmp)/", text)
    # Its extra brings what it imports, and Jupyter.
    extra = {Requirement(one).name for one in PROJECT["optional-dependencies"]["lesson"]}
    assert extra >= {"jupyterlab", "golf-impact"}
    assert ".[lesson]" in text


# Imports


def test_contracts():
    """Those of pyproject.toml."""
    run(Path(sys.executable).with_name("lint-imports"), "--no-cache", cwd=ROOT)


def test_scenarios_import_no_machinery():
    """What a user of the package may import as well, and of fmpy what its examples use."""
    machinery = {"commands", "scripts", "files", "runs", "results", "engine", "peers"}
    for name in SCENARIOS:
        tree = ast.parse((FOLDER / f"{name}.py").read_text("utf-8"))
        modules = [n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
        assert "golf_impact.scenario" in modules
        assert not machinery & {part for module in modules for part in module.split(".")}, name


def test_scripts_are_all_in_the_list():
    assert {file.stem for file in FOLDER.glob("*.py")} == {*SCENARIOS, *BY_NAME}


def test_nothing_undeclared_is_imported():
    """Third-party modules come from declared packages."""
    extras = chain(*PROJECT["optional-dependencies"].values())
    names = {Requirement(one).name for one in chain(PROJECT["dependencies"], extras)} - {
        "golf-impact"
    }
    owners = importlib.metadata.packages_distributions()
    ours = {"golf_physics", "golf_build", "golf_impact", "tomllib", *sys.stdlib_module_names}
    for folder in ("scenarios", "fmu_src", "build"):
        for file in (ROOT / folder).rglob("*.py"):
            text = file.read_text("utf-8")
            for module in {*re.findall(r"^ *(?:import|from) (\w+)", text, re.MULTILINE)} - ours:
                packages = {name.lower().replace("_", "-") for name in owners.get(module, [])}
                assert packages & names or not packages, (file.name, module)
