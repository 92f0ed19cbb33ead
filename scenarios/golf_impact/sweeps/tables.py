"""Tables of a sweep as CSV and Parquet: the same bytes in whatever pieces they are written."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from golf_build.archive import whole
from golf_impact.errors import UserError, missing_package
from golf_impact.runs import FLAGS

#: Columns by name, those of doubles with NaN where there is no value; and which cases are refused.
Cells = Mapping[str, np.ndarray]
Write = Callable[[Cells, np.ndarray, bytes], object]

#: Rows of a Parquet row group: independent of chunks, so that the file is too.
_ROW_GROUP = 2**16


def csv_lines(cells: Cells, refused: np.ndarray) -> bytes:
    """Lines of CSV: doubles as Python's `repr`, with all digits; Booleans as 0 and 1."""
    try:
        import pyarrow
        from pyarrow import csv as arrow
    except ImportError:
        return plain_lines(cells, refused)
    columns = []
    for name, column in cells.items():
        if column.dtype == object:
            if any(character in ball for ball in set(column) for character in '",\r\n'):
                return plain_lines(cells, refused)
            columns.append(pyarrow.array(column, pyarrow.string()))
        elif name in FLAGS:
            columns.append(pyarrow.array(column.astype(np.int64), mask=refused))
        elif column.dtype == np.int64:
            columns.append(pyarrow.array(column))
        else:
            columns.append(_doubles(pyarrow, column))
    stream = io.BytesIO()
    options = arrow.WriteOptions(include_header=False, quoting_style="none", batch_size=2**14)
    arrow.write_csv(pyarrow.table(columns, list(cells)), stream, options)
    return stream.getvalue()


def _doubles(pyarrow: Any, column: np.ndarray) -> Any:
    """A column that pyarrow writes as `repr` does, null where it is NaN."""
    size, without = np.abs(column), np.isnan(column)
    # Of other numbers pyarrow writes the same digits, but 1 and 1e-7 instead of 1.0 and 1e-07.
    alike = (size >= 1e-4) & (size < 1e10) & (column != np.trunc(column))
    array = pyarrow.array(column, mask=without)
    other = ~(alike | without)
    if not other.any():
        return array
    values, index = np.unique(column[other].view(np.int64), return_inverse=True)
    texts = pyarrow.array(map(repr, values.view(float).tolist()), pyarrow.string())
    if other.all():
        return texts.take(pyarrow.array(index))
    from pyarrow import compute

    array = array.cast(pyarrow.string())
    return compute.replace_with_mask(array, pyarrow.array(other), texts.take(pyarrow.array(index)))


def plain_lines(cells: Cells, refused: np.ndarray) -> bytes:
    rows: list[list[Any]] = []
    for name, column in cells.items():
        values = (column.astype(int) if name in FLAGS else column).tolist()
        rows.append(list(map(repr, values)) if column.dtype != object else values)
        for n in np.flatnonzero(refused if name in FLAGS else column != column).tolist():
            rows[-1][n] = ""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(zip(*rows))
    return stream.getvalue().encode()


@contextmanager
def table(path: Path, names: Sequence[str]) -> Iterator[Write]:
    """Write the file in a `with` block; afterwards it is complete, or as it was.

    Yields a function that writes some cases: columns by name, which cases are refused, and lines of
    CSV (unused in other files). UserError: it can't be written.
    """
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".parquet"):
        raise UserError(f"--out {path} is refused: its name must end in .csv or .parquet")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as stream:
            if suffix == ".csv":
                stream.write((",".join(names) + "\n").encode())
                yield lambda cells, refused, lines: stream.write(lines)
            else:
                with _parquet(stream, names) as write:
                    yield write
    except OSError as error:
        raise UserError(
            f"can't write {path}: {error.strerror or error}; a file there stays as it was"
        ) from error


@contextmanager
def _parquet(stream: BinaryIO, names: Sequence[str]) -> Iterator[Write]:
    """Columns in row groups of one size; outputs without a value are null."""
    try:
        import pyarrow
        from pyarrow.parquet import ParquetWriter
    except ImportError as error:
        raise missing_package("Parquet", "pyarrow", "sweep", ", or name a .csv file") from error
    kinds = {"ball": pyarrow.string(), "law": pyarrow.int64()}
    kinds |= dict.fromkeys(FLAGS, pyarrow.bool_())
    schema = pyarrow.schema([(name, kinds.get(name, pyarrow.float64())) for name in names])
    waiting, rows = [schema.empty_table()], 0

    def write(cells: Cells, refused: np.ndarray, lines: bytes) -> None:
        nonlocal rows
        arrays = [
            pyarrow.array(c, schema.field(n).type, mask=refused if n in FLAGS else c != c)
            for n, c in cells.items()
        ]
        waiting.append(pyarrow.table(arrays, schema=schema))
        rows += len(refused)
        while rows >= _ROW_GROUP:
            write_group()

    def write_group() -> None:
        nonlocal waiting, rows
        table = pyarrow.concat_tables(waiting)
        waiting, rows = [table.slice(_ROW_GROUP)], max(0, rows - _ROW_GROUP)
        writer.write_table(table.slice(0, _ROW_GROUP).combine_chunks(), row_group_size=_ROW_GROUP)

    # Doubles of outputs hardly ever repeat: dictionaries of them would cost most of the time.
    with ParquetWriter(stream, schema, use_dictionary=["ball"]) as writer:
        yield write
        if rows:
            write_group()
    # Later steps need the memory.
    pyarrow.default_memory_pool().release_unused()
