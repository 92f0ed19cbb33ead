"""The same bits: in every FMU, whatever is set, stepped and restored, and in every Python.

sum() and math.hypot have changed with Python, so the physics uses neither.
"""

import ast
import json
import math
import os
import random
import shutil
import struct
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from command import ROOT
from conftest import some
from ways import REALS

from golf_impact.runs import FLAGS

PHYSICS = ROOT / "fmu_src" / "golf_physics"

#: Smaller numbers are left over where larger ones cancel: their bits are those of no function.
LEFT_OVER = 1e-50


def random_values(rng):
    """Inputs and parameters: laws, exponents, COR lines, heavy damping, forces, moving balls."""
    law = rng.choice([1, 2, 2])
    values = {"law": law, "k": 10 ** rng.uniform(4, 8), "club_speed": rng.uniform(0.1, 70.0)}
    values["b"] = rng.choice([0.0, 10 ** rng.uniform(-1, 4), 10 ** rng.uniform(0, 2)])
    several = {
        "ball_speed": rng.uniform(-20.0, 20.0), "gap": 10 ** rng.uniform(-5, -1),
        "m_club": 10 ** rng.uniform(-2, 1), "m_ball": 10 ** rng.uniform(-2, 1),
        "club_force": rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(0, 3.5),
    }  # fmt: skip
    values |= {name: value for name, value in several.items() if rng.random() < 0.3}
    if law == 2 and rng.random() < 0.6:
        values["exponent"] = rng.choice([1.5, rng.uniform(1.0, 3.0), rng.uniform(1.0, 12.0)])
    if law == 2 and rng.random() < 0.3:
        values |= {"restitution_at_rest": rng.uniform(0.3, 1.0)}
        values |= {"restitution_slope": rng.uniform(0.0, 0.004)}
    return values


def random_calls(rng):
    """Calls of a way after its start: names and arguments."""
    saved = False
    for _ in range(rng.randint(1, 12)):
        if rng.random() < 0.3:
            changed = {
                "k": rng.choice([1.0] * 9 + [-1.0]) * 10 ** rng.uniform(4, 8),
                "b": 10 ** rng.uniform(-1, 3), "club_force": rng.uniform(-2e3, 2e3),
                "club_speed": rng.uniform(0.0, 60.0),
            }  # fmt: skip
            name = rng.choice([*changed])
            yield "set", {name: changed[name]}
        if rng.random() < 0.2:
            saved = True
            yield "save", rng.random() < 0.5
        if saved and rng.random() < 0.15:
            yield "restore", None
        yield "step", rng.choice([10 ** rng.uniform(-6, -3)] * 9 + [rng.choice([1e-9, 0.01, 1.0])])


def bits(number):
    if math.isnan(number) or abs(number) < LEFT_OVER:
        return str(math.isnan(number))
    return struct.pack("<d", number)


def history(way, number):
    """What a way answers to the same random calls: bits of outputs after each step, refusals."""
    rng = random.Random(number)
    way.begin(random_values(rng), start=rng.choice([0.0, 0.0, rng.uniform(-5.0, 5.0)]))
    found, saved = [], None
    for call, argument in random_calls(rng):
        if call == "set":
            way.set(**argument)
        elif call == "save":
            saved = way.save(argument)
        elif call == "restore":
            way.restore(saved)
        else:
            found.append(way.step(argument))
            # Before it, an FMU 3.0 of pythonfmu3 doesn't know the start time.
            if True in found:
                found += [bits(x) for x in way.read(REALS).values()]
                found += way.read(FLAGS).values()
    return [*found, *way.messages]


@pytest.fixture(scope="module")
def expected(way_of):
    """What the physics in this process answers, by the number."""
    return cache(lambda number: history(way_of("in process"), number))


@pytest.mark.skipif(sys.platform != "linux", reason="of another C library functions differ")
@pytest.mark.parametrize("block", some(4, range(40), 40))
def test_bits(fmu_way, expected, block):
    for number in range(50 * block, 50 * (block + 1)):
        assert history(fmu_way, number) == expected(number), number


#: Impacts of all kinds, changed in contact; their outputs as hexadecimal numbers.
_RUN = """
import json, random, sys
sys.path.insert(0, sys.argv[1])
from golf_physics.component.component import Component
from golf_physics.variables import BY_NAME, VARIABLES

reals = [row.reference for row in VARIABLES if (row.causality, row.type) == ("output", "Real")]
rng, found = random.Random(1), []
for number in range(100):
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


@cache
def run(interpreter):
    command = [interpreter, "-I", "-c", _RUN, str(PHYSICS.parent)]
    return json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)


@pytest.mark.parametrize("version", ["3.10", "3.11", "3.12", "3.13", "3.14"])
def test_bits_of_pythons(version):
    interpreter = python(version)
    if interpreter is None:
        pytest.skip(f"python{version} isn't on PATH, nor among pyenv's versions")
    (_, expected), (found_version, found) = run(sys.executable), run(interpreter)
    assert found_version == [int(part) for part in version.split(".")]
    assert len(found) == 100 * 5 * len(REALS)
    differing = [(one, other) for one, other in zip(found, expected) if one != other]
    assert not differing, (len(differing), differing[:3])


def test_no_sum_and_no_hypot():
    for path in sorted(PHYSICS.rglob("*.py")):
        nodes = [*ast.walk(ast.parse(path.read_text("utf-8")))]
        names = {n.id for n in nodes if isinstance(n, ast.Name)}
        names |= {n.attr for n in nodes if isinstance(n, ast.Attribute)}
        assert not names & {"sum", "hypot", "fsum", "dist", "sumprod"}, path
