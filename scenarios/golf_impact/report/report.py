"""The report of a scenario: impacts, checks, tables and figures."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING, Any

from golf_impact import closed_forms
from golf_impact.document import NUMERICAL_ERROR, Printed
from golf_impact.quantities import choose_prefix, format_options, format_value, label
from golf_impact.report.outcome import Check, Kind, Table
from golf_impact.runs import METRICS, Named

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from golf_impact.fmu.impact_fmu import ImpactFmu

    #: Plots a figure, given the module `golf_impact.report.figures`.
    Plot = Callable[[Any], Figure]

#: Tolerance of the FMU's outputs against closed forms, balances and its own velocities (relative
#: to numbers of order one; the largest error seen is 4e-16).
SELF_CHECK = 1e-12

Metrics = Named[float]

#: Numbers, or the name of a metric: its values in all cases so far, in order.
Values = str | Sequence[float]


def derive_metrics(outputs: Mapping[str, float], values: Mapping[str, float]) -> Metrics:
    """The metrics of an impact by the names of results.json (SI units).

    Of the outputs, velocities and contact_displacement are needed; momentum and kinetic_energy are
    used if they are there. `values` has masses, diameter and initial speeds.
    """
    m_club, m_ball = values["m_club"], values["m_ball"]
    u_club, u_ball = values["club_speed"], values["ball_speed"]
    v_club, v_ball = outputs["club_velocity"], outputs["ball_velocity"]
    displacement = outputs["contact_displacement"]
    # NaN stays the same object: it has its reason.
    diameters = displacement if math.isnan(displacement) else displacement / values["ball_diameter"]
    energy = 0.5 * (m_club * v_club**2 + m_ball * v_ball**2)
    return Metrics(
        {
            **outputs,
            "contact_displacement_over_diameter": diameters,
            "momentum_gain_ball": m_ball * (v_ball - u_ball),
            "momentum_initial": m_club * u_club + m_ball * u_ball,
            "momentum_final": outputs.get("momentum", m_club * v_club + m_ball * v_ball),
            "kinetic_energy_initial": 0.5 * (m_club * u_club**2 + m_ball * u_ball**2),
            "kinetic_energy_final": outputs.get("kinetic_energy", energy),
        }
    )


class Report:
    """The results of a scenario; `fmu` runs its impacts, if it has some. Units are SI."""

    fmu: ImpactFmu

    def __init__(self, title: str, fmu: ImpactFmu | None = None) -> None:
        self.title = title
        #: Start values of inputs and parameters.
        self.starts: dict[str, float] = {}
        if fmu is not None:
            self.fmu, variables = fmu, fmu.variables.values()
            inputs = [v.name for v in variables if v.causality in ("input", "parameter")]
            self.starts = {name: fmu.default(name) for name in inputs}
        #: Metrics by case, as in results.json.
        self.cases: dict[str, Mapping[str, float]] = {}
        #: By case, the command that opens it in `golf-impact explore`.
        self.commands: dict[str, str] = {}
        self.tables: list[Table] = []
        self.checks: list[Check] = []
        #: Printed numbers that are known not to be reproduced, each in a sentence.
        self.deviations: list[str] = []
        #: By file name without suffix: columns by name, arrays of one shape (n,).
        self.trajectories: dict[str, dict[str, np.ndarray]] = {}
        #: By file name without suffix: functions that plot, and their captions.
        self.figures: dict[str, Plot] = {}
        self.captions: dict[str, str] = {}
        #: The conclusion in a sentence, for the summary of all scenarios; empty if there is none.
        self.verdict = ""
        self.words: list[str] = []

    # Run

    def impact(
        self, name: str, printed: Mapping[str, Printed] | None = None, /, **values: float
    ) -> Metrics:
        """Run an impact in one communication step, check it and add it to the cases.

        Args:
            name: of the case.
            printed: numbers that the document prints for it, by metric.
            values: inputs and parameters (SI units); defaults for the others.

        Returns:
            The metrics by the names of results.json (SI units). Results that need a contact or a
            separation are NaN if there is none, see `ImpactFmu.impact`.
        """
        complete = self.starts | values
        metrics = derive_metrics(self.fmu.impact(METRICS, **values), complete)
        self.cases[name] = metrics
        # Without a value the page opens with a case of its own.
        self.commands[name] = f"golf-impact explore {format_options(values or {'law': 1})}"

        if not self.fmu.read_flag("touched"):
            self.say(f"{name}: no contact. The club never touches the ball.")
        elif not self.fmu.read_flag("separated"):
            after = self.fmu.horizon(values).item()
            self.say(
                f"{name}: no separation. Club and ball stay in contact; velocities, momentum, "
                f"kinetic energy and impulse are those after {after:g} s."
            )
        elif metrics["kinetic_energy_initial"]:
            self._check_impact(name, complete, metrics)
        for metric, number in (printed or {}).items():
            claim = (
                f"{name}: {label(metric)} agrees with the printed {number.text} within its error"
            )
            allowed = NUMERICAL_ERROR * abs(number.value) + number.half_digit
            why = "0.5 % numerical error of the document and half a printed digit"
            self.check_close(claim, metrics[metric], number.value, allowed, why, "documents")
        return metrics

    def _check_impact(self, name: str, given: Mapping[str, float], metrics: Metrics) -> None:
        speed = abs(given["club_speed"]) + abs(given["ball_speed"])
        scales = {
            "ball_velocity": speed,
            "momentum_final": (given["m_club"] + given["m_ball"]) * speed,
            "smash_factor": max(1.0, abs(metrics["smash_factor"])),
            "coefficient_of_restitution": 1.0,
            "energy_efficiency": 1.0,
        }
        definition = "its definition, applied to the FMU's own velocities"
        claims: tuple[tuple[Kind, str, Mapping[str, float]], ...] = (
            ("consistency", definition, closed_forms.definitions(given, metrics)),
            ("closed forms", "the closed form", closed_forms.solution(given)),
            ("invariants", "the balance of momentum", closed_forms.balances(given, metrics)),
        )
        for kind, what, solution in claims:
            for metric, expected in solution.items():
                claim = f"{name}: {label(metric)} agrees with {what}"
                allowed = SELF_CHECK * scales.get(metric, abs(expected))
                self.check_close(claim, metrics[metric], expected, allowed, kind=kind)

    def describe(self, **values: float) -> str:
        """Contact law, stiffness and damping of a case in words, for the title of its figure."""
        given = self.starts | values
        factor, unit = choose_prefix("N/m", given["k"])
        words = [f"law {given['law']:g}", f"k = {given['k'] * factor:.4g} {unit}"]
        if given["exponent"] != 1.0:
            words.append(f"n = {given['exponent']:.3g}")
        if given["restitution_at_rest"]:
            line = f"{given['restitution_at_rest']:g} − {given['restitution_slope']:g} s/m · v"
            words.append(f"COR = {line}")
        else:
            words.append(f"b = {given['b']:.4g} N·s/m")
        return ", ".join(words)

    # Check

    def check(self, claim: str, passed: bool, detail: str = "", kind: Kind = "statements") -> None:
        """Record a claim, a sentence on what is compared; `detail` has the numbers."""
        self.checks.append(Check(claim, bool(passed), detail, kind))

    def check_close(
        self,
        claim: str,
        value: float,
        expected: float,
        tolerance: float,
        why: str = "",
        kind: Kind = "closed forms",
    ) -> None:
        """Record whether a value is within an absolute tolerance of the expected one.

        `claim` states what is compared, `why` is the reason for the tolerance.
        """
        error = abs(value - expected)
        detail = f"{value:.10g} against {expected:.10g}: error {error:.2g}, allowed {tolerance:.2g}"
        self.check(claim, error <= tolerance, f"{detail} ({why})" if why else detail, kind)

    def rises(self, claim: str, values: Values, kind: Kind = "statements") -> None:
        """Check that these values (or a metric of all cases, in order) increase strictly."""
        self._trend(claim, values, operator.lt, kind)

    def falls(self, claim: str, values: Values, kind: Kind = "statements") -> None:
        """Check that these values (or a metric of all cases, in order) decrease strictly."""
        self._trend(claim, values, operator.gt, kind)

    def stays(self, claim: str, values: Values, kind: Kind = "statements") -> None:
        """Check that these values (or a metric of all cases) are equal, to 1e-12 relative."""
        self._trend(claim, values, partial(math.isclose, rel_tol=SELF_CHECK), kind)

    def _trend(self, claim: str, values: Values, holds: Callable[..., bool], kind: Kind) -> None:
        """Check that this holds between each value and all later ones."""
        values = self.each(values) if isinstance(values, str) else values
        passed = all(holds(*pair) for pair in combinations(values, 2))
        self.check(claim, passed, " → ".join(f"{value:.6g}" for value in values), kind)

    def each(self, metric: str) -> list[float]:
        """A metric of all cases so far, in order (SI units); UserError if there is none."""
        return [metrics[metric] for metrics in self.cases.values()]

    # Present

    def say(self, *sentences: str) -> None:
        """Add conclusions, a paragraph each."""
        self.words += sentences

    def conclude(self, verdict: str) -> None:
        """Add the conclusion that also stands in the summary of all scenarios; one sentence."""
        self.verdict = verdict
        self.say(verdict)

    def table(self, title: str, columns: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
        """Add a table of text cells; the first column names the row."""
        self.tables.append(Table(title, list(columns), [list(row) for row in rows]))

    def compare(
        self, title: str, printed: Mapping[str, Printed], scheme: Metrics, exact: Metrics
    ) -> None:
        """Add a table of printed numbers, the unrounded ones of the document's scheme, and ours.

        The last column is the error of the scheme; the printed numbers are also rounded.
        """
        rows = (
            [
                label(one),
                number.text,
                format_value(one, scheme[one]),
                format_value(one, exact[one]),
                f"{(scheme[one] / exact[one] - 1) * 100:+.2f}",
            ]
            for one, number in printed.items()
        )
        self.table(title, ["", "printed", "its scheme", "exact", "error (%)"], rows)

    def figure(self, name: str, caption: str = "") -> Callable[[Plot], Plot]:
        """Decorate a function that plots a figure; its name is that of the file, without suffix.

        The function is called with the module `golf_impact.report.figures` when figures are
        written, and returns a matplotlib figure. The caption is a sentence.
        """

        def keep(draw: Plot) -> Plot:
            self.figures[name], self.captions[name] = draw, caption
            return draw

        return keep
