"""Checks that hold for every impact, for any inputs and steps."""

import math
import warnings
from collections.abc import Callable, Mapping, Set
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import quad

from golf_impact.facts.closed_forms import reduced_mass
from golf_impact.fmu.impact_fmu import FLAGS
from golf_impact.stress import cases
from golf_impact.stress.cases import ImpactCase, Steps
from golf_impact.stress.driver import Driver, Outputs
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

#: Under law 1 a contact may last for ever: the energy balance then ends after so many natural time
#: units, some sixteen oscillations.
_LONGEST = 100.0


@dataclass
class Invariant:
    """A check and its errors, which are without unit."""

    claim: str  #: in words
    tolerance: float  #: the largest error that passes
    worst: float = 0.0  #: the largest error seen
    count: int = 0  #: of evaluations
    failures: int = 0
    #: Of the worst error: everything needed to reproduce it.
    case: Mapping[str, Any] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether it was evaluated, and never failed."""
        return self.count > 0 and self.failures == 0


class Ledger:
    """Checks by name; each claim is its name, its statement and the largest error that passes."""

    def __init__(self, *claims: tuple[str, str, float]) -> None:
        self.checks = {name: Invariant(claim, tolerance) for name, claim, tolerance in claims}

    def record(self, name: str, error: float, case: Mapping[str, Any], **where: Any) -> None:
        """Record an error of a check; `where` adds to the case, if this is the worst so far."""
        check = self.checks[name]
        check.count += 1
        check.failures += not error <= check.tolerance  # NaN is bad
        if not check.case or math.isnan(error) or error > check.worst:
            check.worst, check.case = error, {**case, **where}


#: Records the error of a check by name; keywords add to the case.
Record = Callable[..., None]


def check(driver: Driver, ledger: Ledger, impact: ImpactCase, seed: int, exact: bool) -> None:
    """Check one impact; against the reference too, if `exact`."""
    # Everything needed to reproduce it.
    case = {"seed": seed, **asdict(impact), "damping_ratio": cases.damping_ratio(impact.values)}
    record = partial(ledger.record, case=case)
    driver.messages.clear()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        if impact.closing > 0.0:
            _check_contact(driver, record, impact, seed, exact)
        else:
            final = driver.run(impact, cases.one_step(impact))[-1]
            _check_finite(record, final)
            record("flags", float(any(final[flag] for flag in FLAGS)))
    messages = [*driver.messages, *(str(warning.message) for warning in caught)]
    record("warnings", float(len(messages)), messages=messages[:3])


def _check_contact(
    driver: Driver, record: Record, impact: ImpactCase, seed: int, exact: bool
) -> None:
    final = driver.run(impact, cases.one_step(impact))[-1]
    scales = _scales(driver, impact, final)
    partitions = cases.partitions(impact, final["contact_time"], seed)
    paths = {name: driver.run(impact, steps) for name, steps in partitions.items()}
    for name, path in paths.items():
        steps = cases.flat(partitions[name])
        _check_path(partial(record, partition=name), impact, scales, steps, path)
        for output, value in final.items():
            if output != "mean_force":  # it belongs to the last step
                error = scales.error(output, path[-1][output], value)
                record("partition", error, output=output, partition=name)
    restitution = final["coefficient_of_restitution"]
    if impact.values["law"] == 2 and not impact.changed:
        # Not even its smallest value, exp(-2ζs) ~ 1/(4ζ²), is below the rounding of velocities.
        error = max(0.0, restitution - 1.0, -restitution) / scales.of("coefficient_of_restitution")
        record("restitution", error, restitution=restitution)
    record("energy", _energy_error(driver, impact))
    for name in ("random", "straddling") if exact else ():
        path = paths[name]
        # A few instants in contact, and the end.
        in_contact = [n for n, now in enumerate(path) if now["in_contact"]]
        chosen = {*in_contact[:: max(1, len(in_contact) // 3)], len(path) - 1}
        check_reference(record, impact, scales, partitions[name], path, chosen)


def _scales(driver: Driver, impact: ImpactCase, final: Outputs) -> Scales:
    """After the run in one step, whose outputs are `final`.

    A contact that isn't over (law 1 may never part) is continued for ten natural time units, to
    see how large the quantities become.
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


def _check_path(
    record: Record, impact: ImpactCase, scales: Scales, sizes: list[float], path: list[Outputs]
) -> None:
    """The outputs after each step of one run."""
    record = partial(record, steps=sizes)
    v = impact.values
    m_club, m_ball = v["m_club"], v["m_ball"]
    parts = (m_club * v["club_speed"], m_ball * v["ball_speed"])
    before: Outputs = {"touched": False, "separated": False, "contact_time": 0.0}
    impulse = 0.0
    for size, now in zip(sizes, path, strict=True):
        _check_finite(record, now)
        force = now["force"]
        over = max(0.0, -force, force - now["max_force"])
        record("force", over / (scales.of("force") or 1.0))
        order = (
            now["in_contact"] == (now["touched"] and not now["separated"])
            and now["touched"] >= before["touched"]
            and now["separated"] >= before["separated"]
            and not (force > 0.0 and not now["in_contact"])
        )
        record("flags", float(not order))
        # Just at touch the force is the limit for the inputs present, which may still be set.
        for name in RISING if before["contact_time"] > 0.0 else ():
            fall = max(0.0, before[name] - now[name])
            record("rising", fall / (scales.of(name) or 1.0), output=name)
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
        error = abs(impulse - before["impulse"]) / scales.of("impulse")
        # The end of contact within a step is exact to the rounding of the step's length.
        record("mean_force", max(0.0, error - scales.rounding_of_time("mean_force")))


def _energy_error(driver: Driver, impact: ImpactCase) -> float:
    """Error of the balance of kinetic, spring and dissipated energy by phase, over the largest.

    The impact begins with touch here: a gap would add an error to the starts of the phases.
    """
    impact = cases.without_gap(impact)
    contact_time = driver.run(impact, cases.one_step(impact))[-1]["contact_time"]
    driver.begin_run(impact.values)
    m_club, m_ball = impact.values["m_club"], impact.values["m_ball"]

    def energy(k: float) -> float:
        """Kinetic and spring energy now, J."""
        now = driver.outputs()
        v_club, v_ball, d = now["club_velocity"], now["ball_velocity"], now["compression"]
        return 0.5 * (m_club * v_club * v_club + m_ball * v_ball * v_ball + k * d * d)

    worst, largest, begin = 0.0, 0.0, 0.0
    mu = reduced_mass(m_club, m_ball)
    for segment in impact.segments:
        omega = math.sqrt(segment.k / mu)
        length = min(segment.length, contact_time - begin, _LONGEST / omega)
        if length <= 0.0:
            break
        before = energy(segment.k)
        driver.set({"k": segment.k, "b": segment.b})
        shortest = min(length, 1.0 / max(omega, segment.b / mu))
        places = np.geomspace(shortest, length, 5).tolist()
        dissipated = _dissipated(driver, impact.values["law"], segment.b, begin, places)
        after = energy(segment.k)
        largest = max(largest, before, after)
        worst = max(worst, abs(after + dissipated - before))
        begin += length
        if length == _LONGEST / omega:
            break
    return worst / largest


def _dissipated(driver: Driver, law: float, b: float, begin: float, places: list[float]) -> float:
    """Energy dissipated until the last of these times after `begin`, J; all in s.

    The power follows from velocities read at the points of SciPy's adaptive quadrature, with breaks
    at the other times. The FMU is then at the last one.
    """
    slave, velocities = driver.slave, driver.references(("club_velocity", "ball_velocity"))
    start = slave.getFMUstate()

    def power(time: float) -> float:
        slave.setFMUstate(start)
        slave.doStep(begin, time)
        v_club, v_ball = slave.getReal(velocities)
        return b * (v_club**2 + v_ball**2 if law == 1 else (v_club - v_ball) ** 2)

    *breaks, length = places
    # The error, 1e-15 measured, is far below SciPy's estimate; full output leaves out warnings.
    energy, *_ = quad(
        power, 0.0, length, points=breaks, epsabs=0.0, epsrel=1e-11, limit=200, full_output=True
    )
    power(length)
    slave.freeFMUstate(start)
    return float(energy)


def check_reference(
    record: Record,
    impact: ImpactCase,
    scales: Scales,
    steps: Steps,
    path: list[Outputs],
    chosen: Set[int],
) -> None:
    """Every output after the chosen ones of all steps, by their number from 0 on."""

    def errors_of(outputs: dict[str, Any], expected: dict[str, Any]) -> dict[str, float]:
        return {name: scales.error(name, outputs[name], x) for name, x in expected.items()}

    for number, expected in outputs_after(impact, steps, chosen).items():
        errors = errors_of(path[number], expected)
        if impact.changed and not all(error <= TOLERANCE for error in errors.values()):
            # The instant at which k and b change has an error of up to one unit in the last place.
            shaken = outputs_after(impact, steps, chosen, 1.0 + 2.0**-52)[number]
            for name, unknown in errors_of(shaken, expected).items():
                errors[name] = 0.0 if errors[name] <= unknown else errors[name] - unknown
        so_far = cases.flat(steps)[: number + 1]
        for name, error in errors.items():
            record("reference", error, output=name, steps=so_far)
