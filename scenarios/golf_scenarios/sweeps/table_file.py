"""The file of a sweep: written aside while it grows, given its name when it is whole."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

import numpy as np

from golf_build.archive import whole
from golf_scenarios.errors import UserError
from golf_scenarios.sweeps.chunk import Chunk, Form
from golf_scenarios.sweeps.plan import Plan
from golf_scenarios.sweeps.study import Study

SUFFIXES = (".csv", ".parquet")

#: Rows of a Parquet row group: independent of chunks, so that the file is too.
_ROW_GROUP = 2**16


class Format(Protocol):
    """A file format."""

    def form(self, plan: Plan) -> Form:
        """What chunks must give for it."""

    def write(self, columns: Mapping[str, np.ndarray], chunk: Chunk) -> None:
        """Append a chunk."""

    def finish(self) -> None:
        """Write what is still to be written."""


class Csv:
    """Lines of text; the cells of a refused case's outputs are empty."""

    def __init__(self, stream: Any, study: Study, plan: Plan) -> None:
        self._stream = stream
        stream.write((",".join((*study.names, *plan.outputs)) + "\n").encode())

    @staticmethod
    def form(plan: Plan) -> Form:
        """Text, and the first output, which is drawn."""
        return Form(as_text=True, kept=(0,))

    def write(self, columns: Mapping[str, np.ndarray], chunk: Chunk) -> None:
        """Append a chunk."""
        self._stream.write(chunk.text)

    def finish(self) -> None:
        """Nothing is left."""


class Parquet:
    """Columns in row groups of one size; the outputs of a refused case are null."""

    def __init__(self, stream: Any, study: Study, plan: Plan) -> None:
        try:
            import pyarrow
            import pyarrow.parquet
        except ImportError as error:
            raise UserError(
                "Parquet needs pyarrow: run `pip install 'golf-impact[sweep]'`, or name a .csv file"
            ) from error
        self._arrow = pyarrow
        kinds = {"ball": pyarrow.string(), "law": pyarrow.int64()}
        kinds |= {name: pyarrow.bool_() for name in plan.booleans}
        self._schema = pyarrow.schema(
            [(n, kinds.get(n, pyarrow.float64())) for n in (*study.names, *plan.outputs)]
        )
        self._names = study.names
        self._outputs = plan.outputs
        self._writer = pyarrow.parquet.ParquetWriter(stream, self._schema)
        self._waiting: list[Any] = []
        self._rows = 0

    @staticmethod
    def form(plan: Plan) -> Form:
        """All outputs as numbers."""
        return Form(as_text=False, kept=tuple(range(len(plan.outputs))))

    def write(self, columns: Mapping[str, np.ndarray], chunk: Chunk) -> None:
        """Append a chunk."""
        refused = np.isnan(chunk.kept).any(axis=1)
        arrays = [self._arrow.array(columns[name]) for name in self._names]
        arrays += [
            self._arrow.array(chunk.kept[:, n], mask=refused) for n in range(len(self._outputs))
        ]
        table = self._arrow.table(arrays, names=[*self._names, *self._outputs])
        self._waiting.append(table.cast(self._schema))
        self._rows += chunk.cases
        while self._rows >= _ROW_GROUP:
            whole = self._arrow.concat_tables(self._waiting)
            self._write(whole.slice(0, _ROW_GROUP))
            rest = whole.slice(_ROW_GROUP)
            self._waiting, self._rows = [rest], rest.num_rows

    def finish(self) -> None:
        """Write the last row group and the footer."""
        if self._rows:
            self._write(self._arrow.concat_tables(self._waiting))
            self._waiting, self._rows = [], 0
        self._writer.close()
        # What comes after wants memory too.
        self._arrow.default_memory_pool().release_unused()

    def _write(self, table: Any) -> None:
        self._writer.write_table(table.combine_chunks(), row_group_size=_ROW_GROUP)


_FORMATS: dict[str, Any] = {".csv": Csv, ".parquet": Parquet}


class TableFile:
    """The file to write, for use in a `with` block: whole under its name, or not there.

    Args:
        path: its suffix chooses the format.
        study: the swept variables are its first columns.
        plan: the outputs are its last ones.

    Raises:
        UserError: the suffix is unknown, or the file can't be written.
    """

    def __init__(self, path: Path, study: Study, plan: Plan) -> None:
        check_path(path)
        self.path = path
        self._study, self._plan = study, plan
        self._stack = ExitStack()

    def __enter__(self) -> TableFile:
        with self._lines(), ExitStack() as stack:
            stream = stack.enter_context(whole(self.path))
            kind = _FORMATS[self.path.suffix.lower()]
            self.format: Format = kind(stream, self._study, self._plan)
            self._stack = stack.pop_all()
        return self

    def write(self, columns: Mapping[str, np.ndarray], chunk: Chunk) -> None:
        """Append a chunk.

        Raises:
            UserError: it can't be written, e.g. because the disk is full.
        """
        with self._lines():
            self.format.write(columns, chunk)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is not None:
            # Closing writes what is buffered, which may fail once more on a full disk.
            with suppress(OSError):
                self._stack.__exit__(kind, error, trace)
            return
        with self._lines(), self._stack:
            self.format.finish()

    @contextmanager
    def _lines(self) -> Iterator[None]:
        """What goes wrong with the file, as one line."""
        try:
            yield
        except OSError as error:
            raise UserError(
                f"can't write {self.path}: {error.strerror or error}; a file there stays as it was"
            ) from error


def check_path(path: Path) -> None:
    """See before anything is computed that this file can be written.

    Raises:
        UserError: it can't.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(
            f"--out {path} is refused: the name of the file must end in {' or '.join(SUFFIXES)}"
        )
    if path.is_dir():
        raise UserError(f"--out {path} is a folder; give the name of a file in it")
    if not path.parent.is_dir():
        raise UserError(f"can't write {path}: there is no folder {path.parent}; make it first")
    if path.exists() and not os.access(path, os.W_OK):
        raise UserError(f"can't write {path}: it is write-protected")
