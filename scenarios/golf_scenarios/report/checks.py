"""Running a case and holding it against the document, closed forms and itself."""

import math
from collections.abc import Mapping
from itertools import pairwise

from golf_scenarios.facts import closed_forms
from golf_scenarios.facts.document import NUMERICAL_ERROR, USED, Printed
from golf_scenarios.fmu.impact_fmu import METRICS, ImpactFmu
from golf_scenarios.report.outcome import Outcome, Table

#: What the script computes from the FMU's velocities must agree with the FMU's own outputs to this
#: (relative to order-one numbers; the worst seen is 4e-16).
SELF_CHECK = 1e-12

LABELS = {
    "club_velocity": "club velocity v_C (m/s)",
    "ball_velocity": "ball velocity v_B (m/s)",
    "momentum_initial": "initial momentum (N.s)",
    "momentum_final": "final momentum (N.s)",
    "kinetic_energy_initial": "initial kinetic energy (J)",
    "kinetic_energy_final": "final kinetic energy (J)",
    "smash_factor": "smash factor S",
    "coefficient_of_restitution": "COR",
    "contact_time": "contact time (µs)",
    "contact_displacement_over_diameter": "contact displacement / D",
    "max_force": "max force (N)",
    "time_of_max_force": "time of max force (µs)",
    "impulse": "impulse J (N.s)",
    "momentum_gain_ball": "momentum gained by ball P_B (N.s)",
    "energy_efficiency": "energy efficiency E (%)",
}

#: Units in which a metric is shown, where not SI: factor and decimals.
_SHOWN = {
    "contact_time": (1e6, 2),
    "time_of_max_force": (1e6, 2),
    "energy_efficiency": (100.0, 2),
    "max_force": (1.0, 1),
    "kinetic_energy_initial": (1.0, 3),
    "kinetic_energy_final": (1.0, 3),
    "club_velocity": (1.0, 3),
    "ball_velocity": (1.0, 3),
}

DEFAULTS = {**USED, "k": 1e6, "b": 9.0, "club_speed": 35.0, "ball_speed": 0.0, "law": 1}


def shown(metric: str, value: float) -> str:
    """A metric in the unit of its label, with digits enough to see a difference."""
    factor, decimals = _SHOWN.get(metric, (1.0, 4))
    return f"{value * factor:.{decimals}f}"


def run_case(outcome: Outcome, fmu: ImpactFmu, name: str, **values: float) -> dict[str, float]:
    """One impact in one communication step, checked and added to the outcome's cases.

    Args:
        outcome: where the case and its checks go.
        fmu: the FMU in use.
        name: of the case.
        values: inputs and parameters; defaults for the others.

    Returns:
        The FMU's metrics and those derived from them, by the names of results.json (SI units).
    """
    metrics = fmu.impact(METRICS, **values)
    given = {**DEFAULTS, **values}
    m_club, m_ball = given["m_club"], given["m_ball"]
    u_club, u_ball = given["club_speed"], given["ball_speed"]
    v_club, v_ball = metrics["club_velocity"], metrics["ball_velocity"]
    energy = 0.5 * (m_club * u_club**2 + m_ball * u_ball**2)
    metrics |= {
        "contact_displacement_over_diameter": metrics["contact_displacement"]
        / given["ball_diameter"],
        "momentum_gain_ball": m_ball * (v_ball - u_ball),
        "momentum_initial": m_club * u_club + m_ball * u_ball,
        "momentum_final": metrics["momentum"],
        "kinetic_energy_initial": energy,
        "kinetic_energy_final": metrics["kinetic_energy"],
    }
    outcome.cases[name] = metrics
    if not fmu.flag("touched") or energy == 0.0:
        outcome.words.append(
            f"{name}: the speeds are too small for an energy in doubles."
            if fmu.flag("touched")
            else f"{name}: the club never touches the ball."
        )
        return metrics
    checks = {
        "smash_factor": v_ball / u_club if u_club else 0.0,
        "coefficient_of_restitution": (v_ball - v_club) / (u_club - u_ball),
        "energy_efficiency": 0.5 * (m_club * v_club**2 + m_ball * v_ball**2) / energy,
    }
    for metric, expected in checks.items():
        outcome.check_close(
            f"{name}: {LABELS[metric]} is what velocities and masses give",
            metrics[metric],
            expected,
            SELF_CHECK * max(1.0, abs(expected)),
        )
    if fmu.flag("separated"):
        _check_closed_forms(outcome, name, metrics, given)
    else:
        outcome.words.append(f"{name}: club and ball never part: they are still in contact.")
    return metrics


def _check_closed_forms(
    outcome: Outcome, name: str, metrics: Mapping[str, float], given: Mapping[str, float]
) -> None:
    expected = closed_forms.expected(given, metrics)
    speed = abs(given["club_speed"]) + abs(given["ball_speed"])
    scales = {
        "coefficient_of_restitution": 1.0,
        "ball_velocity": speed,
        "momentum_final": (given["m_club"] + given["m_ball"]) * speed,
    }
    for metric, value in expected.items():
        scale = scales.get(metric, abs(value))
        outcome.check_close(
            f"{name}: {LABELS.get(metric, metric)} is what the closed form gives",
            metrics[metric],
            value,
            SELF_CHECK * scale,
        )


def check_printed(
    outcome: Outcome,
    name: str,
    metrics: Mapping[str, float],
    printed: Mapping[str, Printed],
) -> None:
    """Hold a case against the numbers that the document prints for it.

    They may differ by the document's numerical error and by half a unit of the last digit.
    """
    for metric, number in printed.items():
        outcome.check_close(
            f"{name}: {LABELS[metric]} is the printed {number.text} within its error",
            metrics[metric],
            number.value,
            NUMERICAL_ERROR * abs(number.value) + number.half_digit,
            "0.5 % numerical error of the document and half a printed digit",
        )


def comparison(
    title: str,
    cases: Mapping[str, tuple[Mapping[str, float], Mapping[str, Printed]]],
) -> Table:
    """Document | this FMU | difference, for each case: metrics and printed numbers."""
    several = len(cases) > 1
    rows = []
    for name, (metrics, printed) in cases.items():
        for metric, number in printed.items():
            value = metrics[metric]
            off = (value - number.value) / number.value
            label = LABELS[metric]
            rows.append(
                [
                    f"{name}: {label}" if several else label,
                    number.text,
                    shown(metric, value),
                    f"{off * 100:+.2f} %",
                ]
            )
    return Table(title, ["", "document", "this FMU (exact)", "difference"], rows)


def rises(outcome: Outcome, claim: str, values: list[float]) -> None:
    """Claim that these values rise from each to the next."""
    outcome.check(claim, all(a < b for a, b in pairwise(values)), _in_order(values))


def falls(outcome: Outcome, claim: str, values: list[float]) -> None:
    """Claim that these values fall from each to the next."""
    outcome.check(claim, all(a > b for a, b in pairwise(values)), _in_order(values))


def stays(outcome: Outcome, claim: str, values: list[float], tolerance: float = 1e-12) -> None:
    """Claim that these values are the same, to a relative tolerance."""
    same = all(math.isclose(values[0], value, rel_tol=tolerance) for value in values)
    outcome.check(claim, same, _in_order(values))


def _in_order(values: list[float]) -> str:
    return " → ".join(f"{value:.6g}" for value in values)
