"""The report of a scenario as it is made: impacts run, held against facts, shown."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

from golf_scenarios.facts import closed_forms
from golf_scenarios.facts.document import NUMERICAL_ERROR, Printed
from golf_scenarios.facts.quantities import label, set_options, shown
from golf_scenarios.fmu.impact_fmu import METRICS, ImpactFmu
from golf_scenarios.report.outcome import Outcome, Table

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
    """An outcome in the making.

    Args:
        title: one line.
        fmu: the FMU in use.
    """

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
        metrics = self.fmu.impact(METRICS, **values)
        given = {name: self.fmu.default(name) for name in _GIVEN} | values
        v_club, v_ball = metrics["club_velocity"], metrics["ball_velocity"]
        m_club, m_ball = given["m_club"], given["m_ball"]
        u_club, u_ball = given["club_speed"], given["ball_speed"]
        momentum, energy_left = metrics["momentum"], metrics["kinetic_energy"]
        metrics = derived(metrics, given)
        metrics |= {"momentum_final": momentum, "kinetic_energy_final": energy_left}
        energy = metrics["kinetic_energy_initial"]
        self.cases[name] = metrics
        self.commands[name] = f"golf-impact explore {set_options(values)}".rstrip()
        if not self.fmu.flag("touched"):
            self.say(f"{name}: the club never touches the ball.")
        elif energy == 0.0:
            self.say(f"{name}: the speeds are too small for an energy in doubles.")
        else:
            after = 0.5 * (m_club * v_club**2 + m_ball * v_ball**2)
            own = {
                "smash_factor": v_ball / u_club if u_club else 0.0,
                "coefficient_of_restitution": (v_ball - v_club) / (u_club - u_ball),
                "energy_efficiency": after / energy,
            }
            for metric, expected in own.items():
                self.check_close(
                    f"{name}: {label(metric)} is what velocities and masses give",
                    metrics[metric],
                    expected,
                    SELF_CHECK * max(1.0, abs(expected)),
                )
            if self.fmu.flag("separated"):
                self._check_closed_forms(name, metrics, given)
            else:
                self.say(f"{name}: club and ball never part: they are still in contact.")
        self._check_printed(name, metrics, printed or {})
        return metrics

    def _check_closed_forms(self, name: str, metrics: Metrics, given: Mapping[str, float]) -> None:
        speed = abs(given["club_speed"]) + abs(given["ball_speed"])
        scales = {
            "coefficient_of_restitution": 1.0,
            "ball_velocity": speed,
            "momentum_final": (given["m_club"] + given["m_ball"]) * speed,
        }
        for metric, value in closed_forms.expected(given, metrics).items():
            self.check_close(
                f"{name}: {label(metric)} is what the closed form gives",
                metrics[metric],
                value,
                SELF_CHECK * scales.get(metric, abs(value)),
            )

    def _check_printed(self, name: str, metrics: Metrics, printed: Mapping[str, Printed]) -> None:
        """They may differ by the document's numerical error and half a unit of the last digit."""
        for metric, number in printed.items():
            self.check_close(
                f"{name}: {label(metric)} is the printed {number.text} within its error",
                metrics[metric],
                number.value,
                NUMERICAL_ERROR * abs(number.value) + number.half_digit,
                "0.5 % numerical error of the document and half a printed digit",
            )

    # Claim

    def rises(self, claim: str, values: str | Sequence[float]) -> None:
        """Claim that these values (or a metric over all cases) rise from each to the next."""
        values = self._values(values)
        self.check(claim, all(a < b for a, b in pairwise(values)), _in_order(values))

    def falls(self, claim: str, values: str | Sequence[float]) -> None:
        """Claim that these values (or a metric over all cases) fall from each to the next."""
        values = self._values(values)
        self.check(claim, all(a > b for a, b in pairwise(values)), _in_order(values))

    def stays(self, claim: str, values: str | Sequence[float], tolerance: float = 1e-12) -> None:
        """Claim that these values are the same, to a relative tolerance."""
        values = self._values(values)
        same = all(math.isclose(values[0], value, rel_tol=tolerance) for value in values)
        self.check(claim, same, _in_order(values))

    def _values(self, values: str | Sequence[float]) -> Sequence[float]:
        return self.each(values) if isinstance(values, str) else values

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
        rows = []
        for metric, number in printed.items():
            values = (shown(metric, metrics[metric]) for metrics in (scheme, exact))
            error = scheme[metric] / exact[metric] - 1.0
            rows.append([label(metric), number.text, *values, f"{error * 100:+.2f}"])
        columns = ["", "printed", "its scheme", "exact", "error (%)"]
        self.table(title, columns, rows)

    def figure(
        self, name: str, caption: str = ""
    ) -> Callable[[Callable[[Any], Any]], Callable[[Any], Any]]:
        """A figure by its file name: decorates a function that draws it.

        The function gets the module `golf_scenarios.report.figures`, when somebody wants to see it.

        Args:
            name: of the file, without suffix.
            caption: what there is to see, in a sentence.
        """

        def keep(draw: Callable[[Any], Any]) -> Callable[[Any], Any]:
            self.figures[name] = draw
            self.captions[name] = caption
            return draw

        return keep


def _in_order(values: Sequence[float]) -> str:
    return " → ".join(f"{value:.6g}" for value in values)


_GIVEN = (
    *("m_club", "m_ball", "ball_diameter", "k", "b", "club_speed", "ball_speed", "law"),
    *("exponent", "restitution_at_rest"),
)
