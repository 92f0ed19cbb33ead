"""`golf-impact bench`."""

from pathlib import Path
from typing import Annotated, Any

import typer

from golf_impact.commands.console import RESULTS, print_paragraphs, print_table, progress, say
from golf_impact.errors import missing_package

EPILOG = "Example: golf-impact bench --quick --out bench"


def bench(
    quick: Annotated[
        bool, typer.Option("--quick", help="A short run: the same with fewer repetitions.")
    ] = False,
    folder: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="For bench.json and figures.")
    ] = RESULTS,
    native: Annotated[
        bool,
        typer.Option("--native", help="Instead: the FMUs in a host that isn't Python."),
    ] = False,
) -> int:
    """Measure run time against error beside other methods, and what an impact costs.

    Exit codes: 0 all targets are met, 1 some are missed.
    """
    if native:
        return _native(quick, folder)
    need("bench", "distributed", "mpmath", "scipy")
    from golf_impact.files import as_json, prepare, write_together

    prepare(folder, "bench.json", "run_time_vs_error.png")
    from golf_impact.benchmarks.all import TICKS, costs_and_errors
    from golf_impact.benchmarks.limits import LIMITS
    from golf_impact.benchmarks.work_precision import run_time_vs_error

    with progress() as begin:
        about = costs_and_errors(quick, begin("benchmark", TICKS))
    figures, series = about["figures"], about.pop("series")
    targets = {
        limit.key: {"limit": limit.in_words, "passed": limit.met(figures[limit.key])}
        for limit in LIMITS
        if limit.key in figures
    }
    missed = [key for key, target in targets.items() if not target["passed"]]
    results: dict[str, Any] = {
        **{key: figures[key] for key in targets},
        "targets": targets,
        "passed": not missed,
        "quick": quick,
        "conclusion": _conclusion(missed, figures),
        **about,
        "run_time_vs_error": series,
    }
    image = run_time_vs_error(series)
    write_together(folder, {"bench.json": as_json(results), "run_time_vs_error.png": image})
    _show(results)
    say(f"Results in {folder}")
    return 1 if missed else 0


def _native(quick: bool, folder: Path) -> int:
    from golf_impact.benchmarks.native import standalone_and_plain
    from golf_impact.files import as_json, prepare, write_together

    prepare(folder, "bench_native.json")
    from golf_impact.report.outcome import Table

    figures = standalone_and_plain(quick)
    title = "In a native host: standalone, and plain with LD_PRELOAD"
    names = ("standalone", "plain", "ratio", "limit")
    rows = [
        [figure["meaning"], *(f"{figure[name]:.3g}" for name in names), verdict(figure["passed"])]
        for figure in figures.values()
    ]
    print_table(Table(title, ["", *names[:3], "at most", ""], rows))
    passed = all(figure["passed"] for figure in figures.values())
    results = {"quick": quick, "passed": passed, "figures": figures}
    write_together(folder, {"bench_native.json": as_json(results)})
    say(f"Results in {folder}")
    return 0 if passed else 1


def need(command: str, *packages: str) -> None:
    """UserError unless these packages are installed."""
    for name in packages:
        try:
            __import__(name)
        except ImportError as error:
            raise missing_package(command, str(error.name), "test") from error


def _conclusion(missed: list[str], figures: dict[str, float]) -> list[str]:
    but = f"; missed on this machine: {', '.join(missed)}" if missed else ""
    fast = (
        f"S, COR and E of an impact take {figures['impact_by_fmu_us']:.1f} µs under law 2 and "
        f"{figures['impact_by_fmu_law1_us']:.1f} µs under law 1, at a worst error of "
        f"{figures['worst_error']:.1g}"
    )
    if "impact_over_compiled_euler" in figures:
        fast += (
            f": {figures['impact_over_compiled_euler']:.2f} and "
            f"{figures['impact_over_compiled_euler_law1']:.2f} times the document's scheme as an "
            f"FMU compiled from C, whose error is {figures['impact_by_compiled_euler_error']:.1g}"
        )
    extended = (
        "Contacts that need extended precision (heavy damping, nearly equal rates) take "
        f"{figures['unusual_impact_us'] / 1e3:.2f} ms an impact and "
        f"{figures['unusual_read_us']:.0f} µs a step that is read."
    )
    limits = (
        "Limits. Through fmpy every FMU pays for FMI calls from Python; in a native host compiled "
        "code is faster. Each step whose outputs are read costs a few µs, and instances in one "
        "process share one interpreter lock. Numerical accuracy does not improve the model."
    )
    return [f"{fast}{but}.", extended, limits]


#: The methods for S, COR and E in words, by the parts of their keys in bench.json.
_WAYS = {
    "fmu": ("this FMU", ""),
    "compiled_euler": ("document's scheme, FMU in C", "impact_over_"),
    "compiled_rk4": ("Runge–Kutta 4, FMU in C", "impact_over_"),
    "document_fmu": ("document's scheme, Python FMU", "impact_speedup_over_"),
    "simulate_fmu": ("this FMU, simulate_fmu", "impact_speedup_over_"),
    "scipy": ("SciPy DOP853, rtol 1e-12", "impact_speedup_over_"),
}


def _show(results: dict[str, Any]) -> None:
    from golf_impact.benchmarks.limits import CALLS, SWEEPS
    from golf_impact.report.outcome import Table

    about, figures = results["machine"], results["figures"]
    versions = [f"{name} {about[name]}" for name in ("fmpy", "pythonfmu", "numpy", "scipy")]
    words = [about["processor"], f"{about['cores']} cores", about["system"], about["python"]]
    print_paragraphs([", ".join(words + versions)])

    def judged(key: str) -> tuple[str, Any]:
        """The target of a figure, and whether it is met; empty if it has none."""
        target = results["targets"].get(key)
        return (target["limit"], verdict(target["passed"])) if target else ("", "")

    rows: list[list[Any]] = []
    for way, (name, kind) in _WAYS.items():
        for law, suffix in ((2, ""), (1, "_law1")):
            if f"impact_by_{way}_us" in figures:
                error, time = (figures[f"impact_by_{way}{suffix}_{of}"] for of in ("error", "us"))
                key = f"{kind}{way}{suffix}"
                ratio = f"{figures[key]:.3g}" if kind else ""
                row = [name, str(law), f"{error:.0e}", f"{time:.1f}", ratio, *judged(key)]
                rows.append(row)
    columns = ["", "law", "error", "µs", "ratio", "target", ""]
    print_table(Table("S, COR and E of one impact", columns, rows))
    for title, limits in (("FMI calls, and other runs", CALLS), ("Accuracy and sweeps", SWEEPS)):
        meanings = {limit.key: f"\n  {limit.meaning}" for limit in limits}
        if limits is SWEEPS:
            meanings |= {
                key: "" for key in figures if key.startswith("sweep_") and key not in meanings
            }
        rows = [[f"{k}{words}", f"{figures[k]:.3g}", *judged(k)] for k, words in meanings.items()]
        print_table(Table(title, ["", "figure", "target", ""], rows))
    rows = []
    for of_laws in zip(*results["run_time_vs_error"].values(), strict=True):
        for law, series in enumerate(of_laws, 1):
            order = "" if series["order"] is None else f"{series['order']:.2f}"
            errors, micro = series["errors"], [1e6 * seconds for seconds in series["seconds"]]
            ends = (cell for n in (0, -1) for cell in (f"{errors[n]:.0e}", f"{micro[n]:.0f}"))
            rows.append([series["method"], str(law), order, *ends])
    columns = ["", "law", "order", "error at coarsest", "µs", "error at finest", "µs"]
    print_table(Table("Run time against error, by step size or tolerance", columns, rows))
    where = results["worst_error_is_of"]
    worst = (
        f"Worst error {results['worst_error']:.2g}: {where.get('output')} of {where.get('case')}, "
        f"{where.get('pattern')} ({where['numbers_compared']} numbers in {where['cases']} cases)."
    )
    print_paragraphs([worst, *results["conclusion"]])


def verdict(passed: bool, number: int | str = "") -> Any:
    """A cell with the verdict on a check."""
    from rich.text import Text

    return Text("pass", "green") if passed else Text(f"FAIL {number}".strip(), "red")
