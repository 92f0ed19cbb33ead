"""`golf-impact sweep`: many impacts into one table, a picture and Sobol indices."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from golf_impact.commands.console import print_table, progress, say, warn
from golf_impact.commands.options import (
    complete_output,
    complete_setting,
    pairs_of,
    take_conditions,
)
from golf_impact.data.errors import UserError

if TYPE_CHECKING:
    import numpy as np

    from golf_impact.studies.sweep.sweep import Design

EPILOG = (
    "Examples: golf-impact sweep --set k=0.5e6:2e6:100 --out k.csv · golf-impact sweep "
    "--set k=log:1e5:1e7:50 --set b=0,9,12 --out k_b.parquet · golf-impact sweep "
    "--set k=normal:1e6:3e4 --samples 1000 --out samples.csv"
)
_SET = (
    "LO:HI:COUNT, log:LO:HI:COUNT, A,B,C, normal:MEAN:SIGMA or uniform:LO:HI, for an input or "
    "parameter or `ball`; repeatable, the last one varies fastest."
)
_METHOD = "How samples are drawn; sobol is a Sobol sequence, lhs a Latin hypercube."
_CLUSTER = "Compute on a Dask cluster, tcp://HOST:PORT, into the folder FILE.parquet."
_FMU = "Run the cases through this .fmu file, one after another."

_Number = int | None
_Text = str | None


def sweep(
    set_: Annotated[
        list[str] | None,
        Option("--set", metavar="NAME=VALUES", help=_SET, autocompletion=complete_setting),
    ] = None,
    out: Annotated[Path | None, Option(metavar="FILE", help="FILE.csv or FILE.parquet.")] = None,
    outputs: Annotated[
        _Text,
        Option(metavar="A,B,C", help="Outputs to read, no others.", autocompletion=complete_output),
    ] = None,
    samples: Annotated[_Number, Option(metavar="N", help="Samples of the distributions.")] = None,
    seed: Annotated[int, Option(metavar="N", help="Of the samples.")] = 0,
    method: Annotated[str, Option(metavar="random|lhs|sobol", help=_METHOD)] = "random",
    scheduler: Annotated[_Text, Option(metavar="ADDRESS", help=_CLUSTER)] = None,
    figures: Annotated[bool, Option(help="Write FILE.png.")] = True,
    fmu: Annotated[Path | None, Option(metavar="FILE", help=_FMU)] = None,
) -> None:
    """Run many impacts into one table.

    Each case is a row: swept variables first, then outputs. Of two or more distributions without a
    grid, FILE.json has first-order and total Sobol indices with 95 % intervals.
    """
    from golf_impact.data import files
    from golf_impact.data.balls import ball
    from golf_impact.data.quantities import DEFAULT_LAW
    from golf_impact.data.units import remarks
    from golf_impact.studies.sweep.sweep import OUTPUTS, Design, sobol_indices
    from golf_impact.studies.sweep.table import write_table

    if out is None:
        raise UserError("no output file: give --out FILE.csv or FILE.parquet")
    if fmu is not None and scheduler is not None:
        raise UserError("an FMU runs in this process: leave out --fmu or --scheduler")
    sets = pairs_of(set_ or [], "NAME=VALUES, e.g. --set k=0.5e6:2e6:100")
    names = OUTPUTS if outputs is None else tuple(map(str.strip, outputs.split(",")))
    if out.suffix.lower() not in (".csv", ".parquet"):
        raise UserError(f"--out {out} is refused: its name must end in .csv or .parquet")
    design = Design(sets, names, samples, seed, method)
    take_conditions(map(ball, design.grid.get("ball", ())), design.axes)
    ends = [{name: values[n]} for name, values in design.grid.items() for n in (0, -1)]
    ends += [{name: axis.mean()} for name, axis in design.distributions.items()]
    for words in dict.fromkeys(words for end in ends for words in remarks(end)):
        warn(words, style="yellow")
    if "law" not in design.values({name: x[:1] for name, x in design.grid.items()}):
        say(DEFAULT_LAW)
    with_indices = len(design.distributions) > 1 and design.cases == design.shape[-1]
    # On a cluster it is a folder.
    kinds = ((out.suffix, scheduler is None), (".json", with_indices), (".png", figures))
    for suffix, wanted in kinds:
        if wanted:
            files.check(out.with_suffix(suffix))
    with ExitStack() as stack:
        impact = None
        if fmu is not None:
            from golf_impact.fmu import Impact

            impact = stack.enter_context(Impact(fmu))
        move = stack.enter_context(progress("sweep", design.cases))
        start = time.perf_counter()
        if scheduler is None:
            summary = write_table(out, design, range(design.cases), impact, move)
        else:
            from golf_impact.studies.sweep.cluster import sweep_on_cluster

            summary = sweep_on_cluster(scheduler, out, design, move)
        seconds = time.perf_counter() - start
        written, indices = [out], {}
        if with_indices:
            indices = sobol_indices(design, impact)
            written.append(files.write(out.with_suffix(".json"), files.as_json(indices)))
    if figures and (picture := _picture(design, summary.drawn, indices)):
        written.append(files.write(out.with_suffix(".png"), picture))
    cases = f"{design.cases:,} case{'s' * (design.cases != 1)}"
    # The time of a few is that of the start.
    rate = f" ({design.cases / seconds:,.0f} impacts/s)" if design.cases >= 1000 else ""
    say(f"{cases} in {seconds:.2f} s{rate}")
    if summary.first is not None:
        row, reason = summary.first
        say(f"Refused: {summary.refused:,} of them; the first is row {row:,}: {reason}")
    if indices:
        print_table(*_table(indices))
    say(f"Written: {', '.join(map(str, written))}")


def _table(indices: Mapping[str, Any]) -> tuple[str, list[str], list[list[str]]]:
    """Sobol indices: title, columns, rows."""
    rows = [
        [output, kind.replace("_", " "), *(_with_interval(*index) for index in of.values())]
        for output in indices["total"]
        for kind, of in ((kind, indices[kind][output]) for kind in ("first_order", "total"))
    ]
    variables = [*next(iter(indices["total"].values()))]
    return "Sobol indices, 95 %", ["", "", *variables], rows


def _with_interval(value: float, low: float, high: float) -> str:
    return f"{value:.3f} ± {0.5 * (high - low):.3f}" if value == value else "–"


def _picture(design: Design, drawn: np.ndarray, indices: Mapping[str, Any]) -> bytes:
    """A PNG image; empty if there are fewer than two values."""
    import numpy as np

    from golf_impact.report.results import plotting, png
    from golf_impact.studies.sweep.picture import draw, draw_indices

    if np.isfinite(drawn).sum() < 2:
        return b""
    with plotting():
        import matplotlib.pyplot as plt

        count = 2 if indices else 1
        figure, places = plt.subplots(1, count, squeeze=False)
        figure.set_figwidth(count * figure.get_figwidth())
        draw(design, drawn, places[0, 0])
        if indices:
            draw_indices(indices, places[0, 1])
        return png(figure)
