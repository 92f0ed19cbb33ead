"""READMEs, the lesson and import contracts: links, lengths, tables, and programs that run."""

import ast
import importlib.metadata
import re
import shlex
import shutil
import sys
from itertools import chain
from pathlib import Path
from pkgutil import resolve_name

import nbformat
import pytest
from cases import integrated
from command import DOCUMENTS, ROOT, run
from nbclient import NotebookClient
from packaging.requirements import Requirement
from typer.main import get_command

from golf_impact.commands.app import app
from golf_impact.data.document import tables
from golf_impact.data.files import read_toml
from golf_impact.report.scripts import ALL, FOLDER, SCENARIOS

PROJECT = read_toml(ROOT / "pyproject.toml")["project"]

FOLDERS = "build", "fmu_src", "scenarios", "tests"
#: A file that a reader writes, and one that is in FMUs.
ELSEWHERE = {"hunt_crossley.py", "sources/all.c"}

PYTHON = r"(?s)```python\n(.*?)```"
documents = pytest.mark.parametrize(
    "document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT))
)


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


@documents
def test_links_lead_somewhere(document):
    for target in re.findall(r"\]\(([^)]+)\)", document.read_text("utf-8")):
        if not target.startswith(("http://", "https://")):
            path, _, anchor = target.partition("#")
            there = document.parent / path if path else document
            assert there.exists(), target
            assert not anchor or anchor in anchors(there), target


def files_of(name):
    """The files of this name, or this end of a path."""
    return [path for folder in FOLDERS for path in (ROOT / folder).rglob(name)]


@documents
def test_modules_files_and_symbols_that_they_name_exist(document):
    text = document.read_text("utf-8")
    for dotted in {*re.findall(r"\bgolf_(?:physics|impact|build)(?:\.\w+)+\b(?!/)", text)}:
        if not dotted.endswith((".py", ".toml")):
            resolve_name(dotted)
    file = r"`(?:(?:fmu_src|build|scenarios|tests)/)?([\w/]+\.(?:py|c|toml|jinja))`"
    for name in {*re.findall(file, text), *re.findall(r"\btest_\w+\.py\b", text)} - ELSEWHERE:
        assert files_of(name), name
    for symbol, name in re.findall(rf"`(\w+)`\s+(?:of|in)\s+{file}", text):
        texts = [one.read_text("utf-8") for one in files_of(name)]
        assert re.search(rf"\b{symbol}\b", "\n".join(texts)), symbol


# Programs and command lines in them


def programs():
    """The Python programs; CONTRIBUTING.md has modules."""
    for document in (one for one in DOCUMENTS if one.name == "README.md"):
        found = re.findall(PYTHON, document.read_text("utf-8"))
        yield from (
            pytest.param(one, id=f"{document.parent.name}-{n}") for n, one in enumerate(found)
        )


@pytest.mark.parametrize("program", [*programs()])
def test_a_program(program, fmu_path, ssp, tmp_path, monkeypatch, capsys):
    """It prints what its comments promise, and writes its pictures."""
    for file in ("ClubBallImpact.fmu", "build/ClubBallImpact.fmu"):
        (tmp_path / file).parent.mkdir(exist_ok=True)
        shutil.copy(fmu_path, tmp_path / file)
    for file in ("GolfSwing.ssp", "build/GolfSwing.ssp"):
        shutil.copy(ssp, tmp_path / file)
    for many, few in (("1_000_000", "10_000"), ("(8, 21, 2)", "(8, 21, 12)"), ("105, 120", "")):
        program = program.replace(many, few)
    monkeypatch.chdir(tmp_path)
    exec(compile(program, "program.py", "exec"), {"__name__": "__main__"})
    words = iter(capsys.readouterr().out.split())
    for comment in re.findall(r"(?m)^ *print.*\)  # (.*)$", program):
        for promised in comment.split(", "):
            start = promised.split()[0].rstrip("…")
            assert any(word.startswith(start) for word in words), promised
    for picture in re.findall(r'savefig\("(.*?)"', program):
        assert (tmp_path / picture).is_file()


def command_lines():
    """Those of golf-impact, in blocks and in sentences."""
    for document in DOCUMENTS:
        text = re.sub(r"\\\n *", " ", document.read_text("utf-8"))
        blocks = re.findall(r"(?m)^(?:.*\bin/)?golf-impact (\w.*?)(?: {3,}.*)?$", text)
        for line in {*blocks, *re.findall(r"`(?:\.venv/bin/)?golf-impact (\w[^`]*)`", text)}:
            if not line.startswith("COMMAND"):
                yield line


@pytest.mark.parametrize("line", sorted({*command_lines()}))
def test_a_command_line(line):
    """Its options exist and take such values."""
    name, *words = shlex.split(line)
    get_command(app).commands[name].make_context(name, words)


@pytest.mark.parametrize(
    ("force", "touch", "speed", "steps", "tolerance"),
    [
        ("400.0", 0.01, 60.0, "[1e-3, 3e-4, 1e-4]", 1e-12),
        # Before touch this shaft moves as its grip.
        ("2e5 * (40.0 * t - 0.5 - x) + 5.0 * (40.0 - v)", 0.0125, 40.0, "[2e-5, 1e-5]", 3e-6),
    ],
)
def test_a_host_for_a_club(fmu_path, tmp_path, force, touch, speed, steps, tolerance):
    """As it stands there, and with the shaft in the text as its force, beside DOP853."""
    text = (ROOT / "fmu_src/golf_physics/companions/README.md").read_text("utf-8")
    text = text.partition("### A host for a club of your own")[2]
    assert f"return {force}" in text
    program = f"import random\nrandom.seed(1)\n{re.search(PYTHON, text)[1]}"
    program = program.replace("return 400.0", f"return {force}")
    program = program.replace("[1e-3, 3e-4, 1e-4]", steps)
    shutil.copy(fmu_path, tmp_path)
    done = run(sys.executable, "-c", program, cwd=tmp_path)
    values, push = {"law": 2, "m_club": 0.2, "club_speed": speed}, f"lambda t, x, v: {force}"
    expected = integrated(values, push=eval(push), touch=touch)["ball_velocity"]
    ball = float(re.search(r"ball (\S+) m/s", done.stdout)[1])
    assert ball == pytest.approx(expected, rel=tolerance)


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


@pytest.mark.ci
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


def test_scripts_are_all_in_the_list_and_run_by_themselves():
    files = [*FOLDER.glob("*.py")]
    assert {file.stem for file in files} == {*ALL}
    end = 'if __name__ == "__main__":\n    main(run)\n'
    assert all(file.read_text("utf-8").endswith(end) for file in files)


@pytest.mark.ci
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
