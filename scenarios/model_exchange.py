"""FMI 3.0: what a host's own solver pays in Model Exchange for what the exact phases give.

The same sources as ClubBallImpact.fmi3.fmu. fmpy integrates it with SUNDIALS' CVode (variable-order
BDF) at several tolerances and with explicit Euler, beside its co-simulation.
"""

import math
import time
from functools import partial
from types import SimpleNamespace

import numpy as np

from golf_impact.scenario import BALLS, LoadedFmu3, Report, current_fmu, main

TITLE = "Model Exchange: what a general solver pays"
CHAPTER = 15

_LAWS: dict[str, dict[str, float]] = {
    "law 1": {"law": 1},
    "law 2": {"law": 2},
    "power law": dict(BALLS["roh-lee"].values),
}

_TOLERANCES = tuple(10.0**-n for n in range(3, 13))
_SHOWN = _TOLERANCES[::3]
_EULER_STEPS = (4e-6, 2e-6, 1e-6, 0.5e-6)

_STOP = 1e-3
#: So many rounds of all, and at least so long in each, s.
_REPEATS = 4
_LEAST_TIME = 2e-3
_METRICS = ("ball_velocity", "contact_time", "coefficient_of_restitution", "energy_efficiency")

#: How equal FMI 2.0 and 3.0 must be, relative: the same sources do both, by the same operations.
_SAME = 1e-13


class _Way:
    """One way of running one impact: errors are relative to the FMI 2.0 FMU's results.

    Args:
        setting: tolerance, or step (s).
        run: runs it once and gives the metrics.
        exact: what the FMI 2.0 FMU gives.
        counted: runs it and says how often it asks for derivatives, too.
    """

    def __init__(self, setting, run, exact, counted=lambda run: (run(), 0)) -> None:
        self.setting, self.run, self.seconds = setting, run, math.inf
        self.metrics, self.evaluations = counted(run)
        self.speed_error, self.time_error = (
            abs(self.metrics[name] - exact[name]) / exact[name] for name in _METRICS[:2]
        )

    def time(self):
        """Run it again; the fastest counts: whatever else the machine does only adds to it."""
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
    """Every law by CVode, by Euler and stepped."""
    report = Report(TITLE, fmu)
    exact = {name: fmu.impact(_METRICS, **values) for name, values in _LAWS.items()}
    with LoadedFmu3(current_fmu(fmi=3)[0]) as fmi3:
        ways = _ways(fmi3, exact)
        # In turns, so that a busy moment of the machine doesn't hit one of them alone.
        for _ in range(_REPEATS):
            for group in (*ways.solved.values(), ways.stepped.values(), ways.euler, ways.simulated):
                for one in group:
                    one.time()
    for name, solved in ways.solved.items():
        for one in solved:
            report.cases[f"{name}, CVode {one.setting:.0e}"] = one.numbers()
        report.cases[f"{name}, co-simulation"] = ways.stepped[name].numbers()
    report.cases |= {f"law 1, Euler {one.setting:.1e}": one.numbers() for one in ways.euler}
    report.table(TITLE, ["", "derivatives", "ms", "error of v_B", "of contact time"], _rows(ways))
    _check(report, ways)
    _conclude(report, ways)

    @report.figure(
        "model_exchange",
        "A general solver pays for every digit. One communication step of the exact phases gives "
        "the answer of the FMI 2.0 FMU to the last bit, so its points stand at 0.",
    )
    def error_against_run_time(figures):
        return _drawn(figures, ways)

    return report


def _ways(fmi3, exact):
    def solve(values, **options):
        return fmi3.simulate(fmi3.model, _METRICS, stop_time=_STOP, start_values=values, **options)

    def step(values):
        # One communication step, as a scene that drives the instance itself.
        fmi3.begin(values)
        fmi3.slave.doStep(0.0, _STOP)
        return fmi3.read(_METRICS)

    def cvode(name, tolerance):
        options = {"relative_tolerance": tolerance, "output_interval": _STOP / 10}
        return _Way(tolerance, partial(solve, _LAWS[name], **options), exact[name], fmi3.counted)

    def euler(h):
        run = partial(solve, {}, solver="Euler", step_size=h, output_interval=h)
        return _Way(h, run, exact["law 1"], fmi3.counted)

    at_once = {"stop_time": _STOP, "output_interval": _STOP}
    simulated = partial(fmi3.simulate, fmi3.slave, _METRICS, **at_once)
    return SimpleNamespace(
        solved={name: [cvode(name, tolerance) for tolerance in _TOLERANCES] for name in _LAWS},
        stepped={name: _Way(_STOP, partial(step, _LAWS[name]), exact[name]) for name in _LAWS},
        euler=[euler(h) for h in _EULER_STEPS],
        simulated=[_Way(_STOP, simulated, exact["law 1"])],
    )


def _rows(ways):
    for name, solved in ways.solved.items():
        shown = {f"CVode, rtol {one.setting:.0e}": one for one in solved if one.setting in _SHOWN}
        if name == "law 1":
            shown |= {f"Euler {one.setting * 1e6:g} µs": one for one in ways.euler}
            shown["simulate_fmu"] = ways.simulated[0]
        shown["one step"] = ways.stepped[name]
        for words, one in shown.items():
            costs = str(one.evaluations or "–"), f"{one.seconds * 1e3:.3g}"
            yield [f"{name}: {words}", *costs, f"{one.speed_error:.1e}", f"{one.time_error:.1e}"]


def _check(report, ways):
    for name, one in ways.stepped.items():
        worst = max(one.speed_error, one.time_error)
        claim = f"{name}: co-simulation gives what the FMI 2.0 FMU gives"
        report.check(claim, worst <= _SAME, f"off by {worst:.1e}, allowed {_SAME:.0e}")
    for name, solved in ways.solved.items():
        slope, last = _slope(solved), solved[-1]
        # BDF keeps the error of a step below the tolerance; over the contact it adds up.
        claim = f"{name}: CVode's error falls with its tolerance"
        report.check(claim, 0.6 < slope < 1.2, f"with its power {slope:.2f}")
        report.check(
            f"{name}: at a tolerance of {last.setting:.0e} Model Exchange gives the same impact",
            max(last.speed_error, last.time_error) < 1e-8,
            f"ball velocity off by {last.speed_error:.1e}, contact time by {last.time_error:.1e}",
        )
    order = _slope(ways.euler)
    report.check("explicit Euler is of first order", 0.9 < order < 1.1, f"{order:.3f} measured")


def _slope(ways):
    """The power of its setting with which the ball's error in speed falls: a fit over all ways."""
    settings, errors = np.log([(one.setting, one.speed_error) for one in ways]).T
    return float(np.polyfit(settings, errors, 1)[0])


def _conclude(report, ways):
    solved, exact, document = ways.solved["law 1"], ways.stepped["law 1"], ways.euler[-1]
    good = min((one for one in solved if one.speed_error < 1e-6), key=lambda one: one.seconds)
    best = solved[-1]
    report.say(
        f"Law 1 to six digits costs CVode {good.evaluations} evaluations of the derivatives and "
        f"{good.seconds * 1e3:.1f} ms, {good.seconds / exact.seconds:.0f} times the "
        f"{exact.seconds * 1e6:.0f} µs of one communication step, which is exact. At a tolerance "
        f"of {best.setting:.0e} it is {best.evaluations} evaluations and {best.seconds * 1e3:.1f} "
        f"ms for an error of {best.speed_error:.0e}.",
        f"Explicit Euler at {document.setting * 1e6:g} µs, the document's scheme, errs by "
        f"{document.speed_error:.1e} after {document.evaluations} evaluations; halving the step "
        f"divides that by {2.0 ** _slope(ways.euler):.2f}.",
    )
    smooth, steep = (
        sum(one.evaluations for one in ways.solved[name]) for name in ("law 2", "power law")
    )
    report.say(
        "CVode's error in the ball's velocity falls with the power "
        + ", ".join(f"{_slope(solved):.2f} ({name})" for name, solved in ways.solved.items())
        + f" of its tolerance. The power law's damper has an infinite slope at first touch: over "
        f"all tolerances it costs {steep / smooth:.1f} times the evaluations of the linear law 2."
    )


def _drawn(figures, ways):
    title = "Run time against error: a host's solver, and the exact phases"
    figure, axes = figures.new(title, (7.2, 5.2))
    curves = {f"{name}, CVode": (name, solved) for name, solved in ways.solved.items()}
    curves["law 1, explicit Euler"] = "explicit Euler, Python", ways.euler
    for label, (look, some) in curves.items():
        errors, micro = zip(*((one.speed_error, one.seconds * 1e6) for one in some))
        axes.plot(errors, micro, **figures.LOOKS[look].points, ms=5, lw=1.4, label=label)
    for name, one in ways.stepped.items():
        look = figures.LOOKS[name]
        point = {"color": look.colour, "ms": 10, "mec": figures.BLACK, "clip_on": False}
        label = f"{name}, co-simulation in one step"
        axes.plot(one.speed_error, one.seconds * 1e6, look.marker, **point, label=label)
    figures.run_time_axes(axes, "difference from the exact FMU's ball velocity (relative)")
    figures.legend_below(figure, axes, columns=2)
    return figure


if __name__ == "__main__":
    main(__file__)
