"""Impacts over the whole range of every variable: rejected with a reason, or correct.

A hundred in CI, always the same ones; 10,000 of each kind with --hypothesis-profile=nightly.
"""

import math
import random
from functools import cached_property
from types import SimpleNamespace

import pytest
from compare import assert_within
from components import initialized
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Discard
from hypothesis import assume, event, example, given
from hypothesis import strategies as st
from impact_fmu import ImpactFmu

from golf_impact.arrays.impacts import ScalarImpacts
from golf_impact.impact_checks import check
from golf_impact.random_impacts import BASELINE, ImpactCase, half_contact, segments_of
from golf_impact.runs import FLAGS
from golf_impact.scales import TOLERANCE, reduced_mass

#: Where times come from quadrature; other results are as exact, but at those times.
TOLERANCE_OF_QUADRATURE = 1e-10

RUNS = ScalarImpacts()

#: Doubles below this are subnormal and have fewer digits, with a margin.
LEAST = 1e-300


class Driver(ImpactFmu):
    """The FMU, for any number of runs; refusals are messages, not errors."""

    def outputs(self):
        return {**self.read(self.real_outputs), **{flag: self.read_flag(flag) for flag in FLAGS}}

    @cached_property
    def opened(self):
        """What checks need of a golf_impact.Impact; its instance is this one."""
        references = {name: v.valueReference for name, v in self.variables.items()}
        return SimpleNamespace(
            instance=self.slave, references=references, description=self.description
        )


@pytest.fixture(scope="module")
def driver(fmu_path):
    with Driver(fmu_path) as driver:
        yield driver


def decades(low, high):
    return st.floats(low, high).map(lambda power: 10.0**power)


def signed(magnitudes):
    return st.builds(lambda sign, x: sign * x, st.sampled_from((1.0, -1.0)), magnitudes)


exponents = st.one_of(
    st.just(1.0),
    st.floats(1.0, 12.0),
    st.sampled_from((1.5, 3.0, 12.0, 1.0 + 2e-16, 1.0 + 1e-9, 11.999999999)),
)

damping_ratios = st.one_of(
    st.just(0.0),
    decades(-6, 6),
    st.floats(0.5, 1.5),
    signed(decades(-16, -2)).map(lambda x: 1.0 + x),
)


@st.composite
def impacts(draw):
    """Values of an impact that is accepted: far beyond golf, but physics."""
    mass, ratio = draw(decades(-3, 2)), draw(decades(-6, 6))
    m_club, m_ball = mass * math.sqrt(ratio), mass / math.sqrt(ratio)
    mu = reduced_mass({"m_club": m_club, "m_ball": m_ball})
    k = draw(st.one_of(st.just(1e6), decades(0, 12)))
    law = draw(st.sampled_from((1, 2)))
    ball_speed = draw(st.one_of(st.just(0.0), signed(decades(-6, 3))))
    closing = draw(st.one_of(st.just(35.0), decades(-6, 3)))
    values = {
        "law": law,
        "m_club": m_club,
        "m_ball": m_ball,
        "k": k,
        "b": 2.0 * draw(damping_ratios) * math.sqrt(k * mu),
        "club_speed": ball_speed + closing,
        "ball_speed": ball_speed,
        "gap": draw(st.one_of(st.just(0.0), decades(-6, 0))),
    }
    closing = values["club_speed"] - ball_speed
    assume(closing > 0.0)
    if law == 2 and draw(st.booleans()):
        values["exponent"] = draw(exponents)
        values["reference_compression"] = draw(decades(-5, 1))
    if law == 2 and draw(st.integers(0, 3)) == 0:
        coefficient = draw(st.one_of(st.floats(0.01, 1.0), decades(-20, -1)))
        slope = draw(st.one_of(st.just(0.0), st.floats(0.0, 1.0))) * (1.0 - coefficient) / closing
        values["restitution_at_rest"] = min(1.0, coefficient + slope * closing)
        values["restitution_slope"] = slope
        assume(values["restitution_at_rest"] - slope * closing > 1e-28)
    return values


def closing_speed(values):
    return values["club_speed"] - values["ball_speed"]


def damping_ratio(values):
    """ζ of the linear oscillator in the law's own time."""
    mu = reduced_mass(values)
    stiffening = 0.5 * (values.get("exponent", 1.0) + 1.0)
    return values["b"] / (2.0 * math.sqrt(stiffening * values["k"] * mu))


def restitution(values):
    """Law 2's coefficient of restitution, in closed form."""
    if values.get("restitution_at_rest"):
        return values["restitution_at_rest"] - values["restitution_slope"] * closing_speed(values)
    zeta = damping_ratio(values)
    return math.exp(-2.0 * zeta * half_contact(zeta))


def long_step(values):
    """A step (s) beyond separation, short enough for the accuracy of positions."""
    zeta = damping_ratio(values)
    if values.get("restitution_at_rest"):
        zeta = -math.log(restitution(values))
    contact = 3.2 * (1.0 + math.log1p(zeta)) * (1.0 + zeta) * RUNS.half_period(values)
    return values["gap"] / closing_speed(values) + contact


# Drag separates the bodies long after its fast mode has decayed: modes cancel, many panels.
_SEPARATED_BY_DRAG = {
    "law": 1, "m_club": 0.0031622776601683794, "m_ball": 316.2277660168379, "k": 1e6,
    "b": 11246.770270096215, "club_speed": 36.0, "ball_speed": 1.0, "gap": 0.0,
}  # fmt: skip


@example(values=_SEPARATED_BY_DRAG, number=0)
@given(values=impacts(), number=st.integers(0, 2**32))
def test_an_impact(driver, values, number):
    """Every check of `golf-impact stress`, and law 2's coefficient of restitution."""
    event(f"law {values['law']}, exponent {values.get('exponent', 1.0) != 1.0}")
    tolerance = TOLERANCE_OF_QUADRATURE if "exponent" in values else TOLERANCE
    end = long_step(values)
    driver.messages.clear()
    case = ImpactCase(values, segments_of(values, end))
    for which, output, steps, error in check(driver.opened, case, random.Random(number)):
        # That balance is of a linear spring and of the damper b.
        if which != "energy" or not {"exponent", "restitution_at_rest"} & values.keys():
            within = 0.0 if which == "state" else tolerance
            assert_within(error, within, f"{which} {output}", steps=steps, values=values)
    assert not driver.messages
    driver.begin_run(values)
    driver.slave.doStep(0.0, end)
    final = driver.outputs()
    _check_balances(values, final)
    if values["law"] == 2:
        assert final["separated"]
        speed = abs(values["club_speed"]) + abs(values["ball_speed"])
        error = abs(final["coefficient_of_restitution"] - restitution(values))
        assert_within(error * closing_speed(values) / speed, name="restitution", case=values)


def test_the_time_of_the_largest_force_never_goes_back(driver):
    """Near its maximum the force is flat: a later value may be larger by rounding."""
    values = {"m_club": 1.6511082076446364, "m_ball": 0.6056538241224874, "b": 281579248.5904923}
    driver.begin_run(values | {"club_speed": 1.0})
    size, before = 2.5483879036306085e-09, 0.0
    for n in range(64):
        driver.slave.doStep(n * size, size)
        now = driver.outputs()["time_of_max_force"]
        assert now >= before
        before = now


@pytest.mark.parametrize("before", [f * 10.0**-n for n in range(4, 17) for f in (1, 3)])
def test_the_largest_force_comes_after_a_change_just_before_it(driver, before):
    """Under law 1 the force doesn't jump with b: it goes on to rise, by less than rounding."""
    names = ("time_of_max_force", "max_force")
    driver.begin_run(BASELINE)
    driver.slave.doStep(0.0, 1e-3)
    when, most = (driver.outputs()[name] for name in names)
    change = when * (1.0 - before)
    driver.begin_run(BASELINE)
    driver.slave.doStep(0.0, change)
    driver.slave.setReal(driver.references(["b"]), [BASELINE["b"] * (1.0 + 1e-9)])
    driver.slave.doStep(change, 1e-3)
    assert [driver.outputs()[name] for name in names] == pytest.approx([when, most], rel=1e-14)


anything = st.floats(allow_nan=True, allow_infinity=True)
magnitudes = signed(decades(-320, 308))


def any_value(usual):
    return st.one_of(
        st.just(usual), decades(-12, 12).map(lambda x: usual * x or x), magnitudes, anything
    )


USUAL = BASELINE | {
    "ball_diameter": 0.04267, "exponent": 1.5, "reference_compression": 0.005,
    "restitution_at_rest": 0.5, "restitution_slope": 1e-3,
}  # fmt: skip


#: A ball that hits a club at rest.
STANDING = {"club_speed": 0.0, "ball_speed": -1.0, "exponent": 1.0, "restitution_at_rest": 0.0}


@st.composite
def any_values(draw):
    """Some variables with any double, the others as usual."""
    names = draw(st.lists(st.sampled_from(sorted(USUAL)), min_size=1, max_size=5, unique=True))
    values = {name: draw(any_value(USUAL[name])) for name in names}
    return values | {"law": draw(st.sampled_from((1, 2)))}


@example(values=STANDING | {"law": 1}, later={}, size=1e-2)
@example(values=STANDING | {"law": 2, "club_speed": -1e-309}, later={}, size=1e-2)
@given(
    values=any_values(),
    later=st.dictionaries(st.sampled_from(("k", "b", "club_speed")), any_value(50.0)),
    size=st.one_of(st.sampled_from((1e-4, 1.0)), decades(-30, 30), decades(-320, 100)),
)
def test_any_double(driver, values, later, size):
    """Rejected with a message and without effect, or all outputs are finite."""
    driver.messages.clear()
    driver.begin_run(values)
    accepted = _steps(driver, 0.0, size)
    now = driver.outputs()
    _check_numbers(driver, now, accepted)
    if accepted and now["touched"]:
        _check_balances(values, now)
    if accepted:
        driver.slave.setReal(driver.references(list(later)), list(later.values()))
        driver.messages.clear()
        again = _steps(driver, size, size)
        later_on = driver.outputs()
        _check_numbers(driver, later_on, again)
        if not again:
            assert not {n for n in now if now[n] != later_on[n]}
            _check_recovery(driver, values, later, size)
    event(f"accepted {accepted}")


#: Values that are accepted, but no others that are farther from 1, with these other ones.
TWO = {"m_club": 2.0, "m_ball": 2.0}
HARDENING = {"law": 2, "exponent": 3.0}
#: The largest compression is four times the root of reference_compression (in m).
ROOT = TWO | HARDENING | {"k": 4.0, "club_speed": 15.0, "ball_speed": -1.0}
BORDERS = [
    ("m_club", 1e15, {"m_ball": 1.0}),
    ("m_club", 1e-15, {"m_ball": 1.0}),
    ("m_ball", 1e15, {"m_club": 1.0}),
    ("m_ball", 1e-15, {"m_club": 1.0}),
    ("m_ball", 0.5e75, HARDENING | {"m_club": 0.5e75, "club_speed": 0.0}),
    ("m_ball", 2e-75, {"m_club": 2e-75, "b": 0.0}),
    ("k", 1e150, TWO),
    ("k", 1e-150, TWO | {"b": 0.0}),
    ("b", 2e15, TWO | {"k": 1.0}),
    ("gap", 1e75, {}),
    *((speed, value, {}) for speed in ("club_speed", "ball_speed") for value in (1e75, -1e75)),
    *(("club_force", value, TWO) for value in (2e75, -2e75)),
    ("reference_compression", 0.0625e150, ROOT),
    ("reference_compression", 16e-150 * (1.0 + 1e-15), ROOT),
]


@pytest.mark.parametrize(("name", "last", "others"), BORDERS)
def test_the_borders_of_values_together(name, last, others):
    for value, accepted in ((last, True), (last * abs(last) ** 1e-6, False)):
        messages = []
        component = initialized(report=messages.append, **{**others, name: value})
        assert component.step(0.0, 1e-4) is accepted, (value, messages)
    words = "acceleration" if name == "club_force" else "leave the range of a double"
    assert words in messages[0].sentence


def _check_recovery(driver, values, later, size):
    """With the old inputs the run continues as if the rejected ones had never been set."""
    inputs = driver.references(list(later))
    usual = [values.get(name, USUAL[name]) for name in later]
    driver.slave.setReal(inputs, usual)
    accepted = _steps(driver, size, size)
    outputs = driver.outputs()
    driver.begin_run(values)
    assert _steps(driver, 0.0, size)
    assert _steps(driver, size, size) == accepted
    event("recovered")
    assert outputs == driver.outputs()


def _steps(driver, point, size):
    try:
        driver.slave.doStep(point, size)
    except FMICallException as error:
        status = error.status
    else:
        return True
    assert status == fmi2Discard
    assert driver.messages
    return False


def _check_numbers(driver, now, accepted):
    if accepted:
        bad = {name: value for name, value in now.items() if not math.isfinite(value)}
        assert not bad, (bad, driver.messages)
        assert now["force"] >= 0.0
        assert 0.0 <= now["compression"] <= now["max_compression"] * (1.0 + TOLERANCE)
        assert now["max_force"] >= now["force"] * (1.0 - 1e-9) - LEAST
        assert not driver.messages, driver.messages


def _check_balances(values, now):
    """Neither law adds energy, law 2 keeps momentum; also near overflow and underflow."""
    v = USUAL | values
    pairs = [(v["m_club"], v["club_speed"]), (v["m_ball"], v["ball_speed"])]
    before = math.fsum(0.5 * m * u * u for m, u in pairs)
    gained = (now["kinetic_energy"] - before - LEAST) / (before or LEAST)
    assert_within(gained, name="kinetic_energy", case=values)
    if v["law"] == 2:
        momentum = math.fsum(m * u for m, u in pairs)
        size = sum(m * abs(u) for m, u in pairs)
        off = (abs(now["momentum"] - momentum) - LEAST) / (size or LEAST)
        assert_within(off, name="momentum", case=values)
        speed = abs(v["club_speed"]) + abs(v["ball_speed"])
        beyond = abs(now["coefficient_of_restitution"]) - 1.0
        off = (beyond * (v["club_speed"] - v["ball_speed"]) - LEAST) / (speed or LEAST)
        assert_within(off, name="coefficient_of_restitution", case=values)
