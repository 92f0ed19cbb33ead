"""The same bits in C and in every Python; in every FMU: contract/test_lockstep.py.

sum() and math.hypot have changed with Python, so the physics uses neither, nor their like.
"""

import ast
import json
import os
import random
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
import random_cases
from command import ROOT
from conftest import some

from golf_impact.data.runs import REALS

PHYSICS = ROOT / "fmu_src" / "golf_physics"

#: Impacts of all kinds, changed in contact; their outputs as hexadecimal numbers.
_RUN = """
import json, sys
sys.path.insert(0, sys.argv[1])
from golf_physics.component.component import Component
from golf_physics.variables import BY_NAME, VARIABLES

reals = [row.reference for row in VARIABLES if (row.causality, row.type) == ("output", "Real")]
found = []
for values, changes in json.loads(sys.argv[2]):
    component = Component(lambda refusal: found.append(str(refusal)))
    component.enter_initialization()
    for name, value in values.items():
        row = BY_NAME[name]
        component.set_values([row.reference], [value], row.type)
    component.exit_initialization()
    time = 0.0
    for size, k in changes:
        component.set_values([0], [k])
        if not component.step(time, size):
            break
        time += size
        found += [value.hex() for value in component.reals(reals)[: len(reals)]]
print(json.dumps([sys.version_info[:2], found]))
"""


@pytest.mark.skipif(
    sys.platform != "linux", reason="C and Python use different libraries' functions"
)
def test_bits_of_c(way_of):
    """Whatever a host does with an impact: outputs and refusals."""
    native, physics = map(way_of, ("native, FMI 2.0", "in process"))
    histories = random_cases.history
    assert not [n for n in range(250) if histories(native, n) != histories(physics, n)]


def changed_impacts():
    """Values, and steps (s) with the stiffness before each."""
    for number in range(50):
        rng, values = random.Random(number), random_cases.accepted(number, pushed=0.3)
        yield (
            values,
            [(size, values["k"] * rng.choice([1.0, 1.2])) for size in (2e-5, 1e-4, 3e-4, 1e-2)],
        )


def python(version):
    """An interpreter of this version, which may be one of pyenv's that isn't active."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    names = [shutil.which(f"python{version}"), *pyenv.glob(f"{version}.*/bin/python{version}")]
    for name in filter(None, names):
        done = subprocess.run([name, "-c", "pass"], capture_output=True, check=False)
        if done.returncode == 0:
            return str(name)
    return None


@cache
def run(interpreter):
    command = [interpreter, "-I", "-c", _RUN, str(PHYSICS.parent), json.dumps([*changed_impacts()])]
    return json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)


@pytest.mark.parametrize("version", some(2, ["3.10", "3.14", "3.11", "3.12", "3.13"]))
def test_bits_of_pythons(version):
    interpreter = python(version)
    if interpreter is None:
        pytest.skip(f"python{version} isn't on PATH, nor among pyenv's versions")
    (_, expected), (found_version, found) = run(sys.executable), run(interpreter)
    assert found_version == [int(part) for part in version.split(".")]
    assert len(found) > 150 * len(REALS)
    differing = [(one, other) for one, other in zip(found, expected) if one != other]
    assert not differing, (len(differing), differing[:3])


def test_no_function_that_changed_with_python():
    for path in sorted(PHYSICS.rglob("*.py")):
        nodes = [*ast.walk(ast.parse(path.read_text("utf-8")))]
        names = {n.id for n in nodes if isinstance(n, ast.Name)}
        names |= {n.attr for n in nodes if isinstance(n, ast.Attribute)}
        assert not names & {"sum", "hypot", "fsum", "dist", "sumprod"}, path
