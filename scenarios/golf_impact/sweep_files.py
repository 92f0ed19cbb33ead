"""The files of a sweep: its table as CSV or Parquet, and a picture of its first output."""

from __future__ import annotations

import csv
import io
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from golf_build import VERSION
from golf_build.archive import whole
from golf_impact.errors import UserError, missing_package
from golf_impact.quantities import format_unit
from golf_impact.runs import FLAGS, ImpactRuns
from golf_impact.sweeps import Design
from golf_impact.units import unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Cases at a time: a bound of the memory.
BLOCK = 100_000

#: Of a picture: more points of a line, or along a side of a map, are invisible; up to so many
#: values of a second variable are lines; variables whose values are names.
_MOST_POINTS, _MOST_SIDE, _FEW, _NAMED = 2000, 200, 7, ("ball", "law")

Write = Callable[[Mapping[str, np.ndarray], np.ndarray], object]


class Summary(NamedTuple):
    """What a sweep found."""

    refused: int  #: number of cases that were refused
    first: tuple[int, str] | None  #: row (from 1, without the header) of the first, and why
    drawn: np.ndarray  #: the first output of all cases; NaN without a value


def check_name(path: Path) -> None:
    """Raise a UserError unless a table of this name can be written."""
    if path.suffix.lower() not in (".csv", ".parquet"):
        raise UserError(f"--out {path} is refused: its name must end in .csv or .parquet")
    if path.suffix.lower() == ".parquet":
        try:
            import pyarrow  # noqa: F401
        except ImportError as error:
            raise missing_package("Parquet", "pyarrow", "sweep", ", or name a .csv file") from error


def write_table(
    path: Path,
    design: Design,
    cases: range,
    impact: ImpactRuns | None = None,
    progress: Callable[[int], object] = lambda done: None,
) -> Summary:
    """Compute cases and write a row for each: the swept variables, then the outputs.

    Args:
        path: a .csv or .parquet file; it gets its name when it is complete.
        design: the sweep.
        cases: their numbers.
        impact: an FMU to compute them through instead of the physics.
        progress: called with the number of cases done.

    Raises:
        UserError: it can't be written; then it is as it was.
    """
    refused, first, drawn = 0, None, []
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as stream, _opened(path.suffix.lower(), stream, design) as write:
            for begin in cases[::BLOCK]:
                columns = design.columns(begin, min(begin + BLOCK, cases.stop))
                found = design.run(columns, impact)
                write({**columns, **found}, found.refused)
                if found.reason and first is None:
                    first = begin + int(found.refused.argmax()) + 1, found.reason
                refused += int(found.refused.sum())
                drawn.append(np.where(found.refused, np.nan, found[design.outputs[0]]))
                progress(min(begin + BLOCK, cases.stop) - cases.start)
    except OSError as error:
        raise UserError(f"can't write {path}: {error.strerror or error}") from error
    return Summary(refused, first, np.concatenate(drawn))


@contextmanager
def _opened(suffix: str, stream: Any, design: Design) -> Iterator[Write]:
    """A function that writes columns by name, and which of the cases are refused."""
    try:
        import pyarrow
        from pyarrow.csv import CSVWriter, WriteOptions
        from pyarrow.parquet import ParquetWriter
    except ImportError:
        with _plain_csv(stream, design) as write:
            yield write
        return
    # Flags are 0 and 1 in CSV.
    flag = pyarrow.int8() if suffix == ".csv" else pyarrow.bool_()
    types = {"ball": pyarrow.string(), "law": pyarrow.int64(), **dict.fromkeys(FLAGS, flag)}
    names = (*design.axes, *design.outputs)
    fields = [
        pyarrow.field(n, types.get(n, pyarrow.float64()), True, {"unit": unit_of(n)}) for n in names
    ]
    about = {"version": VERSION, "seed": str(design.seed), "method": design.method}
    schema = pyarrow.schema(fields, about)
    if suffix == ".csv":
        quoted = any({*name} & {*'",\r\n'} for name in design.grid.get("ball", ()))
        style = "needed" if quoted else "none"
        stream.write((",".join(names) + "\n").encode())
        writer = CSVWriter(
            stream, schema, write_options=WriteOptions(include_header=False, quoting_style=style)
        )
    else:
        # Doubles of outputs hardly ever repeat: dictionaries would cost most of the time.
        writer = ParquetWriter(stream, schema, use_dictionary=["ball"])
    with writer:

        def write(columns: Mapping[str, np.ndarray], refused: np.ndarray) -> None:
            arrays = [
                pyarrow.array(c, mask=refused if c.dtype == bool else c != c).cast(field.type)
                for c, field in zip(columns.values(), schema)
            ]
            writer.write_table(pyarrow.table(arrays, schema=schema))

        yield write


@contextmanager
def _plain_csv(stream: Any, design: Design) -> Iterator[Write]:
    """The same numbers without pyarrow."""
    with io.TextIOWrapper(stream, newline="") as text:
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([*design.axes, *design.outputs])

        def write(columns: Mapping[str, np.ndarray], refused: np.ndarray) -> None:
            cells = []
            for column in columns.values():
                values = column.astype(object if column.dtype != bool else int).astype(object)
                values[refused if column.dtype == bool else column != column] = None
                cells.append(values.tolist())
            writer.writerows(zip(*cells))

        yield write
        text.flush()
        text.detach()


def draw(design: Design, drawn: np.ndarray, axes: Axes) -> None:
    """Plot the first output: a histogram of samples, or over the longest axes lines or a map.

    Of samples at a point of the grid the median is plotted, on lines with a band of 5 to 95 %. Axes
    that aren't plotted stand at their first value.
    """
    output = _label(design.outputs[0])
    grid = {name: values for name, values in design.grid.items() if len(values) > 1}
    if not grid:
        axes.hist(drawn[np.isfinite(drawn)], bins=60)
        axes.set(title=f"{design.cases:,} samples", xlabel=output, ylabel="samples")
        return
    # Along amounts rather than names, of which each is a line.
    along, *others = sorted(grid, key=lambda name: (name in _NAMED, -len(grid[name])))
    by = next((name for name in others if name in _NAMED), others[0] if others else "")
    lines = by in _NAMED or len(grid.get(by, ())) <= _FEW
    most = _MOST_POINTS if lines else _MOST_SIDE
    places = {
        name: np.argsort(grid[name], kind="stable")[:: -(-len(grid[name]) // most)]
        for name in (along, by)
        if name
    }
    index = (places.get(name, [0]) for name in design.grid)
    table = drawn.reshape(design.shape)[np.ix_(*index, range(design.shape[-1]))]
    order = [[*design.grid].index(name) for name in places]
    table = np.moveaxis(table, order, range(len(order)))
    # Of shape (along, by, samples).
    table = table.reshape(len(places[along]), -1, design.shape[-1])
    x = grid[along][places[along]]
    if lines:
        labels = [f"{by} = {value}" for value in grid[by][places[by]]] if by else [""]
        _draw_lines(axes, x.astype(str) if along in _NAMED else x, table, labels)
        axes.set(ylabel=output)
    else:
        image = axes.pcolormesh(
            x, grid[by][places[by]], _quantiles(table, 50)[0].T, rasterized=True
        )
        axes.figure.colorbar(image, label=output)
        axes.set(ylabel=_label(by), yscale=_scale(grid[by]))
    axes.set(title=f"{output} over {along}", xlabel=_label(along), xscale=_scale(grid[along]))


def _draw_lines(axes: Axes, x: np.ndarray, table: np.ndarray, labels: list[str]) -> None:
    low, middle, high = _quantiles(table, 5, 50, 95)
    marker = "o" if len(x) <= _FEW else ""
    for n, label in enumerate(labels):
        (line,) = axes.plot(x, middle[:, n], marker=marker, label=label)
        if table.shape[-1] > 1:
            axes.fill_between(x, low[:, n], high[:, n], color=line.get_color(), alpha=0.2)
    if any(labels):
        axes.legend()


def _quantiles(table: np.ndarray, *percent: float) -> np.ndarray:
    """Of the samples, the last dimension, without those that have no value."""
    if table.shape[-1] == 1:
        return np.stack([table[..., 0]] * len(percent))
    with warnings.catch_warnings():
        # A point where all is refused stays empty.
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.nanpercentile(table, percent, axis=-1)


def _label(name: str) -> str:
    unit = format_unit(unit_of(name))
    return name.replace("_", " ") + (f" ({unit})" if unit else "")


def _scale(values: np.ndarray) -> str:
    """Logarithmic for values at equal ratios."""
    if len(values) < 3 or values.dtype != float or values.min() <= 0.0:
        return "linear"
    steps = np.diff(np.log(values))
    return "log" if np.allclose(steps, steps[0]) else "linear"
