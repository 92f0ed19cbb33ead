"""What holds for every impact, whatever its inputs and whatever the steps."""

import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from golf_impact.facts.closed_forms import reduced_mass
from golf_impact.stress import cases
from golf_impact.stress.cases import ImpactCase, Steps
from golf_impact.stress.driver import Driver, Outputs
from golf_impact.stress.ledger import Ledger
from golf_impact.stress.reference import outputs_after
from golf_impact.stress.scales import TOLERANCE, Scales

CLAIMS = (
    ("momentum", "law 2: momentum stays, of its sum of magnitudes", TOLERANCE),
    ("impulse", "law 2: the ball gains the impulse, in mass times speeds", TOLERANCE),
    ("energy", "kinetic + spring + dissipated energy stays, of the largest", TOLERANCE),
    ("force", "force >= 0 and <= max_force, of max_force", TOLERANCE),
    ("restitution", "law 2: 0 < COR <= 1, on the scale of velocities", TOLERANCE),
    ("partition", "all outputs are the same by every partition, on their scales", TOLERANCE),
    ("rising", "contact time, maxima and impulse never fall, on their scales", TOLERANCE),
    ("mean_force", "mean forces times steps add up to the impulse", TOLERANCE),
    ("flags", "touched, in_contact, separated follow each other (1 if not)", 0.0),
    ("finite", "NaN or infinite outputs", 0.0),
    ("warnings", "messages and warnings", 0.0),
    ("reference", "all outputs against 80-digit arithmetic, on their scales", TOLERANCE),
)

#: Outputs that can only rise.
RISING = ("contact_time", "max_force", "time_of_max_force", "max_compression", "impulse")

#: Points and weights of Gauss's quadrature on (0, 1), for the energy that the damping takes.
_GAUSS = 0.5 * np.stack(np.polynomial.legendre.leggauss(16), axis=1) + (0.5, 0.0)

#: Rates times length of a panel: the integrand is then exact to a double with 16 points.
_PANEL = 2.0

#: Notes the error of a check by name; more words say where.
Record = Callable[..., None]

#: Under law 1 a contact may last for ever: the balance is then drawn up over its beginning.
_MOST_PANELS = 80


def check(driver: Driver, ledger: Ledger, impact: ImpactCase, seed: int, exact: bool) -> None:
    """Look at one impact in every way; against the reference too, if `exact`."""
    # Everything needed to do it again by hand.
    case = {"seed": seed, **asdict(impact), "damping_ratio": cases.damping_ratio(impact.values)}
    record = partial(ledger.record, case=case)
    driver.messages.clear()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        final = driver.run(impact, cases.one_step(impact))[-1]
        _check_finite(partial(record, partition="one step"), final)
        if impact.closing > 0.0:
            _check_contact(driver, record, impact, seed, exact, final)
        else:
            wrong = final["touched"] or final["in_contact"] or final["separated"]
            record("flags", float(wrong))
    said = [*driver.messages, *(str(warning.message) for warning in caught)]
    record("warnings", float(len(said)), messages=said[:3])


def _check_contact(
    driver: Driver, record: Record, impact: ImpactCase, seed: int, exact: bool, final: Outputs
) -> None:
    """`final` is of the run in one step that `driver` has just made."""
    scales = _scales(driver, impact, final)
    partitions = {
        "random": cases.random_steps(impact, seed),
        "equal": cases.equal_steps(impact),
        "straddling": cases.straddling_steps(impact, final["contact_time"], seed),
    }
    courses = {name: driver.run(impact, steps) for name, steps in partitions.items()}
    for name, steps in partitions.items():
        at = partial(record, partition=name)
        for now in courses[name]:
            _check_finite(at, now)
        _check_course(at, impact, scales, cases.flat(steps), courses[name])
        for output, value in final.items():
            if output != "mean_force":  # it belongs to the last step
                error = scales.error(output, courses[name][-1][output], value)
                record("partition", error, output=output, partition=name)
    restitution = final["coefficient_of_restitution"]
    if impact.values["law"] == 2 and not impact.changed:
        # Not even its smallest value, exp(-2ζs) ~ 1/(4ζ²), is below the rounding of velocities.
        error = max(0.0, restitution - 1.0, -restitution) / scales.of("coefficient_of_restitution")
        record("restitution", error, restitution=restitution)
    record("energy", _energy_error(driver, impact))
    for name in ("random", "straddling") if exact else ():
        _check_reference(record, impact, scales, partitions[name], courses[name])


def _scales(driver: Driver, impact: ImpactCase, final: Outputs) -> Scales:
    """From the run in one step.

    A contact that isn't over (law 1 may never part) is followed on for ten natural time units, to
    see how large things get in it.
    """
    mu = reduced_mass(impact.values["m_club"], impact.values["m_ball"])
    later = final
    if not final["separated"]:
        unit = math.sqrt(mu / impact.values["k"])
        driver.slave.doStep(impact.start_time + impact.span, 10.0 * unit)
        later = driver.outputs()
    return Scales(
        {**impact.values, "start_time": impact.start_time},
        later,
        impact.approach,
        impact.span,
        fastest=max(max(math.sqrt(s.k / mu), s.b / mu) for s in impact.segments),
        speed_after=abs(final["club_velocity"]) + abs(final["ball_velocity"]),
        energy_after=final["kinetic_energy"],
    )


def _check_finite(record: Record, outputs: Outputs) -> None:
    bad = [name for name, value in outputs.items() if not math.isfinite(value)]
    record("finite", float(len(bad)), outputs=bad)


def _check_course(
    record: Record, impact: ImpactCase, scales: Scales, sizes: list[float], course: list[Outputs]
) -> None:
    """The outputs after each step of one run."""
    record = partial(record, steps=sizes)
    v = impact.values
    m_club, m_ball = v["m_club"], v["m_ball"]
    parts = (m_club * v["club_speed"], m_ball * v["ball_speed"])
    before: Outputs = {"touched": False, "separated": False, "contact_time": 0.0}
    impulse = 0.0
    for size, now in zip(sizes, course, strict=True):
        force, largest = now["force"], scales.of("force")
        over = max(0.0, -force, force - now["max_force"])
        record("force", over / largest if largest else over)
        order = (
            now["in_contact"] == (now["touched"] and not now["separated"])
            and now["touched"] >= before["touched"]
            and now["separated"] >= before["separated"]
            and not (force > 0.0 and not now["in_contact"])
        )
        record("flags", 0.0 if order else 1.0)
        # Just at touch the force is the limit for the inputs present, which may still be set.
        for name in RISING if before["contact_time"] > 0.0 else ():
            fall, scale = before[name] - now[name], scales.of(name)
            record("rising", max(0.0, fall) / scale if scale else 0.0, output=name)
        if v["law"] == 2:
            of_velocities = m_club * now["club_velocity"] + m_ball * now["ball_velocity"]
            for name, momentum in (("momentum", now["momentum"]), ("velocities", of_velocities)):
                error = abs(momentum - sum(parts)) / sum(map(abs, parts))
                record("momentum", error, output=name)
            gain = m_ball * (now["ball_velocity"] - v["ball_speed"])
            scale = m_ball * scales.speed + scales.of("impulse")
            record("impulse", abs(gain - now["impulse"]) / scale)
        impulse += now["mean_force"] * size
        before = now
    if before["impulse"]:
        off = abs(impulse - before["impulse"]) / scales.of("impulse")
        # Where in a step the contact ended is known to the rounding of its length.
        record("mean_force", max(0.0, off - scales.rounding_of_time("mean_force")))


def _energy_error(driver: Driver, impact: ImpactCase) -> float:
    """By how much kinetic and spring energy at the ends of each phase differ from what was
    dissipated between them, over the largest.

    The dissipated power is integrated over velocities read at Gauss's points. The impact begins
    with touch here: a gap would only blur when the points are.
    """
    impact = cases.without_gap(impact)
    total = driver.run(impact, cases.one_step(impact))[-1]["contact_time"]
    driver.begin_run(impact.values)
    m_club, m_ball = impact.values["m_club"], impact.values["m_ball"]
    mu = reduced_mass(m_club, m_ball)

    def energy(k: float) -> float:
        """Kinetic and spring energy now, J."""
        now = driver.outputs()
        v_club, v_ball, d = now["club_velocity"], now["ball_velocity"], now["compression"]
        return 0.5 * (m_club * v_club * v_club + m_ball * v_ball * v_ball + k * d * d)

    def power(b: float) -> float:
        """What the damping takes now, W."""
        v_club, v_ball = driver.read(("club_velocity", "ball_velocity")).values()
        if impact.values["law"] == 1:
            return b * (v_club * v_club + v_ball * v_ball)
        return b * (v_club - v_ball) ** 2

    worst, largest, point, begin = 0.0, 0.0, 0.0, 0.0
    for number, segment in enumerate(impact.segments):
        length = min(segment.length, total - begin)
        if length <= 0.0:
            break
        before = energy(segment.k)
        if number:
            driver.set({"k": segment.k, "b": segment.b})
        panels = [*islice(_panels(math.sqrt(segment.k / mu), segment.b / mu, length), _MOST_PANELS)]
        cut = len(panels) == _MOST_PANELS
        if cut:
            length = sum(panels[-1])
        points = [
            (start + node * width, weight * width)
            for start, width in panels
            for node, weight in _GAUSS.tolist()
        ]
        dissipated, at = 0.0, 0.0
        for place, weight in [*points, (length, 0.0)]:
            if place > at:  # the last panel may be an ulp wide
                driver.slave.doStep(point, place - at)
                point, at = point + (place - at), place
            dissipated += weight * power(segment.b)
        after = energy(segment.k)
        largest = max(largest, before, after)
        worst = max(worst, abs(after + dissipated - before))
        begin += length
        if cut:
            break
    return worst / largest


def _panels(omega: float, damping: float, length: float) -> Iterator[tuple[float, float]]:
    """(start, width) of panels, s: as short as the fastest rate (1/s) asks for, then growing."""
    fastest, widest = max(omega, damping), _PANEL / omega
    start, width = 0.0, _PANEL / fastest
    while start < length:
        width = min(width, widest, length - start)
        yield start, width
        start += width
        if start * fastest > 8.0 * _PANEL:
            width *= 1.5


def _check_reference(
    record: Record, impact: ImpactCase, scales: Scales, steps: Steps, course: list[Outputs]
) -> None:
    """Every output at a few instants: those of a partition that lie in contact, and its end."""
    in_contact = [n for n, now in enumerate(course) if now["in_contact"]]
    chosen = {*in_contact[:: max(1, len(in_contact) // 3)], len(course) - 1}

    def errors_of(outputs: dict[str, Any], expected: dict[str, Any]) -> dict[str, float]:
        return {name: scales.error(name, outputs[name], x) for name, x in expected.items()}

    for number, expected in outputs_after(impact, steps, chosen).items():
        errors = errors_of(course[number], expected)
        if impact.changed and not all(error <= TOLERANCE for error in errors.values()):
            # A double knows the instant at which k and b change to one unit in its last place.
            shaken = outputs_after(impact, steps, chosen, 1.0 + 2.0**-52)[number]
            for name, unknown in errors_of(shaken, expected).items():
                errors[name] = 0.0 if errors[name] <= unknown else errors[name] - unknown
        so_far = cases.flat(steps)[: number + 1]
        for name, error in errors.items():
            record("reference", error, output=name, steps=so_far)
