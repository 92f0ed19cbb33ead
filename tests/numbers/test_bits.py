"""Every FMU has the bits of the physics in this process, whatever is set, stepped and restored."""

import math
import random
import struct
import sys

import pytest
from conftest import some
from ways import REALS

from golf_impact.runs import FLAGS

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="of another C library functions differ"
)

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


@pytest.mark.parametrize("block", some(4, range(40), 40))
def test_bits(fmu_way, way_of, block):
    for number in range(50 * block, 50 * (block + 1)):
        assert history(fmu_way, number) == history(way_of("in process"), number), number
