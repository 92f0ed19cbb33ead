"""The worst error of the FMU: all reference cases, by all step patterns, in all results."""

from collections.abc import Callable
from typing import Any

from golf_impact.stress import cases
from golf_impact.stress.driver import Driver
from golf_impact.stress.reference import outputs_after
from golf_impact.stress.scales import Scales


def worst_error(driver: Driver, randoms: int, tick: Callable[[], None]) -> dict[str, Any]:
    """The worst error on the scales of the tolerance table, what it belongs to, and how many.

    Each case is looked at in ten instants of two partitions, and at the end of four.
    """
    worst, where, compared, count = 0.0, {}, 0, 0
    for name, impact in cases.named_cases(randoms):
        count += 1
        once = cases.one_step(impact)
        final = driver.run(impact, once)[-1]
        scales = Scales(impact.values, final, impact.approach)
        straddling = cases.straddling_steps(impact, final["contact_time"], 20)
        for pattern, steps in (
            ("one step", once),
            ("64 equal steps", cases.equal_steps(impact)),
            ("random steps", cases.random_steps(impact, 20)),
            ("steps across touch and separation", straddling),
        ):
            seen = driver.run(impact, steps)
            every = max(1, len(seen) // 10)
            chosen = {*range(every - 1, len(seen), every), len(seen) - 1}
            for number, exact in outputs_after(impact, steps, chosen).items():
                compared += len(exact)
                for output, value in exact.items():
                    error = scales.error(output, seen[number][output], value)
                    if error > worst:
                        worst = error
                        where = {"case": name, "output": output, "pattern": pattern}
        tick()
    return {"worst_error": worst, **where, "cases": count, "numbers_compared": compared}
