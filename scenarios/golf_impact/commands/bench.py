"""`golf-impact bench`."""

from pathlib import Path
from typing import Annotated, Any

import typer

from golf_impact.commands.console import RESULTS, out, paragraphs, progress, rich_table, say
from golf_impact.errors import lacking

EPILOG = "Example: golf-impact bench --quick --out bench"


def bench(
    quick: Annotated[
        bool, typer.Option("--quick", help="A short run: the same, measured less.")
    ] = False,
    folder: Annotated[
        Path, typer.Option("--out", help="The folder for bench.json and figures.")
    ] = RESULTS,
    native: Annotated[
        bool,
        typer.Option("--native", help="Instead: the FMUs in a host that isn't Python."),
    ] = False,
    explore: Annotated[
        bool,
        typer.Option("--explore", help="Instead: a slider's step in the page of explore."),
    ] = False,
) -> int:
    """Measure run time against error beside other methods, and what an impact costs.

    Exit codes: 0 all targets are met, 1 some are missed, 3 some can't be judged since the machine
    was busy, and no other one is missed.
    """
    if native:
        return _native(quick, folder)
    if explore:
        return _explore(quick, folder)
    need("bench", "distributed", "mpmath", "scipy")
    from golf_impact.files import as_json, prepare, write_together

    prepare(folder, "bench.json", "run_time_vs_error.png")
    from golf_impact.benchmarks.all import TICKS, costs_and_errors
    from golf_impact.benchmarks.limits import LIMITS, missed
    from golf_impact.benchmarks.work_precision import run_time_vs_error

    with progress() as bar:
        about = costs_and_errors(quick, bar("benchmark", TICKS[quick]))
    figures, series = about["figures"], about.pop("series")
    targets = {
        one.key: {
            "limit": one.in_words,
            "passed": one.met(figures[one.key]),
            "spread": getattr(figures[one.key], "spread", None),
        }
        for one in LIMITS
    }
    failed, busy = missed(figures)
    results: dict[str, Any] = {
        **{key: figures[key] for key in targets},
        "targets": targets,
        "passed": not failed and not busy,
        "machine_busy": busy,
        "quick": quick,
        "conclusion": _conclusion(failed, busy, figures),
        **about,
        "run_time_vs_error": series,
    }
    image = run_time_vs_error(series)
    write_together(folder, {"bench.json": as_json(results), "run_time_vs_error.png": image})
    _show(results)
    if busy:
        ratios = sum(target["spread"] is not None for target in targets.values())
        say(
            f"Machine busy: {len(busy)} of {ratios} ratios can't be judged "
            f"({', '.join(busy)}); measure again when nothing else runs.",
            style="yellow",
        )
    say(f"Results in {folder}")
    return 1 if failed else 3 if busy else 0


def _native(quick: bool, folder: Path) -> int:
    from golf_impact.benchmarks.native import standalone_and_plain
    from golf_impact.files import prepare

    prepare(folder, "bench_native.json")
    figures = standalone_and_plain(quick)
    title = "In a native host: standalone, and plain with LD_PRELOAD"
    table = rich_table(title, "", "standalone", "plain", "ratio", "at most", "")
    for one in figures.values():
        numbers = (f"{one[name]:.3g}" for name in ("standalone", "plain", "ratio", "limit"))
        table.add_row(one["meaning"], *numbers, verdict(one["passed"]))
    out.print(table)
    return _written(folder, "bench_native.json", quick, {"figures": figures})


def _explore(quick: bool, folder: Path) -> int:
    need("bench --explore", "bokeh")
    from golf_impact.benchmarks.exploring import LIMIT, memory_of_tabs, slider_steps
    from golf_impact.files import prepare

    prepare(folder, "bench_explore.json")
    steps, tabs = slider_steps(quick), memory_of_tabs()
    title = f"A slider's step at the server, ms of processor time (at most {LIMIT:g})"
    table = rich_table(title, "", "step", "then S and COR over a variable", "")
    for case, one in steps.items():
        numbers = (f"{one[name]:.1f}" for name in ("step", "sweep"))
        table.add_row(case, *numbers, verdict(one["passed"]))
    out.print(table)
    say(
        f"The server takes {tabs['server_mb']:.1f} MB after the first tab, and "
        f"{tabs['after_mb']:.1f} MB after {tabs['tabs']} more."
    )
    return _written(folder, "bench_explore.json", quick, {"steps_ms": steps, "tabs": tabs})


def _written(folder: Path, name: str, quick: bool, results: dict[str, dict[str, Any]]) -> int:
    """The exit code; the first of the results are figures that have passed or not."""
    from golf_impact.files import as_json, write_together

    passed = all(one["passed"] for one in next(iter(results.values())).values())
    write_together(folder, {name: as_json({"quick": quick, "passed": passed, **results})})
    say(f"Results in {folder}")
    return 0 if passed else 1


def need(command: str, *packages: str) -> None:
    """See that these packages are there.

    Raises:
        UserError: one isn't.
    """
    for name in packages:
        try:
            __import__(name)
        except ImportError as error:
            raise lacking(command, str(error.name), "test") from error


def _conclusion(failed: list[str], busy: list[str], figures: dict[str, float]) -> list[str]:
    from golf_impact.benchmarks.limits import UNUSUAL_IMPACT, UNUSUAL_READ

    but = f"; missed on this machine: {', '.join(failed)}" if failed else ""
    but += f"; not judged, since the machine was busy: {', '.join(busy)}" if busy else ""
    fast = (
        f"An impact's S, COR and E cost {figures['impact_by_fmu_us']:.0f} µs through fmpy "
        f"({figures['impact_by_fmu_law1_us']:.0f} µs under law 1): "
        f"{figures['impact_speedup_over_document_fmu']:.0f} times less than the document's scheme "
        f"as an FMU and {figures['impact_speedup_over_scipy']:.0f} times less than SciPy's DOP853, "
        f"with a worst error of {figures['worst_error']:.1g}{but}."
    )
    unusual = (
        "A contact that the usual forms in doubles can't tell (heavy damping, rates that meet) is "
        f"told in decimals: {figures['unusual_impact_us'] / 1e3:.2f} ms an impact and "
        f"{figures['unusual_read_us']:.0f} µs a step that is read, "
        f"{figures['unusual_impact_over_usual']:.1f} and "
        f"{figures['unusual_read_over_usual_run']:.1f} times a usual run of law 1. The targets, "
        f"{UNUSUAL_IMPACT:g} and {UNUSUAL_READ:g}, are 0.6 ms and 40 µs beside the 16.6 µs of a "
        "usual run on the reference machine: as ratios, since times differ between machines."
    )
    limits = (
        "What this can't do: a step that is read costs what FMI and Python cost, a few µs, so "
        "code without FMI is as fast for a coarse answer, instances in one process share one "
        "interpreter lock, and nothing here makes the model more true, only its equations exactly "
        "solved."
    )
    return [fast, unusual, limits]


def _show(results: dict[str, Any]) -> None:
    from rich.text import Text

    from golf_impact.benchmarks.limits import LIMITS

    about = results["machine"]
    versions = [f"{name} {about[name]}" for name in ("fmpy", "pythonfmu", "numpy", "scipy")]
    words = [about["processor"], f"{about['cores']} cores", about["system"], about["python"]]
    paragraphs([", ".join(words + versions)])
    table = rich_table("Targets (ratios within one run)", "", "figure", "target", "")
    for one in LIMITS:
        shown = verdict(results["targets"][one.key]["passed"])
        if one.key in results["machine_busy"]:
            shown = Text("busy", "yellow")
        name = f"{one.key}\n  {one.meaning}"
        table.add_row(name, f"{results[one.key]:.3g}", one.in_words, shown)
    out.print(table)
    table = rich_table("More ratios, without targets", "", "figure")
    for key, value in results["figures"].items():
        if not key.endswith("_us") and key not in results:
            table.add_row(key, f"{value:.3g}")
    out.print(table)
    columns = ("", "order", "coarsest: error", "µs", "finest: error", "µs")
    for law, methods in results["run_time_vs_error"].items():
        table = rich_table(f"Run time against error, {law}", *columns)
        for one in methods:
            order = "" if one["order"] is None else f"{one['order']:.2f}"
            errors, micro = one["errors"], [1e6 * seconds for seconds in one["seconds"]]
            ends = (cell for n in (0, -1) for cell in (f"{errors[n]:.1e}", f"{micro[n]:.0f}"))
            table.add_row(one["method"], order, *ends)
        out.print(table)
    where = results["worst_error_is_of"]
    worst = (
        f"Worst error {results['worst_error']:.2g}: {where.get('output')} of {where.get('case')}, "
        f"{where.get('pattern')} ({where['numbers_compared']} numbers in {where['cases']} cases)."
    )
    paragraphs([worst, *results["conclusion"]])


def verdict(passed: bool, number: int | str = "") -> Any:
    """A cell that says whether something holds."""
    from rich.text import Text

    return Text("pass", "green") if passed else Text(f"FAIL {number}".strip(), "red")
