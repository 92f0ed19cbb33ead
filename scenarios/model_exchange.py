"""FMI 3.0 Model Exchange: the cost of a general solver, compared with the closed form.

ClubBallImpact.fmi3.fmu is integrated by fmpy with SUNDIALS' CVode (variable-order BDF) at several
tolerances and with explicit Euler, and run in co-simulation.
"""

import math
import time
from functools import partial
from types import SimpleNamespace

import numpy as np

from golf_impact.scenario import BALLS, LoadedFmu3, Report, current_fmu, main

TITLE = "Model Exchange: the cost of a general solver"
CHAPTER = 16

_LAWS: dict[str, dict[str, float]] = {
    "law 1": {"law": 1},
    "law 2": {"law": 2},
    "power law": dict(BALLS["roh-lee"].values),
}

_TOLERANCES = tuple(10.0**-n for n in range(3, 13))
_SHOWN = _TOLERANCES[::3]
_EULER_STEPS = (4e-6, 2e-6, 1e-6, 0.5e-6)

_STOP = 1e-3
#: Rounds of measurement, and the least time of each method in a round, s.
_REPEATS = 4
_LEAST_TIME = 2e-3
_METRICS = ("ball_velocity", "contact_time", "coefficient_of_restitution", "energy_efficiency")

#: Relative tolerance between FMI 2.0 and 3.0: the same operations of the same sources.
_SAME = 1e-13


class _Method:
    """A method of running one impact; errors are relative to the results of the FMI 2.0 FMU.

    Args:
        setting: tolerance or step (s).
        run: runs it once and returns the metrics.
        exact: the metrics by the FMI 2.0 FMU.
        counted: runs it once and returns the metrics and the number of derivative evaluations.
    """

    def __init__(self, setting, run, exact, counted=lambda run: (run(), 0)) -> None:
        self.setting, self.run, self.seconds = setting, run, math.inf
        self.metrics, self.evaluations = counted(run)
        self.speed_error, self.time_error = (
            abs(self.metrics[name] - exact[name]) / exact[name] for name in _METRICS[:2]
        )

    def time(self):
        """Time it; the fastest run counts, since other load on the machine only adds time."""
        enough = time.perf_counter() + _LEAST_TIME
        while (begin := time.perf_counter()) < enough:
            self.run()
            self.seconds = min(self.seconds, time.perf_counter() - begin)

    def numbers(self):
        """For results.json."""
        return {
            **self.metrics,
            "run_time": self.seconds,
            "derivative_evaluations": float(self.evaluations),
            "ball_velocity_error": self.speed_error,
            "contact_time_error": self.time_error,
        }


def run(fmu):
    """All laws by CVode, by explicit Euler and in co-simulation."""
    report = Report(TITLE, fmu)
    exact = {name: fmu.impact(_METRICS, **values) for name, values in _LAWS.items()}
    with LoadedFmu3(current_fmu(fmi=3)[0]) as fmi3:
        methods = _methods(fmi3, exact)
        # Interleaved, so that other load on the machine affects all of them.
        for _ in range(_REPEATS):
            for group in (
                *methods.solved.values(),
                methods.stepped.values(),
                methods.euler,
                methods.simulated,
            ):
                for method in group:
                    method.time()
    for name, solved in methods.solved.items():
        for method in solved:
            report.cases[f"{name}, CVode {method.setting:.0e}"] = method.numbers()
        report.cases[f"{name}, co-simulation"] = methods.stepped[name].numbers()
    report.cases |= {
        f"law 1, Euler {euler.setting:.1e}": euler.numbers() for euler in methods.euler
    }
    report.table(
        TITLE, ["", "evaluations", "ms", "error of v_B", "error of contact time"], _rows(methods)
    )
    _check(report, methods)
    _conclude(report, methods)

    @report.figure(
        "model_exchange",
        "Each digit costs a general solver run time. One communication step of the closed form "
        "equals the FMI 2.0 FMU to the last bit: its points are at 0.",
    )
    def error_against_run_time(figures):
        return _plot(figures, methods)

    return report


def _methods(fmi3, exact):
    def solve(values, **options):
        return fmi3.simulate(fmi3.model, _METRICS, stop_time=_STOP, start_values=values, **options)

    def step(values):
        # One communication step, by calls of the instance.
        fmi3.begin(values)
        fmi3.slave.doStep(0.0, _STOP)
        return fmi3.read(_METRICS)

    def cvode(name, tolerance):
        options = {"relative_tolerance": tolerance, "output_interval": _STOP / 10}
        return _Method(
            tolerance, partial(solve, _LAWS[name], **options), exact[name], fmi3.count_evaluations
        )

    def euler(h):
        run = partial(solve, {}, solver="Euler", step_size=h, output_interval=h)
        return _Method(h, run, exact["law 1"], fmi3.count_evaluations)

    at_once = {"stop_time": _STOP, "output_interval": _STOP}
    simulated = partial(fmi3.simulate, fmi3.slave, _METRICS, **at_once)
    return SimpleNamespace(
        solved={name: [cvode(name, tolerance) for tolerance in _TOLERANCES] for name in _LAWS},
        stepped={name: _Method(_STOP, partial(step, _LAWS[name]), exact[name]) for name in _LAWS},
        euler=[euler(h) for h in _EULER_STEPS],
        simulated=[_Method(_STOP, simulated, exact["law 1"])],
    )


def _rows(methods):
    for name, solved in methods.solved.items():
        rows = {f"CVode, rtol {m.setting:.0e}": m for m in solved if m.setting in _SHOWN}
        if name == "law 1":
            rows |= {f"Euler {m.setting * 1e6:g} µs": m for m in methods.euler}
            rows["simulate_fmu"] = methods.simulated[0]
        rows["one step"] = methods.stepped[name]
        for words, m in rows.items():
            costs = str(m.evaluations or "–"), f"{m.seconds * 1e3:.3g}"
            yield [f"{name}: {words}", *costs, f"{m.speed_error:.1e}", f"{m.time_error:.1e}"]


def _check(report, methods):
    for name, method in methods.stepped.items():
        worst = max(method.speed_error, method.time_error)
        claim = f"{name}: FMI 3.0 co-simulation agrees with the FMI 2.0 FMU"
        detail = f"error {worst:.1e}, allowed {_SAME:.0e}"
        report.check(claim, worst <= _SAME, detail, "consistency")
    for name, solved in methods.solved.items():
        slope, last = _slope(solved), solved[-1]
        # BDF controls the error of each step; over the contact these add up.
        claim = f"{name}: CVode's error decreases with its tolerance"
        report.check(claim, 0.6 < slope < 1.2, f"order {slope:.2f} in the tolerance")
        report.check(
            f"{name}: CVode at a tolerance of {last.setting:.0e} agrees with the closed form",
            max(last.speed_error, last.time_error) < 1e-8,
            f"error {last.speed_error:.1e} in ball velocity, {last.time_error:.1e} in contact time",
            "closed forms",
        )
    order = _slope(methods.euler)
    claim = "the order of explicit Euler is 1"
    report.check(claim, 0.9 < order < 1.1, f"measured: {order:.3f}")


def _slope(methods):
    """The order of the error in ball velocity in the setting, fitted over all methods."""
    settings, errors = np.log([(method.setting, method.speed_error) for method in methods]).T
    return float(np.polyfit(settings, errors, 1)[0])


def _conclude(report, methods):
    solved, exact, document = methods.solved["law 1"], methods.stepped["law 1"], methods.euler[-1]
    shown = (method for method in solved if method.setting in _SHOWN)
    good = min((m for m in shown if m.speed_error < 1e-6), key=lambda m: m.seconds)
    best = solved[-1]
    report.say(
        f"Law 1 to six digits costs CVode (rtol {good.setting:.0e}) {good.evaluations} evaluations "
        f"of the derivatives, {good.seconds / exact.seconds:.0f} times the run time of one "
        "communication step in closed form."
    )
    report.say(
        f"These are {good.seconds * 1e3:.1f} ms and {exact.seconds * 1e6:.0f} µs. At a tolerance "
        f"of {best.setting:.0e} CVode takes {best.evaluations} evaluations and "
        f"{best.seconds * 1e3:.1f} ms; its error is {best.speed_error:.0e}.",
        f"Explicit Euler at {document.setting * 1e6:g} µs, the document's scheme, has an error of "
        f"{document.speed_error:.1e} after {document.evaluations} evaluations; half the step "
        f"reduces it by a factor of {2.0 ** _slope(methods.euler):.2f}.",
    )
    smooth, steep = (
        sum(method.evaluations for method in methods.solved[name])
        for name in ("law 2", "power law")
    )
    orders = (f"{_slope(solved):.2f} ({name})" for name, solved in methods.solved.items())
    report.say(
        f"The order of CVode's error in ball velocity in its tolerance is {', '.join(orders)}. The "
        "damper of the power law has an infinite slope at first touch: over all tolerances it "
        f"takes {steep / smooth:.1f} times the evaluations of the linear law 2."
    )


def _plot(figures, methods):
    title = "Run time over error: a general solver and the closed form"
    figure, axes = figures.new(
        title, (7.2, 5.2), "k = 1 MN/m, b = 9 N·s/m (power law: ball roh-lee), 35 m/s"
    )
    curves = {f"{name}, CVode": (name, solved) for name, solved in methods.solved.items()}
    curves["law 1, explicit Euler"] = "explicit Euler, Python", methods.euler
    for label, (style, of_curve) in curves.items():
        errors, micro = zip(*((method.speed_error, method.seconds * 1e6) for method in of_curve))
        axes.plot(errors, micro, **figures.STYLES[style].points, ms=5, lw=1.4, label=label)
    for name, method in methods.stepped.items():
        style = figures.STYLES[name]
        point = {"color": style.colour, "ms": 10, "mec": figures.BLACK, "clip_on": False}
        label = f"{name}, co-simulation in one step"
        axes.plot(method.speed_error, method.seconds * 1e6, style.marker, **point, label=label)
    figures.set_run_time_axes(axes, "relative error of ball velocity against the FMI 2.0 FMU")
    figures.add_legend_below(figure, axes, columns=2)
    return figure


if __name__ == "__main__":
    main(__file__)
