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
import random_cases
from command import ROOT
from compare import to_15_digits
from conftest import some
from ways import REALS

from golf_impact.data.runs import FLAGS

PHYSICS = ROOT / "fmu_src" / "golf_physics"

#: Smaller numbers are left over where larger ones cancel, as between bodies that stay together:
#: their last digits are those of no function.
LEFT_OVER = 1e-40


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
    """What a way returns for the same random calls: bits of outputs after each step, refusals."""
    rng = random.Random(number)
    values = random_cases.whole(number, pushed=0.3)
    way.begin(values, start=rng.choice([0.0, 0.0, rng.uniform(-5.0, 5.0)]))
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
            found += [bits(x) for x in way.read(REALS).values()]
            found += way.read(FLAGS).values()
    return [*found, *map(to_15_digits, way.messages)]


@pytest.fixture(scope="module")
def expected(way_of):
    """What the physics in this process returns, by the number of the case."""
    return cache(lambda number: history(way_of("in process"), number))


#: Refused at the start, at touch or by a later value, with round numbers in the sentence.
REFUSED = [
    {"m_club": 2e16, "m_ball": 1.0}, {"k": 1e200}, {"gap": 100.0, "club_speed": 1e80},
    # The compression would be 4e100 m.
    {"law": 2, "exponent": 3.0, "m_club": 2.0, "m_ball": 2.0, "k": 4.0, "club_speed": 15.0,
     "ball_speed": -1.0, "reference_compression": 1e200},
    {"law": 2, "exponent": 2.0, "m_club": 0.2, "m_ball": 0.05, "club_force": 1e10},
    {"law": 2, "restitution_at_rest": 0.5, "restitution_slope": 0.1, "club_speed": 30.0},
    {"law": 1, "exponent": 1.5}, {"law": 1, "restitution_at_rest": 0.1 + 0.2},
    {"m_club": 2e-6, "m_ball": 2.1}, {"law": 2, "b": 1e9, "k": 1.0}, {"club_force": 1e12},
]  # fmt: skip


@pytest.mark.parametrize("values", REFUSED, ids=str)
def test_sentences(fmu_way, way_of, values):
    for way in (here := way_of("in process"), fmu_way):
        assert not way.begin(values).step(1.0)
    assert here.messages
    # An FMU 3.0 of Python has a few words before some.
    for sentence, same in zip(here.messages, fmu_way.messages, strict=True):
        assert to_15_digits(same).endswith(to_15_digits(sentence))


@pytest.mark.skipif(sys.platform != "linux", reason="of another C library functions differ")
@pytest.mark.parametrize("block", some(1, range(40), 40))
def test_bits(fmu_way, expected, block):
    for number in range(50 * block, 50 * (block + 1)):
        assert history(fmu_way, number) == expected(number), number


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


def changed_impacts():
    """Values, and steps (s) with the stiffness before each."""
    for number in range(100):
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
    assert len(found) > 300 * len(REALS)
    differing = [(one, other) for one, other in zip(found, expected) if one != other]
    assert not differing, (len(differing), differing[:3])


def test_no_sum_and_no_hypot():
    for path in sorted(PHYSICS.rglob("*.py")):
        nodes = [*ast.walk(ast.parse(path.read_text("utf-8")))]
        names = {n.id for n in nodes if isinstance(n, ast.Name)}
        names |= {n.attr for n in nodes if isinstance(n, ast.Attribute)}
        assert not names & {"sum", "hypot", "fsum", "dist", "sumprod"}, path
