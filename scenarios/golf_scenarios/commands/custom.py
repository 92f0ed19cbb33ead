"""The user's own case: `golf-impact run --set NAME=VALUE`."""

from typing import Any

from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.checks import LABELS, run_case, shown
from golf_scenarios.report.outcome import Outcome, Table


def run(fmu: ImpactFmu, values: dict[str, Any]) -> Outcome:
    """Metrics and force of one impact with these values, checked like every other case."""
    title = "Your case: " + ", ".join(f"{name} = {value:g}" for name, value in values.items())
    outcome = Outcome(title)
    metrics = run_case(outcome, fmu, "custom", **values)
    rows = [[label, shown(metric, metrics[metric])] for metric, label in LABELS.items()]
    outcome.tables.append(Table(title, ["", "this FMU"], rows))
    path = fmu.trajectory(**values)
    outcome.trajectories["custom"] = path

    def force():
        from golf_scenarios.report import figures

        figure, axes = figures.new("Contact force: your case")
        axes.plot(path["time"] * 1e6, path["force"], color=figures.BLUE)
        axes.set(xlabel="time (µs)", ylabel="contact force (N)", ylim=(0, None))
        return figure

    outcome.figures["custom_force"] = force
    return outcome
