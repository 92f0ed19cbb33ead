"""`golf-impact stress`: a map of stability, thousands of random impacts, and two long runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from golf_scenarios.errors import UserError
from golf_scenarios.report.writing import as_json, prepare, write_together

if TYPE_CHECKING:
    from golf_scenarios.stress.ledger import Ledger
    from golf_scenarios.stress.stability import Map

#: Without --seed: the same run every time.
DEFAULT_SEED = 20

#: Of so many impacts one is held against the reference.
_SAMPLE = 10


def stress(out: Path, quick: bool, seed: int | None = None) -> int:
    """Run the stress tests, print them, and write stress.json and stability.png.

    Args:
        out: the folder for both.
        quick: fewer and shorter ones.
        seed: of the random impacts; the same one gives the same impacts and steps again.

    Returns:
        0 if every check passed, else 1.

    Raises:
        UserError: the folder can't be written into, or a package is missing.
    """
    try:
        import mpmath  # noqa: F401
        import scipy  # noqa: F401
    except ImportError as error:
        raise UserError(
            f"stress needs {error.name}: install it with `pip install 'golf-impact[test]'`"
        ) from error
    folder = prepare(out)
    seed = DEFAULT_SEED if seed is None else seed
    with Progress(console=Console(stderr=True), transient=True) as progress:
        results, maps, ledger = _measure(quick, seed, progress)
    results["conclusion"] = _conclusion(results, maps)
    from golf_scenarios.stress.stability import draw

    write_together(folder, {"stress.json": as_json(plain(results)), "stability.png": draw(maps)})
    _print(Console(), results, ledger, folder)
    return 0 if results["passed"] else 1


def _measure(
    quick: bool, seed: int, progress: Progress
) -> tuple[dict[str, Any], list[Map], Ledger]:
    # Not before they are needed: `golf-impact --help` stays fast.
    from golf_scenarios.benchmarks.timing import machine
    from golf_scenarios.stress import cases, invariants, long_runs, stability
    from golf_scenarios.stress.driver import opened
    from golf_scenarios.stress.ledger import Ledger

    impacts = 150 if quick else 5000

    def bar(name: str, total: int) -> Callable[[], None]:
        task = progress.add_task(name, total=total)
        return lambda: progress.advance(task)

    ledger = Ledger()
    invariants.announce(ledger)
    long_runs.announce(ledger)
    ledger.claim("flat", "the map of this FMU: error at any step size and damping", 1e-13)
    with opened() as (driver, fmu):
        tick = bar("random impacts", impacts)
        for number in range(impacts):
            impact = cases.random_impact(seed, number)
            invariants.check(driver, ledger, impact, seed, exact=number % _SAMPLE == 0)
            tick()
        tick = bar("long runs", 50)
        steps = 20_000 if quick else 1_000_000
        tiny = {
            f"law {law}": long_runs.tiny_steps(driver, ledger, law, steps, tick) for law in (1, 2)
        }
        many = long_runs.many_impacts(driver, ledger, 2000 if quick else 100_000, tick)
        maps = stability.measure(driver, quick, bar("stability map", 8 * (5 if quick else 27)))
        guid = fmu.description.guid
    for row, zeta in zip(maps[0].errors, maps[0].damping.tolist(), strict=True):
        for error, x in zip(row.tolist(), maps[0].steps.tolist(), strict=True):
            ledger.record("flat", error, {"damping_ratio": zeta, "omega_h": x})
    results = {
        "passed": ledger.passed,
        "seed": seed,
        "quick": quick,
        "impacts": impacts,
        "checks": {
            name: {
                "claim": check.claim,
                "worst": check.worst,
                "bar": check.bar,
                "passed": check.passed,
                "count": check.count,
                "failures": check.failures,
                "case": dict(check.case),
            }
            for name, check in ledger.checks.items()
        },
        "tiny_steps": tiny,
        "many_impacts": many,
        "stability": [
            asdict(one)
            | {name: getattr(one, name).tolist() for name in ("steps", "damping", "errors")}
            for one in maps
        ],
        "machine": machine() | {"fmu": guid},
    }
    return results, maps, ledger


def _conclusion(results: dict[str, Any], maps: list[Map]) -> list[str]:
    from golf_scenarios.stress.stability import STEPPING

    flat = results["checks"]["flat"]["worst"]
    lost = {one.method: float((one.errors > 1.0).mean()) for one in maps if one.method in STEPPING}
    failed = [name for name, check in results["checks"].items() if not check["passed"]]
    first = (
        f"Over six decades of step size and any damping the FMU's error stays below {flat:.1g}, "
        f"while stepping methods are wrong by more than 100 % on {min(lost.values()):.0%} to "
        f"{max(lost.values()):.0%} of the same map; {results['impacts']} random impacts far beyond "
        "golf kept "
        + ("every invariant." if not failed else f"all invariants but: {', '.join(failed)}.")
    )
    second = (
        "What this can't show: that the model is a golf ball (a stable, exact answer to the wrong "
        "equations is still wrong), anything outside the ranges drawn from, or a clock finer than "
        "a double's: after an approach A the contact T is known to 4e-16 A/T."
    )
    return [first, second]


def plain(value: Any) -> Any:
    """Without inf and NaN, which JSON doesn't have."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value


def _print(console: Console, results: dict[str, Any], ledger: Ledger, folder: Path) -> None:
    table = Table(
        title=f"Stress, seed {results['seed']}: worst cases",
        title_justify="left",
        title_style="bold",
    )
    table.add_column("check", overflow="fold")
    for name in ("worst", "bar", "looked at", ""):
        table.add_column(name, justify="right")
    for name, check in ledger.checks.items():
        verdict = "[green]pass[/]" if check.passed else f"[red]FAIL {check.failures}[/]"
        table.add_row(
            f"{name}\n  {check.claim}",
            f"{check.worst:.2g}",
            f"{check.bar:.2g}",
            str(check.count),
            verdict,
        )
    console.print(table)
    for name, check in ledger.checks.items():
        if check.worst > 0.0:
            console.print(f"{name}: {check.worst:.2g} at {_shown(check.case)}", highlight=False)
    for law, run in results["tiny_steps"].items():
        console.print(
            f"{run['steps']} steps of 1 ns, {law}: error {run['errors'][0]:.1g} at the start, "
            f"{run['errors'][-1]:.1g} at the end; memory gained {_megabytes(run)}.",
            highlight=False,
        )
    many = results["many_impacts"]
    console.print(
        f"{many['impacts']} impacts in one instance: memory gained {_megabytes(many)}.",
        highlight=False,
    )
    for words in results["conclusion"]:
        console.print(words, highlight=False)
    console.print(f"Results in {folder}", soft_wrap=True, highlight=False)


def _shown(case: Any) -> str:
    """Inputs in one line; the steps themselves are in stress.json."""
    parts = []
    for name, value in case.items():
        if name == "steps":
            parts.append(f"{len(value)} steps")
        elif isinstance(value, float):
            parts.append(f"{name} {value:.6g}")
        elif isinstance(value, dict):
            parts.append(_shown(value))
        elif name == "segments":
            if len(value) > 1:
                parts.append(f"{len(value)} segments")
        else:
            parts.append(f"{name} {value}")
    return ", ".join(parts)


def _megabytes(run: dict[str, Any]) -> str:
    gained = run["memory_gained_mb"]
    return "not known on this system" if gained is None else f"{gained:.2f} MB"
