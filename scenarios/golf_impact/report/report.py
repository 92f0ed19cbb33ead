"""The report of a scenario as it is made: impacts run, held against facts, shown."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

from golf_impact.facts import closed_forms
from golf_impact.facts.document import NUMERICAL_ERROR, Printed
from golf_impact.facts.quantities import label, set_options, shown
from golf_impact.fmu.impact_fmu import METRICS, ImpactFmu
from golf_impact.report.outcome import Outcome, Table

#: What the script computes from the FMU's velocities must agree with the FMU's own outputs to this
#: (relative to order-one numbers; the worst seen is 4e-16).
SELF_CHECK = 1e-12

Metrics = dict[str, float]


def derived(outputs: Metrics, given: Mapping[str, float]) -> Metrics:
    """The outputs of an impact, and what follows from them by the names of results.json (SI units).

    Args:
        outputs: velocities and contact_displacement at least; an FMU's own momentum and
            kinetic_energy, if it has them, are those at the end.
        given: masses, diameter and speeds before.
    """
    m_club, m_ball = given["m_club"], given["m_ball"]
    u_club, u_ball = given["club_speed"], given["ball_speed"]
    v_club, v_ball = outputs["club_velocity"], outputs["ball_velocity"]
    displacement = outputs["contact_displacement"]
    energy_left = 0.5 * (m_club * v_club**2 + m_ball * v_ball**2)
    return outputs | {
        "contact_displacement_over_diameter": displacement / given["ball_diameter"],
        "momentum_gain_ball": m_ball * (v_ball - u_ball),
        "momentum_initial": m_club * u_club + m_ball * u_ball,
        "momentum_final": outputs.get("momentum", m_club * v_club + m_ball * v_ball),
        "kinetic_energy_initial": 0.5 * (m_club * u_club**2 + m_ball * u_ball**2),
        "kinetic_energy_final": outputs.get("kinetic_energy", energy_left),
    }


class Report(Outcome):
    """An outcome in the making, with the FMU in use."""

    def __init__(self, title: str, fmu: ImpactFmu) -> None:
        super().__init__(title)
        self.fmu = fmu

    # Run

    def impact(
        self, name: str, printed: Mapping[str, Printed] | None = None, /, **values: float
    ) -> Metrics:
        """One impact in one communication step, checked and added to the cases.

        Args:
            name: of the case.
            printed: what the document prints for it, to be held against.
            values: inputs and parameters; defaults for the others.

        Returns:
            The FMU's metrics and those derived from them, by the names of results.json (SI units).
        """
        given = {name: self.fmu.default(name) for name in _GIVEN} | values
        metrics = derived(self.fmu.impact(METRICS, **values), given)
        self.cases[name] = metrics
        # Without a value the page would open with its own case.
        self.commands[name] = f"golf-impact explore {set_options(values or {'law': 1})}"

        def hold(metric: str, expected: float, what: str, tolerance: float, why: str = "") -> None:
            claim = f"{name}: {label(metric)} is {what}"
            self.check_close(claim, metrics[metric], expected, tolerance, why)

        if not self.fmu.flag("touched"):
            self.say(f"{name}: the club never touches the ball.")
        elif metrics["kinetic_energy_initial"] == 0.0:
            self.say(f"{name}: the speeds are too small for an energy in doubles.")
        else:
            for metric, expected in _of_velocities(metrics, given).items():
                allowed = SELF_CHECK * max(1.0, abs(expected))
                hold(metric, expected, "what velocities and masses give", allowed)
            if self.fmu.flag("separated"):
                speed = abs(given["club_speed"]) + abs(given["ball_speed"])
                momentum = (given["m_club"] + given["m_ball"]) * speed
                scales = {"ball_velocity": speed, "momentum_final": momentum}
                scales["coefficient_of_restitution"] = 1.0
                for metric, expected in closed_forms.expected(given, metrics).items():
                    allowed = SELF_CHECK * scales.get(metric, abs(expected))
                    hold(metric, expected, "what the closed form gives", allowed)
            else:
                self.say(f"{name}: club and ball never part: they are still in contact.")
        for metric, number in (printed or {}).items():
            what = f"the printed {number.text} within its error"
            allowed = NUMERICAL_ERROR * abs(number.value) + number.half_digit
            hold(metric, number.value, what, allowed, _PRINTED)
        return metrics

    # Claim

    def rises(self, claim: str, values: str | Sequence[float]) -> None:
        """Claim that these values (or a metric over all cases) rise from each to the next."""
        self._claim(claim, values, lambda all_: all(a < b for a, b in pairwise(all_)))

    def falls(self, claim: str, values: str | Sequence[float]) -> None:
        """Claim that these values (or a metric over all cases) fall from each to the next."""
        self._claim(claim, values, lambda all_: all(a > b for a, b in pairwise(all_)))

    def stays(self, claim: str, values: str | Sequence[float], tolerance: float = 1e-12) -> None:
        """Claim that these values are the same, to a relative tolerance."""
        close = partial(math.isclose, rel_tol=tolerance)
        self._claim(claim, values, lambda all_: all(close(all_[0], one) for one in all_))

    def _claim(
        self, claim: str, values: str | Sequence[float], true: Callable[[Sequence[float]], bool]
    ) -> None:
        values = self.each(values) if isinstance(values, str) else values
        self.check(claim, true(values), " → ".join(f"{value:.6g}" for value in values))

    def each(self, metric: str) -> list[float]:
        """A metric of all cases so far, in order."""
        return [metrics[metric] for metrics in self.cases.values()]

    # Show

    def say(self, *words: str) -> None:
        """Conclusions, in sentences."""
        self.words += words

    def table(self, title: str, columns: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
        """A table of text cells; the first column names the row."""
        self.tables.append(Table(title, list(columns), [list(row) for row in rows]))

    def compare(
        self, title: str, printed: Mapping[str, Printed], scheme: Metrics, exact: Metrics
    ) -> None:
        """The table of what the document prints, what its scheme gives unrounded, and the answer.

        The last column is the scheme's error: what is printed differs by its rounding besides.
        """
        rows = [
            [
                *(label(metric), number.text, shown(metric, scheme[metric])),
                *(
                    shown(metric, exact[metric]),
                    f"{(scheme[metric] / exact[metric] - 1) * 100:+.2f}",
                ),
            ]
            for metric, number in printed.items()
        ]
        self.table(title, ["", "printed", "its scheme", "exact", "error (%)"], rows)

    def figure(
        self, name: str, caption: str = ""
    ) -> Callable[[Callable[[Any], Any]], Callable[[Any], Any]]:
        """A figure by its file name without suffix: decorates a function that draws it.

        The function gets the module `golf_impact.report.figures`, when somebody wants to see it.
        The caption says what there is to see, in a sentence.
        """

        def keep(draw: Callable[[Any], Any]) -> Callable[[Any], Any]:
            self.figures[name] = draw
            self.captions[name] = caption
            return draw

        return keep


def _of_velocities(metrics: Metrics, given: Mapping[str, float]) -> Metrics:
    """What the FMU puts out besides, worked out from its velocities."""
    u_club, u_ball = given["club_speed"], given["ball_speed"]
    v_club, v_ball = metrics["club_velocity"], metrics["ball_velocity"]
    left = 0.5 * (given["m_club"] * v_club**2 + given["m_ball"] * v_ball**2)
    return {
        "smash_factor": v_ball / u_club if u_club else 0.0,
        "coefficient_of_restitution": (v_ball - v_club) / (u_club - u_ball),
        "energy_efficiency": left / metrics["kinetic_energy_initial"],
    }


_PRINTED = "0.5 % numerical error of the document and half a printed digit"

_GIVEN = (
    *("m_club", "m_ball", "ball_diameter", "k", "b", "club_speed", "ball_speed", "law"),
    *("exponent", "restitution_at_rest"),
)
