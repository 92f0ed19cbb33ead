"""Imports run one way: scripts, package, build, physics."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from golf_impact import scenario
from golf_impact.commands.scripts import FOLDER, list_names

OURS = ("golf_build", "golf_physics", "golf_impact")


def imports(path):
    """All modules that a file imports, and the names imported from them."""
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


@pytest.mark.parametrize("name", list_names())
def test_a_scenario_has_one_import_of_ours(name):
    found = [one for one in imports(FOLDER / f"{name}.py") if one[0].split(".")[0] in OURS]
    ((module, taken),) = found
    assert module == "golf_impact.scenario"
    assert set(taken) <= set(scenario.__all__)


def test_all_names_of_the_scenario_interface_are_used():
    taken = {
        name
        for script in list_names()
        for _, all_ in imports(FOLDER / f"{script}.py")
        for name in all_
    }
    assert set(scenario.__all__) <= taken | {"ImpactFmu", "Metrics"}
