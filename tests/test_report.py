"""Reports of runs: their checks, and what they say."""

import math

import numpy as np
import pytest
from compare import assert_close

from golf_impact.document import Printed
from golf_impact.quantities import NoValue
from golf_impact.report import figures
from golf_impact.report.any_law import check_any_law
from golf_impact.report.own_cases import own_cases
from golf_impact.report.report import Report, derive_metrics
from golf_impact.report.styles import STYLES
from golf_impact.report.uncertainty import gradient, standard_errors

pytestmark = pytest.mark.usefixtures("no_figure_stays_open")


def checked(fmu, change, **values):
    report = Report("a case", fmu)
    metrics = report.impact("a case", **values)
    before = len(report.checks)
    check_any_law(report, "a case", report.starts | values, {**metrics, **change(metrics)})
    return report.checks[before:]


@pytest.mark.parametrize("b", [9.0, 300.0])
def test_balances_that_hold_for_any_law_hold_under_drag(fmu, b):
    """Law 1 has it; its terms are some per mille and some ten per cent of the balances."""
    given = {"b": b, "gap": 0.001, "ball_speed": 3.0, "club_force": 500.0}
    checks = checked(fmu, lambda metrics: {}, **given)
    assert len(checks) == 8
    assert all(check.passed for check in checks)
    for name in ("impulse", "contact_time", "club_velocity", "ball_velocity"):
        checks = checked(fmu, lambda now, name=name: {name: now[name] * (1.0 + 1e-3)}, **given)
        failed = [check.claim for check in checks if not check.passed]
        assert any(f" {name} " in claim for claim in failed), failed
    # Drag never pushes.
    checks = checked(fmu, lambda now: {"impulse": now["impulse"] * (1.0 - 1e-6)}, law=2)
    assert [check.passed for check in checks if "doesn't give any" in check.claim] == [False]


@pytest.mark.parametrize(("ball_speed", "b"), [(-10.0, 9.0), (29.0, 300.0)])
def test_errors_that_checks_allow(fmu, ball_speed, b):
    """By hand, of speed, momentum and energy; for a contact time more if the bodies part slowly."""
    report = Report("a case", fmu)
    allowed = []
    report.check_close = lambda *one, **_: allowed.append(one[3])
    given = {"law": 2, "b": b, "m_club": 0.2, "m_ball": 0.05, "club_speed": 30.0}
    given["ball_speed"] = ball_speed
    found = report.impact("a case", {"ball_velocity": Printed("20.0")}, **given)
    for parting in (1.0, 0.0):
        club = found["ball_velocity"] - parting
        metrics = {**found, "club_velocity": club}
        check_any_law(report, "a case", report.starts | given, metrics)
    speed, time, impulse = 30.0 + abs(ball_speed), found["contact_time"], found["impulse"]
    momentum, energy = 6.0 + 0.05 * abs(ball_speed), 90.0 + 0.025 * ball_speed**2
    definitions = [max(1.0, found["smash_factor"]), 1.0, 1.0]
    own = [*definitions, 1.0, time, speed, impulse, 0.25 * speed]
    balances = [momentum, momentum, energy, energy]
    expected = [*(1e-12 * scale for scale in own), 0.005 * 20.0 + 0.05]
    for part in (1.0, 1e-9 * speed):
        expected += [1e-8 * scale for scale in balances]
        expected += [1e-6 * speed, 1e-6 * speed, 1e-6 * time * speed / part]
    assert allowed == pytest.approx(expected, rel=1e-12, abs=0.0)


def test_metrics_by_hand():
    """Of velocities; and a table of the document's scheme, which is wrong by 1 %."""
    given = {"m_club": 0.2, "m_ball": 0.05, "club_speed": 30.0, "ball_speed": -10.0}
    outputs = {"club_velocity": 18.0, "ball_velocity": 40.0, "contact_displacement": 0.01}
    metrics = derive_metrics(outputs, {**given, "ball_diameter": 0.04})
    assert metrics == pytest.approx(
        outputs
        | {"momentum_gain_ball": 2.5, "momentum_initial": 5.5, "momentum_final": 5.6}
        | {"kinetic_energy_initial": 92.5, "kinetic_energy_final": 72.4}
        | {"contact_displacement_over_diameter": 0.25}
    )
    report = Report("a case")
    report.compare("T", {"ball_velocity": Printed("40.4")}, {"ball_velocity": 40.4}, metrics)
    (row,) = report.tables[0].rows
    assert row[1:] == ["40.4", "40.400", "40.000", "+1.00"]


def test_a_case_has_the_command_that_opens_it(fmu):
    report = Report("cases", fmu)
    report.impact("plain")
    report.impact("stiff", k=2e6, law=2)
    report.conclude("Both hit.")
    assert (report.words, report.verdict) == (["Both hit."], "Both hit.")
    report.impact("away", club_speed=-1.0)
    report.impact("stuck", b=1e4)
    assert report.commands == {
        "plain": "golf-impact explore --set law=1",
        "stiff": "golf-impact explore --set k=2000000 --set law=2",
        "away": "golf-impact explore --set club_speed=-1",
        "stuck": "golf-impact explore --set b=10000",
    }
    no_contact, no_separation = report.words[1:]
    assert no_contact.startswith("away: no contact. ")
    assert no_separation.startswith("stuck: no separation. ")
    assert no_separation.endswith(" after 1 s.")
    assert report.describe(k=2e6) == "law 1, k = 2 MN/m, b = 9 N·s/m"
    tour = {"law": 2, "exponent": 1.5, "restitution_at_rest": 0.86, "restitution_slope": 0.003}
    assert report.describe(**tour) == "law 2, k = 1 MN/m, n = 1.5, COR = 0.86 − 0.003 s/m · v"


def test_orders_are_strict():
    report = Report.__new__(Report)
    report.checks = []
    for values in ([1.0, 2.0], [2.0, 1.0], [1.0, 1.0], [2.0, 3.0, 1.0], [2.0, 2.0, 1.0]):
        for check in (report.rises, report.falls, report.stays):
            check("x", values)
    passed = [check.passed for check in report.checks]
    assert passed == [True, False, False, False, True, False, False, False, True] + [False] * 6
    report.check_close("x", 2.0, 2.5, 0.5)
    report.check_close("x", 2.0, 2.5, 0.499)
    assert [check.passed for check in report.checks[-2:]] == [True, False]


@pytest.mark.parametrize(
    ("name", "value", "ends"),
    [
        ("k", 3.0, [3.0 - 3e-4, 3.0 + 3e-4]), ("k", 0.0, [0.0, 1e-6]), ("b", 0.0, [0.0, 1e-6]),
        ("exponent", 1.0, [1.0, 1.0001]), ("exponent", 12.0, [12.0 - 12e-4, 12.0]),
        ("restitution_at_rest", 0.0, [0.0, 1e-6]), ("restitution_at_rest", 1.0, [0.9999, 1.0]),
        ("restitution_slope", 0.0, [0.0, 1e-6]),
    ],
)  # fmt: skip
def test_gradients_stay_in_the_range_of_a_parameter(name, value, ends):
    """Central differences, one-sided at the end of a range."""
    seen = []
    gradient(lambda values: seen.append(values[name]) or np.zeros(1), {name: value}, [name])
    assert seen == ends


def test_standard_errors_by_gradients():
    """Of x², whose central differences are exact."""
    square = gradient(lambda values: np.array([values["k"] ** 2]), {"k": 3.0}, ["k"])
    assert square == pytest.approx(np.array([[6.0]]), rel=1e-9)
    slopes = np.array([[3.0], [4.0]])
    assert standard_errors(slopes, np.diag([1.0, 4.0])) == pytest.approx([math.sqrt(73.0)])


PUSHED = {"club_force": 300.0}


@pytest.mark.parametrize(
    ("values", "integrated"),
    [
        ({"law": 1}, False), ({"law": 2}, False), ({"exponent": 1.6}, True),
        # CVODE's velocity after separation, where the force goes on accelerating.
        ({"law": 1, **PUSHED}, False), (PUSHED, True), ({"exponent": 1.6, **PUSHED}, True),
    ],
)  # fmt: skip
def test_cases_without_a_closed_form_or_a_balance_are_integrated(fmu, values, integrated):
    _, report = own_cases(fmu, {"law": 2, **values}, [])
    assert any("CVODE" in check.claim for check in report.checks) == integrated
    assert all(check.passed for check in report.checks)


def test_a_figure_of_forces():
    """µs since touch, kN; a marker at the peak, and both numbers in the legend."""
    path = {"time": np.array([0.0, 1e-4, 2e-4, 4e-4]), "force": np.array([0.0, 0.0, 6e3, 3e3])}
    metrics = {"touch_time": 1e-4, "contact_time": 628e-6, "max_force": 6e3}
    stuck = {**metrics, "contact_time": NoValue("no separation")}
    figure = figures.plot_forces(
        "T", "c", [("ball", "A", metrics, path), ("less", "B", stuck, path)]
    )
    (axes,) = figure.axes
    line, _ = axes.lines
    assert_close(
        dict(zip("xy", map(np.array, line.get_data()))),
        {"x": np.array([-100.0, 0.0, 100.0, 300.0]), "y": np.array([0.0, 0.0, 6.0, 3.0])},
    )
    assert (line.get_markevery(), axes.get_ylim()[0]) == ([2], 0.0)
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["A: 6.00 kN, 628 µs", "B: 6.00 kN, no separation"]
    assert (axes.get_title("left"), axes.get_xlabel()) == ("T\nc", "time since touch (µs)")


@pytest.mark.parametrize(("letters", "columns"), [(4, 4), (34, 2), (80, 1)])
def test_a_legend_has_room(letters, columns):
    """Beside the axes' end, and below the title."""
    figure, axes = figures.new("Title")
    for n in range(5):
        axes.plot([n], label=("litre " * 20)[:letters])
    figures.add_legend_above(axes)
    figure.canvas.draw()
    legend = axes.get_legend().get_window_extent()
    assert axes.get_legend()._ncols == columns
    assert legend.x1 < axes.bbox.x1 or columns == 1
    title = axes._left_title.get_window_extent()
    assert 0.0 < title.y0 - legend.y1 < title.height


def test_shades_and_legend_of_two_pairs_of_axes():
    """From light to dark; side by side, or one above the other for narrow screens."""
    less, baseline, more = (STYLES[name] for name in ("less", "baseline", "more"))
    assert figures.make_shades(1) == [baseline]
    shades = [shade.colour.upper() for shade in figures.make_shades(3)]
    assert shades == [one.colour for one in (less, baseline, more)]

    def pair():
        figure, (left, right) = figures.new_pair("Title", "case")
        for name in "abc":
            left.plot([1.0], label=name)
        figures.add_legend_below(figure, left, 3)
        figure.canvas.draw()
        first, second = (one.get_position() for one in (left, right))
        assert len(figure.axes) == 2
        return first.x1 < second.x0, second.y1 < first.y0, figure.legends[0]._ncols

    with figures.stacking():
        assert pair() == (False, True, 1)
    assert pair() == (True, False, 3)


def test_axes_with_units():
    _, axes = figures.new("Title")
    axes.plot([-2e6, 1.0], [1.0, 2.0])
    figures.name_axis(axes.xaxis, "k", "N/m")
    assert (axes.get_xlabel(), axes.xaxis.get_major_formatter()(5e5)) == ("k (MN/m)", "0.5")
    figures.name_axis(axes.yaxis, "COR", "1")
    assert axes.get_ylabel() == "COR"
    axes.set_xscale("log")
    figures.name_axis(axes.xaxis, "k", "N/m")
    assert axes.get_xlabel() == "k (N/m)"


def test_rows_of_deviations():
    """The first is the uppermost; a line at 0 in a grey band."""
    _, axes = figures.new("Title")
    figures.label_rows(axes, ["a", "b"], 0.5)
    figures.mark(axes, 1.0, 0.0, "here")
    labels = [text.get_text() for text in axes.get_yticklabels()]
    assert (labels, axes.get_ylim()) == (["a", "b"], (1.5, -0.5))
    band = axes.patches[0].get_extents().transformed(axes.transData.inverted())
    assert (band.x0, band.x1) == pytest.approx((-0.5, 0.5))
    assert [list(line.get_xdata()) for line in axes.lines] == [[0.0, 0.0], [1.0]]
    assert (axes.texts[0].get_text(), axes.texts[0].xy) == ("here", (1.0, 0.0))


def test_a_work_precision_diagram():
    """From an error of 0, left of the smallest powers of ten, to 1."""
    _, axes = figures.new("Title")
    axes.plot([0.0, 1e-3], [3.0, 4.0])
    figures.set_run_time_axes(axes, "error")
    ticks = axes.get_xticks()
    assert (ticks[0], ticks[1], ticks[-1], len(ticks)) == (0.0, 1e-16, 1.0, 10)
    assert axes.get_xlim() == (-3e-18, 1.0)
    assert (axes.get_xscale(), axes.get_yscale()) == ("symlog", "log")
    (text,) = axes.texts
    assert (text.get_text(), text.xy[0]) == ("resolution of a double", 2.2e-16)
    assert axes.lines[1].get_xdata()[0] == 2.2e-16
