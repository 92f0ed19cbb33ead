"""Impacts over the whole range of every variable: rejected with a reason, or correct.

Where the borders are: refusals.toml.
"""

import math

import pytest
import random_cases
from cases import DEFAULTS, restitution
from compare import assert_within
from hypothesis import event, example, given
from hypothesis import strategies as st

import golf_impact
from golf_impact.evidence.random_impacts import critical_damping
from golf_impact.evidence.scales import TOLERANCE

#: Doubles below this are subnormal and have fewer digits, with a margin.
LEAST = 1e-300


def decades(low, high):
    return st.floats(low, high).map(lambda power: 10.0**power)


def signed(magnitudes):
    return st.builds(lambda sign, x: sign * x, st.sampled_from((1.0, -1.0)), magnitudes)


def closing_speed(values):
    return values["club_speed"] - values["ball_speed"]


def exact_restitution(values):
    """Law 2's coefficient of restitution, in closed form."""
    if values["restitution_at_rest"]:
        return values["restitution_at_rest"] - values["restitution_slope"] * closing_speed(values)
    # Of the linear oscillator in the law's own time.
    own = math.sqrt(0.5 * (values["exponent"] + 1.0))
    return float(restitution(values["b"] / critical_damping(values) / own))


def any_value(usual):
    return st.one_of(
        st.just(usual),
        decades(-12, 12).map(lambda x: usual * x or x),
        signed(decades(-320, 308)),
        st.floats(allow_nan=True, allow_infinity=True),
    )


USUAL = {name: value for name, value in DEFAULTS.items() if name not in ("law", "club_force")}
USUAL |= {"exponent": 1.5, "restitution_at_rest": 0.5, "restitution_slope": 1e-3}
#: A ball that hits a club at rest.
STANDING = {"club_speed": 0.0, "ball_speed": -1.0, "exponent": 1.0, "restitution_at_rest": 0.0}


@st.composite
def any_values(draw):
    """Some variables with any double, the others as usual."""
    names = draw(st.lists(st.sampled_from(sorted(USUAL)), min_size=1, max_size=5, unique=True))
    values = {name: draw(any_value(USUAL[name])) for name in names}
    return values | {"law": draw(st.sampled_from((1, 2)))}


@example(values=STANDING | {"law": 1}, size=1e-2)
@example(values=STANDING | {"law": 2, "club_speed": -1e-309}, size=1e-2)
@given(
    values=any_values(),
    size=st.one_of(st.sampled_from((1e-4, 1.0)), decades(-30, 30), decades(-320, 100)),
)
def test_any_double(way_of, values, size):
    """Rejected with a message, or all outputs are finite and balance; law 2's COR is exact.

    That what is rejected has no effect, and the same bits in FMUs: contract/test_lockstep.py.
    """
    way = way_of("in process").begin(values)
    accepted, now = way.step(size), way.read()
    event(f"accepted {accepted}")
    if not accepted:
        assert way.messages
        return
    assert not way.messages, way.messages
    assert all(map(math.isfinite, now.values())), now
    assert now["force"] >= 0.0
    assert 0.0 <= now["compression"] <= now["max_compression"] * (1.0 + TOLERANCE)
    assert now["max_force"] >= now["force"] * (1.0 - 1e-9) - LEAST
    if now["touched"]:
        check_balances(DEFAULTS | values, now)


def check_balances(v, now):
    """Neither law adds energy, law 2 keeps momentum; also near overflow and underflow."""
    pairs = [(v["m_club"], v["club_speed"]), (v["m_ball"], v["ball_speed"])]
    before = math.fsum(0.5 * m * u * u for m, u in pairs)
    gained = (now["kinetic_energy"] - before - LEAST) / (before or LEAST)
    assert_within(gained, name="kinetic_energy", case=v)
    if v["law"] == 2:
        momentum = math.fsum(m * u for m, u in pairs)
        size = sum(m * abs(u) for m, u in pairs)
        off = (abs(now["momentum"] - momentum) - LEAST) / (size or LEAST)
        assert_within(off, name="momentum", case=v)
        speed = abs(v["club_speed"]) + abs(v["ball_speed"])
        found = now["coefficient_of_restitution"]
        beyond = abs(found - exact_restitution(v)) if now["separated"] else abs(found) - 1.0
        off = (beyond * closing_speed(v) - LEAST) / (speed or LEAST)
        assert_within(off, name="coefficient_of_restitution", case=v)


def test_random_impacts():
    """In golf and far beyond it, by exponents and COR lines, too."""
    cases = [DEFAULTS | random_cases.accepted(number, pushed=0.0) for number in range(1000)]
    columns = {name: [values[name] for values in cases] for name in DEFAULTS}
    names = "kinetic_energy", "momentum", "separated", "touched", "coefficient_of_restitution"
    found = golf_impact.run_impacts(names, **columns)
    for row, values in enumerate(cases):
        now = {name: column[row] for name, column in found.items()}
        if now["touched"] and not found.refused[row]:
            check_balances(values, now)


@pytest.mark.parametrize("law", [1, 2])
def test_bodies_that_hardly_approach_never_touch(fmu_way, law):
    """Up to 1e-30 m/s, with any force on the head, which is ignored then."""
    fmu_way.begin({"law": law, "club_speed": 1e-30, "club_force": 300.0})
    assert fmu_way.step(1.0)
    assert not fmu_way["touched"]
    fmu_way.begin({"law": law, "club_speed": 1.1e-30})
    assert fmu_way.step(1e-4)
    assert fmu_way["touched"]
