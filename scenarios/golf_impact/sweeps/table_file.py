"""The file of a sweep: written aside while it grows, given its name when it is whole."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from golf_build.archive import plain, whole
from golf_impact.errors import UserError, missing_package
from golf_impact.sweeps.chunk import Chunk
from golf_impact.sweeps.impacts import Plan
from golf_impact.sweeps.study import Study

#: Rows of a Parquet row group: independent of chunks, so that the file is too.
_ROW_GROUP = 2**16


class Csv:
    """Lines of text; cells of outputs without a value are empty."""

    as_text = True

    def __init__(self, stream: Any, study: Study, plan: Plan) -> None:
        self._stream = stream
        stream.write((",".join((*study.names, *plan.outputs)) + "\n").encode())

    def write(self, columns: Mapping[str, np.ndarray], chunk: Chunk) -> None:
        self._stream.write(chunk.text)

    def finish(self) -> None:
        """Nothing is left."""


class Parquet:
    """Columns in row groups of one size; outputs without a value are null."""

    as_text = False

    def __init__(self, stream: Any, study: Study, plan: Plan) -> None:
        try:
            import pyarrow
            import pyarrow.parquet
        except ImportError as error:
            raise missing_package("Parquet", "pyarrow", "sweep", ", or name a .csv file") from error
        self._arrow = pyarrow
        kinds = {"ball": pyarrow.string(), "law": pyarrow.int64()}
        kinds |= dict.fromkeys(plan.booleans, pyarrow.bool_())
        names = (*study.names, *plan.outputs)
        self._schema = pyarrow.schema(
            [(name, kinds.get(name, pyarrow.float64())) for name in names]
        )
        self._writer = pyarrow.parquet.ParquetWriter(stream, self._schema)
        self._waiting: list[Any] = []
        self._rows = 0

    def write(self, columns: Mapping[str, np.ndarray], chunk: Chunk) -> None:
        arrays = [self._arrow.array(column) for column in columns.values()]
        outputs = chunk.results.outputs
        arrays += [self._arrow.array(column, mask=np.isnan(column)) for column in outputs.T]
        table = self._arrow.table(arrays, names=self._schema.names)
        self._waiting.append(table.cast(self._schema))
        self._rows += len(outputs)
        while self._rows >= _ROW_GROUP:
            self._write_group()

    def finish(self) -> None:
        """Write the last row group and the footer."""
        if self._rows:
            self._write_group()
        self._writer.close()
        # What comes after wants memory too.
        self._arrow.default_memory_pool().release_unused()

    def _write_group(self) -> None:
        """The first rows that wait, as many as a group has; the rest goes on waiting."""
        table = self._arrow.concat_tables(self._waiting)
        group, rest = table.slice(0, _ROW_GROUP), table.slice(_ROW_GROUP)
        self._waiting, self._rows = [rest], rest.num_rows
        self._writer.write_table(group.combine_chunks(), row_group_size=_ROW_GROUP)


#: What writes a file, by its suffix.
_FORMATS: dict[str, type[Csv] | type[Parquet]] = {".csv": Csv, ".parquet": Parquet}


@contextmanager
def table_file(path: Path, study: Study, plan: Plan) -> Iterator[Csv | Parquet]:
    """What writes the file, for a `with` block: whole under its name then, or not there.

    UserError if the file can't be written; `check_path` checks it beforehand.
    """
    try:
        with whole(path) as stream:
            table = _FORMATS[path.suffix.lower()](stream, study, plan)
            yield table
            table.finish()
    except OSError as error:
        raise UserError(
            f"can't write {path}: {error.strerror or error}; a file there stays as it was"
        ) from error


def check_path(path: Path) -> None:
    """UserError, before anything is computed, if this file can't be written."""
    if path.suffix.lower() not in _FORMATS:
        raise UserError(
            f"--out {path} is refused: the name of the file must end in {' or '.join(_FORMATS)}"
        )
    if path.is_dir():
        raise UserError(f"--out {path} is a folder; give the name of a file in it")
    if not path.parent.is_dir():
        raise UserError(f"can't write {path}: there is no folder {path.parent}; make it first")
    try:
        plain(path)
    except OSError as error:
        raise UserError(f"can't write {path}: {error.strerror}") from error
    if path.exists() and not os.access(path, os.W_OK):
        raise UserError(f"can't write {path}: it is write-protected")
