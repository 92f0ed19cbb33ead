"""The whole stress test: random impacts, two long runs, and the map of stability."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from golf_impact.stress import cases, invariants, long_runs, special_points, stability
from golf_impact.stress.driver import driver
from golf_impact.timing import describe_machine

#: Random impacts and special points, of --quick and of all.
IMPACTS = {True: (150, 100), False: (5000, 1500)}

_FLAT = ("flat", "the map of this FMU: error at any step size and damping", 1e-13)


def checks_and_maps(
    quick: bool, seed: int, progress: Callable[[str, int], Callable[[], None]]
) -> dict[str, Any]:
    """The contents of stress.json; a seed reproduces impacts and steps."""
    impacts, specials = IMPACTS[quick]
    ledger = invariants.Ledger(*invariants.CLAIMS, *long_runs.CLAIMS, _FLAT)
    # Every tenth random impact and every special one is compared with the reference.
    random = ("random impacts", impacts, cases.random_impact, 10)
    special = ("special points", specials, special_points.special_impact, 1)
    with driver() as fmu:
        for title, count, draw, sample in (random, special):
            tick = progress(title, count)
            for number in range(count):
                exact = number % sample == 0
                invariants.check(fmu, ledger, draw(seed, number), seed, exact)
                tick()
        tick = progress("long runs", 50)
        steps = 20_000 if quick else 1_000_000
        tiny = {f"law {law}": long_runs.tiny_steps(fmu, ledger, law, steps, tick) for law in (1, 2)}
        many = long_runs.many_impacts(fmu, ledger, 2000 if quick else 100_000, tick)
        tick = progress("stability map", 5 if quick else 27)
        maps = stability.maps(fmu, quick, tick)
        guid = fmu.description.guid
    for row, zeta in zip(maps[0]["errors"], maps[0]["damping"], strict=True):
        for error, x in zip(row, maps[0]["steps"], strict=True):
            ledger.record("flat", error, {"damping_ratio": zeta, "omega_h": x})
    checks = {name: asdict(one) | {"passed": one.passed} for name, one in ledger.checks.items()}
    return {
        "passed": all(check["passed"] for check in checks.values()),
        "seed": seed,
        "quick": quick,
        "impacts": impacts,
        "special_points": specials,
        "checks": checks,
        "tiny_steps": tiny,
        "many_impacts": many,
        "stability": maps,
        "machine": describe_machine() | {"fmu": guid},
    }
