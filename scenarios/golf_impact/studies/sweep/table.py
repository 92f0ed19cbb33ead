"""The table of a sweep, as CSV or Parquet."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from golf_build import VERSION
from golf_impact.data.errors import missing_package
from golf_impact.data.files import opened
from golf_impact.data.runs import FLAGS
from golf_impact.data.units import unit_of
from golf_impact.studies.sweep.sweep import CONTACT, Design

if TYPE_CHECKING:
    from golf_impact.fmu import Impact

#: Cases at a time: a bound of the memory.
BLOCK = 100_000

Write = Callable[[Mapping[str, np.ndarray], np.ndarray], object]


class Summary(NamedTuple):
    """What a sweep found."""

    refused: int  #: number of cases that were refused
    first: tuple[int, str] | None  #: row (from 1, without the header) of the first, and why
    drawn: np.ndarray  #: the output of the picture in all cases; NaN without a value

    @classmethod
    def of(cls, parts: Sequence[Summary]) -> Summary:
        """Of parts that follow each other."""
        first = next((part.first for part in parts if part.first), None)
        drawn = np.concatenate([part.drawn for part in parts])
        return cls(sum(part.refused for part in parts), first, drawn)


def write_table(
    path: Path,
    design: Design,
    cases: range,
    impact: Impact | None = None,
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
    parts = []
    with opened(path) as stream, _writer(path.suffix.lower(), stream, design) as write:
        for begin in cases[::BLOCK]:
            end = min(begin + BLOCK, cases.stop)
            table = design.run(design.columns(np.arange(begin, end)), impact)
            refused = table.refused
            write(table, refused)
            first = (begin + int(refused.argmax()) + 1, table.reason) if table.reason else None
            drawn = np.where(refused, np.nan, table[design.drawn])
            parts.append(Summary(int(refused.sum()), first, drawn))
            progress(end - cases.start)
    return Summary.of(parts)


@contextmanager
def _writer(suffix: str, stream: Any, design: Design) -> Iterator[Write]:
    """A function that writes columns by name, and which of the cases are refused."""
    names = (*dict.fromkeys((*design.axes, *CONTACT)), *design.outputs)
    if suffix == ".csv":
        stream.write((",".join(names) + "\n").encode())
    try:
        import pyarrow
        from pyarrow.csv import CSVWriter, WriteOptions
        from pyarrow.parquet import ParquetWriter
    except ImportError as error:
        if suffix == ".parquet":
            raise missing_package("Parquet", "pyarrow", "sweep", ", or name a .csv file") from error
        yield partial(_write_plain, stream)
        return
    # Flags are 0 and 1 in CSV.
    flag = pyarrow.int8() if suffix == ".csv" else pyarrow.bool_()
    types = {"ball": pyarrow.string(), "law": pyarrow.int64(), **dict.fromkeys(FLAGS, flag)}
    fields = [
        pyarrow.field(n, types.get(n, pyarrow.float64()), True, {"unit": unit_of(n)}) for n in names
    ]
    about = {"version": VERSION, "seed": str(design.seed), "method": design.method}
    schema = pyarrow.schema(fields, about)
    if suffix == ".csv":
        quoted = any({*name} & {*'",\r\n'} for name in design.grid.get("ball", ()))
        options = WriteOptions(include_header=False, quoting_style="needed" if quoted else "none")
        writer = CSVWriter(stream, schema, write_options=options)
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


def _write_plain(stream: Any, columns: Mapping[str, np.ndarray], refused: np.ndarray) -> None:
    """Lines of CSV without pyarrow: the same numbers."""
    cells = []
    for column in columns.values():
        values = (column.astype(int) if column.dtype == bool else column).astype(object)
        values[refused if column.dtype == bool else column != column] = None
        cells.append(values.tolist())
    lines = io.StringIO()
    csv.writer(lines, lineterminator="\n").writerows(zip(*cells))
    stream.write(lines.getvalue().encode())
