"""The table of a sweep, as CSV or Parquet."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from golf_build import VERSION
from golf_impact.data.errors import missing_package
from golf_impact.data.files import opened
from golf_impact.data.runs import FLAGS
from golf_impact.data.units import unit_of
from golf_impact.studies.sweep.sweep import CONTACT, Design

#: Cases at a time: a bound of the memory.
BLOCK = 100_000


def write_table(
    path: Path,
    design: Design,
    cases: range,
    progress: Callable[[int], object] = lambda done: None,
) -> list[tuple[int, str]]:
    """Compute cases and write a row for each: swept variables, law, k and b, then outputs.

    Returns how many of each block are refused; and the first: its row (from 1), and why.

    Args:
        path: a .csv or .parquet file; it gets its name when it is complete.
        design: the sweep.
        cases: their numbers.
        progress: called with the number of the last case done.

    Raises:
        UserError: it can't be written; then it is as it was.
    """
    refused = []
    with opened(path) as stream, _writer(path.suffix.lower(), stream, design) as write:
        for begin in cases[::BLOCK]:
            end = min(begin + BLOCK, cases.stop)
            table = design.run(design.columns(np.arange(begin, end)))
            # A flag has no NaN.
            missing = {n: table.refused if c.dtype == bool else c != c for n, c in table.items()}
            write({name: np.ma.array(c, mask=missing[name]) for name, c in table.items()})
            first = f"row {begin + int(table.refused.argmax()) + 1:,}: {table.reason}"
            refused.append((int(table.refused.sum()), first))
            progress(end)
    return refused


@contextmanager
def _writer(
    suffix: str, stream: Any, design: Design
) -> Iterator[Callable[[Mapping[str, Any]], object]]:
    """A function that writes rows, given as masked arrays by name."""
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
        yield partial(_write_csv, stream)
        return
    flag = pyarrow.int8() if suffix == ".csv" else pyarrow.bool_()
    types = {"ball": pyarrow.string(), "law": pyarrow.int64(), **dict.fromkeys(FLAGS, flag)}
    fields = [
        pyarrow.field(n, types.get(n, pyarrow.float64()), True, {"unit": unit_of(n)}) for n in names
    ]
    about = {"version": VERSION, "seed": str(design.seed), "method": design.method}
    schema = pyarrow.schema(fields, about)
    if suffix == ".csv":
        quoted = any({*name} & {*'"\r\n'} for name in design.balls)
        options = WriteOptions(include_header=False, quoting_style="needed" if quoted else "none")
        writer = CSVWriter(stream, schema, write_options=options)
    else:
        # Doubles of outputs hardly ever repeat: dictionaries would cost most of the time.
        writer = ParquetWriter(stream, schema, use_dictionary=["ball"])
    with writer:

        def write(table: Mapping[str, Any]) -> None:
            arrays = [pyarrow.array(table[field.name]).cast(field.type) for field in schema]
            writer.write_table(pyarrow.table(arrays, schema=schema))

        yield write


def _write_csv(stream: Any, table: Mapping[str, Any]) -> None:
    """Write rows without pyarrow; flags are 0 and 1."""
    text = io.StringIO()
    columns = ((c.astype(int) if c.dtype == bool else c).tolist() for c in table.values())
    csv.writer(text, lineterminator="\n").writerows(zip(*columns))
    stream.write(text.getvalue().encode())
