"""Impacts over the whole range of every variable: rejected with a reason, or correct.

Where the borders are: refusals.toml.
"""

import math
import random

import pytest
from cases import DEFAULTS
from compare import assert_within
from conftest import numbers
from hypothesis import event, example, given
from hypothesis import strategies as st

import golf_impact
from golf_impact.evidence.checks import check
from golf_impact.evidence.random_impacts import (
    ImpactCase,
    contact_time_of_law_2,
    critical_damping,
    random_impact,
)
from golf_impact.evidence.reference import restitution
from golf_impact.evidence.scales import TOLERANCE

#: Where times come from quadrature; other results are as exact, but at those times.
TOLERANCE_OF_QUADRATURE = 1e-10

#: Doubles below this are subnormal and have fewer digits, with a margin.
LEAST = 1e-300


def decades(low, high):
    return st.floats(low, high).map(lambda power: 10.0**power)


def signed(magnitudes):
    return st.builds(lambda sign, x: sign * x, st.sampled_from((1.0, -1.0)), magnitudes)


def wide(number):
    """Values far beyond golf; of half of law 2's an exponent, of a quarter a COR line."""
    rng, values = random.Random(f"wide {number}"), dict(random_impact(26, number).values)
    if values["law"] == 2 and rng.random() < 0.5:
        values["exponent"] = rng.choice((rng.uniform(1, 12), 1.5, 12.0, 1 + 2e-16, 1 + 1e-9))
        values["reference_compression"] = 10.0 ** rng.uniform(-5, 1)
    if values["law"] == 2 and rng.random() < 0.25:
        coefficient = rng.choice((rng.uniform(0.01, 1.0), 10.0 ** rng.uniform(-8.5, -1)))
        fall = rng.choice((0.0, rng.random())) * (1.0 - coefficient)
        values["restitution_at_rest"] = coefficient + fall
        values["restitution_slope"] = min(1e3, fall / closing_speed(values))
    return values


def closing_speed(values):
    return values["club_speed"] - values["ball_speed"]


def exact_restitution(values):
    """Law 2's coefficient of restitution, in closed form."""
    if values["restitution_at_rest"]:
        return values["restitution_at_rest"] - values["restitution_slope"] * closing_speed(values)
    # Of the linear oscillator in the law's own time.
    own = math.sqrt(0.5 * (values["exponent"] + 1.0))
    return float(restitution(values["b"] / critical_damping(values) / own))


# Drag separates the bodies long after its fast mode has decayed: modes cancel, many panels.
_SEPARATED_BY_DRAG = {
    "law": 1, "m_club": 0.0031622776601683794, "m_ball": 316.2277660168379, "k": 1e6,
    "b": 11246.770270096215, "club_speed": 36.0, "ball_speed": 1.0, "gap": 0.0,
}  # fmt: skip


@pytest.mark.parametrize("number", [None, *numbers(20, 200, 1000)])
def test_an_impact(way_of, number):
    """Every check of `golf-impact stress`, and law 2's coefficient of restitution."""
    given = _SEPARATED_BY_DRAG if number is None else wide(number)
    tolerance = TOLERANCE_OF_QUADRATURE if "exponent" in given else TOLERANCE
    values = DEFAULTS | given
    contact = golf_impact.run_impact(["contact_time"], **given)["contact_time"]
    if math.isnan(contact):
        contact = contact_time_of_law_2(values)
    case = ImpactCase(given, values["gap"] / closing_speed(values) + 4.0 * contact)
    impact = way_of("Impact").function
    for which, output, steps, error in check(impact, case, random.Random(number)):
        # That balance is of a linear spring and of the damper b.
        if which != "energy" or not {"exponent", "restitution_at_rest"} & given.keys():
            within = 0.0 if which == "state" else tolerance
            assert_within(error, within, f"{which} {output}", steps=steps, values=given)
    way = way_of("in process").begin(given)
    assert way.step(case.end)
    final = way.read()
    assert not way.messages
    check_balances(values, final)
    if values["law"] == 2:
        assert final["separated"]
        speed = abs(values["club_speed"]) + abs(values["ball_speed"])
        error = abs(final["coefficient_of_restitution"] - exact_restitution(values))
        assert_within(error * closing_speed(values) / speed, name="restitution", case=values)


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
    """Rejected with a message, or all outputs are finite and balance.

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
        beyond = abs(now["coefficient_of_restitution"]) - 1.0
        off = (beyond * closing_speed(v) - LEAST) / (speed or LEAST)
        assert_within(off, name="coefficient_of_restitution", case=v)


@pytest.mark.parametrize("law", [1, 2])
def test_bodies_that_hardly_approach_never_touch(fmu_way, law):
    """Up to 1e-30 m/s, with any force on the head, which is ignored then."""
    fmu_way.begin({"law": law, "club_speed": 1e-30, "club_force": 300.0})
    assert fmu_way.step(1.0)
    assert not fmu_way["touched"]
    fmu_way.begin({"law": law, "club_speed": 1.1e-30})
    assert fmu_way.step(1e-4)
    assert fmu_way["touched"]
