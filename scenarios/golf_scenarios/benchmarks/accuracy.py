"""The worst error of the FMU: all reference cases, by all step patterns, in all results."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from typing import Any

from golf_scenarios.stress.cases import (
    Impact,
    Segment,
    Steps,
    contact_time_of_law2,
    damping_ratio,
    equal_steps,
    flat,
    one_step,
    quantum,
    random_steps,
    straddling_steps,
)
from golf_scenarios.stress.driver import Driver
from golf_scenarios.stress.reference import Reference
from golf_scenarios.stress.scales import Scales

_BASELINE = {
    "m_club": 0.210,
    "m_ball": 0.04593,
    "k": 1e6,
    "b": 9.0,
    "club_speed": 35.0,
    "ball_speed": 0.0,
    "gap": 0.0,
}

#: Named cases that stretch one thing each, under both laws; ζ replaces b where it is given.
_VARIED: dict[str, dict[str, float]] = {
    "baseline": {},
    "elastic": {"b": 0.0},
    "soft": {"k": 1e2},
    "stiff": {"k": 1e12},
    "slow": {"club_speed": 1e-6},
    "fast": {"club_speed": 1e3},
    "ball moving away": {"ball_speed": 20.0},
    "ball coming": {"ball_speed": -20.0},
    "after a gap": {"gap": 0.01},
    "nearly undamped": {"zeta": 1e-6},
    "half of critical": {"zeta": 0.5},
    "just below critical": {"zeta": 1.0 - 5e-15},
    "critical": {"zeta": 1.0},
    "just above critical": {"zeta": 1.0 + 5e-15},
    "overdamped": {"zeta": 2.9},
    "heavily overdamped": {"zeta": 1e4},
    "light ball": {"m_ball": 2.1e-7, "zeta": 0.1},
    "heavy ball": {"m_ball": 2.1e5, "zeta": 0.1},
    "equal masses": {"m_ball": 0.21, "zeta": 0.1},
}


def reference_cases(randoms: int) -> Iterator[tuple[str, Impact]]:
    """The named cases under both laws and as many random ones near golf, by name."""
    number = 0
    for law in (1, 2):
        for name, changes in _VARIED.items():
            yield f"{name}, law {law}", _impact(number, law, dict(changes))
            number += 1
    rng = random.Random(20)
    for n in range(randoms):
        law = 1 + n % 2
        changes = {
            "m_club": 10.0 ** rng.uniform(-3, 1),
            "m_ball": 10.0 ** rng.uniform(-3, 1),
            "k": 10.0 ** rng.uniform(3, 10),
            "zeta": 10.0 ** rng.uniform(-3, 0.2),
            "club_speed": rng.uniform(10.0, 80.0),
            "ball_speed": rng.choice((0.0, rng.uniform(-30.0, 5.0))),
            "gap": rng.choice((0.0, 0.0, 1e-4)),
        }
        yield f"random {n}, law {law}", _impact(number + n, law, changes)


def _impact(number: int, law: int, changes: dict[str, float]) -> Impact:
    zeta = changes.pop("zeta", None)
    values = _BASELINE | {"law": law} | changes
    mu = values["m_club"] * (values["m_ball"] / (values["m_club"] + values["m_ball"]))
    if zeta is not None:
        values["b"] = 2.0 * zeta * math.sqrt(values["k"] * mu)
    time = contact_time_of_law2(damping_ratio(values), math.sqrt(values["k"] / mu))
    span = values["gap"] / (values["club_speed"] - values["ball_speed"]) + 1.5 * time
    unit = quantum(span)
    segment = Segment(round(span / unit) * unit, values["k"], values["b"])
    return Impact(number, values, 0.0, (segment,))


def worst_error(driver: Driver, randoms: int, tick: Callable[[], None]) -> dict[str, Any]:
    """The worst error on the scales of the tolerance table, what it belongs to, and how many.

    Each case is looked at in ten instants of two partitions, and at the end of four.
    """
    worst, where, compared, cases = 0.0, {}, 0, 0
    for name, impact in reference_cases(randoms):
        cases += 1
        final = driver.run(impact, one_step(impact))
        scales = Scales(
            impact.values,
            force=final["max_force"],
            compression=final["max_compression"],
            impulse=final["impulse"],
            contact_time=final["contact_time"],
            approach=impact.approach,
            span=impact.approach,
            fastest=0.0,
            speed=abs(impact.values["club_speed"]) + abs(impact.values["ball_speed"]),
            energy=0.0,
        )
        patterns = {
            "one step": one_step(impact),
            "64 equal steps": equal_steps(impact),
            "random steps": random_steps(impact, 20),
            "steps across touch and separation": straddling_steps(
                impact, final["contact_time"], 20
            ),
        }
        for pattern, steps in patterns.items():
            for exact, given in _instants(driver, impact, steps):
                for output, value in exact.items():
                    error = scales.error(output, given[output], value)
                    compared += 1
                    if error > worst:
                        worst = error
                        where = {"case": name, "output": output, "pattern": pattern}
        tick()
    return {"worst_error": worst, **where, "cases": cases, "numbers_compared": compared}


def _instants(
    driver: Driver, impact: Impact, steps: Steps
) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Exact and given outputs at about ten instants of a run, the last one among them."""
    seen: list[dict[str, Any]] = []
    driver.run(impact, steps, lambda size, now: seen.append(now))
    sizes = flat(steps)
    every = max(1, len(sizes) // 10)
    exact, pending = Reference(impact.values), 0.0
    for n, size in enumerate(sizes):
        pending += size  # exact: multiples of one unit
        if n % every == every - 1 or n == len(sizes) - 1:
            exact.step(pending)
            pending = 0.0
            yield exact.outputs(), seen[n]
