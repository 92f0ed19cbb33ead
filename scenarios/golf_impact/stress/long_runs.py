"""The two long runs: a million steps of 1 ns, and 100,000 impacts in one instance."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

from golf_impact.stress.cases import BASELINE, unchanged
from golf_impact.stress.driver import Driver, Outputs
from golf_impact.stress.invariants import Ledger
from golf_impact.stress.reference import Reference
from golf_impact.stress.scales import TOLERANCE, Scales
from golf_impact.timing import resident_bytes

#: s; with this stiffness the contact lasts 1.24 ms, longer than a million steps.
_TINY = 1e-9
_VALUES = BASELINE | {"k": 2.5e5}

#: Memory may grow by as much as this, MB: allocators keep some pages of their own.
_SLACK = 2.0

CLAIMS = (
    ("tiny_steps", "steps of 1 ns: outputs against 80 digits, on their scales", TOLERANCE),
    ("tiny_steps_memory", "steps of 1 ns: memory gained, MB", _SLACK),
    ("many_impacts", "the last impacts give what the first ones gave (difference)", 0.0),
    ("many_impacts_memory", "many impacts: memory gained, MB", _SLACK),
)


def tiny_steps(
    driver: Driver, ledger: Ledger, law: int, number: int, tick: Callable[[], None]
) -> dict[str, Any]:
    """The errors over the run, read 20 times on the way: the same at its end as at its start."""
    values = {**_VALUES, "law": law}
    impact = unchanged(0, values, 1.5)
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
        name, error = max(errors.items(), key=lambda item: item[1])
        worst.append(error)
        ledger.record("tiny_steps", error, values, output=name, time=point)
        tick()
    gained = _memory_gained(memory)
    ledger.record("tiny_steps_memory", gained or 0.0, values)
    return {"steps": every * 20, "errors": worst, "memory_gained_mb": gained}


def many_impacts(
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
    gained = _memory_gained(memory)
    ledger.record("many_impacts_memory", gained or 0.0, {"impacts": number})
    return {"impacts": number, "memory_gained_mb": gained}


def _memory_gained(before: int | None) -> float | None:
    now = resident_bytes()
    return None if before is None or now is None else max(0.0, (now - before) / 1e6)
