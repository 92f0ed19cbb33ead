"""Checks that hold for every impact, for any inputs and steps."""

import math
import warnings
from collections.abc import Callable, Mapping, Set
from dataclasses import asdict, replace
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import quad

from golf_impact.closed_forms import reduced_mass
from golf_impact.reference import outputs_after
from golf_impact.runs import FLAGS
from golf_impact.scales import TOLERANCE, Scales
from golf_impact.stress import cases
from golf_impact.stress.cases import ImpactCase, Steps
from golf_impact.stress.driver import Driver, Outputs
from golf_impact.toml import read_toml

#: Name, statement and the largest error that passes: of every impact, and of the long runs.
CLAIMS, LONG_RUNS = (
    [(name, *row) for name, row in of_kind.items()]
    for of_kind in read_toml(Path(__file__).with_name("claims.toml")).values()
)

#: Outputs that can only rise.
RISING = ("contact_time", "max_force", "time_of_max_force", "max_compression", "impulse")

#: Under law 1 a contact may last for ever: the energy balance then ends after so many natural time
#: units, some sixteen oscillations.
_LONGEST = 100.0


class Ledger:
    """Checks by name; each claim is its name, its statement and the largest error that passes."""

    def __init__(self, *claims: tuple[str, str, float]) -> None:
        #: For JSON: the largest error seen and its case, everything needed to reproduce it. A check
        #: passes if it was evaluated and never failed.
        self.checks: dict[str, dict[str, Any]] = {}
        for name, claim, tolerance in claims:
            self.checks[name] = {"claim": claim, "tolerance": tolerance, "worst": 0.0, "count": 0}
            self.checks[name] |= {"failures": 0, "case": {}, "passed": False}

    def record(self, name: str, errors: Any, case: Mapping[str, Any], **where: Any) -> None:
        """Record an error of a check or an array of them, without unit and of either sign.

        `where` adds to the case, if this is the worst so far.
        """
        check, errors = self.checks[name], np.abs(np.array(errors, float, ndmin=1))
        check["count"] += errors.size
        check["failures"] += int(np.sum(~(errors <= check["tolerance"])))  # NaN is bad
        check["passed"] = check["count"] > 0 and not check["failures"]
        worst = float(errors.max(initial=0.0))
        if errors.size and (not check["case"] or math.isnan(worst) or worst > check["worst"]):
            check.update(worst=worst, case={**case, **where})


#: Records errors of a check by name; keywords add to the case.
Record = Callable[..., None]


def check(driver: Driver, ledger: Ledger, impact: ImpactCase, seed: int, exact: bool) -> None:
    """Check one impact; against the reference too, if `exact`."""
    # Everything needed to reproduce it.
    case = {"seed": seed, **asdict(impact), "damping_ratio": cases.damping_ratio(impact.values)}
    record = partial(ledger.record, case=case)
    driver.messages.clear()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        final = driver.run(impact, impact.segments)[-1]
        if impact.closing > 0.0:
            _check_contact(driver, record, impact, final, seed, exact)
        else:
            record("finite", sum(not math.isfinite(value) for value in final.values()))
            record("flags", any(final[flag] for flag in FLAGS))
    messages = [*driver.messages, *(str(warning.message) for warning in caught)]
    record("warnings", len(messages), messages=messages[:3])


def _check_contact(
    driver: Driver, record: Record, impact: ImpactCase, final: Outputs, seed: int, exact: bool
) -> None:
    """All checks of an impact; `final` are the outputs after its run in one step."""
    scales = _scales(driver, impact, final)
    for partition, steps in cases.partitions(impact, final["contact_time"], seed).items():
        path = driver.run(impact, steps)
        _check_path(partial(record, partition=partition), scales, steps, path)
        for output, value in final.items():
            if output != "mean_force":  # it belongs to the last step
                error = scales.error(output, path[-1][output], value)
                record("partition", error, output=output, partition=partition)
        if exact and partition in ("random", "straddling"):
            # A few instants in contact, and the end.
            in_contact = [n for n, now in enumerate(path) if now["in_contact"]]
            chosen = {*in_contact[:: max(1, len(in_contact) // 3)], len(path) - 1}
            check_reference(record, scales, steps, path, chosen)
    restitution = final["coefficient_of_restitution"]
    if impact.values["law"] == 2 and len(impact.segments) == 1 and impact.kind != "pushed":
        # Not even its smallest value, exp(-2ζs) ~ 1/(4ζ²), is below the rounding of velocities.
        error = max(0.0, restitution - 1.0, -restitution) / scales.of("coefficient_of_restitution")
        record("restitution", error, restitution=restitution)
    record("energy", _energy_error(driver, impact))


def _scales(driver: Driver, impact: ImpactCase, final: Outputs) -> Scales:
    """After the run in one step, whose outputs are `final`.

    A contact that isn't over (law 1 may never part) is continued for ten natural time units, to
    see how large the quantities become.
    """
    mu = reduced_mass(impact.values["m_club"], impact.values["m_ball"])
    later, span = final, math.fsum(segment.length for segment in impact.segments)
    if not final["separated"]:
        driver.slave.doStep(impact.start_time + span, 10.0 * math.sqrt(mu / impact.values["k"]))
        later = driver.outputs()
    fastest = max(max(math.sqrt(s.k / mu), s.b / mu) for s in impact.segments)
    start = impact.values | {"start_time": impact.start_time}
    return Scales(start, later, impact.approach, span, fastest, final)


def _check_path(record: Record, scales: Scales, steps: Steps, path: list[Outputs]) -> None:
    """The outputs after each step of one run."""
    sizes = [step.length for step in steps]
    record = partial(record, steps=sizes)
    now = {name: np.array([outputs[name] for outputs in path]) for name in path[0]}
    bad = {name: ~np.isfinite(values) for name, values in now.items()}
    record("finite", sum(bad.values()), outputs=[name for name in bad if bad[name].any()])
    force, touched, in_contact, separated = (now[name] for name in ("force", *FLAGS))
    over = np.maximum(-force, force - now["max_force"])
    record("force", np.maximum(0.0, over) / (scales.of("force") or 1.0))
    disorder = (in_contact != (touched & ~separated)) | ((force > 0.0) & ~in_contact)
    for flag in (touched, separated):
        disorder[1:] |= flag[:-1] > flag[1:]
    record("flags", disorder)
    # Just at touch the force is the limit for the inputs present, which may still be set.
    begun = now["contact_time"][:-1] > 0.0
    for name in RISING:
        falls = (now[name][:-1] - now[name][1:])[begun]
        record("rising", np.maximum(0.0, falls) / (scales.of(name) or 1.0), output=name)
    v = scales.values
    if v["law"] == 2:
        m_club, m_ball = v["m_club"], v["m_ball"]
        parts = (m_club * v["club_speed"], m_ball * v["ball_speed"])
        of_velocities = m_club * now["club_velocity"] + m_ball * now["ball_velocity"]
        acted = np.clip(np.cumsum(sizes) - scales.approach, 0.0, sizes)
        gained = np.cumsum([s.club_force for s in steps] * acted)
        whole = sum(map(abs, parts)) + np.max(np.abs(gained))
        # As in `Scales`: of the instant of touch.
        rounding = 4e-16 * scales.approach * max(abs(s.club_force) for s in steps)
        for name, momentum in (("momentum", now["momentum"]), ("velocities", of_velocities)):
            error = np.abs(momentum - sum(parts) - gained) - rounding
            record("momentum", np.maximum(0.0, error) / whole, output=name)
        gain = m_ball * (now["ball_velocity"] - v["ball_speed"])
        scale = m_ball * scales.of("ball_velocity") + scales.of("impulse")
        record("impulse", (gain - now["impulse"]) / scale)
    if impulse := path[-1]["impulse"]:
        error = abs(sum(now["mean_force"] * sizes) - impulse) / scales.of("impulse")
        # The end of contact within a step is exact to the rounding of the step's length.
        record("mean_force", max(0.0, error - scales.rounding_of_time("mean_force")))


def _energy_error(driver: Driver, impact: ImpactCase) -> float:
    """Error of the balance of energy, dissipation and work by phase, over the largest.

    The impact begins with touch here: a gap would add an error to the starts of the phases.
    """
    v = impact.values | {"gap": 0.0}
    ends = accumulate(segment.length for segment in impact.segments)
    segments = [
        replace(segment, length=min(segment.length, end - impact.approach))
        for segment, end in zip(impact.segments, ends)
        if end > impact.approach
    ]
    without_gap = replace(impact, values=v, start_time=0.0)
    contact_time = driver.run(without_gap, segments)[-1]["contact_time"]
    driver.begin_run(v)
    moving = driver.references(("club_velocity", "ball_velocity", "compression", "club_position"))

    def energy(k: float, force: float) -> float:
        """Kinetic and spring energy now, less the work of the force on the head, J."""
        v_club, v_ball, d, x = driver.slave.getReal(moving)
        kinetic = v["m_club"] * v_club * v_club + v["m_ball"] * v_ball * v_ball
        return 0.5 * (kinetic + k * d * d) - force * x

    def power(time: float, start: Any, begin: float, b: float) -> float:
        """Dissipated a time after an instant with this state of the FMU, W."""
        driver.slave.setFMUstate(start)
        driver.slave.doStep(begin, time)
        v_club, v_ball, *_ = driver.slave.getReal(moving)
        return b * (v_club**2 + v_ball**2 if v["law"] == 1 else (v_club - v_ball) ** 2)

    worst = largest = begin = 0.0
    mu = reduced_mass(v["m_club"], v["m_ball"])
    for segment in segments:
        k, b, omega = segment.k, segment.b, math.sqrt(segment.k / mu)
        length = min(segment.length, contact_time - begin, _LONGEST / omega)
        if length <= 0.0:
            break
        before = energy(k, segment.club_force)
        driver.set({"k": k, "b": b, "club_force": segment.club_force})
        phase = driver.slave.getFMUstate(), begin, b
        breaks = np.geomspace(min(length, 1.0 / max(omega, b / mu)), length, 5)[:-1]
        # The error, 1e-15 measured, is far below SciPy's estimate; full output leaves out warnings.
        dissipated, *_ = quad(
            power, 0.0, length, phase, True, epsabs=0.0, epsrel=1e-11, limit=200, points=breaks
        )
        power(length, *phase)
        driver.slave.freeFMUstate(phase[0])
        after = energy(k, segment.club_force)
        largest = max(largest, before, after)
        worst = max(worst, abs(after + dissipated - before))
        begin += length
        if length == _LONGEST / omega:
            break
    return worst / largest


def check_reference(
    record: Record, scales: Scales, steps: Steps, path: list[Outputs], chosen: Set[int]
) -> None:
    """Every output after the chosen ones of all steps, by their number from 0 on."""

    def errors_of(outputs: dict[str, Any], expected: dict[str, Any]) -> dict[str, float]:
        return {name: scales.error(name, outputs[name], x) for name, x in expected.items()}

    changed = len({(step.k, step.b, step.club_force) for step in steps}) > 1
    for number, expected in outputs_after(scales.values, steps, chosen).items():
        errors = errors_of(path[number], expected)
        if changed and not all(error <= TOLERANCE for error in errors.values()):
            # The instant at which k and b change has an error of up to one unit in the last place.
            shaken = outputs_after(scales.values, steps, chosen, 1.0 + 2.0**-52)[number]
            for name, unknown in errors_of(shaken, expected).items():
                errors[name] = 0.0 if errors[name] <= unknown else errors[name] - unknown
        so_far = [step.length for step in steps[: number + 1]]
        for name, error in errors.items():
            record("reference", error, output=name, steps=so_far)
