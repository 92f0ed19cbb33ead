from importlib.util import find_spec
from typing import Annotated, Any

from typer import Option

from golf_impact.commands.console import RESULTS, Out, print_paragraphs, print_table, progress, say
from golf_impact.errors import missing_package
from golf_impact.report.outcome import Table

EPILOG = "Example: golf-impact bench --quick --out bench"


def bench(
    quick: Annotated[bool, Option("--quick", help="The same with fewer repetitions.")] = False,
    folder: Out = RESULTS,
    native: Annotated[bool, Option("--native", help="Instead: the FMUs in a C host.")] = False,
) -> int:
    """Measure what an impact costs, beside other methods.

    Exit codes: 0 all targets are met, 1 some are missed.
    """
    from golf_impact.files import as_json, prepare, write_together

    if native:
        from golf_impact.benchmarks.native import standalone_and_plain

        prepare(folder, "bench_native.json")
        results = standalone_and_plain(quick)
        names, rows = ("standalone", "plain", "ratio", "limit"), []
        for figure in results["figures"].values():
            numbers = (f"{figure[name]:.3g}" for name in names)
            rows.append([figure["meaning"], *numbers, verdict(figure["passed"])])
        title = "In a native host: standalone, and plain with LD_PRELOAD"
        print_table(Table(title, ["", "standalone", "plain", "ratio", "at most", ""], rows))
        files = {"bench_native.json": as_json(results)}
    else:
        need("bench", "mpmath", "scipy")
        prepare(folder, "bench.json", "run_time_vs_error.png")
        from golf_impact.benchmarks.all import TICKS, costs_and_errors
        from golf_impact.benchmarks.work_precision import run_time_vs_error

        with progress() as begin:
            results = costs_and_errors(quick, begin("benchmark", TICKS))
        image = run_time_vs_error(results["run_time_vs_error"])
        files = {"bench.json": as_json(results), "run_time_vs_error.png": image}
        _show(results)
    write_together(folder, files)
    say(f"Results in {folder}")
    return 0 if results["passed"] else 1


def need(command: str, *packages: str) -> None:
    """UserError unless these packages are installed."""
    for name in packages:
        if find_spec(name) is None:
            raise missing_package(command, name, "test")


def _show(results: dict[str, Any]) -> None:
    from golf_impact.benchmarks.all import FIGURES, WORDS

    about, figures = results["machine"], results["figures"]
    versions = (f"{name} {about[name]}" for name in ("fmpy", "pythonfmu", "numpy", "scipy"))
    words = (about["processor"], f"{about['cores']} cores", about["system"], about["python"])
    print_paragraphs([", ".join((*words, *versions))])

    def figure(key: str) -> list[Any]:
        """A figure, its target and whether that is met; empty where there is none."""
        number = f"{figures[key]:.3g}" if key in figures else ""
        target = results["targets"].get(key)
        return [number, target["limit"], verdict(target["passed"])] if target else [number, "", ""]

    rows: list[list[Any]] = []
    for way, name in WORDS["ways"].items():
        for law, suffix in ((2, ""), (1, "_law1")):
            if f"impact_by_{way}_us" in figures:
                error, time = (figures[f"impact_by_{way}{suffix}_{of}"] for of in ("error", "us"))
                over = "impact_over_" if way.startswith("compiled") else "impact_speedup_over_"
                row = [name, str(law), f"{error:.0e}", f"{time:.1f}"]
                rows.append(row + figure(f"{over}{way}{suffix}"))
    columns = ["", "law", "error", "µs", "ratio", "target", ""]
    print_table(Table("S, COR and E of one impact", columns, rows))
    others = {key: row["meaning"] for key, row in FIGURES.items() if row["meaning"]}
    rows = [[f"{key}\n  {meaning}", *figure(key)] for key, meaning in others.items()]
    print_table(Table("FMI calls, accuracy and sweeps", ["", "figure", "target", ""], rows))
    worst = WORDS["worst"].format(**figures, **results["worst_error_is_of"])
    print_paragraphs([worst, *results["conclusion"]])


def verdict(passed: bool, number: int | str = "") -> Any:
    from rich.text import Text

    return Text("pass", "green") if passed else Text(f"FAIL {number}".strip(), "red")
