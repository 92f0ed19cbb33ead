"""Measured numbers and force curves: ranges, and what a record's rows mean."""

import math

import numpy as np
import pytest

import golf_impact
from golf_impact.calibration.fit import ContactLaw, Fit
from golf_impact.calibration.measurements import measurements, number
from golf_impact.errors import UserError

IMPACT = {"club_speed": 30.0, "m_club": 0.2, "m_ball": 0.05}
RATE = 5e-6


def curve(rows=200, lead=100):
    """The half sine of an undamped contact: 6 kN, 628 µs, 2.4 N·s; one row in 5 µs."""
    time = RATE * np.arange(rows)
    since = time - lead * RATE
    inside = (since > 0.0) & (since < math.pi / 5e3)
    return time, np.where(inside, 6e3 * np.sin(5e3 * since), 0.0)


def read(time, force):
    return measurements(IMPACT, curve=(time, force)).curves["curve"]


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("cor", 0.01, 1.0), ("exponent", 0.999999, 12.000001), ("max_force", 20.0, math.inf),
        ("contact_time", 0.0, 0.1), ("time_of_max_force", 0.0, 0.1), ("m_club", 0.0, 10.0),
        ("m_ball", 0.0, 10.0), ("club_speed", 0.0, math.inf),
    ],
)  # fmt: skip
def test_ranges_from_both_sides(name, low, high):
    inside = [low * (1.0 + 1e-9) or 1e-9, high * (1.0 - 1e-9) if high < math.inf else 1e9]
    assert [number(value, name) for value in inside] == inside
    for value in (low, high, math.nan):
        with pytest.raises(UserError, match="is refused"):
            number(value, name)


def test_a_good_curve_has_no_notes():
    series = read(*curve(260))
    assert (series.notes, series.offset_error) == ((), 0.0)
    assert len(series.x) == 260


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, f: (t[:0], f[:0]), "it has no rows of time, force"),
        (lambda t, f: (t[[0, 1, 2, 4, 3, 5]], f[:6]), "row 5: time = 1.5e-05 s isn't after 2e-05"),
        (lambda t, f: (t[[0, 1, 2, 2, 4, 5]], f[:6]), "row 4: time = 1e-05 s isn't after 1e-05"),
        (lambda t, f: (np.where(t == t[9], np.inf, t), f), "row 10: time = inf"),
        (lambda t, f: (t, np.where(t == t[9], np.nan, f)), "row 10: force = nan"),
        (lambda t, f: (t, 0.0 * f), "row 1: .* no touch"),
        (lambda t, f: (t, np.where(t == t[150], 6e3, 0.0)), "of only 1 row in contact"),
        (lambda t, f: (t[::40], f[::40]), "one of only 3 rows in contact"),
        (lambda t, f: (t[170:], f[170:]), "the first: the record was triggered too late"),
        (lambda t, f: (t * 1e3, f), "contact of 0.5.* s, not of 600e-6: for ms write"),
        (lambda t, f: (t * 1e6, f), "for µs write"),
        (lambda t, f: (t, 1e3 * np.sin(t / RATE)), "no more than the rest"),
        (lambda t, f: (t, f * 1e-3 + 0.0), "force looks like kN"),
        (lambda t, f: (t, 0.35 * f), "mph.* 10.5 to 21 m/s, or --m-club from 0.0194 to 0.0636"),
    ],
)  # fmt: skip
def test_curves_that_are_refused(change, words):
    with pytest.raises(UserError, match=words):
        read(*change(*curve(260)))


@pytest.mark.parametrize(("rows", "subtracted"), [(9, False), (10, True)])
def test_an_offset_needs_ten_rows_before_contact(rows, subtracted):
    """Of rows at least a quarter of the contact before it."""
    time, force = curve(260)
    contact = np.flatnonzero(force > 0.25 * 6e3)
    quarter = 0.25 * (time[contact[-1]] - time[contact[0]])
    first = np.flatnonzero(time < time[contact[0]] - quarter)[-1] + 1 - rows
    series = read(time[first:], force[first:] + 50.0)
    assert bool(series.notes) == subtracted
    assert series.y.max() == pytest.approx(6e3 if subtracted else 6050.0, rel=1e-4)
    if subtracted:
        assert f"mean of {rows} rows before contact" in series.notes[0]


@pytest.mark.parametrize(("rows", "every"), [(3000, 1), (200, 6), (40, 8)])
def test_rows_around_contact(rows, every):
    """Those above a quarter of the largest force, half as many on both sides; one in eight."""
    time = np.linspace(-1e-3, 2e-3, 3001)
    force = 6e3 * np.sin(5e3 * time) * (abs(time - math.pi / 1e4) < math.pi / 1e4)
    series = measurements(IMPACT, curve=(time, force, force + 1e4)).curves["curve"]
    assert series.around_contact(3001) is series
    (first, *_, last), some = series.contact, series.around_contact(rows)
    half = (last - first) // 2 + 1
    kept = np.arange(first - half, last + half + 1, every)
    assert (some.x.tolist(), some.y.tolist()) == (time[kept].tolist(), force[kept].tolist())
    assert some.sigma.tolist() == (force + 1e4)[kept].tolist()


@pytest.mark.parametrize("order", ["columns", "rows", "table", "mapping"])
def test_forms_of_a_curve(order):
    time, force = curve(260)
    given = {
        "columns": (time, force),
        "rows": np.stack([time, force], axis=1),
        "table": np.stack([time, force]),
        "mapping": {"force": force, "time": time},
    }[order]
    series = measurements(IMPACT, curve=given).curves["curve"]
    assert (series.x.tolist(), series.y.tolist()) == (time.tolist(), force.tolist())


def test_clipped_rows_are_left_out_with_their_sigma():
    time, force = curve(260)
    sigma = np.linspace(10.0, 20.0, 260)
    series = measurements(IMPACT, curve=(time, np.minimum(force, 5e3), sigma)).curves["curve"]
    clipped = force >= 5e3
    assert f"{clipped.sum()} rows at the largest force are left out: clipped" in series.notes[0]
    assert series.sigma.tolist() == sigma[~clipped].tolist()


def test_the_sign_of_a_sensor():
    time, force = curve(260)
    series = read(time, -force)
    assert series.notes == ("the force is negative; its sign was changed",)
    assert series.y.tolist() == force.tolist()


def test_parameters_are_rounded_to_a_thousandth_of_a_standard_deviation():
    """Digits that the measurements don't determine are left out; the instant of touch keeps its."""
    time, force = curve(260)
    noise = np.random.default_rng(1).normal(0.0, 20.0, 260)
    fit = Fit(measurements(IMPACT, curve=(time, force + noise)), ContactLaw(2, 1.0))
    k, touch = fit.parameters["k"], fit.curves["curve"]["touch"]
    assert k.value == round(k.value, 1)
    assert k.value == pytest.approx(1e6, abs=3.0 * k.standard_error)
    assert touch.value != round(touch.value, 12)
    assert touch.value == pytest.approx(100 * RATE, abs=3.0 * touch.standard_error)


@pytest.mark.parametrize(
    ("more", "sentences"),
    [
        (
            {},
            [
                "σ is taken as 1 % of cor, contact_time.",
                "No more targets than parameters: Kelvin–Voigt meets them exactly, so χ² doesn't",
            ],
        ),
        (
            {"max_force": 20e3, "sigma_max_force": 200.0},
            [
                "σ is taken as 1 % of cor, contact_time.",
                "This law doesn't fit: χ² = 3.03e+03 with 1 degrees of freedom (probability 0); ",
                "power law, n free describes these measurements better: its AIC is lower by 3.03",
            ],
        ),
    ],
    ids=["as many", "contradiction"],
)
def test_what_a_calibration_says(more, sentences):
    words = golf_impact.calibrate(cor=0.8, contact_time=5e-4, **more).words
    assert len(words) == len(sentences)
    assert all(map(str.startswith, words, sentences))


def test_the_progress_of_a_calibration():
    """Each of four laws has a quarter, and each step of its search a fifth of what is left."""
    seen = []
    golf_impact.calibrate(
        cor=0.8, contact_time=5e-4, max_force=8e3, progress=lambda percent, _: seen.append(percent)
    )
    assert seen[:2] == pytest.approx([5.0, 9.0], rel=1e-12)
    assert seen == sorted(seen)
    assert 75.0 < seen[-1] < 100.0
