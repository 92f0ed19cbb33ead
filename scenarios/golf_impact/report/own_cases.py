"""The user's own cases: the values of `--set`, with each ball of `--ball`."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence

from golf_impact.facts.balls import Ball
from golf_impact.facts.quantities import QUANTITIES, format_unit
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.report.any_law import check_any_law, has_closed_form
from golf_impact.report.report import Report

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
    paths, columns = {}, []
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
        paths[ball] = (path["time"] - columns[-1]["touch_time"]) * 1e6, path["force"] / 1e3
    rows = [
        [one.label, *(one.format_value(column[metric]) for column in columns)]
        for metric, one in QUANTITIES.items()
    ]
    report.table(report.title, ["", *(ball or "this FMU" for ball in cases)], rows)

    @report.figure(f"{_file(cases, values)}_force")
    def force(figures):
        case = report.describe(**next(iter(cases.values()))) if len(cases) == 1 else ""
        figure, axes = figures.new(f"Contact force: {title}", case=case)
        for ball, (micro, kilonewton) in paths.items():
            axes.plot(micro, kilonewton, label=ball, **figures.STYLES[ball or "ball"].line)
        axes.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, None))
        if len(cases) > 1:
            figures.add_legend_above(axes)
        return figure

    return report


def _unit(fmu: ImpactFmu, name: str) -> str:
    unit = format_unit(fmu.variables[name].unit) if name in fmu.variables else ""
    return f" {unit}" if unit else ""


def _file(balls: Iterable[str], values: Mapping[str, float]) -> str:
    """The beginning of a file's name, another one for other values."""
    parts = [*filter(None, balls), *(f"{name}={value!r}" for name, value in values.items())]
    name = "_".join(("custom", *(re.sub(r"\.0$", "", part) for part in parts)))
    if len(name) > _LONGEST:
        name = f"{name[:_LONGEST]}_{hashlib.sha256(name.encode()).hexdigest()[:8]}"
    return name
