"""FMI 3.0: what a host's own solver pays in Model Exchange for what the exact phases give.

The same sources as ClubBallImpact.fmi3.fmu. fmpy integrates it with SUNDIALS' CVode (variable-order
BDF) at several tolerances and with explicit Euler, beside its co-simulation.
"""

import math
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import NamedTuple

import fmpy
import numpy as np

# Before an FMU brings its own copy, which has no binaries to build another FMU with.
import pythonfmu3.builder  # noqa: F401
from fmpy.fmi3 import FMU3Model, FMU3Slave

from golf_scenarios.facts.balls import ball
from golf_scenarios.fmu.file import current_fmu
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.outcome import Outcome, Table

TITLE = "Model Exchange: what a general solver pays"

_LAWS: dict[str, dict[str, float]] = {
    "law 1": {"law": 1},
    "law 2": {"law": 2},
    "power law": dict(ball("roh-lee").values),
}

_TOLERANCES = tuple(10.0**-n for n in range(3, 13))
_SHOWN = _TOLERANCES[::3]
_EULER_STEPS = (4e-6, 2e-6, 1e-6, 0.5e-6)

_STOP = 1e-3
#: So many rounds of all, and at least so long in each, s.
_REPEATS = 4
_LEAST_TIME = 2e-3
_METRICS = ("ball_velocity", "contact_time", "coefficient_of_restitution", "energy_efficiency")

#: For a speed that is compared with others, an error is at least this: a double tells no less.
_LEAST_ERROR = 1e-16

#: How equal FMI 2.0 and 3.0 must be, relative: the same sources do both, by the same operations.
_SAME = 1e-13


#: Runs one impact and gives its metrics.
_Runner = Callable[[], dict[str, float]]


class _Run:
    """One way of running one impact: errors are relative to the FMI 2.0 FMU's results.

    Args:
        setting: tolerance, or step (s).
        run: runs it once and gives the metrics.
        exact: what the FMI 2.0 FMU gives.
        counted: runs it and says how often it asks for derivatives, too; None if it doesn't.
    """

    def __init__(
        self,
        setting: float,
        run: _Runner,
        exact: dict[str, float],
        counted: Callable[[_Runner], tuple[dict[str, float], int]] | None = None,
    ) -> None:
        self.setting = setting
        self._run = run
        self.metrics, self.evaluations = counted(run) if counted is not None else (run(), 0)
        self.seconds = math.inf
        speed, contact = "ball_velocity", "contact_time"
        self.speed_error = abs(self.metrics[speed] - exact[speed]) / abs(exact[speed])
        self.time_error = abs(self.metrics[contact] - exact[contact]) / exact[contact]

    def measure(self) -> None:
        """Run it again; the fastest counts: whatever else the machine does only adds to it."""
        now = time.perf_counter()
        enough = now + _LEAST_TIME
        while now < enough:
            begin = now
            self._run()
            now = time.perf_counter()
            self.seconds = min(self.seconds, now - begin)


class _Found(NamedTuple):
    """All runs: by law where there is one for each."""

    solved: dict[str, list[_Run]]
    stepped: dict[str, _Run]
    euler: list[_Run]
    simulated: _Run

    def all(self) -> list[_Run]:
        """Every run once."""
        solved = [one for runs in self.solved.values() for one in runs]
        return [*solved, *self.stepped.values(), *self.euler, self.simulated]


class _Fmi3:
    """The FMI 3.0 FMU, extracted: one instance of each kind, set back for every run.

    Args:
        folder: where it has been extracted.
    """

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self.description = fmpy.read_model_description(folder)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.model, self.slave = (
            kind(
                guid=self.description.guid,
                unzipDirectory=folder,
                modelIdentifier=self.description.modelName,
                instanceName=kind.__name__,
            )
            for kind in (FMU3Model, FMU3Slave)
        )
        self.model.instantiate()
        self.slave.instantiate(eventModeUsed=True)
        self._fresh = {id(one): one.getFMUState() for one in (self.model, self.slave)}

    def free(self) -> None:
        """Free both instances."""
        for instance in (self.model, self.slave):
            instance.freeFMUState(self._fresh[id(instance)])
            instance.terminate()
            instance.freeInstance()

    def set_back(self, instance: FMU3Model | FMU3Slave) -> None:
        """As it was instantiated."""
        instance.setFMUState(self._fresh[id(instance)])

    def simulate(self, instance: FMU3Model | FMU3Slave, **options) -> dict[str, float]:
        """One impact by fmpy.simulate_fmu; the metrics at its end."""
        self.set_back(instance)
        rows = fmpy.simulate_fmu(
            self.folder,
            model_description=self.description,
            fmu_instance=instance,
            stop_time=_STOP,
            output=_METRICS,
            record_events=False,
            **options,
        )
        return {name: float(rows[name][-1]) for name in _METRICS}

    def step(self, values: dict[str, float]) -> dict[str, float]:
        """One impact in one communication step, as a scene that drives the instance itself."""
        slave = self.slave
        self.set_back(slave)
        self.begin(values)
        slave.doStep(0.0, _STOP)
        return self.read(_METRICS)

    def begin(self, values: dict[str, float]) -> None:
        """Initialize the co-simulation with these inputs and parameters."""
        slave = self.slave
        slave.enterInitializationMode(startTime=0.0)
        for name, value in values.items():
            if name == "law":
                slave.setInt64([self.references[name]], [int(value)])
            else:
                slave.setFloat64([self.references[name]], [value])
        slave.exitInitializationMode()

    def read(self, names: tuple[str, ...]) -> dict[str, float]:
        """Outputs of the co-simulation."""
        values = self.slave.getFloat64([self.references[name] for name in names])
        return dict(zip(names, values, strict=True))

    def solve(self, values: dict[str, float], **options) -> dict[str, float]:
        """One impact in Model Exchange."""
        return self.simulate(self.model, start_values=values, **options)

    def counted(self, run: _Runner) -> tuple[dict[str, float], int]:
        """A run's metrics, and how often it asks the model for its derivatives."""
        asked = self.model.getContinuousStateDerivatives
        count = 0

        def counting(*arguments):
            nonlocal count
            count += 1
            return asked(*arguments)

        self.model.getContinuousStateDerivatives = counting
        try:
            return run(), count
        finally:
            del self.model.getContinuousStateDerivatives


@contextmanager
def _extracted() -> Iterator[_Fmi3]:
    path, _ = current_fmu(fmi=3)
    folder = tempfile.mkdtemp(prefix="golf-impact-")
    try:
        fmpy.extract(str(path), folder)
        fmi3 = _Fmi3(folder)
        try:
            yield fmi3
        finally:
            fmi3.free()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _slope(runs: list[_Run]) -> float:
    """The power of its setting with which the ball's error in speed falls: a fit over all runs."""
    settings = [math.log(run.setting) for run in runs]
    errors = [math.log(max(run.speed_error, _LEAST_ERROR)) for run in runs]
    return float(np.polyfit(settings, errors, 1)[0])


def run(fmu: ImpactFmu) -> Outcome:
    """Every law by CVode, by Euler and stepped; then the events of the co-simulation."""
    outcome = Outcome(TITLE)
    exact = {name: fmu.impact(_METRICS, **values) for name, values in _LAWS.items()}
    with _extracted() as fmi3:
        found = _found(fmi3, exact)
        # In turns, so that a busy moment of the machine doesn't hit one of them alone.
        for _ in range(_REPEATS):
            for one in found.all():
                one.measure()
        _event_mode(outcome, fmu, fmi3)
    for name, runs in found.solved.items():
        for one in runs:
            outcome.cases[f"{name}, CVode {one.setting:.0e}"] = _numbers(one)
        outcome.cases[f"{name}, co-simulation"] = _numbers(found.stepped[name])
    outcome.cases |= {f"law 1, Euler {one.setting:.1e}": _numbers(one) for one in found.euler}
    outcome.tables.append(_table(found))
    _check(outcome, found)
    _conclude(outcome, found)
    outcome.figures["model_exchange"] = lambda: _figure(found)
    return outcome


def _found(fmi3: _Fmi3, exact: dict[str, dict[str, float]]) -> _Found:
    def cvode(name: str, tolerance: float) -> _Run:
        options = {"relative_tolerance": tolerance, "output_interval": _STOP / 10}
        run = partial(fmi3.solve, _LAWS[name], **options)
        return _Run(tolerance, run, exact[name], fmi3.counted)

    def euler(h: float) -> _Run:
        run = partial(fmi3.solve, {}, solver="Euler", step_size=h, output_interval=h)
        return _Run(h, run, exact["law 1"], fmi3.counted)

    simulate = partial(fmi3.simulate, fmi3.slave, output_interval=_STOP)
    return _Found(
        {name: [cvode(name, tolerance) for tolerance in _TOLERANCES] for name in _LAWS},
        {
            name: _Run(_STOP, partial(fmi3.step, values), exact[name])
            for name, values in _LAWS.items()
        },
        [euler(h) for h in _EULER_STEPS],
        _Run(_STOP, simulate, exact["law 1"]),
    )


def _numbers(one: _Run) -> dict[str, float]:
    return {
        **one.metrics,
        "run_time": one.seconds,
        "derivative_evaluations": float(one.evaluations),
        "ball_velocity_error": one.speed_error,
        "contact_time_error": one.time_error,
    }


def _table(found: _Found) -> Table:
    def row(name: str, one: _Run) -> list[str]:
        return [
            name,
            str(one.evaluations or "–"),
            f"{one.seconds * 1e3:.3g}",
            f"{one.speed_error:.1e}",
            f"{one.time_error:.1e}",
        ]

    rows = []
    for name, runs in found.solved.items():
        for one in runs:
            if one.setting in _SHOWN:
                rows.append(row(f"{name}: CVode {one.setting:.0e}", one))
        if name == "law 1":
            rows += [row(f"{name}: Euler {one.setting * 1e6:g} µs", one) for one in found.euler]
            rows.append(row(f"{name}: simulate_fmu", found.simulated))
        rows.append(row(f"{name}: one step", found.stepped[name]))
    columns = ["", "derivatives", "ms", "error of v_B", "of contact time"]
    return Table(TITLE, columns, rows)


def _check(outcome: Outcome, found: _Found) -> None:
    for name, one in found.stepped.items():
        worst = max(one.speed_error, one.time_error)
        outcome.check(
            f"{name}: co-simulation gives what the FMI 2.0 FMU gives",
            worst <= _SAME,
            f"off by {worst:.1e}, allowed {_SAME:.0e}",
        )
    for name, runs in found.solved.items():
        slope, last = _slope(runs), runs[-1]
        # BDF keeps the error of a step below the tolerance; over the contact it adds up.
        outcome.check(
            f"{name}: CVode's error falls with its tolerance",
            0.6 < slope < 1.2,
            f"with its power {slope:.2f}",
        )
        outcome.check(
            f"{name}: at a tolerance of {last.setting:.0e} Model Exchange gives the same impact",
            max(last.speed_error, last.time_error) < 1e-8,
            f"ball velocity off by {last.speed_error:.1e}, contact time by {last.time_error:.1e}",
        )
    order = _slope(found.euler)
    outcome.check("explicit Euler is of first order", 0.9 < order < 1.1, f"{order:.3f} measured")


def _event_mode(outcome: Outcome, fmu: ImpactFmu, fmi3: _Fmi3) -> None:
    """Step to every event that fmi3UpdateDiscreteStates announces."""
    gap = 0.001
    found = fmu.impact(("touch_time", "contact_time"), gap=gap)
    expected = [found["touch_time"], found["touch_time"] + found["contact_time"]]
    slave = fmi3.slave
    fmi3.set_back(slave)
    fmi3.begin({"gap": gap})
    # The first step tells the instance the host's time.
    slave.enterStepMode()
    now = 1e-9
    slave.doStep(0.0, now)
    events = []
    while True:
        slave.enterEventMode()
        *_, announced, when = slave.updateDiscreteStates()
        slave.enterStepMode()
        if not announced:
            break
        slave.doStep(now, when - now)
        now = when
        events.append(now)
    flags = slave.getBoolean([fmi3.references[n] for n in ("touched", "in_contact", "separated")])
    outcome.check(
        "event mode announces touch and separation, and nothing else",
        len(events) == 2 and flags == [True, False, True],
        f"{len(events)} events",
    )
    if len(events) == 2:
        off = max(abs(event - right) for event, right in zip(events, expected, strict=True))
        outcome.check(
            "both at the exact time", off <= 1e-13 * found["contact_time"], f"off by {off:.1e} s"
        )


def _conclude(outcome: Outcome, found: _Found) -> None:
    law_1 = found.solved["law 1"]
    good = min((one for one in law_1 if one.speed_error < 1e-6), key=lambda one: one.seconds)
    best = law_1[-1]
    exact = found.stepped["law 1"]
    document = found.euler[-1]
    outcome.words += [
        f"Law 1 to six digits costs CVode {good.evaluations} evaluations of the derivatives and "
        f"{good.seconds * 1e3:.1f} ms, {good.seconds / exact.seconds:.0f} times the "
        f"{exact.seconds * 1e6:.0f} µs of one communication step, which is exact. At a tolerance "
        f"of {best.setting:.0e} it is {best.evaluations} evaluations and {best.seconds * 1e3:.1f} "
        f"ms for an error of {best.speed_error:.0e}.",
        f"Explicit Euler at {document.setting * 1e6:g} µs, the document's scheme, errs by "
        f"{document.speed_error:.1e} after {document.evaluations} evaluations; halving the step "
        f"divides that by {2.0 ** _slope(found.euler):.2f}.",
    ]
    smooth, steep = (
        sum(one.evaluations for one in found.solved[name]) for name in ("law 2", "power law")
    )
    outcome.words.append(
        "CVode's error in the ball's velocity falls with the power "
        + ", ".join(f"{_slope(runs):.2f} ({name})" for name, runs in found.solved.items())
        + f" of its tolerance. The power law's damper has an infinite slope at first touch: over "
        f"all tolerances it costs {steep / smooth:.1f} times the evaluations of the linear law 2."
    )


def _figure(found: _Found):
    from golf_scenarios.report import figures

    figure, axes = figures.new("Error against run time: a host's solver, and the exact phases")
    colours = dict(zip(found.solved, (figures.ORANGE, figures.BLUE, figures.GREEN), strict=True))
    for (name, runs), marker in zip(found.solved.items(), "osD", strict=True):
        axes.loglog(
            [one.seconds * 1e3 for one in runs],
            [max(one.speed_error, _LEAST_ERROR) for one in runs],
            marker + "-",
            color=colours[name],
            label=f"{name}, CVode",
            ms=5,
        )
        one = found.stepped[name]
        axes.plot(
            one.seconds * 1e3,
            max(one.speed_error, _LEAST_ERROR),
            marker,
            color=colours[name],
            ms=9,
            mec=figures.BLACK,
        )
    axes.loglog(
        [one.seconds * 1e3 for one in found.euler],
        [one.speed_error for one in found.euler],
        "^--",
        color=figures.VERMILION,
        label="law 1, explicit Euler",
        ms=6,
    )
    left = min(one.seconds for one in found.stepped.values()) * 1e3
    axes.annotate(
        "co-simulation, one step:\nequal to FMI 2.0 to the last digits",
        (left, 2e-16),
        xytext=(0, 22),
        textcoords="offset points",
    )
    axes.set(
        xlabel="run time of one impact (ms)",
        ylabel="relative error of the ball's velocity",
        ylim=(3e-17, 0.3),
    )
    axes.legend(loc="upper left", bbox_to_anchor=(0.02, 0.8))
    return figure


if __name__ == "__main__":
    from golf_scenarios.commands.app import run_alone

    run_alone("model_exchange")
