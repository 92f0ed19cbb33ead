"""The built FMU, and the tables of reference cases, for all tests."""

import json
from pathlib import Path

import pytest

from scenarios.fmu_file import build_fmu
from scenarios.impact_fmu import ImpactFmu

HERE = Path(__file__).resolve().parent


@pytest.fixture(scope="session")
def fmu_path(tmp_path_factory):
    """The FMU, built from the present sources: what is tested is what is shipped."""
    return build_fmu(tmp_path_factory.mktemp("fmu") / "ClubBallImpact.fmu")


@pytest.fixture(scope="session")
def _loaded(fmu_path):
    with ImpactFmu(fmu_path) as fmu:
        yield fmu


@pytest.fixture
def fmu(_loaded):
    """One instance for all tests; each starts it anew."""
    _loaded.messages.clear()
    return _loaded


def reference_cases(*files):
    """The cases of these files in tests/data, with an id each."""
    cases = []
    for file in files:
        table = json.loads((HERE / "data" / f"{file}.json").read_text())
        for n, case in enumerate(table["cases"]):
            name = case.get("id", f"{file}-{n}-{case['law']}")
            cases.append(pytest.param(case, id=name))
    return cases
