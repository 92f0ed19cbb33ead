"""`golf-impact sweep`: options to a study, progress, the summary, pictures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Context, Option

from golf_impact.commands.console import err, progress, say, warn
from golf_impact.commands.run import fmu_file, pairs_of, take_conditions
from golf_impact.errors import UserError, missing_package
from golf_impact.stopping import held
from golf_impact.units import remarks

if TYPE_CHECKING:
    from golf_impact.sweeps.run import Summary, Sweep

EPILOG = (
    "Examples: golf-impact sweep --set k=0.5e6:2e6:100 --out k.csv · golf-impact sweep "
    "--set k=log:1e5:1e7:50 --set b=0,9,12 --out k_b.parquet · golf-impact sweep "
    "--set club_speed=normal:45:2 --samples 1000 --out speed.csv"
)
_SET = (
    "LO:HI:COUNT, log:LO:HI:COUNT, A,B,C, normal:MEAN:SIGMA or uniform:LO:HI, for an input or "
    "parameter or `ball`; repeatable, the last one varies fastest."
)
_DESIGN = "Sampling design: independent (if omitted), Latin hypercube, Sobol sequence."
_CHUNK = "Cases at a time; some 0.1 s of work if omitted. Changes no result."
_COMPARE = "Also measure a loop over fmpy.simulate_fmu."
_WORKERS = "Processes, for cases without closed form; 1 if omitted."
_CLUSTER = "Compute on a Dask cluster: tcp://HOST:PORT."
_FMU = "Run the cases through this .fmu file, one after another in this process."

_Number = int | None
_File = Path | None
_Text = str | None


def sweep(
    context: Context,
    file: Annotated[_File, Argument(metavar="STUDY", hidden=True)] = None,
    set_: Annotated[list[str] | None, Option("--set", metavar="NAME=VALUES", help=_SET)] = None,
    out: Annotated[_File, Option(metavar="FILE", help="FILE.csv or FILE.parquet.")] = None,
    outputs: Annotated[_Text, Option(metavar="A,B,C", help="Outputs to read, no others.")] = None,
    samples: Annotated[_Number, Option(metavar="N", help="Samples of the distributions.")] = None,
    seed: Annotated[_Number, Option(metavar="N", help="Of the samples; 0 if omitted.")] = None,
    design: Annotated[_Text, Option(metavar="random|lhs|sobol", help=_DESIGN)] = None,
    workers: Annotated[_Number, Option(metavar="N", help=_WORKERS)] = None,
    chunk: Annotated[_Number, Option(metavar="N", help=_CHUNK)] = None,
    scheduler: Annotated[_Text, Option(metavar="ADDRESS", help=_CLUSTER)] = None,
    compare: Annotated[bool | None, Option("--compare", help=_COMPARE)] = None,
    figures: Annotated[bool | None, Option(help="Write FILE.png and FILE.html.")] = None,
    fmu: Annotated[_File, Option(metavar="FILE", help=_FMU)] = None,
) -> int:
    """Run many impacts into one table.

    Each case is a row: variables first, then outputs. The physics computes them in arrays; one case
    in a thousand is computed again without these. STUDY is a TOML file; options override it.
    """
    from golf_impact.ball import ball
    from golf_impact.files import prepare
    from golf_impact.sweeps.run import Stopped, Sweep
    from golf_impact.sweeps.study import KEYS, Study, read_study

    sets, options = ({}, {}) if file is None else read_study(file)
    sets |= pairs_of(set_ or [], "NAME=VALUES, e.g. --set k=0.5e6:2e6:100")
    # The keys of a study are these options.
    given = {name: value for name, value in context.params.items() if name in KEYS}
    options |= {name: value for name, value in given.items() if value is not None}
    if "out" not in options:
        raise UserError("no output file: give --out FILE.csv or FILE.parquet")
    table = Path(options.pop("out"))
    names = options.pop("outputs", None)
    names = names.split(",") if isinstance(names, str) else names
    sampling = options.pop("seed", 0), options.pop("design", "random")
    study = Study.of(sets, names, options.pop("samples", None), *sampling)
    presets = [one for axis in study.grid if axis.name == "ball" for one in axis.values]
    take_conditions(map(ball, presets), study.names)
    ends = [{axis.name: axis.values[n]} for axis in study.grid for n in (0, -1)]
    ends += [{axis.name: axis.first} for axis in study.distributions]
    for remark in dict.fromkeys(remark for end in ends for remark in remarks(end)):
        warn(remark, style="yellow")
    with_report, with_loop = options.pop("figures", True), options.pop("compare", False)
    if with_report:
        prepare(table.parent, table.with_suffix(".png").name, table.with_suffix(".html").name)
    fmu = options.pop("fmu", None)
    if with_loop:
        compared = fmu_file(fmu)
    with Sweep(study, fmu and fmu_file(fmu)) as running:
        # Ctrl-C and SIGTERM end the sweep between chunks, and the process at the end of this block.
        with held() as is_requested:
            try:
                with progress() as begin:
                    move = begin("sweep", study.cases)
                    summary = running.run(table, progress=move, stop=is_requested, **options)
            except Stopped as stopped:
                state = "is as it was" if table.exists() else "was not written"
                warn(f"{stopped.done:,} of {_cases(study.cases)} were done; {table} {state}.")
                return 130
        words = _describe(summary, options)
        say("\n".join(words))
        if with_loop:
            words.append(_compare(running, compared))
        if with_report:
            say("\n".join(map(str, _write_report(running, summary, words))))
    return 0


def _cases(number: int) -> str:
    return f"{number:,} case{'s' * (number != 1)}"


def _describe(summary: Summary, options: dict[str, Any]) -> list[str]:
    workers, scheduler = options.get("workers", 1), options.get("scheduler")
    who = "in one process" if workers in (None, 1) else f"in {workers} processes"
    if scheduler is not None:
        who = f"on {scheduler}"
    done = f"{summary.path}: {_cases(summary.cases)} in {summary.seconds:.2f} s"
    words = [f"{done} {who} ({summary.cases / summary.seconds:,.0f} impacts/s)"]
    if summary.checked:
        words.append(
            f"Computed again without arrays: {_cases(summary.checked)}, largest error "
            f"{summary.worst_error:.1g}. Not in closed form: {_cases(summary.scalar)}."
        )
    if summary.first_refused is not None:
        row, reason = summary.first_refused
        refused = f"Refused: {_cases(summary.refused)}, whose outputs are empty"
        words.append(f"{refused}; the first is row {row:,}: {reason}")
    return words


def _compare(sweep: Sweep, fmu: Path) -> str:
    from golf_impact.scales import TOLERANCE
    from golf_impact.sweeps.comparison import compare

    with err.status("comparing with fmpy.simulate_fmu"):
        rate, error = compare(sweep, fmu)
    same = error <= TOLERANCE
    words = (
        f"A loop over fmpy.simulate_fmu (FMU extracted and description read beforehand, one step): "
        f"{rate:,.0f} impacts/s, {'the same' if same else 'OTHER'} numbers (largest error "
        f"{error:.1g})."
    )
    say(words)
    if not same:
        raise UserError("the sweep and fmpy.simulate_fmu disagree: run `golf-impact build`")
    return words


def _write_report(sweep: Sweep, summary: Summary, words: list[str]) -> list[Path]:
    import numpy as np

    from golf_impact.files import write_together
    from golf_impact.report.figures import to_png
    from golf_impact.report.page import render_page
    from golf_impact.report.report import Report
    from golf_impact.sweeps.pictures import draw, sobol_indices

    path, name, drawn = summary.path, sweep.study.outputs[0], summary.drawn
    report = Report(f"Sweep {path.name}")
    report.words = words
    rows = [[axis.name, axis.text] for axis in sweep.study.axes]
    report.table("Swept variables (SI units)", ["", "values"], rows)
    usable, indices = drawn[np.isfinite(drawn)], None
    if len(usable):
        columns = ["", "least", "5 %", "median", "95 %", "greatest", "mean", "standard deviation"]
        values = (*np.percentile(usable, (0, 5, 50, 95, 100)), usable.mean(), usable.std())
        row = [name, *(f"{value:.6g}" for value in values)]
        report.table(f"{name} over all cases", columns, [row])
    try:
        indices = sobol_indices(sweep.study, drawn, sweep.first_output)
    except ImportError:
        words.append(f"{missing_package('the table of sensitivities', 'SciPy', 'sweep')}.")
    if indices is not None:
        rows = [[variable, f"{value:.4f}"] for variable, value in indices.items()]
        title = f"Sensitivity of {name}: shares of its variance that each variable explains"
        report.table(title, ["", "first-order Sobol index"], rows)
    figure = draw(sweep.study, drawn, sweep.units, indices)
    images = {} if figure is None else {report.title: to_png(figure)}
    page = render_page({"sweep": report}, {"sweep": images}, sweep.source)
    html, png = (path.with_suffix(suffix).name for suffix in (".html", ".png"))
    files = dict(zip((png,), images.values())) | {html: page}
    # Where there is nothing to draw, a picture of that name shows other data.
    return write_together(path.parent, files, stale={png} - files.keys())
