"""`golf-impact sweep`: options to a study, progress, the summary, pictures."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from golf_impact.commands.console import err, progress, say, warn
from golf_impact.commands.run import fmu_file, pairs_of
from golf_impact.errors import UserError, missing_package
from golf_impact.stopping import SIGNALS

if TYPE_CHECKING:
    from golf_impact.report.report import Report
    from golf_impact.sweeps.run import Summary, Sweep
    from golf_impact.sweeps.sensitivity import Sensitivity
    from golf_impact.sweeps.study_file import Options

EPILOG = (
    "Examples: golf-impact sweep --set k=0.5e6:2e6:100 --out k.csv · golf-impact sweep "
    "--set k=log:1e5:1e7:50 --set b=0,9,12 --workers 2 --out k_b.parquet · golf-impact sweep "
    "--set club_speed=normal:45:2 --samples 1000 --out speed.csv"
)
_SET = (
    "LO:HI:COUNT, log:LO:HI:COUNT, A,B,C, normal:MEAN:SIGMA or uniform:LO:HI, for an input or "
    "parameter of the FMU or `ball`; repeatable, the last one runs fastest."
)
_DESIGN = "How samples lie: independent, Latin hypercube, Sobol sequence."
_CHUNK = "Cases that a worker gets at a time; changes no result."


def sweep(
    study: Annotated[
        Path | None,
        Argument(metavar="[STUDY]", help="A study as a TOML file; options win over it."),
    ] = None,
    set_: Annotated[list[str] | None, Option("--set", metavar="NAME=VALUES", help=_SET)] = None,
    out: Annotated[Path | None, Option(help="The table: FILE.csv or FILE.parquet.")] = None,
    outputs: Annotated[
        str | None, Option(metavar="A,B,C", help="The FMU's outputs to read, no others.")
    ] = None,
    samples: Annotated[int | None, Option(help="How many to draw of the distributions.")] = None,
    seed: Annotated[int | None, Option(help="Of the samples.", show_default="0")] = None,
    design: Annotated[
        str | None, Option(metavar="random|lhs|sobol", help=_DESIGN, show_default="random")
    ] = None,
    workers: Annotated[int | None, Option(help="Processes that compute.", show_default="1")] = None,
    chunk: Annotated[int | None, Option(help=_CHUNK, show_default="2000")] = None,
    scheduler: Annotated[
        str | None, Option(metavar="tcp://HOST:PORT|local", help="Compute on a Dask cluster.")
    ] = None,
    compare: Annotated[
        bool, Option("--compare", help="Also measure a loop over fmpy.simulate_fmu.")
    ] = False,
    figures: Annotated[bool | None, Option(help="Write FILE.png and FILE.html.")] = None,
    fmu: Annotated[Path | None, Option(help="Use this .fmu file; don't build.")] = None,
) -> int:
    """Many impacts through the FMU into one table: a row a case, variables first, then outputs."""
    from golf_impact.sweeps.study_file import Options

    sets = pairs_of(set_ or [], "VALUES", "k=0.5e6:2e6:100", "write one list, NAME=A,B")
    names = None if outputs is None else tuple(outputs.split(","))
    how = Options(sets, out, names, samples, seed, design, workers, chunk, scheduler)
    return swept(replace(how, compare=compare or None, figures=figures, fmu=fmu), study)


def swept(options: Options, study: Path | None) -> int:
    """Run the sweep that options and a study describe, and print what came out.

    Returns the exit code: 0, or 130 if the user stopped it. UserError if something in it isn't
    allowed, or a file can't be written.
    """
    from golf_impact.files import prepare
    from golf_impact.sweeps.run import CHUNK, Stopped, Sweep, check_size
    from golf_impact.sweeps.study import Study
    from golf_impact.sweeps.study_file import read_study
    from golf_impact.sweeps.table_file import check_path

    if study is not None:
        options = options.over(read_study(study))
    if options.out is None:
        raise UserError("say where the table goes: --out FILE.csv or FILE.parquet")
    out, workers, scheduler = options.out, options.workers, options.scheduler
    seed, design = options.seed or 0, options.design or "random"
    asked = Study.of(options.sets, options.outputs, options.samples, seed, design)
    chunk = CHUNK if options.chunk is None else options.chunk
    figures = options.figures is not False
    check_size(asked, workers, chunk, figures)
    check_path(out)
    if figures:
        prepare(out.parent, *(out.with_suffix(suffix).name for suffix in (".png", ".html")))
    with _stop_asked() as stop, Sweep(asked, fmu_file(options.fmu), stop.is_set) as running:
        try:
            with progress() as begin:
                move = begin("sweep", asked.cases)
                summary = running.run(
                    out, workers=workers, scheduler=scheduler, chunk=chunk, progress=move
                )
            words = _words(summary, options, chunk)
            for line in words:
                say(line)
            if options.compare:
                words.append(_compared(running))
            if figures:
                outcome, sensitivity = _outcome(running, summary, words)
        except Stopped as stopped:
            kept = "is written" if stopped.written else "is as it was"
            file = f"{out} {kept if out.exists() else 'was not written'}"
            warn(f"{stopped.done:,} of {asked.cases:,} cases were done; {file}.")
            return 130
    if figures:
        for path in _draw(running, summary, outcome, sensitivity):
            say(path)
    return 0


@contextmanager
def _stop_asked() -> Iterator[threading.Event]:
    """Set on Ctrl-C and SIGTERM, which take effect between cases, never inside the FMU's code."""
    stop = threading.Event()
    # nohup has a signal ignored, and so it stays.
    heard = [n for n in SIGNALS if n == signal.SIGINT or signal.getsignal(n) != signal.SIG_IGN]
    before = {number: signal.signal(number, lambda *_: stop.set()) for number in heard}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _words(summary: Summary, options: Options, chunk: int) -> list[str]:
    workers = min(options.workers or 1, -(-summary.cases // chunk))
    who = f"in {workers} processes" if workers > 1 else "in one process"
    if options.scheduler is not None:
        who = f"on {options.scheduler}" if options.scheduler != "local" else "on a local cluster"
    done = f"{summary.path}: {summary.cases:,} cases in {summary.seconds:.2f} s"
    words = [f"{done} {who} ({summary.cases / summary.seconds:,.0f} impacts/s)"]
    if summary.first_refused is not None:
        row, reason = summary.first_refused
        words.append(
            f"Refused by the FMU: {summary.refused:,} cases, their outputs are empty; the first is "
            f"row {row:,}: {reason}"
        )
    return words


def _compared(sweep: Sweep) -> str:
    from golf_impact.sweeps.comparison import compare

    with err.status("comparing with fmpy.simulate_fmu"):
        both = compare(sweep, tick=sweep.go_on)
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


def _outcome(sweep: Sweep, summary: Summary, words: list[str]) -> tuple[Report, Sensitivity | None]:
    """The tables of the page, and how much each distribution matters, if there is one."""
    import numpy as np

    from golf_impact.report.report import Report

    outcome = Report(f"Sweep {summary.path.name}", sweep.fmu)
    rows = [[one.name, one.described] for one in sweep.study.axes]
    outcome.table("Swept variables (SI units)", ["", "values"], rows)
    outcome.words = words
    name, drawn = sweep.study.outputs[0], summary.drawn
    usable = drawn[np.isfinite(drawn)]
    if len(usable):
        columns = ["", "least", "5 %", "median", "95 %", "greatest", "mean", "standard deviation"]
        values = (*np.percentile(usable, (0, 5, 50, 95, 100)), usable.mean(), usable.std())
        row = [name, *(f"{value:.6g}" for value in values)]
        outcome.table(f"{name} over all cases", columns, [row])
    if not sweep.study.distributions:
        return outcome, None
    try:
        from golf_impact.sweeps.sensitivity import sensitivity

        result = sensitivity(sweep.study, drawn, sweep.first_output)
    except ImportError:
        words.append(f"{missing_package('the table of sensitivities', 'SciPy', 'sweep')}.")
        return outcome, None
    if result is not None:
        words.append(result.note)
        rows = [[one, f"{value:.4f}"] for one, value in result.values.items()]
        outcome.table(f"What {name} depends on", ["", result.label], rows)
    return outcome, result


def _draw(
    sweep: Sweep, summary: Summary, outcome: Report, sensitivity: Sensitivity | None
) -> list[Path]:
    """The picture beside the data, and the page with it."""
    from golf_impact.files import write_together
    from golf_impact.report.figures import to_png
    from golf_impact.report.page import render_page
    from golf_impact.sweeps.pictures import draw

    figure = draw(sweep.study, summary.drawn, sweep.fmu.variables, sensitivity)
    images = {} if figure is None else {outcome.title: to_png(figure)}
    path = summary.path
    files = {path.with_suffix(".png").name: image for image in images.values()}
    report = render_page({"sweep": outcome}, {"sweep": images}, sweep.fmu.description.guid)
    return write_together(path.parent, files | {path.with_suffix(".html").name: report})
