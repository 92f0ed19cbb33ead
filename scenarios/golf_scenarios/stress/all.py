"""The whole stress test: random impacts, two long runs, and the map of stability."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from golf_scenarios.stress import cases, invariants, long_runs, special_points, stability
from golf_scenarios.stress.driver import driver
from golf_scenarios.stress.ledger import Ledger
from golf_scenarios.timing import machine

#: Random impacts and special points, of --quick and of all.
IMPACTS = {True: (150, 100), False: (5000, 1500)}

#: Of so many impacts one is held against the reference.
_SAMPLE = 10


def measured(
    quick: bool, seed: int, bar: Callable[[str, int], Callable[[], None]]
) -> tuple[dict[str, Any], list[stability.Map]]:
    """What stress.json holds, and the maps; a seed gives the same impacts and steps again."""
    impacts, specials = IMPACTS[quick]
    ledger = Ledger()
    invariants.announce(ledger)
    long_runs.announce(ledger)
    ledger.claim("flat", "the map of this FMU: error at any step size and damping", 1e-13)
    with driver() as fmu:
        tick = bar("random impacts", impacts)
        for number in range(impacts):
            impact = cases.random_impact(seed, number)
            invariants.check(fmu, ledger, impact, seed, exact=number % _SAMPLE == 0)
            tick()
        tick = bar("special points", specials)
        for number in range(specials):
            impact = special_points.special_impact(seed, number)
            invariants.check(fmu, ledger, impact, seed, exact=True)
            tick()
        tick = bar("long runs", 50)
        steps = 20_000 if quick else 1_000_000
        tiny = {f"law {law}": long_runs.tiny_steps(fmu, ledger, law, steps, tick) for law in (1, 2)}
        many = long_runs.many_impacts(fmu, ledger, 2000 if quick else 100_000, tick)
        maps = stability.maps(fmu, quick, bar("stability map", 8 * (5 if quick else 27)))
        guid = fmu.description.guid
    for row, zeta in zip(maps[0].errors, maps[0].damping.tolist(), strict=True):
        for error, x in zip(row.tolist(), maps[0].steps.tolist(), strict=True):
            ledger.record("flat", error, {"damping_ratio": zeta, "omega_h": x})
    arrays = ("steps", "damping", "errors")
    results = {
        "passed": ledger.passed,
        "seed": seed,
        "quick": quick,
        "impacts": impacts,
        "special_points": specials,
        "checks": {
            name: asdict(check) | {"passed": check.passed} for name, check in ledger.checks.items()
        },
        "tiny_steps": tiny,
        "many_impacts": many,
        "stability": [
            asdict(one) | {name: getattr(one, name).tolist() for name in arrays} for one in maps
        ],
        "machine": machine() | {"fmu": guid},
    }
    return results, maps
