"""Imports run one way: scripts, machinery, the build, the physics."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from golf_impact import scenario
from golf_impact.commands.scripts import FOLDER, names

OURS = ("golf_build", "golf_physics", "golf_impact")


def imports(path):
    """The modules that a file imports, wherever in it, and the names that it takes from them."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, ()) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module, tuple(alias.name for alias in node.names)


def test_contracts():
    """Those of pyproject.toml."""
    lint = Path(sys.executable).with_name("lint-imports")
    root = Path(__file__).parent.parent
    done = subprocess.run([lint, "--no-cache"], capture_output=True, text=True, cwd=root)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("name", names())
def test_a_scenario_has_one_import_of_ours(name):
    found = [one for one in imports(FOLDER / f"{name}.py") if one[0].split(".")[0] in OURS]
    ((module, taken),) = found
    assert module == "golf_impact.scenario"
    assert set(taken) <= set(scenario.__all__)


def test_the_vocabulary_of_scenarios_is_all_used():
    taken = {
        name for script in names() for _, all_ in imports(FOLDER / f"{script}.py") for name in all_
    }
    assert set(scenario.__all__) <= taken | {"ImpactFmu", "Metrics"}


def test_no_module_is_loaded_by_its_path_but_a_scenario():
    loading = {
        path.name
        for folder in ("scenarios", "build", "fmu_src")
        for path in (Path(__file__).parent.parent / folder).rglob("*.py")
        if "spec_from_file_location" in path.read_text("utf-8")
    }
    assert loading == {"scripts.py"}
