"""The file of a sweep: written aside while it grows, given its name when it is whole."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from golf_build.archive import whole
from golf_impact.errors import UserError, missing_package
from golf_impact.sweeps.impacts import Plan
from golf_impact.sweeps.study import Study

#: Rows of a Parquet row group: independent of chunks, so that the file is too.
_ROW_GROUP = 2**16

#: Writes some cases: swept variables by name, arrays of shape (cases,); the cases as lines of CSV;
#: outputs, shape (cases, outputs).
Write = Callable[[Mapping[str, np.ndarray], bytes, np.ndarray], object]


@contextmanager
def _csv(stream: BinaryIO, study: Study, plan: Plan) -> Iterator[Write]:
    """Lines of text; cells of outputs without a value are empty."""
    stream.write((",".join((*study.names, *plan.outputs)) + "\n").encode())
    yield lambda columns, text, outputs: stream.write(text)


@contextmanager
def _parquet(stream: BinaryIO, study: Study, plan: Plan) -> Iterator[Write]:
    """Columns in row groups of one size; outputs without a value are null."""
    try:
        import pyarrow
        from pyarrow.parquet import ParquetWriter
    except ImportError as error:
        raise missing_package("Parquet", "pyarrow", "sweep", ", or name a .csv file") from error
    kinds = {"ball": pyarrow.string(), "law": pyarrow.int64()}
    kinds |= dict.fromkeys(plan.booleans, pyarrow.bool_())
    names = (*study.names, *plan.outputs)
    schema = pyarrow.schema([(name, kinds.get(name, pyarrow.float64())) for name in names])
    waiting, rows = [schema.empty_table()], 0

    def write_group() -> None:
        nonlocal waiting, rows
        table = pyarrow.concat_tables(waiting)
        waiting, rows = [table.slice(_ROW_GROUP)], max(0, rows - _ROW_GROUP)
        writer.write_table(table.slice(0, _ROW_GROUP).combine_chunks(), row_group_size=_ROW_GROUP)

    def write(columns: Mapping[str, np.ndarray], text: bytes, outputs: np.ndarray) -> None:
        nonlocal rows
        arrays = [pyarrow.array(column) for column in columns.values()]
        arrays += [pyarrow.array(column, mask=np.isnan(column)) for column in outputs.T]
        waiting.append(pyarrow.table(arrays, names=names).cast(schema))
        rows += len(outputs)
        if rows >= _ROW_GROUP:
            write_group()

    with ParquetWriter(stream, schema) as writer:
        yield write
        if rows:
            write_group()
    # What comes after needs memory, too.
    pyarrow.default_memory_pool().release_unused()


@contextmanager
def table_file(path: Path, study: Study, plan: Plan) -> Iterator[Write]:
    """What writes the file, for a `with` block: whole under its name then, or not there.

    UserError if the file can't be written.
    """
    open_table = {".csv": _csv, ".parquet": _parquet}.get(path.suffix.lower())
    if open_table is None:
        raise UserError(f"--out {path} is refused: its name must end in .csv or .parquet")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as stream, open_table(stream, study, plan) as write:
            yield write
    except OSError as error:
        raise UserError(
            f"can't write {path}: {error.strerror or error}; a file there stays as it was"
        ) from error
