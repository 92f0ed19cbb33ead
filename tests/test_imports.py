"""Imports run one way: scripts, package, build, physics."""

import ast
import re
import sys
from pathlib import Path

from command import ROOT, run

from golf_impact import scenario
from golf_impact.scripts import FOLDER


def test_contracts():
    """Those of pyproject.toml."""
    lint = Path(sys.executable).with_name("lint-imports")
    run(lint, "--no-cache", cwd=ROOT)


def test_scenarios_import_the_scenario_interface_alone_and_use_all_of_it():
    taken = {"ImpactFmu", "Metrics"}  # for annotations
    for name in list_names():
        tree = ast.parse((FOLDER / f"{name}.py").read_text("utf-8"))
        imports = [n for n in ast.walk(tree) if isinstance(n, ast.Import | ast.ImportFrom)]
        (ours,) = (one for one in imports if re.search(r"\bgolf_", ast.unparse(one)))
        assert (name, getattr(ours, "module", "")) == (name, "golf_impact.scenario")
        taken.update(alias.name for alias in ours.names)
    assert taken == set(scenario.__all__)
