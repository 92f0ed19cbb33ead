"""What holds for every impact, whatever its inputs and whatever the steps."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Container, Mapping
from functools import partial
from typing import Any

import numpy as np

from golf_scenarios.facts.closed_forms import reduced_mass
from golf_scenarios.stress.cases import (
    ImpactCase,
    Steps,
    equal_steps,
    flat,
    one_step,
    random_steps,
    straddling_steps,
    without_gap,
)
from golf_scenarios.stress.driver import Driver, Outputs
from golf_scenarios.stress.ledger import Ledger
from golf_scenarios.stress.reference import Reference
from golf_scenarios.stress.scales import BAR, Scales

#: Outputs that can only rise.
RISING = ("contact_time", "max_force", "time_of_max_force", "max_compression", "impulse")

#: Gauss's quadrature on (0, 1), for the energy that the damping takes.
_NODES, _WEIGHTS = (0.5 * x for x in np.polynomial.legendre.leggauss(16))
_NODES = _NODES + 0.5

#: Rates times length of a panel: the integrand is then exact to a double with 16 points.
_PANEL = 2.0

#: Notes the error of a check by name; more words say where.
Record = Callable[..., None]

#: See _scales, in units of 1/ω0.
_LATER = 10.0

#: Under law 1 a contact may last for ever: the balance is then drawn up over its beginning.
_MOST_PANELS = 80


def announce(ledger: Ledger) -> None:
    for name, claim, bar in (
        ("momentum", "law 2: momentum stays, of its sum of magnitudes", BAR),
        ("impulse", "law 2: the ball gains the impulse, in mass times speeds", BAR),
        ("energy", "kinetic + spring + dissipated energy stays, of the largest", BAR),
        ("force", "force >= 0 and <= max_force, of max_force", BAR),
        ("restitution", "law 2: 0 < COR <= 1, on the scale of velocities", BAR),
        ("partition", "all outputs are the same by every partition, on their scales", BAR),
        ("rising", "contact time, maxima and impulse never fall, on their scales", BAR),
        ("mean_force", "mean forces times steps add up to the impulse", BAR),
        ("flags", "touched, in_contact, separated follow each other (1 if not)", 0.0),
        ("finite", "NaN or infinite outputs", 0.0),
        ("warnings", "messages and warnings", 0.0),
        ("reference", "all outputs against 80-digit arithmetic, on their scales", BAR),
    ):
        ledger.claim(name, claim, bar)


def check(driver: Driver, ledger: Ledger, impact: ImpactCase, seed: int, exact: bool) -> None:
    """Look at one impact in every way; against the reference too, if `exact`."""
    case = {"seed": seed, **impact.described()}

    def record(name: str, error: float, **where: Any) -> None:
        ledger.record(name, error, case, **where)

    driver.messages.clear()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        final = driver.run(impact, one_step(impact))
        _check_finite(record, final, "one step")
        if impact.closing <= 0.0:
            wrong = final["touched"] or final["in_contact"] or final["separated"]
            record("flags", float(wrong))
        else:
            scales = _scales(driver, impact, final)
            partitions = {
                "random": random_steps(impact, seed),
                "equal": equal_steps(impact),
                "straddling": straddling_steps(impact, final["contact_time"], seed),
            }
            for name, steps in partitions.items():
                watch = _Watch(record, impact, scales, name, steps)
                end = driver.run(impact, steps, watch.see)
                watch.finish(end)
                _compare(record, scales, "partition", end, final, partition=name)
            if impact.law == 2 and not impact.changed:
                _check_restitution(record, scales, final)
            record("energy", _energy_error(driver, impact))
            if exact:
                for name in ("random", "straddling"):
                    _check_reference(driver, record, impact, scales, partitions[name])
    said = [*driver.messages, *(str(warning.message) for warning in caught)]
    record("warnings", float(len(said)), messages=said[:3])


def _scales(driver: Driver, impact: ImpactCase, final: Outputs) -> Scales:
    """From the run in one step, which `driver` has just made.

    A contact that isn't over (law 1 may never part) is followed on for ten natural time units, to
    see how large things get in it.
    """
    mu = reduced_mass(impact.values["m_club"], impact.values["m_ball"])
    later = final
    if not final["separated"]:
        unit = math.sqrt(mu / impact.values["k"])
        driver.slave.doStep(impact.start_time + impact.span, _LATER * unit)
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


def _check_finite(record: Record, outputs: Outputs, where: str) -> None:
    bad = [name for name, value in outputs.items() if not math.isfinite(value)]
    record("finite", float(len(bad)), outputs=bad, partition=where)


def _compare(
    record: Record,
    scales: Scales,
    check: str,
    outputs: Outputs,
    expected: Mapping[str, Any],
    **where: Any,
) -> None:
    for name, value in expected.items():
        if name != "mean_force":  # it belongs to the last step
            record(check, scales.error(name, outputs[name], value), output=name, **where)


class _Watch:
    """Looks at the outputs after each step of one run."""

    def __init__(
        self, record: Record, impact: ImpactCase, scales: Scales, partition: str, steps: Steps
    ) -> None:
        self.record = partial(record, partition=partition, steps=flat(steps))
        self.check_finite = partial(_check_finite, record, where=partition)
        self.impact, self.scales = impact, scales
        self.before: Outputs = {}
        self.impulse = 0.0
        v = impact.values
        self.momentum = v["m_club"] * v["club_speed"] + v["m_ball"] * v["ball_speed"]
        self.momenta = abs(v["m_club"] * v["club_speed"]) + abs(v["m_ball"] * v["ball_speed"])

    def see(self, size: float, now: Outputs) -> None:
        self.check_finite(now)
        force, largest = now["force"], self.scales.of("force")
        over = max(0.0, -force, force - now["max_force"])
        self.record("force", over / largest if largest else over)
        order = (
            now["in_contact"] == (now["touched"] and not now["separated"])
            and now["touched"] >= self.before.get("touched", False)
            and now["separated"] >= self.before.get("separated", False)
            and not (force > 0.0 and not now["in_contact"])
        )
        self.record("flags", 0.0 if order else 1.0)
        # Just at touch the force is the limit for the inputs present, which may still be set.
        passed_touch = self.before.get("contact_time", 0.0) > 0.0
        for name in RISING if passed_touch else ():
            fall = self.before[name] - now[name]
            scale = self.scales.of(name)
            self.record("rising", max(0.0, fall) / scale if scale else 0.0, output=name)
        if self.impact.law == 2:
            v = self.impact.values
            momenta = {
                "momentum": now["momentum"],
                "velocities": v["m_club"] * now["club_velocity"]
                + v["m_ball"] * now["ball_velocity"],
            }
            for name, momentum in momenta.items():
                self.record("momentum", abs(momentum - self.momentum) / self.momenta, output=name)
            gain = v["m_ball"] * (now["ball_velocity"] - v["ball_speed"])
            scale = v["m_ball"] * self.scales.speed + self.scales.of("impulse")
            self.record("impulse", abs(gain - now["impulse"]) / scale)
        self.impulse += now["mean_force"] * size
        self.before = now

    def finish(self, end: Outputs) -> None:
        if end["impulse"]:
            off = abs(self.impulse - end["impulse"]) / self.scales.of("impulse")
            # Where in a step the contact ended is known to the rounding of its length.
            self.record("mean_force", max(0.0, off - self.scales.rounding_of_time("mean_force")))


def _check_restitution(record: Record, scales: Scales, final: Outputs) -> None:
    restitution = final["coefficient_of_restitution"]
    out = max(0.0, restitution - 1.0)
    if restitution <= 0.0:
        # Not even its smallest value, exp(-2ζs) ~ 1/(4ζ²), is below the rounding of velocities.
        out = max(out, -restitution)
    error = out / scales.of("coefficient_of_restitution")
    record("restitution", error, restitution=restitution)


def _energy_error(driver: Driver, impact: ImpactCase) -> float:
    """By how much kinetic and spring energy at the ends of each phase differ from what was
    dissipated between them, over the largest.

    The dissipated power is integrated over velocities read at Gauss's points. The impact begins
    with touch here: a gap would only blur when the points are.
    """
    impact = without_gap(impact)
    total = driver.run(impact, one_step(impact))["contact_time"]
    driver.begin_run(impact.values)
    m_club, m_ball = impact.values["m_club"], impact.values["m_ball"]
    worst, largest, point, begin = 0.0, 0.0, 0.0, 0.0
    for number, segment in enumerate(impact.segments):
        length = min(segment.length, total - begin)
        if length <= 0.0:
            break
        before = _energy(driver.outputs(), segment.k, m_club, m_ball)
        if number:
            driver.set({"k": segment.k, "b": segment.b})
        dissipated, at = 0.0, 0.0
        panels = _panels(segment, m_club, m_ball, length)
        if len(panels) == _MOST_PANELS:
            length = sum(panels[-1])
        for start, width in panels:
            for node, weight in zip(_NODES.tolist(), _WEIGHTS.tolist()):
                place = start + node * width
                if place > at:  # the last panel may be an ulp wide
                    driver.slave.doStep(point, place - at)
                    point, at = point + (place - at), place
                dissipated += width * weight * _power(impact.law, segment.b, driver)
        if length > at:
            driver.slave.doStep(point, length - at)
            point += length - at
        after = _energy(driver.outputs(), segment.k, m_club, m_ball)
        largest = max(largest, before, after)
        worst = max(worst, abs(after + dissipated - before))
        begin += length
        if len(panels) == _MOST_PANELS:
            break
    return worst / largest


def _energy(now: Outputs, k: float, m_club: float, m_ball: float) -> float:
    """Kinetic and spring energy, J."""
    v_club, v_ball, d = now["club_velocity"], now["ball_velocity"], now["compression"]
    return 0.5 * (m_club * v_club * v_club + m_ball * v_ball * v_ball + k * d * d)


def _power(law: int, b: float, driver: Driver) -> float:
    """What the damping takes now, W."""
    v_club, v_ball = driver.velocities()
    if law == 1:
        return b * (v_club * v_club + v_ball * v_ball)
    return b * (v_club - v_ball) ** 2


def _panels(segment: Any, m_club: float, m_ball: float, length: float) -> list[tuple[float, float]]:
    """(start, width) of panels, s: as short as the fastest rate asks for, then growing."""
    mu = reduced_mass(m_club, m_ball)
    omega = math.sqrt(segment.k / mu)
    fastest = max(omega, segment.b / mu)
    widest = _PANEL / omega
    panels: list[tuple[float, float]] = []
    start, width = 0.0, _PANEL / fastest
    while start < length and len(panels) < _MOST_PANELS:
        width = min(width, widest, length - start)
        panels.append((start, width))
        start += width
        if start * fastest > 8.0 * _PANEL:
            width *= 1.5
    return panels


def _check_reference(
    driver: Driver, record: Record, impact: ImpactCase, scales: Scales, steps: Steps
) -> None:
    """Every output at a few instants: those of a partition that lie in contact, and its end."""
    seen: list[Outputs] = []
    driver.run(impact, steps, lambda size, now: seen.append(now))
    chosen = [n for n, now in enumerate(seen) if now["in_contact"]]
    some = {*chosen[:: max(1, len(chosen) // 3)], len(seen) - 1}
    exact = _told(impact, steps, some)
    for number, expected in exact.items():
        errors = {name: scales.error(name, seen[number][name], expected[name]) for name in expected}
        errors.pop("mean_force", None)  # it belongs to the last step
        if impact.changed and not all(error <= BAR for error in errors.values()):
            # A double knows the instant at which k and b change to one unit in its last place.
            shaken = _told(impact, steps, some, 1.0 + 2.0**-52)[number]
            for name, error in errors.items():
                unknown = scales.error(name, shaken[name], expected[name])
                errors[name] = 0.0 if error <= unknown else error - unknown
        so_far = flat(steps)[: number + 1]
        for name, error in errors.items():
            record("reference", error, output=name, steps=so_far)


def _told(
    impact: ImpactCase, steps: Steps, some: Container[int], stretched: float = 1.0
) -> dict[int, Mapping[str, Any]]:
    """The outputs by 80-digit arithmetic after some of the steps, by their number."""
    exact = Reference({**impact.values, "start_time": impact.start_time})
    told: dict[int, Mapping[str, Any]] = {}
    number = 0
    for place, (segment, sizes) in enumerate(zip(impact.segments, steps)):
        inputs = {"k": segment.k, "b": segment.b} if place else {}
        pending = 0.0
        for index, size in enumerate(sizes):
            pending += size  # exact: multiples of one unit
            if number in some or index == len(sizes) - 1:
                exact.step(pending * stretched, **inputs)
                pending, inputs = 0.0, {}
            if number in some:
                told[number] = exact.outputs()
            number += 1
    return told
