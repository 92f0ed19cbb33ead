"""`golf-impact bench`: run time against error, the FMI floor, what a scene costs, and growth."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from golf_scenarios.errors import UserError
from golf_scenarios.report.writing import as_json, prepare, write_together

_HERE = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Target:
    """What is promised of a figure.

    Attributes:
        key: in bench.json.
        meaning: in words.
        limit: at most this, or at least if `rising`.
        rising: whether more is better.
    """

    key: str
    meaning: str
    limit: float
    rising: bool = False

    def met(self, value: float) -> bool:
        """Whether a value keeps the promise."""
        return value >= self.limit if self.rising else value <= self.limit

    @property
    def in_words(self) -> str:
        """The limit with its sense."""
        return f"{'≥' if self.rising else '≤'} {self.limit:g}"


TARGETS = (
    Target("do_step_over_empty", "doStep / the empty FMU's", 1.15),
    Target("step_and_read5_over_empty", "doStep + getReal of 5 in contact / the empty FMU's", 1.0),
    Target("instantiate_over_empty", "instantiate / an empty FMU with as many variables", 1.3),
    Target("impact_speedup_over_document_fmu", "one impact / document's scheme as FMU", 140, True),
    Target("impact_speedup_over_simulate_fmu", "one impact / simulate_fmu of this FMU", 120, True),
    Target("impact_speedup_over_scipy", "one impact / DOP853 with events, 1e-12", 100, True),
    Target("impact_speedup_over_document_fmu_law1", "the same under law 1", 100, True),
    Target("impact_speedup_over_simulate_fmu_law1", "the same under law 1", 85, True),
    Target("impact_speedup_over_scipy_law1", "the same under law 1", 75, True),
    Target("worst_error", "worst error of all reference cases, patterns, results", 1e-13),
    Target("sweep_speedup_over_simulate_fmu", "sweep to CSV / loop over simulate_fmu", 60, True),
    Target("sweep_two_workers_over_one", "sweep by two worker processes / by one", 1.7, True),
)


def bench(out: Path, quick: bool) -> int:
    """Run the benchmark, print it, and write bench.json and run_time_vs_error.png.

    Args:
        out: the folder for both.
        quick: fewer points and rounds: correctness and counts are looked at, times only roughly.

    Returns:
        0 if every target is met, else 1.

    Raises:
        UserError: the folder can't be written into, or a package is missing.
    """
    try:
        import distributed  # noqa: F401
        import mpmath  # noqa: F401
        import scipy  # noqa: F401
    except ImportError as error:
        raise UserError(
            f"bench needs {error.name}: install it with `pip install 'golf-impact[test]'`"
        ) from error
    folder = prepare(out)
    errors = Console(stderr=True)
    with Progress(console=errors, transient=True) as progress:
        found = _measure(quick, _ticker(progress, "benchmark", _ticks(quick)))
    results: dict[str, Any] = {target.key: found["figures"][target.key] for target in TARGETS}
    targets = {
        target.key: {"limit": target.in_words, "passed": target.met(results[target.key])}
        for target in TARGETS
    }
    imports_ok = not found["imports"]["heavy"]
    missed = [key for key, target in targets.items() if not target["passed"]]
    passed = not missed and imports_ok
    words = _conclusion(missed, found)
    series = found.pop("series")
    results |= {
        "targets": targets,
        "passed": passed,
        "quick": quick,
        "conclusion": words,
        **found,
        "run_time_vs_error": {
            f"law {law}": [asdict(one) for one in methods] for law, methods in series.items()
        },
    }
    from golf_scenarios.benchmarks.drawing import run_time_vs_error

    files = {
        "bench.json": as_json(_plain(results)),
        "run_time_vs_error.png": run_time_vs_error(series),
    }
    write_together(folder, files)
    _print(Console(), results, series, folder)
    return 0 if passed else 1


def _ticks(quick: bool) -> int:
    """About as many as there will be."""
    return 182 if quick else 440


def _ticker(progress: Progress, name: str, total: int) -> Callable[[], None]:
    task = progress.add_task(name, total=total)
    return lambda: progress.advance(task)


def _measure(quick: bool, tick: Callable[[], None]) -> dict[str, Any]:
    # Not before they are needed: `golf-impact --help` stays fast.
    from golf_scenarios.benchmarks import (
        accuracy,
        floor,
        growth,
        scene,
        speedup,
        sweep_rate,
        work_precision,
    )
    from golf_scenarios.benchmarks.loaded import LoadedFmu
    from golf_scenarios.benchmarks.timing import machine
    from golf_scenarios.fmu.file import build_plain_fmu, current_fmu
    from golf_scenarios.peers.document_scheme import SLAVE as DOCUMENT_FMU
    from golf_scenarios.stress.driver import opened

    ours_path, _ = current_fmu()
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="golf-impact-")))
        paths = [
            build_plain_fmu(script, scratch)
            for script in (DOCUMENT_FMU, _HERE / "empty_fmu.py", _HERE / "empty_wide_fmu.py")
        ]
        ours, document, empty, wide = (
            stack.enter_context(LoadedFmu(path)) for path in (ours_path, *paths)
        )
        figures = floor.measure(ours, empty, wide, 15 if quick else 41, tick)
        figures |= speedup.measure(ours, document, 9 if quick else 25, tick)
        series = {law: work_precision.measure(ours, document, law, quick, tick) for law in (1, 2)}
        scenes = scene.measure(ours, quick)
        steps = growth.over_steps(ours, 1000 if quick else 100_000, tick)
        instances = growth.over_instances(ours, 10 if quick else 1000, tick)
        imports = scene.imported(ours)
        guid = ours.description.guid
    figures |= sweep_rate.measure(ours_path, quick, tick)
    with opened() as (driver, _):
        accurate = accuracy.measure(driver, 2 if quick else 60, tick)
    figures["worst_error"] = accurate.pop("worst_error")
    return {
        "figures": figures,
        "series": series,
        "worst_error_is_of": accurate,
        "scenes": scenes,
        "imports": imports,
        "growth_over_steps": steps,
        "growth_over_instances": instances,
        "machine": machine() | {"fmu": guid},
    }


def _conclusion(missed: list[str], found: dict[str, Any]) -> list[str]:
    figures = found["figures"]
    fast = (
        f"An impact's S, COR and E cost {figures['impact_by_fmu_us']:.0f} µs through fmpy "
        f"({figures['impact_by_fmu_law1_us']:.0f} µs under law 1): "
        f"{figures['impact_speedup_over_document_fmu']:.0f} times less than the document's scheme "
        f"as an FMU and {figures['impact_speedup_over_scipy']:.0f} times less than SciPy's DOP853, "
        f"with a worst error of {figures['worst_error']:.1g}"
        + (f"; missed on this machine: {', '.join(missed)}." if missed else ".")
    )
    limits = (
        "What this can't do: a step that is read costs what FMI and Python cost, a few µs, so "
        "code without FMI is as fast for a coarse answer, instances in one process share one "
        "interpreter lock, and nothing here makes the model more true, only its equations exactly "
        "solved."
    )
    return [fast, limits]


def _plain(value: Any) -> Any:
    """Without inf and NaN, which JSON doesn't have."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value


def _print(console: Console, results: dict[str, Any], series: dict[int, Any], folder: Path) -> None:
    about = results["machine"]
    console.print(
        f"{about['processor']}, {about['cores']} cores, {about['system']}, {about['python']}, "
        f"fmpy {about['fmpy']}, pythonfmu {about['pythonfmu']}, numpy {about['numpy']}, "
        f"scipy {about['scipy']}",
        highlight=False,
    )
    table = _table("Targets (ratios within one run)", "", "figure", "target", "", left=1)
    for target in TARGETS:
        passed = results["targets"][target.key]["passed"]
        verdict = "[green]pass[/]" if passed else "[red]FAIL[/]"
        value = f"{results[target.key]:.3g}"
        table.add_row(f"{target.key}\n  {target.meaning}", value, target.in_words, verdict)
    console.print(table)
    figures = results["figures"]
    table = _table("More ratios, without targets", "", "figure")
    for key, value in figures.items():
        if not key.endswith("_us") and key not in results:
            table.add_row(key, f"{value:.3g}")
    console.print(table)
    for law, methods in series.items():
        table = _table(
            f"Run time against error, law {law}", "", "order", "coarsest: error", "µs",
            "finest: error", "µs",
        )  # fmt: skip
        for one in methods:
            order = "" if one.order is None else f"{one.order:.2f}"
            ends = [
                f"{x:.1e}" if kind == "e" else f"{1e6 * x:.0f}"
                for n in (0, -1)
                for kind, x in (("e", one.errors[n]), ("t", one.seconds[n]))
            ]
            table.add_row(one.method, order, *ends)
        console.print(table)
    table = _table(
        "What a scene costs", "", "µs", "doStep", "getReal", "closed form", "exponentials",
        "contact phases",
    )  # fmt: skip
    for law, scenes in results["scenes"].items():
        for name, cost in scenes.items():
            table.add_row(
                f"{law}: {name}",
                f"{cost['time_us']:.0f}",
                *(
                    str(cost[key])
                    for key in (
                        "do_step", "get_real", "closed_form", "exponentials", "contact_phases"
                    )
                ),
            )  # fmt: skip
    console.print(table)
    imports = results["imports"]
    console.print(
        f"The FMU's process imports {imports['standard_library']} modules of the standard library, "
        f"{len(imports['others'])} of its own and pythonfmu's, and "
        f"{', '.join(imports['heavy']) or 'no numpy, matplotlib or scipy'}.",
        highlight=False,
    )
    table = _table("Growth", "", "µs per impact", "µs per step", "KiB per instance")
    for row in results["growth_over_steps"]:
        table.add_row(
            f"{row['steps']} steps", f"{row['time_us']:.0f}", f"{row['per_step_us']:.2f}", ""
        )
    for row in results["growth_over_instances"]:
        kib = "" if row["kib_per_instance"] is None else f"{row['kib_per_instance']:.0f}"
        table.add_row(f"{row['instances']} instances", f"{row['time_us']:.0f}", "", kib)
    console.print(table)
    where = results["worst_error_is_of"]
    console.print(
        f"Worst error {figures['worst_error']:.2g}: {where.get('output')} of {where.get('case')}, "
        f"{where.get('pattern')} ({where['numbers_compared']} numbers in {where['cases']} cases).",
        highlight=False,
    )
    for words in results["conclusion"]:
        console.print(words, highlight=False)
    console.print(f"Results in {folder}", soft_wrap=True, highlight=False)


def _table(title: str, *columns: str, left: int = 1) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold")
    for n, column in enumerate(columns):
        table.add_column(column, justify="left" if n < left else "right", overflow="fold")
    return table
