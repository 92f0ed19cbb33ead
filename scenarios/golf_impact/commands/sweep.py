"""`golf-impact sweep`: many impacts into one table, a picture and Sobol indices."""

import time
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

from typer import Option

from golf_impact.commands.console import print_table, progress, say, warn
from golf_impact.commands.options import complete_output, pairs_of, set_option, take_conditions
from golf_impact.data.errors import UserError
from golf_impact.data.units import remarks

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


def sweep(
    *,
    set_: Annotated[list[str] | None, set_option(_SET, "VALUES")] = None,
    out: Annotated[Path, Option(metavar="FILE", help="FILE.csv or FILE.parquet.")],
    outputs: Annotated[
        str | None,
        Option(metavar="A,B,C", help="Outputs to read, no others.", autocompletion=complete_output),
    ] = None,
    samples: Annotated[
        int | None, Option(metavar="N", help="Samples of the distributions.")
    ] = None,
    seed: Annotated[int, Option(metavar="N", help="Of the samples.")] = 0,
    method: Annotated[str, Option(metavar="random|lhs|sobol", help=_METHOD)] = "random",
    scheduler: Annotated[str | None, Option(metavar="ADDRESS", help=_CLUSTER)] = None,
    figures: Annotated[bool, Option(help="Write FILE.png.")] = True,
    fmu: Annotated[Path | None, Option(metavar="FILE", help=_FMU)] = None,
) -> None:
    """Run many impacts into one table.

    Each case is a row: swept variables first, then outputs. Of two or more distributions without a
    grid, FILE.json has first-order and total Sobol indices with 95 % intervals.
    """
    from golf_impact.data import files
    from golf_impact.data.quantities import DEFAULT_LAW
    from golf_impact.studies.sweep.cluster import sweep_on_cluster
    from golf_impact.studies.sweep.sweep import OUTPUTS, Design, sobol_indices
    from golf_impact.studies.sweep.table import write_table

    if out.suffix.lower() not in (".csv", ".parquet"):
        raise UserError(f"--out {out} is refused: give --out FILE.csv or FILE.parquet")
    if fmu is not None and scheduler is not None:
        raise UserError("an FMU runs in this process: leave out --fmu or --scheduler")
    sets = pairs_of(set_ or [], "NAME=VALUES, e.g. --set k=0.5e6:2e6:100")
    names = OUTPUTS if outputs is None else map(str.strip, outputs.split(","))
    design = Design(sets, names, samples, seed, method)
    with_indices = len(design.distributions) > 1 and design.cases == design.shape[-1]
    # On a cluster it is a folder.
    kinds = {out.suffix: scheduler is None, ".json": with_indices, ".png": figures}
    for suffix in (suffix for suffix, wanted in kinds.items() if wanted):
        files.check(out.with_suffix(suffix))
    written, indices = [out], {}
    with ExitStack() as stack:
        if fmu is not None:
            from golf_impact.fmu import Impact

            design.impacts = stack.enter_context(Impact(fmu)).many
        balls = design.balls.values()
        take_conditions(balls, design.axes)
        ends = [{name: values[n]} for name, values in design.grid.items() for n in (0, -1)]
        ends += [{name: axis.mean()} for name, axis in design.distributions.items()]
        for words in dict.fromkeys(words for end in ends for words in remarks(end)):
            warn(words, style="yellow")
        if not any("law" in named for named in (design.axes, *(one.values for one in balls))):
            say(DEFAULT_LAW)
        start = time.perf_counter()
        move = stack.enter_context(progress("sweep", design.cases))
        if scheduler is None:
            refused = write_table(out, design, range(design.cases), move)
        else:
            refused = sweep_on_cluster(scheduler, out, design, move)
        seconds = time.perf_counter() - start
        if with_indices:
            indices = sobol_indices(design)
            written.append(files.write(out.with_suffix(".json"), files.as_json(indices)))
        if figures:
            from golf_impact.studies.sweep.picture import picture

            if image := picture(design, indices):
                written.append(files.write(out.with_suffix(".png"), image))
    cases = f"{design.cases:,} case{'s' * (design.cases != 1)}"
    # The time of a few is that of the start.
    rate = f" ({design.cases / seconds:,.0f} impacts/s)" if design.cases >= 1000 else ""
    say(f"{cases} in {seconds:.2f} s{rate}")
    if number := sum(count for count, _ in refused):
        first = next(first for count, first in refused if count)
        say(f"Refused: {number:,} of them; the first is {first}")
    if indices:
        rows = [
            [output, kind.replace("_", " "), *(_with_interval(*index) for index in of.values())]
            for output in design.outputs
            for kind, of in ((kind, indices[kind][output]) for kind in ("first_order", "total"))
        ]
        print_table("Sobol indices, 95 %", ["", "", *design.distributions], rows)
    say(f"Written: {', '.join(map(str, written))}")


def _with_interval(value: float, low: float, high: float) -> str:
    return f"{value:.3f} ± {0.5 * (high - low):.3f}" if value == value else "–"
