"""Imports run one way: scripts, package, build, physics."""

import ast
import sys
from pathlib import Path

from command import ROOT, run

from golf_impact import scenario
from golf_impact.commands.scripts import FOLDER, list_names

OURS = ("golf_build", "golf_physics", "golf_impact")


def imports(path):
    """The modules of ours that a file imports, and the names imported from them."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found = [(alias.name, ()) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found = [(node.module, [alias.name for alias in node.names])]
        else:
            continue
        yield from ((module, names) for module, names in found if module.split(".")[0] in OURS)


def test_contracts():
    """Those of pyproject.toml."""
    lint = Path(sys.executable).with_name("lint-imports")
    run(lint, "--no-cache", cwd=ROOT)


def test_scenarios_import_the_scenario_interface_alone_and_use_all_of_it():
    taken = {"ImpactFmu", "Metrics"}  # for annotations
    for name in list_names():
        ((module, names),) = imports(FOLDER / f"{name}.py")
        assert (name, module) == (name, "golf_impact.scenario")
        taken.update(names)
    assert taken == set(scenario.__all__)
