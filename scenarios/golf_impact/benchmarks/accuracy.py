"""The worst error of the FMU: all reference cases, by all step patterns, in all results."""

from functools import partial
from typing import Any

from golf_impact.scales import TOLERANCE, Scales
from golf_impact.stress import cases
from golf_impact.stress.driver import Driver
from golf_impact.stress.invariants import Ledger, check_reference


def worst_error(driver: Driver, randoms: int) -> dict[str, Any]:
    """The worst error on the scales of the tolerance table, what it belongs to, and how many.

    Each case is compared at ten instants of each partition, and at the end.
    """
    ledger = Ledger(("reference", "all outputs", TOLERANCE))
    named = [*cases.named_cases(randoms)]
    for name, impact in named:
        final = driver.run(impact, impact.segments)[-1]
        scales = Scales(impact.values, final, impact.approach)
        for pattern, steps in cases.partitions(impact, final["contact_time"], 20).items():
            record = partial(ledger.record, case={"case": name, "pattern": pattern})
            path = driver.run(impact, steps)
            every = max(1, len(path) // 10)
            chosen = {*range(every - 1, len(path), every), len(path) - 1}
            check_reference(record, scales, steps, path, chosen)
    check = ledger.checks["reference"]
    where = {name: check["case"][name] for name in ("case", "output", "pattern")}
    numbers = {"cases": len(named), "numbers_compared": check["count"]}
    return {"worst_error": check["worst"], **where, **numbers}
