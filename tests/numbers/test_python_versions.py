"""The same bits in every Python: sum() and math.hypot have changed, so the physics uses neither."""

import ast
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from command import ROOT

PHYSICS = ROOT / "fmu_src" / "golf_physics"

#: Impacts of all kinds, changed in contact, in this process; their outputs as hexadecimal numbers.
_RUN = """
import json, random, sys
sys.path.insert(0, sys.argv[1])
from golf_physics.component.component import Component
from golf_physics.variables import BY_NAME, VARIABLES

reals = [row.reference for row in VARIABLES if (row.causality, row.type) == ("output", "Real")]
rng, found = random.Random(1), []
for number in range(400):
    kind = number % 5
    values = {"k": 10.0 ** rng.uniform(4.0, 7.0), "b": rng.choice([0.0, rng.uniform(0.0, 300.0)])}
    values |= {"club_speed": rng.uniform(5.0, 60.0), "ball_speed": rng.uniform(-5.0, 5.0)}
    values |= {"law": 1 if kind == 0 else 2, "gap": rng.choice([0.0, 0.001])}
    if kind in (2, 3):
        values["exponent"] = rng.uniform(1.0, 3.0)
    if kind == 3:
        values |= {"restitution_at_rest": 0.86, "restitution_slope": 0.003}
    if kind in (0, 4):
        values["club_force"] = rng.choice([0.0, rng.uniform(-500.0, 500.0)])
    component, time = Component(lambda refusal: None), 0.0
    component.enter_initialization()
    for name, value in values.items():
        component.set_values([BY_NAME[name].reference], [value], BY_NAME[name].type)
    component.exit_initialization()
    for size in (2e-5, 1e-4, 1e-4, 3e-4, 1e-2):
        component.set_values([BY_NAME["k"].reference], [values["k"] * rng.choice([1.0, 1.2])])
        component.step(time, size)
        time += size
        found += [value.hex() for value in component.reals(reals)[: len(reals)]]
print(json.dumps([sys.version_info[:2], found]))
"""


def python(version):
    """An interpreter of this version, which may be one of pyenv's that isn't active."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    names = [shutil.which(f"python{version}"), *pyenv.glob(f"{version}.*/bin/python{version}")]
    for name in filter(None, names):
        done = subprocess.run([name, "-c", "pass"], capture_output=True, check=False)
        if done.returncode == 0:
            return str(name)
    return None


def run(interpreter):
    command = [interpreter, "-I", "-c", _RUN, str(PHYSICS.parent)]
    return json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)


@pytest.mark.parametrize("version", ["3.10", "3.11", "3.12", "3.13"])
def test_bits(version):
    interpreter = python(version)
    if interpreter is None:
        pytest.skip(f"python{version} isn't on PATH, nor among pyenv's versions")
    (_, expected), (found_version, found) = run(sys.executable), run(interpreter)
    assert found_version == [int(part) for part in version.split(".")]
    assert len(found) == 400 * 5 * 19
    differing = [(one, other) for one, other in zip(found, expected) if one != other]
    assert not differing, (len(differing), differing[:3])


@pytest.mark.parametrize(
    "path", sorted(PHYSICS.rglob("*.py")), ids=lambda path: str(path.relative_to(PHYSICS))
)
def test_no_sum_and_no_hypot(path):
    names = {n.id for n in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(n, ast.Name)}
    assert not names & {"sum", "hypot", "fsum", "dist", "sumprod"}
