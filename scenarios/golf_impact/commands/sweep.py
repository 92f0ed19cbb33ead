"""`golf-impact sweep`: options to a study, progress, the summary, pictures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Context, Option

from golf_impact.commands.console import err, progress, say, warn
from golf_impact.commands.run import fmu_file, pairs_of
from golf_impact.errors import UserError, missing_package
from golf_impact.stopping import held

if TYPE_CHECKING:
    from golf_impact.sweeps.run import Summary, Sweep

EPILOG = (
    "Examples: golf-impact sweep --set k=0.5e6:2e6:100 --out k.csv · golf-impact sweep "
    "--set k=log:1e5:1e7:50 --set b=0,9,12 --workers 2 --out k_b.parquet · golf-impact sweep "
    "--set club_speed=normal:45:2 --samples 1000 --out speed.csv"
)
_SET = (
    "LO:HI:COUNT, log:LO:HI:COUNT, A,B,C, normal:MEAN:SIGMA or uniform:LO:HI, for an input or "
    "parameter of the FMU or `ball`; repeatable, the last one varies fastest."
)
_DESIGN = "Sampling design: independent (if omitted), Latin hypercube, Sobol sequence."
_CHUNK = "Cases that a worker gets at a time; 2000 if omitted. Changes no result."


def sweep(
    context: Context,
    file: Annotated[
        Path | None,
        Argument(metavar="STUDY", help="A study as a TOML file; options override it."),
    ] = None,
    set_: Annotated[list[str] | None, Option("--set", metavar="NAME=VALUES", help=_SET)] = None,
    out: Annotated[
        Path | None, Option(metavar="FILE", help="The table: FILE.csv or FILE.parquet.")
    ] = None,
    outputs: Annotated[
        str | None, Option(metavar="A,B,C", help="The FMU's outputs to read, no others.")
    ] = None,
    samples: Annotated[
        int | None, Option(metavar="N", help="Number of samples of the distributions.")
    ] = None,
    seed: Annotated[int | None, Option(metavar="N", help="Of the samples; 0 if omitted.")] = None,
    design: Annotated[str | None, Option(metavar="random|lhs|sobol", help=_DESIGN)] = None,
    workers: Annotated[
        int | None, Option(metavar="N", help="Processes that compute; 1 if omitted.")
    ] = None,
    chunk: Annotated[int | None, Option(metavar="N", help=_CHUNK)] = None,
    scheduler: Annotated[
        str | None, Option(metavar="tcp://HOST:PORT|local", help="Compute on a Dask cluster.")
    ] = None,
    compare: Annotated[
        bool | None, Option("--compare", help="Also measure a loop over fmpy.simulate_fmu.")
    ] = None,
    figures: Annotated[bool | None, Option(help="Write FILE.png and FILE.html.")] = None,
    fmu: Annotated[
        Path | None, Option(metavar="FILE", help="Use this .fmu file; don't build.")
    ] = None,
) -> int:
    """Many impacts through the FMU into one table: a row a case, variables first, then outputs."""
    from golf_impact.sweeps.study import KEYS, read_study

    sets, options = ({}, {}) if file is None else read_study(file)
    sets |= pairs_of(set_ or [], "VALUES", "k=0.5e6:2e6:100", "write one list, NAME=A,B")
    # The keys of a study are these options.
    given = {name: value for name, value in context.params.items() if name in KEYS}
    options |= {name: value for name, value in given.items() if value is not None}
    if "out" not in options:
        raise UserError("no output file: give --out FILE.csv or FILE.parquet")
    return _run(sets, **options)


def _run(
    sets: dict[str, Any],
    out: str,
    outputs: str | list[str] | None = None,
    samples: int | None = None,
    seed: int = 0,
    design: str = "random",
    compare: bool = False,
    figures: bool = True,
    fmu: str | None = None,
    **execution: Any,
) -> int:
    from golf_impact.files import prepare
    from golf_impact.sweeps.run import Stopped, Sweep
    from golf_impact.sweeps.study import Study

    names = outputs.split(",") if isinstance(outputs, str) else outputs
    study, file = Study.of(sets, names, samples, seed, design), Path(out)
    if figures:
        prepare(file.parent, file.with_suffix(".png").name, file.with_suffix(".html").name)
    with Sweep(study, fmu_file(Path(fmu) if fmu else None)) as running:
        # Ctrl-C and SIGTERM end the sweep between chunks, and the process at the end of this block.
        with held() as is_requested:
            try:
                with progress() as begin:
                    move = begin("sweep", study.cases)
                    summary = running.run(file, progress=move, stop=is_requested, **execution)
            except Stopped as stopped:
                state = "is as it was" if file.exists() else "was not written"
                warn(f"{stopped.done:,} of {study.cases:,} cases were done; {file} {state}.")
                return 130
        words = _describe(summary, **execution)
        for line in words:
            say(line)
        if compare:
            words.append(_compare(running))
        if figures:
            for path in _write_report(running, summary, words):
                say(path)
    return 0


def _describe(
    summary: Summary, workers: int = 1, scheduler: str | None = None, **_: object
) -> list[str]:
    who = "in one process" if workers == 1 else f"in {workers} processes"
    if scheduler is not None:
        who = "on a local cluster" if scheduler == "local" else f"on {scheduler}"
    done = f"{summary.path}: {summary.cases:,} cases in {summary.seconds:.2f} s"
    words = [f"{done} {who} ({summary.cases / summary.seconds:,.0f} impacts/s)"]
    if summary.first_refused is not None:
        row, reason = summary.first_refused
        words.append(
            f"Refused by the FMU: {summary.refused:,} cases, their outputs are empty; the first is "
            f"row {row:,}: {reason}"
        )
    return words


def _compare(sweep: Sweep) -> str:
    from golf_impact.sweeps.comparison import compare

    with err.status("comparing with fmpy.simulate_fmu"):
        both = compare(sweep)
    same = "the same numbers to the last bit" if both.same else "OTHER NUMBERS"
    words = (
        f"In turns, on the same cases and outputs, both written to CSV: {both.sweep:,.0f} "
        f"impacts/s in one process, {both.simulate_fmu:,.0f} by a loop over fmpy.simulate_fmu "
        f"(FMU extracted and description read beforehand, one step): {both.ratio:.0f} times the "
        f"rate, {same}."
    )
    say(words)
    if not both.same:
        raise UserError("the sweep and fmpy.simulate_fmu disagree: rebuild the FMU")
    return words


def _write_report(sweep: Sweep, summary: Summary, words: list[str]) -> list[Path]:
    """The picture beside the data, and the page with it."""
    import numpy as np

    from golf_impact.files import write_together
    from golf_impact.report.figures import to_png
    from golf_impact.report.page import render_page
    from golf_impact.report.report import Report
    from golf_impact.sweeps.pictures import draw, sobol_indices

    path, name, drawn = summary.path, sweep.study.outputs[0], summary.drawn
    report = Report(f"Sweep {path.name}", sweep.fmu)
    report.words = words
    rows = [[axis.name, axis.text] for axis in sweep.study.axes]
    report.table("Swept variables (SI units)", ["", "values"], rows)
    usable = drawn[np.isfinite(drawn)]
    if len(usable):
        columns = ["", "least", "5 %", "median", "95 %", "greatest", "mean", "standard deviation"]
        values = (*np.percentile(usable, (0, 5, 50, 95, 100)), usable.mean(), usable.std())
        row = [name, *(f"{value:.6g}" for value in values)]
        report.table(f"{name} over all cases", columns, [row])
    indices = None
    try:
        indices = sobol_indices(sweep.study, drawn, sweep.first_output)
    except ImportError:
        words.append(f"{missing_package('the table of sensitivities', 'SciPy', 'sweep')}.")
    if indices is not None:
        rows = [[variable, f"{value:.4f}"] for variable, value in indices.items()]
        title = f"Sensitivity of {name}: shares of its variance that each variable explains"
        report.table(title, ["", "first-order Sobol index"], rows)
    figure = draw(sweep.study, drawn, sweep.fmu.variables, indices)
    images = {} if figure is None else {report.title: to_png(figure)}
    files = {path.with_suffix(".png").name: image for image in images.values()}
    page = render_page({"sweep": report}, {"sweep": images}, sweep.fmu.description.guid)
    return write_together(path.parent, files | {path.with_suffix(".html").name: page})
