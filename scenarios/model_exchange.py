"""FMI 3.0 Model Exchange: the cost of a general solver, compared with the closed form.

ClubBallImpact.fmi3.fmu is integrated by fmpy with SUNDIALS' CVode (variable-order BDF) at several
tolerances and with explicit Euler, and run in co-simulation.
"""

import math
import time
from functools import partial

import numpy as np

from golf_impact.scenario import BALLS, LoadedFmu3, Report, current_fmu, main

TITLE = "Model Exchange: the cost of a general solver"
CHAPTER = 16

_LAWS = {"law 1": {"law": 1}, "law 2": {"law": 2}, "power law": dict(BALLS["roh-lee"].values)}
_TOLERANCES = tuple(10.0**-n for n in range(3, 13))
_EULER_STEPS = (4e-6, 2e-6, 1e-6, 0.5e-6)

_STOP = 1e-3
_METRICS = ("ball_velocity", "contact_time", "coefficient_of_restitution", "energy_efficiency")

#: Rounds of measurement, and the least time of each method in a round, s.
_ROUNDS, _LEAST_TIME = 4, 2e-3

#: Relative tolerance between FMI 2.0 and 3.0: the same operations of the same sources.
_SAME = 1e-13


class _Method:
    """A method of running one impact of the FMI 3.0 FMU.

    Args:
        fmi3: the FMU.
        setting: tolerance or step (s).
        run: runs it once and returns the metrics.
        exact: the metrics by the FMI 2.0 FMU; errors are relative to them.
    """

    def __init__(self, fmi3, setting, run, exact) -> None:
        self.setting, self.run, self.seconds = setting, run, math.inf
        self.metrics, self.evaluations = fmi3.count_evaluations(run)
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

    def row(self, name):
        """For the table."""
        costs = str(self.evaluations or "–"), f"{self.seconds * 1e3:.3g}"
        return [name, *costs, f"{self.speed_error:.1e}", f"{self.time_error:.1e}"]


def _order(methods):
    """The order of the error in ball velocity in the setting, fitted over all methods."""
    settings, errors = np.log([(method.setting, method.speed_error) for method in methods]).T
    return float(np.polyfit(settings, errors, 1)[0])


def run(fmu):
    """All laws by CVode, by explicit Euler and in co-simulation."""
    report = Report(TITLE, fmu)
    exact = {law: fmu.impact(_METRICS, **values) for law, values in _LAWS.items()}
    with LoadedFmu3(current_fmu(fmi=3)[0]) as fmi3:

        def solve(law, setting, **options):
            values = {"stop_time": _STOP, "start_values": _LAWS[law], **options}
            run = partial(fmi3.simulate, fmi3.model, _METRICS, **values)
            return _Method(fmi3, setting, run, exact[law])

        def step(law):
            fmi3.begin(_LAWS[law])
            fmi3.slave.doStep(0.0, _STOP)
            return fmi3.read(_METRICS)

        cvode = {
            law: [solve(law, r, relative_tolerance=r, output_interval=1e-4) for r in _TOLERANCES]
            for law in _LAWS
        }
        euler = [
            solve("law 1", h, solver="Euler", step_size=h, output_interval=h) for h in _EULER_STEPS
        ]
        stepped = {law: _Method(fmi3, _STOP, partial(step, law), exact[law]) for law in _LAWS}
        # Interleaved, so that other load on the machine affects all of them.
        for _ in range(_ROUNDS):
            for group in (*cvode.values(), stepped.values(), euler):
                for method in group:
                    method.time()

    rows = []
    for law, solved in cvode.items():
        for method in solved:
            report.cases[f"{law}, CVode {method.setting:.0e}"] = method.numbers()
        report.cases[f"{law}, co-simulation"] = stepped[law].numbers()
        shown = solved[::3]
        rows += [method.row(f"{law}: CVode, rtol {method.setting:.0e}") for method in shown]
        if law == "law 1":
            rows += [method.row(f"law 1: Euler {method.setting * 1e6:g} µs") for method in euler]
        rows.append(stepped[law].row(f"{law}: one step"))
    for method in euler:
        report.cases[f"law 1, Euler {method.setting:.1e}"] = method.numbers()
    report.table(TITLE, ["", "evaluations", "ms", "error of v_B", "error of contact time"], rows)

    for law, method in stepped.items():
        worst = max(method.speed_error, method.time_error)
        claim = f"{law}: FMI 3.0 co-simulation agrees with the FMI 2.0 FMU"
        detail = f"error {worst:.1e}, allowed {_SAME:.0e}"
        report.check(claim, worst <= _SAME, detail, "consistency")
    for law, solved in cvode.items():
        order, last = _order(solved), solved[-1]
        # BDF controls the error of each step; over the contact these add up.
        claim = f"{law}: CVode's error decreases with its tolerance"
        report.check(claim, 0.6 < order < 1.2, f"order {order:.2f} in the tolerance")
        report.check(
            f"{law}: CVode at a tolerance of {last.setting:.0e} agrees with the closed form",
            max(last.speed_error, last.time_error) < 1e-8,
            f"error {last.speed_error:.1e} in ball velocity, {last.time_error:.1e} in contact time",
            "closed forms",
        )
    order = _order(euler)
    claim = "the order of explicit Euler is 1"
    report.check(claim, 0.9 < order < 1.1, f"measured: {order:.3f}")

    closed, document, best = stepped["law 1"], euler[-1], cvode["law 1"][-1]
    good = min(
        (method for method in cvode["law 1"][::3] if method.speed_error < 1e-6),
        key=lambda method: method.seconds,
    )
    steep, smooth = (
        sum(method.evaluations for method in cvode[law]) for law in ("power law", "law 2")
    )
    orders = (f"{_order(solved):.2f} ({law})" for law, solved in cvode.items())
    report.say(
        f"Law 1 to six digits costs CVode (rtol {good.setting:.0e}) {good.evaluations} evaluations "
        f"of the derivatives, {good.seconds / closed.seconds:.0f} times the run time of one "
        "communication step in closed form.",
        f"These are {good.seconds * 1e3:.1f} ms and {closed.seconds * 1e6:.0f} µs. At a tolerance "
        f"of {best.setting:.0e} CVode takes {best.evaluations} evaluations and "
        f"{best.seconds * 1e3:.1f} ms; its error is {best.speed_error:.0e}.",
        f"Explicit Euler at {document.setting * 1e6:g} µs, the document's scheme, has an error of "
        f"{document.speed_error:.1e} after {document.evaluations} evaluations; half the step "
        f"reduces it by a factor of {2.0**order:.2f}.",
        f"The order of CVode's error in ball velocity in its tolerance is {', '.join(orders)}. The "
        "damper of the power law has an infinite slope at first touch: over all tolerances it "
        f"takes {steep / smooth:.1f} times the evaluations of the linear law 2.",
    )

    @report.figure(
        "model_exchange",
        "Each digit costs a general solver run time. One communication step of the closed form "
        "equals the FMI 2.0 FMU to the last bit: its points are at 0.",
    )
    def error_against_run_time(figures):
        title = "Run time over error: a general solver and the closed form"
        case = "k = 1 MN/m, b = 9 N·s/m (power law: ball roh-lee), 35 m/s"
        figure, axes = figures.new(title, (7.2, 5.2), case)
        curves = {f"{law}, CVode": (law, solved) for law, solved in cvode.items()}
        curves["law 1, explicit Euler"] = "explicit Euler, Python", euler
        for label, (style, methods) in curves.items():
            errors, micro = zip(*((m.speed_error, m.seconds * 1e6) for m in methods))
            axes.plot(errors, micro, **figures.STYLES[style].points, ms=5, lw=1.4, label=label)
        for law, method in stepped.items():
            colour, _, marker = figures.STYLES[law]
            point = {"color": colour, "ms": 10, "mec": figures.BLACK, "clip_on": False}
            label = f"{law}, co-simulation in one step"
            axes.plot(method.speed_error, method.seconds * 1e6, marker, **point, label=label)
        figures.set_run_time_axes(axes, "relative error of ball velocity against the FMI 2.0 FMU")
        figures.add_legend_below(figure, axes, columns=2)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
