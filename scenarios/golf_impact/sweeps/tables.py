"""Tables of a sweep as CSV and Parquet: the same bytes in whatever pieces they are written."""

import io
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from golf_build.archive import whole
from golf_impact.errors import UserError, missing_package
from golf_impact.runs import FLAGS
from golf_impact.sweeps.study import Columns

#: Writes columns, with which cases are refused, and lines of CSV (unused in other files).
Write = Callable[[Columns, np.ndarray, bytes], object]

#: Rows of a Parquet row group: independent of chunks, so that the file is too.
_ROW_GROUP = 2**16


def csv_lines(columns: Columns, refused: np.ndarray) -> bytes:
    """Lines of CSV: doubles as Python's `repr`, with all digits; Booleans as 0 and 1."""
    try:
        import pyarrow
        from pyarrow import csv
    except ImportError:  # not there, or built for another NumPy
        return plain_lines(columns, refused)
    if any(name != _quoted(name) for name in {*columns.get("ball", ())}):
        return plain_lines(columns, refused)
    table = pyarrow.table([_arrow_cells(c, refused) for c in columns.values()], list(columns))
    stream = io.BytesIO()
    options = csv.WriteOptions(include_header=False, quoting_style="none", batch_size=2**14)
    csv.write_csv(table, stream, options)
    return stream.getvalue()


def _arrow_cells(column: np.ndarray, refused: np.ndarray) -> Any:
    """A column that pyarrow writes as `plain_lines` does."""
    import pyarrow
    from pyarrow import compute

    if column.dtype == bool:
        return pyarrow.array(column.astype(int), mask=refused)
    if column.dtype != float:
        return pyarrow.array(column)
    size, without = np.abs(column), np.isnan(column)
    array = pyarrow.array(column, mask=without)
    # Of other doubles pyarrow writes the same digits, but 1 and 1e-7 instead of 1.0 and 1e-07.
    other = ~((size >= 1e-4) & (size < 1e10) & (column != np.trunc(column)) | without)
    if not other.any():
        return array
    # As bits, by which -0.0 and 0.0 differ.
    values, index = np.unique(column[other].view(np.int64), return_inverse=True)
    texts = pyarrow.array(map(repr, values.view(float).tolist()), pyarrow.string()).take(index)
    return compute.replace_with_mask(array.cast(pyarrow.string()), other, texts)


def plain_lines(columns: Columns, refused: np.ndarray) -> bytes:
    """The same without pyarrow."""
    rows: list[list[str]] = []
    for column in columns.values():
        values = (column.astype(int) if column.dtype == bool else column).tolist()
        rows.append(list(map(_quoted if column.dtype == object else repr, values)))
        for n in np.flatnonzero(refused if column.dtype == bool else column != column).tolist():
            rows[-1][n] = ""
    return ("\n".join(map(",".join, zip(*rows))) + "\n").encode()


def _quoted(name: str) -> str:
    """The name of a ball, in quotation marks if it needs them."""
    return '"' + name.replace('"', '""') + '"' if {*name} & {*'",\r\n'} else name


@contextmanager
def table(path: Path, names: Sequence[str]) -> Iterator[Write]:
    """Write the file in a `with` block; afterwards it is complete, or as it was.

    Yields a function that writes some cases. UserError: it can't be written.
    """
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".parquet"):
        raise UserError(f"--out {path} is refused: its name must end in .csv or .parquet")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as stream:
            if suffix == ".csv":
                stream.write((",".join(names) + "\n").encode())
                yield lambda columns, refused, lines: stream.write(lines)
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

    def write(columns: Columns, refused: np.ndarray, lines: bytes) -> None:
        nonlocal rows
        arrays = [
            pyarrow.array(c, schema.field(n).type, mask=refused if c.dtype == bool else c != c)
            for n, c in columns.items()
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
