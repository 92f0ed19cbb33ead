"""The whole stress test: random impacts, special points, and two long runs."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

from golf_impact.reference import Reference
from golf_impact.scales import Scales
from golf_impact.stress import cases, special_points
from golf_impact.stress.driver import Driver, Outputs, driver
from golf_impact.stress.invariants import CLAIMS, LONG_RUNS, Ledger, check
from golf_impact.timing import describe_machine, resident_bytes

#: Random impacts and special points, of --quick and of all.
IMPACTS = {True: (150, 100), False: (5000, 1500)}

#: s; with this stiffness the contact lasts 1.24 ms, longer than a million steps.
_TINY = 1e-9
_VALUES = cases.BASELINE | {"k": 2.5e5}


def all_checks(
    quick: bool, seed: int, progress: Callable[[str, int], Callable[[], None]]
) -> dict[str, Any]:
    """The contents of stress.json; a seed reproduces impacts and steps."""
    impacts, specials = IMPACTS[quick]
    ledger = Ledger(*CLAIMS, *LONG_RUNS)
    # Every tenth random impact and every special one is compared with the reference.
    random = ("random impacts", impacts, cases.random_impact, 10)
    special = ("special points", specials, special_points.special_impact, 1)
    pushed = ("pushed heads", impacts // 5, cases.pushed_impact, 3)
    with driver() as fmu:
        for title, count, draw, sample in (random, pushed, special):
            tick = progress(title, count)
            for number in range(count):
                check(fmu, ledger, draw(seed, number), seed, exact=number % sample == 0)
                tick()
        tick = progress("long runs", 50)
        steps = 20_000 if quick else 1_000_000
        tiny = {f"law {law}": _tiny_steps(fmu, ledger, law, steps, tick) for law in (1, 2)}
        many = _many_impacts(fmu, ledger, 2000 if quick else 100_000, tick)
        guid = fmu.description.guid
    return {
        "passed": all(one["passed"] for one in ledger.checks.values()),
        "seed": seed,
        "quick": quick,
        "impacts": impacts,
        "special_points": specials,
        "checks": ledger.checks,
        "tiny_steps": tiny,
        "many_impacts": many,
        "machine": describe_machine() | {"fmu": guid},
    }


def _tiny_steps(
    driver: Driver, ledger: Ledger, law: int, number: int, tick: Callable[[], None]
) -> dict[str, Any]:
    """The errors over a run in steps of 1 ns, read 20 times on the way."""
    values = {**_VALUES, "law": law}
    impact = cases.unchanged(0, values)
    scales = Scales(values, driver.run(impact, impact.segments)[-1], approach=0.0)
    exact = Reference(values)
    driver.begin_run(values)
    every, point, memory = number // 20, 0.0, None
    worst: list[float] = []
    for _ in range(20):
        for _ in range(every):
            driver.slave.doStep(point, _TINY)
            point += _TINY
        exact.step(every * Fraction(_TINY))
        outputs = driver.outputs()
        memory = memory or resident_bytes()
        errors = {name: scales.error(name, outputs[name], x) for name, x in exact.outputs().items()}
        name = max(errors, key=lambda name: errors[name])
        worst.append(errors[name])
        ledger.record("tiny_steps", errors[name], values, output=name, time=point)
        tick()
    gained = _record_memory(ledger, "tiny_steps_memory", memory, values)
    return {"steps": every * 20, "errors": worst, "memory_gained_mb": gained}


def _many_impacts(
    driver: Driver, ledger: Ledger, number: int, tick: Callable[[], None]
) -> dict[str, Any]:
    """One instance from impact to impact, k and law different each time."""
    rounds = [
        {**_VALUES, "law": 1 + n % 2, "k": 1e6 * (1.0 + 0.01 * n), "gap": 1e-4 * (n % 3)}
        for n in range(30)
    ]

    def impact(values: dict[str, float]) -> Outputs:
        driver.begin_run(values)
        driver.slave.doStep(0.0, 1.0)
        return driver.outputs()

    first = [impact(values) for values in rounds]
    memory = resident_bytes()
    for n in range(number):
        impact(rounds[n % len(rounds)])
        if (n + 1) % (number // 10) == 0:
            tick()
    for values, before in zip(rounds, first, strict=True):
        after = impact(values)
        difference = max(abs(after[name] - before[name]) for name in before)
        ledger.record("many_impacts", difference, values)
    gained = _record_memory(ledger, "many_impacts_memory", memory, {"impacts": number})
    return {"impacts": number, "memory_gained_mb": gained}


def _record_memory(ledger: Ledger, name: str, before: int | None, case: Any) -> float | None:
    """Megabytes gained; None where they can't be measured."""
    now = resident_bytes()
    gained = max(0.0, (now - before) / 1e6) if before and now else None
    ledger.record(name, gained or 0.0, case)
    return gained
