"""Imports run one way: scripts, package, build, physics."""

import ast
import sys
from pathlib import Path

from command import ROOT, run

from golf_impact.scripts import BY_NAME, FOLDER, SCENARIOS


def test_contracts():
    """Those of pyproject.toml."""
    lint = Path(sys.executable).with_name("lint-imports")
    run(lint, "--no-cache", cwd=ROOT)


def test_scenarios_import_no_machinery():
    """What a user of the package may import as well, and of fmpy what its examples use."""
    machinery = {"commands", "scripts", "files", "flaws", "runs", "results", "arrays", "peers"}
    for name in SCENARIOS:
        tree = ast.parse((FOLDER / f"{name}.py").read_text("utf-8"))
        modules = [n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
        assert "golf_impact.scenario" in modules
        assert not machinery & {part for module in modules for part in module.split(".")}, name


def test_scripts_are_all_in_the_list():
    assert {file.stem for file in FOLDER.glob("*.py")} == {*SCENARIOS, *BY_NAME}
