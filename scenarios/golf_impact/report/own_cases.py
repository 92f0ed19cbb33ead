"""The user's own cases: the values of `--set`, with each ball of `--ball`."""

import hashlib
import itertools
import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from golf_impact import closed_forms
from golf_impact.ball import Ball
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.quantities import QUANTITIES, format_unit
from golf_impact.report.any_law import check_any_law
from golf_impact.report.report import Report, derive_metrics
from golf_impact.report.styles import STYLES
from golf_impact.report.uncertainty import gradient, standard_errors
from golf_impact.runs import METRICS

#: Half the width of a 95 % interval in standard errors.
_COVERAGE = 1.96

#: A file's name may have 255 characters, with what is added to this.
_LONGEST = 100


def own_cases(
    fmu: ImpactFmu, values: Mapping[str, float], balls: Sequence[Ball]
) -> tuple[str, Report]:
    """Metrics and force of a case with each ball, or of one, checked like every other one.

    The values (SI units) win over a ball's. Returns the beginning of its files' names, which has
    balls and values, so that no case overwrites another one; and the report. UserError: a value is
    refused.
    """
    balls = balls or [Ball("", "", {}, "")]
    units = {v.name: format_unit(v.unit) for v in fmu.variables.values()}
    words = [f"{name} = {value:g} {units.get(name, '')}".rstrip() for name, value in values.items()]
    title = ", ".join(filter(None, (*(ball.name for ball in balls), *words)))
    report = Report(f"Your case{'s' * (len(balls) > 1)}: {title}", fmu)
    spare, curves, columns = itertools.cycle(("baseline", "less", "more")), [], []
    for ball in balls:
        name, given = ball.name if len(balls) > 1 else "custom", {**ball.values, **values}
        metrics = report.impact(name, **given)
        complete = report.starts | given
        # Neither a closed form nor, as under law 1, balances with a known drag.
        balances = closed_forms.balances(complete, metrics)
        if not closed_forms.solution(complete) and "impulse" not in balances:
            check_any_law(report, name, complete, metrics)
        path = fmu.trajectory(**given)
        report.trajectories[_stem([ball.name], values)] = path
        style = ball.name or "ball"
        style = style if style in STYLES else next(spare)
        curves.append((style, ball.name or "this FMU", metrics, path))
        error = _errors(report, ball, given)
        cells = ((q, metrics[m], _COVERAGE * error.get(m, 0.0)) for m, q in QUANTITIES.items())
        columns.append([quantity.format_value(*value) for quantity, *value in cells])
    if any("±" in cell for column in columns for cell in column):
        report.say("Intervals are 95 %, from the covariance in the ball's file.")
    labels = [one.label for one in QUANTITIES.values()]
    report.table(report.title, ["", *(label for _, label, *_ in curves)], zip(labels, *columns))
    stem = _stem((ball.name for ball in balls), values)

    @report.figure(f"{stem}_force")
    def force(figures):
        case = "" if len(balls) > 1 else report.describe(**given)
        return figures.plot_forces(f"Contact force: {title}", case, curves)

    return stem, report


def _errors(report: Report, ball: Ball, given: Mapping[str, float]) -> dict[str, float]:
    """Standard errors of the metrics of a case, by name; none if the ball has no covariance."""
    # What is set besides replaces the ball's own value, and is exact.
    names = [name for name in ball.uncertain if given[name] == ball.values[name]]
    if not names:
        return {}

    def evaluate(values: Mapping[str, float]) -> np.ndarray:
        metrics = derive_metrics(report.fmu.impact(METRICS, **values), {**report.starts, **values})
        return np.array([metrics[name] for name in QUANTITIES])

    at = [ball.uncertain.index(name) for name in names]
    covariance = np.array(ball.covariance)[np.ix_(at, at)]
    errors = standard_errors(gradient(evaluate, given, names), covariance).tolist()
    # Rounding makes a tiny error of what doesn't depend on the ball.
    return {name: error for name, error in zip(QUANTITIES, errors) if error > 1e-9}


def _stem(balls: Iterable[str], values: Mapping[str, float]) -> str:
    """The beginning of a file's name, another one for other values."""
    parts = [*filter(None, balls), *(f"{name}={value!r}" for name, value in values.items())]
    name = "_".join(("custom", *(re.sub(r"\.0$", "", part) for part in parts)))
    # A ball's file may lie in another folder.
    name = re.sub(r"[^\w.=+-]+", "-", name)
    if len(name) > _LONGEST:
        name = f"{name[:_LONGEST]}_{hashlib.sha256(name.encode()).hexdigest()[:8]}"
    return name
