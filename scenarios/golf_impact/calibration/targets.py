"""Measured targets and the impact they were measured in: read, and refused if impossible."""

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from golf_impact.errors import UserError
from golf_impact.facts import closed_forms
from golf_impact.facts.quantities import check_masses
from golf_impact.files import read_text

#: Targets by name: the FMU's output, how it is called, and its unit in options and files.
TARGETS = {
    "ball_speed": ("ball_velocity", "ball speed after", "m/s"),
    "club_speed_after": ("club_velocity", "club speed after", "m/s"),
    "cor": ("coefficient_of_restitution", "COR", ""),
    "contact_time": ("contact_time", "contact time", "s"),
    "max_force": ("max_force", "max force", "N"),
    "time_of_max_force": ("time_of_max_force", "time of max force", "s"),
}

#: Targets that tell how much is given back. A law of two bodies has one number for it, so that all
#: of them together count as one.
RESTITUTION = ("ball_speed", "club_speed_after", "cor")

#: The σ of a target without one, as a fraction of its value.
DEFAULT_SIGMA = 0.01

#: No impact with a ball is so long (s) or so soft (N): another unit was meant.
_LONG, _SOFT = 0.1, 20.0

#: Measurements that contradict a conservation law by more than so many σ are refused.
_CONTRADICTION = 3.0


@dataclass(frozen=True)
class Conditions:
    """The impact in which the targets were measured: speed (m/s) and masses (kg), ball at rest."""

    club_speed: float = 35.0
    m_club: float = 0.210
    m_ball: float = 0.04593

    @property
    def reduced_mass(self) -> float:
        """μ = m_C m_B / (m_C + m_B), kg."""
        return closed_forms.reduced_mass(self.m_club, self.m_ball)


@dataclass(frozen=True)
class Target:
    """A measured value with its standard deviation, SI units."""

    name: str  #: a key of TARGETS
    value: float
    sigma: float
    stated: bool = True  #: whether somebody said what σ is, or it is the default


def option(name: str) -> str:
    return "--" + name.replace("_", "-")


def target(name: str, value: float, sigma: float | None = None) -> Target:
    """A target that can be one.

    Raises:
        UserError: it can't.
    """
    _, label, unit = TARGETS[name]
    why = None
    if not math.isfinite(value):
        why = f"{label} must be a finite number, in {unit or 'no unit'}"
    elif name == "cor" and not 0.0 < value < 1.0:
        why = "leaves the ball on the club" if value <= 0.0 else "gains energy"
        why = "loses none (set b = 0 for that)" if value == 1.0 else why
        why = f"a COR of {value:g} {why}; it must be above 0 and below 1"
    elif name in ("contact_time", "max_force", "ball_speed") and value <= 0.0:
        why = f"{label} must be above 0 {unit}"
    elif name == "time_of_max_force" and value < 0.0:
        why = f"{label} must be at least 0 s; it counts from first touch"
    if why:
        raise UserError(f"{option(name)} {value!r} is refused: {why}")
    deviation = option(f"sigma_{name}")
    if sigma is None:
        if value == 0.0:
            raise UserError(f"{option(name)} 0 needs {deviation}: 1 % of it is no σ")
        return Target(name, value, DEFAULT_SIGMA * abs(value), False)
    if not (math.isfinite(sigma) and sigma > 0.0):
        raise UserError(
            f"{deviation} {sigma!r} is refused: a standard deviation must be a finite number above "
            f"0 {unit}".rstrip()
        )
    return Target(name, value, sigma)


def given(
    options: Mapping[str, tuple[float | None, float | None]],
    conditions: Mapping[str, float | None],
    file: Path | None = None,
) -> tuple[Conditions, dict[str, Target]]:
    """The impact and the targets of the command line and, where that is silent, of a CSV file.

    Args:
        options: (value, sigma) of each target by name, None where not given.
        conditions: values of the impact by name, None where not given.
        file: see `read_csv`.

    Raises:
        UserError: a value can't be.
    """
    listed, also = read_csv(file) if file else ({}, {})
    stated = {name: value for name, value in conditions.items() if value is not None}
    measured = Conditions(**{**also, **stated})
    targets = {}
    for name, (value, sigma) in options.items():
        if value is None and name in listed:
            value, listed_sigma = listed[name]
            sigma = listed_sigma if sigma is None else sigma
        if value is not None:
            targets[name] = target(name, value, sigma)
        elif sigma is not None:
            raise UserError(
                f"{option('sigma_' + name)} {sigma!r} is refused without {option(name)}: there is "
                "nothing that it is the standard deviation of"
            )
    for name, number in vars(measured).items():
        if not (math.isfinite(number) and number > 0.0):
            raise UserError(
                f"{option(name)} {number!r} is refused: it must be a finite number above 0"
            )
    return measured, targets


def read_csv(path: Path) -> tuple[dict[str, tuple[float, float | None]], dict[str, float]]:
    """Targets and the impact from a CSV file with the columns target, value and sigma.

    Names are those of the options, with - or _; club_speed, m_club and m_ball may be given too.
    The column sigma, or a cell of it, may be left out.

    Returns:
        Targets as (value, sigma or None) by name, and values of the impact by name.

    Raises:
        UserError: the file can't be read or understood.
    """
    try:
        rows = iter(list(csv.reader(read_text(path).splitlines())))
    except csv.Error as error:
        raise UserError(f"{path} can't be read as CSV: {error}") from error
    header = [cell.strip().lower() for cell in next(rows, [])]
    if not {"target", "value"} <= set(header) <= {"target", "value", "sigma"}:
        raise UserError(
            f"{path} is refused: its first line must be target,value,sigma (sigma may be left "
            f"out), not {','.join(header)!r}"
        )
    if len(set(header)) < len(header):
        raise UserError(f"{path} is refused: its first line names a column twice: {header}")
    targets: dict[str, tuple[float, float | None]] = {}
    impact: dict[str, float] = {}
    exact = list(Conditions.__dataclass_fields__)
    for number, row in enumerate(rows, 2):
        cells = [cell.strip() for cell in row]
        if not any(cells):
            continue
        where = f"{path}, line {number}"
        if len(cells) > len(header):
            raise UserError(f"{where} is refused: it has more cells than the first line")
        given = dict(zip(header, cells))
        name = given["target"].lower().lstrip("-").replace("-", "_")
        value, sigma = (_number(given.get(column, ""), where) for column in ("value", "sigma"))
        if name not in TARGETS and name not in exact:
            raise UserError(
                f"{where}: there is no target {given['target']!r}: choose from "
                f"{', '.join(TARGETS)}, or {', '.join(exact)}"
            )
        if value is None:
            raise UserError(f"{where}: {name} has no value")
        if name in targets or name in impact:
            raise UserError(f"{where}: {name} is given twice")
        if name in TARGETS:
            targets[name] = (value, sigma)
        elif sigma is not None:
            raise UserError(f"{where}: {name} is taken as exact, leave its sigma empty")
        else:
            impact[name] = value
    return targets, impact


def _number(text: str, where: str) -> float | None:
    if not text:
        return None
    try:
        return float(text)
    except ValueError:
        raise UserError(f"{where}: {text!r} is no number (e.g. 600e-6)") from None


def doubts(conditions: Conditions, targets: Mapping[str, Target]) -> list[str]:
    """What may be in another unit than it should, in words; it is taken as it stands."""
    words = [
        f"{option(name)} {targets[name].value:g} is taken in s: write e.g. 600e-6 for 600 µs."
        for name in ("contact_time", "time_of_max_force")
        if name in targets and targets[name].value > _LONG
    ]
    force = targets.get("max_force")
    if force and force.value < _SOFT:
        words.append(f"--max-force {force.value:g} is taken in N: write e.g. 6600 for 6.6 kN.")
    masses = {f"{option(name)} ": getattr(conditions, name) for name in ("m_club", "m_ball")}
    return [*words, *check_masses(masses)]


def check_together(targets: Mapping[str, Target], conditions: Conditions, law: int) -> None:
    """Refuse targets that no contact at all could show together; only law 2 conserves momentum.

    Raises:
        UserError: with the reason.
    """
    time, peak = targets.get("contact_time"), targets.get("time_of_max_force")
    if time and peak and peak.value >= time.value:
        raise UserError(
            f"--time-of-max-force {peak.value!r} is refused: the largest force can't come after "
            f"the contact's end, --contact-time {time.value!r}"
        )
    u = conditions.club_speed
    ball, club, cor = (targets.get(name) for name in RESTITUTION)
    speed = ball or club
    if ball and club:
        names = f"--ball-speed {ball.value!r} with --club-speed-after {club.value!r}"
        implied, sigma = (ball.value - club.value) / u, math.hypot(ball.sigma, club.sigma) / u
        if law == 2:
            _check_momentum(ball, club, conditions)
        off = abs(implied - cor.value) / math.hypot(sigma, cor.sigma) if cor else 0.0
        if cor and off > _CONTRADICTION:
            raise UserError(
                f"--cor {cor.value!r} is refused beside these speeds: (ball - club) / club speed "
                f"= {implied:.6g}, off by {off:.1f} σ (at most {_CONTRADICTION:g})"
            )
    elif speed and law == 2:
        names = f"{option(speed.name)} {speed.value!r}"
        implied, sigma = restitution(speed, conditions)
    else:
        return
    if implied - sigma >= 1.0 or implied + sigma <= 0.0:
        why = "more energy than there was" if implied > 0.0 else "a ball that doesn't leave"
        raise UserError(
            f"{names} at a club speed of {u:g} m/s would be a COR of {implied:.4g}, {why}; it "
            "must be above 0 and below 1"
        )


def _check_momentum(ball: Target, club: Target, conditions: Conditions) -> None:
    m_club, m_ball = conditions.m_club, conditions.m_ball
    start = m_club * conditions.club_speed
    end = m_club * club.value + m_ball * ball.value
    sigma = math.hypot(m_club * club.sigma, m_ball * ball.sigma)
    if abs(end - start) > _CONTRADICTION * sigma:
        raise UserError(
            f"these speeds don't conserve momentum (law 2 does): {start:.6g} N.s before, {end:.6g} "
            f"N.s after, off by {abs(end - start) / sigma:.1f} σ (at most {_CONTRADICTION:g}; σ = "
            f"{sigma:.2g} N.s); correct speeds or masses, or give larger --sigma-… values"
        )


def restitution(target: Target, conditions: Conditions) -> tuple[float, float]:
    """The COR that a speed or a COR means where momentum is conserved, and its σ."""
    total, u = conditions.m_club + conditions.m_ball, conditions.club_speed
    if target.name == "ball_speed":
        factor = total / (conditions.m_club * u)
        return factor * target.value - 1.0, factor * target.sigma
    if target.name == "club_speed_after":
        factor = total / (conditions.m_ball * u)
        return factor * (u - target.value) - 1.0, factor * target.sigma
    return target.value, target.sigma
