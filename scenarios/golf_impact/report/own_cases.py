"""The user's own cases: the values of `--set`, with each ball of `--ball`."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from golf_impact.facts.balls import Ball
from golf_impact.facts.quantities import QUANTITIES, format_unit, format_with_error
from golf_impact.fmu.impact_fmu import METRICS, ImpactFmu
from golf_impact.fmu.uncertainty import standard_errors
from golf_impact.report.any_law import check_any_law, has_closed_form
from golf_impact.report.report import Report, derive_metrics
from golf_impact.report.styles import STYLES

#: Half the width of a 95 % interval in standard errors.
_COVERAGE = 1.96

#: A file's name may have 255 characters, with what is added to this.
_LONGEST = 100


def own_cases(fmu: ImpactFmu, values: Mapping[str, float], balls: Sequence[Ball]) -> Report:
    """Metrics and force of a case with each ball, or of one, checked like every other one.

    The values (SI units) win over a ball's. They are in the files' names, so that no case
    overwrites another one.

    Raises:
        UserError: the FMU refuses a value.
    """
    cases = {ball.name: {**ball.values, **values} for ball in balls} or {"": dict(values)}
    words = [f"{name} = {value:g}{_unit(fmu, name)}" for name, value in values.items()]
    title = ", ".join([*filter(None, cases), *words])
    report = Report(f"Your case{'s' * (len(cases) > 1)}: {title}", fmu)
    report.prefix = f"{_file(cases, values)}_"
    paths, columns, errors = {}, [], []
    for ball, given in cases.items():
        name = ball if len(cases) > 1 else "custom"
        columns.append(report.impact(name, **given))
        complete = {
            v.name: fmu.default(v.name) for v in fmu.variables.values() if v.causality != "output"
        } | given
        if not has_closed_form(complete):
            check_any_law(report, name, complete, columns[-1])
        path = fmu.trajectory(**given)
        report.trajectories[_file([ball], values)] = path
        errors.append(_errors(fmu, next((b for b in balls if b.name == ball), None), given))
        paths[ball] = (path["time"] - columns[-1]["touch_time"]) * 1e6, path["force"] / 1e3
    rows = [
        [one.label]
        + [
            format_with_error(column[metric] * one.factor, _COVERAGE * error[metric] * one.factor)
            if error.get(metric)
            else one.format_value(column[metric])
            for column, error in zip(columns, errors)
        ]
        for metric, one in QUANTITIES.items()
    ]
    report.table(report.title, ["", *(ball or "this FMU" for ball in cases)], rows)
    if any(errors):
        report.say("Intervals are 95 %, from the covariance in the ball's file.")

    @report.figure(f"{_file(cases, values)}_force")
    def force(figures):
        case = report.describe(**next(iter(cases.values()))) if len(cases) == 1 else ""
        figure, axes = figures.new(f"Contact force: {title}", case=case)
        spare = iter(figures.make_shades(max(2, len(paths))))
        for ball, (micro, kilonewton) in paths.items():
            style = STYLES.get(ball or "ball") or next(spare)
            axes.plot(micro, kilonewton, label=ball, **style.line)
        axes.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, None))
        if len(cases) > 1:
            figures.add_legend_above(axes)
        return figure

    return report


def _errors(fmu: ImpactFmu, ball: Ball | None, given: Mapping[str, float]) -> dict[str, float]:
    """Standard errors of the metrics of a case, by name; none if the ball has no covariance."""
    # What is set besides replaces the ball's own value, and is exact.
    uncertain = ball.uncertain if ball else ()
    at = [n for n, name in enumerate(uncertain) if given[name] == ball.values[name]] if ball else []
    if ball is None or not at:
        return {}
    start = {name: fmu.default(name) for name in ("m_club", "m_ball", "ball_diameter")}
    start |= {name: fmu.default(name) for name in ("club_speed", "ball_speed")}

    def evaluate(values: Mapping[str, float]) -> np.ndarray:
        metrics = derive_metrics(fmu.impact(METRICS, **values), {**start, **values})
        return np.array([metrics[name] for name in QUANTITIES])

    names = [uncertain[n] for n in at]
    covariance = np.array(ball.covariance)[np.ix_(at, at)]
    errors = standard_errors(evaluate, given, names, covariance).tolist()
    # Rounding makes a tiny error of what doesn't depend on the ball.
    return {n: e for n, e in zip(QUANTITIES, errors) if e > 1e-9}


def _unit(fmu: ImpactFmu, name: str) -> str:
    unit = format_unit(fmu.variables[name].unit) if name in fmu.variables else ""
    return f" {unit}" if unit else ""


def _file(balls: Iterable[str], values: Mapping[str, float]) -> str:
    """The beginning of a file's name, another one for other values."""
    parts = [*filter(None, balls), *(f"{name}={value!r}" for name, value in values.items())]
    name = "_".join(("custom", *(re.sub(r"\.0$", "", part) for part in parts)))
    # A ball's file may lie in another folder.
    name = re.sub(r"[^\w.=+-]+", "-", name)
    if len(name) > _LONGEST:
        name = f"{name[:_LONGEST]}_{hashlib.sha256(name.encode()).hexdigest()[:8]}"
    return name
