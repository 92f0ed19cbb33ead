"""The command `golf-impact sweep`: options to a study, progress, the summary, pictures."""

from __future__ import annotations

import base64
import io
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from golf_scenarios.errors import UserError
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.outcome import Outcome, Table
from golf_scenarios.sweeps.axes import Axis, Grid, Normal
from golf_scenarios.sweeps.plan import plan
from golf_scenarios.sweeps.pool import SIGNALS
from golf_scenarios.sweeps.run import CHUNK, Stopped, Summary, run_sweep
from golf_scenarios.sweeps.study import Study
from golf_scenarios.sweeps.study_file import Options, read_study
from golf_scenarios.sweeps.target import check_path

_out = Console(markup=False, emoji=False)
_err = Console(stderr=True, markup=False, emoji=False)


def sweep(given: Options, study_file: Path | None) -> int:
    """Run the sweep that command line and study describe, and say what came out.

    Returns:
        The exit code: 0, or 130 if the user stopped it.

    Raises:
        UserError: something in it isn't allowed, or a file can't be written.
    """
    options = given.over(read_study(study_file)) if study_file else given
    if options.out is None:
        raise UserError("say where the table goes: --out FILE.csv or FILE.parquet")
    study = Study.of(
        options.sets,
        options.outputs,
        options.samples,
        0 if options.seed is None else options.seed,
        options.design or "random",
    )
    check_path(options.out)
    fmu = _fmu(options.fmu)
    try:
        with _stop_asked() as stop:
            summary = _run(study, options, options.out, fmu, stop)
            words = _words(summary, options)
            for line in words:
                _out.print(line, soft_wrap=True, highlight=False)
            if options.compare:
                words += _compared(study, fmu, stop)
            if options.figures is not False:
                outcome = _outcome(study, summary, words)
                found = _sensitivity(study, summary, fmu, stop, outcome)
    except Stopped as stopped:
        file = "is written" if stopped.written else "is as it was"
        if not options.out.exists():
            file = "was not written"
        _err.print(
            f"{stopped.done:,} of {study.cases:,} cases were done; {options.out} {file}.",
            soft_wrap=True,
            highlight=False,
        )
        return 130
    if options.figures is not False:
        for path in _draw(study, summary, outcome, found, fmu):
            _out.print(str(path), soft_wrap=True, highlight=False)
    return 0


def _fmu(path: Path | None) -> Path:
    from golf_scenarios.fmu.file import current_fmu, given_fmu

    if path is not None:
        return given_fmu(path)
    path, why = current_fmu()
    if why:
        _err.print(f"Built {path}: {why}.", soft_wrap=True, highlight=False)
    return path


@contextmanager
def _stop_asked() -> Iterator[threading.Event]:
    """Set on Ctrl-C and SIGTERM, which are answered between cases: never inside the FMU's code."""
    stop = threading.Event()
    # nohup has a signal ignored, and so it stays.
    heard = [n for n in SIGNALS if n == signal.SIGINT or signal.getsignal(n) != signal.SIG_IGN]
    before = {number: signal.signal(number, lambda *_: stop.set()) for number in heard}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _run(study: Study, options: Options, out: Path, fmu: Path, stop: threading.Event) -> Summary:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("left"),
    )
    with Progress(*columns, console=_err, transient=True, disable=not _err.is_terminal) as progress:
        task = progress.add_task("sweep", total=study.cases, rate="")

        def advance(done: int) -> None:
            speed = progress.tasks[task].speed
            rate = f"{speed:,.0f} impacts/s" if speed else ""
            progress.update(task, completed=done, rate=rate)

        chunk = CHUNK if options.chunk is None else options.chunk
        if options.scheduler is not None:
            from golf_scenarios.sweeps.cluster import run_on_cluster

            return run_on_cluster(
                study, out, options.scheduler, fmu=fmu, workers=options.workers, chunk=chunk,
                progress=advance, stop=stop.is_set,
            )  # fmt: skip
        workers = 1 if options.workers is None else options.workers
        return run_sweep(
            study, out, fmu=fmu, workers=workers, chunk=chunk, progress=advance, stop=stop.is_set
        )


def _words(summary: Summary, options: Options) -> list[str]:
    if options.scheduler is not None:
        who = f"on {options.scheduler}" if options.scheduler != "local" else "on a local cluster"
    else:
        chunks = -(-summary.cases // (options.chunk or CHUNK))
        workers = min(options.workers or 1, chunks)
        who = f"in {workers} processes" if workers > 1 else "in one process"
    rate = summary.cases / summary.seconds
    words = [
        f"{summary.path}: {summary.cases:,} cases in {summary.seconds:.2f} s {who} "
        f"({rate:,.0f} impacts/s)"
    ]
    if summary.first_refused is not None:
        row, reason = summary.first_refused
        words.append(
            f"Refused by the FMU: {summary.refused:,} cases, their outputs are empty; the first is "
            f"row {row:,}: {reason}"
        )
    return words


def _compared(study: Study, fmu: Path, stop: threading.Event) -> list[str]:
    from golf_scenarios.sweeps.comparison import compare

    def tick() -> None:
        if stop.is_set():
            raise Stopped(study.cases, written=True)

    with _err.status("comparing with fmpy.simulate_fmu"):
        found = compare(study, fmu, tick=tick)
    same = "the same numbers to the last bit" if found.same else "OTHER NUMBERS"
    words = [
        f"In turns, on the same cases and outputs, both written to CSV: {found.sweep:,.0f} "
        f"impacts/s in one process, {found.simulate_fmu:,.0f} by a loop over fmpy.simulate_fmu "
        f"(FMU extracted and description read beforehand, one step): {found.ratio:.0f} times the "
        f"rate, {same}."
    ]
    for line in words:
        _out.print(line, soft_wrap=True, highlight=False)
    if not found.same:
        raise UserError("the sweep and fmpy.simulate_fmu disagree: rebuild the FMU")
    return words


def _outcome(study: Study, summary: Summary, words: list[str]) -> Outcome:
    outcome = Outcome(f"Sweep {summary.path.name}", words=list(words))
    rows = [[one.name, _described(one)] for one in study.axes]
    outcome.tables.append(Table("Swept variables (SI units)", ["", "values"], rows))
    usable = summary.drawn[np.isfinite(summary.drawn)]
    if len(usable):
        quantiles = np.percentile(usable, (0, 5, 50, 95, 100))
        outcome.tables.append(
            Table(
                f"{study.outputs[0]} over all cases",
                ["", "least", "5 %", "median", "95 %", "greatest", "mean", "standard deviation"],
                [
                    [
                        study.outputs[0],
                        *(f"{value:.6g}" for value in (*quantiles, usable.mean(), usable.std())),
                    ]
                ],
            )
        )
    return outcome


def _described(axis: Axis) -> str:
    if isinstance(axis, Normal):
        return f"normal, mean {axis.mean:g}, standard deviation {axis.sigma:g}"
    if not isinstance(axis, Grid):
        return f"uniform, {axis.low:g} to {axis.high:g}"
    values = [value if isinstance(value, str) else f"{value:g}" for value in axis.values[:6]]
    if len(axis.values) > len(values):
        return f"{', '.join(values[:3])} … {axis.values[-1]:g} ({len(axis.values):,} values)"
    return ", ".join(values)


def _sensitivity(
    study: Study, summary: Summary, fmu: Path, stop: threading.Event, outcome: Outcome
):
    """How much each distribution matters, if there is one."""
    if not study.distributions:
        return None
    from golf_scenarios.sweeps.impacts import impacts

    def outputs_of(columns: dict[str, np.ndarray]) -> np.ndarray:
        number = len(next(iter(columns.values())))
        parts = []
        with ImpactFmu(fmu) as instance:
            made = plan(study, instance.variables)
            for start in range(0, number, CHUNK):
                if stop.is_set():
                    raise Stopped(study.cases, written=True)
                part = {name: column[start : start + CHUNK] for name, column in columns.items()}
                parts.append(impacts(instance, made, made.values(part)).outputs[:, 0])
        return np.concatenate(parts)

    try:
        from golf_scenarios.sweeps.sensitivity import sensitivity

        found = sensitivity(study, summary.drawn, outputs_of)
    except ImportError:
        outcome.words.append("Sensitivities need SciPy: `pip install 'golf-impact[sweep]'`.")
        return None
    if found is None:
        return None
    outcome.words.append(found.note)
    rows = [[name, f"{value:.4f}"] for name, value in found.values.items()]
    outcome.tables.append(Table(f"What {study.outputs[0]} depends on", ["", found.label], rows))
    return found


def _draw(study: Study, summary: Summary, outcome: Outcome, found, fmu: Path) -> list[Path]:
    """The picture beside the data, and report.html with it."""
    from golf_impact import __version__

    from golf_scenarios.report import figures
    from golf_scenarios.report.writing import report, write_together
    from golf_scenarios.sweeps.pictures import draw

    description = ImpactFmu(fmu)
    files, pictures = {}, {}
    figure = draw(study, summary.drawn, description.variables, found)
    if figure is not None:
        image = io.BytesIO()
        figures.save(figure, image)
        files[summary.path.with_suffix(".png").name] = image.getvalue()
        data = base64.b64encode(image.getvalue()).decode()
        pictures["sweep"] = [{"alt": outcome.title, "data": data}]
    files["report.html"] = report(
        {"sweep": outcome}, pictures, description.description.guid, __version__
    )
    return write_together(summary.path.parent, files)
