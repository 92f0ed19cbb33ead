"""FMI 3.0 Model Exchange by SUNDIALS' CVode and explicit Euler, beside the closed form."""

from functools import partial
from math import inf
from timeit import repeat
from unittest.mock import patch

import numpy as np

from golf_impact.scenario import BALLS, LoadedFmu3, Report, current_fmu, main

TITLE = "Model Exchange: the cost of a general solver"
CHAPTER = 17

_LAWS = {"law 1": {"law": 1}, "law 2": {"law": 2}, "power law": dict(BALLS["roh-lee"].values)}
_TOLERANCES = tuple(10.0**-n for n in range(3, 13))
_EULER_STEPS = (4e-6, 2e-6, 1e-6, 0.5e-6)

#: Cases by law and method, in the order of these settings.
_CVODE = {law: [f"{law}, CVode {r:.0e}" for r in _TOLERANCES] for law in _LAWS}
_EULER = [f"law 1, Euler {h:.1e}" for h in _EULER_STEPS]
_STEPPED = {law: f"{law}, co-simulation" for law in _LAWS}

#: Ball velocity (m/s) and contact time (s) to 16 digits: of laws 1 and 2 by
#: golf_impact.reference, of the power law by closed form and mpmath's quadrature.
_REFERENCE = {
    "law 1": (54.74501042035887, 6.195162500817234e-4),
    "law 2": (55.44873998342766, 6.010445569987612e-4),
    "power law": (50.05318039960684, 5.998744579623853e-4),
}

_STOP = 1e-3
_METRICS = ("ball_velocity", "contact_time", "coefficient_of_restitution", "energy_efficiency")


def run(fmu):
    report = Report(TITLE, fmu)
    with LoadedFmu3(current_fmu(fmi=3)[0]) as fmi3:
        runs = _runs(fmi3)
        # Interleaved, so that other load on the machine affects all; it only adds time.
        seconds = dict.fromkeys(runs, inf)
        for name, call in list(runs.items()) * 2:
            seconds[name] = min(seconds[name], *repeat(call, number=1, repeat=4))
        for name, call in runs.items():
            exact = dict(zip(_METRICS, _REFERENCE[name.partition(",")[0]]))
            evaluate = fmi3.model.getContinuousStateDerivatives
            with patch.object(fmi3.model, evaluate.__name__, wraps=evaluate) as counted:
                metrics = call()
            errors = {f"{m}_error": abs(metrics[m] - x) / x for m, x in exact.items()}
            cost = {"run_time": seconds[name], "derivative_evaluations": float(counted.call_count)}
            report.cases[name] = {**metrics, **cost, **errors}
    _show(report)
    return report


def _runs(fmi3):
    """By case, functions that run an impact of the FMI 3.0 FMU and return its metrics."""

    def solve(law, **options):
        values = {"stop_time": _STOP, "start_values": _LAWS[law], **options}
        return partial(fmi3.simulate, _METRICS, fmi3.model, **values)

    def step(law):
        fmi3.start(**_LAWS[law])
        fmi3.slave.doStep(0.0, _STOP)
        return fmi3.read(_METRICS)

    runs = {}
    for law, names in _CVODE.items():
        for name, r in zip(names, _TOLERANCES):
            runs[name] = solve(law, relative_tolerance=r, output_interval=1e-4)
        runs[_STEPPED[law]] = partial(step, law)
    for name, h in zip(_EULER, _EULER_STEPS):
        runs[name] = solve("law 1", solver="Euler", step_size=h, output_interval=h)
    return runs


def _show(report):
    columns = ("ball_velocity_error", "contact_time_error", "run_time", "derivative_evaluations")
    speed, time, seconds, count = (dict(zip(report.cases, report.each(name))) for name in columns)
    some = [name for names in _CVODE.values() for name in names[::3]]
    rows = []
    for name in (*some, *_EULER, *_STEPPED.values()):
        costs = f"{count[name]:.0f}", f"{seconds[name] * 1e3:.3g}"
        rows.append([name, *costs, f"{speed[name]:.1e}", f"{time[name]:.1e}"])
    report.table(TITLE, ["", "evaluations", "ms", "error of v_B", "error of contact time"], rows)

    def order(settings, names):
        """That of the error in ball velocity in the setting, fitted over all cases."""
        return np.polyfit(np.log(settings), np.log([speed[name] for name in names]), 1)[0]

    for law, names in _CVODE.items():
        worst = max(speed[_STEPPED[law]], time[_STEPPED[law]])
        claim = f"{law}: FMI 3.0 co-simulation agrees with the reference"
        # A few roundings; the worst measured is 8e-16.
        report.check(claim, worst <= 1e-13, f"error {worst:.1e}, allowed 1e-13", "closed forms")
        # BDF controls the error of each step; over the contact these add up.
        slope = order(_TOLERANCES, names)
        claim = f"{law}: CVode's error decreases with its tolerance"
        report.check(claim, 0.6 < slope < 1.2, f"order {slope:.2f} in the tolerance")
        worst = max(speed[names[-1]], time[names[-1]])
        claim = f"{names[-1]} agrees with the closed form"
        report.check(claim, worst < 1e-8, f"error {worst:.1e}", "closed forms")
    slope = order(_EULER_STEPS, _EULER)
    report.check("the order of explicit Euler is 1", 0.9 < slope < 1.1, f"measured: {slope:.3f}")

    good = next(name for name in some if speed[name] < 1e-6)
    closed, steep, smooth = _STEPPED["law 1"], _CVODE["power law"][-1], _CVODE["law 2"][-1]
    times = seconds[good] / seconds[closed]
    report.say(
        f"Six digits of the ball velocity ({good}) take {count[good]:.0f} evaluations of the "
        f"derivatives and {times:.0f} times the run time of one communication step in closed form. "
        "The damper of the power law has an infinite slope at first touch: it takes "
        f"{count[steep] / count[smooth]:.1f} times the evaluations of the linear law 2.",
        f"That run takes {seconds[closed] * 1e6:.0f} µs by fmpy's FMI 3.0 calls: restoring the "
        "instance, initialization by names, the step, four outputs by name. The 19 to 23 µs of "
        "`golf-impact bench` are those of FMI 2.0 calls with prepared arrays.",
    )

    @report.figure(
        "model_exchange",
        "Each digit costs a solver run time; the closed form is at rounding error.",
    )
    def error_against_run_time(figures):
        title = "Run time over error: a general solver and the closed form"
        case = "k = 1 MN/m, b = 9 N·s/m (power law: ball roh-lee), 35 m/s"
        figure, axes = figures.new(title, (7.2, 5.2), case)

        def plot(names, label, style):
            points = ((speed[name], seconds[name] * 1e6) for name in names)
            axes.plot(*zip(*points), label=label, **style)

        lines = {"ms": 5, "lw": 1.4}
        for law, names in _CVODE.items():
            plot(names, f"{law}, CVode", figures.STYLES[law].points | lines)
        style = figures.STYLES["explicit Euler"].points | lines
        plot(_EULER, "law 1, explicit Euler", style)
        points = {"ls": "", "ms": 10, "mec": figures.BLACK, "clip_on": False}
        for law, name in _STEPPED.items():
            plot([name], f"{name} in one step", figures.STYLES[law].points | points)
        figures.set_run_time_axes(axes, "relative error of ball velocity against the reference")
        figures.add_legend_below(figure, axes, columns=2)
        return figure


if __name__ == "__main__":
    main(__file__)
