"""The worst error of the FMU: all reference cases, by all step patterns, in all results."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from golf_scenarios.stress.cases import (
    ImpactCase,
    Steps,
    equal_steps,
    flat,
    named_cases,
    one_step,
    random_steps,
    straddling_steps,
)
from golf_scenarios.stress.driver import Driver
from golf_scenarios.stress.reference import Reference
from golf_scenarios.stress.scales import Scales


def worst_error(driver: Driver, randoms: int, tick: Callable[[], None]) -> dict[str, Any]:
    """The worst error on the scales of the tolerance table, what it belongs to, and how many.

    Each case is looked at in ten instants of two partitions, and at the end of four.
    """
    worst, where, compared, cases = 0.0, {}, 0, 0
    for name, impact in named_cases(randoms):
        cases += 1
        final = driver.run(impact, one_step(impact))
        scales = Scales(impact.values, final, impact.approach)
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
    driver: Driver, impact: ImpactCase, steps: Steps
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
