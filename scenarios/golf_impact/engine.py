"""The physics in C (fmu_src/native) as WebAssembly, by wasmtime: rows of impacts, and one in time.

Rows are shared out to threads, each with a memory of its own. A row's results don't depend on other
rows: they have the same bits for any number of threads.
"""

from __future__ import annotations

import atexit
import os
import sys
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from golf_physics.variables import BY_NAME

from golf_build.sources import digest
from golf_impact.data.errors import UnavailableError, UserError, first_line, refusal, refused
from golf_impact.data.quantities import START

#: As in rows.c: the most rows, or instants, of a call; how a row ends.
_ROWS = 4096
REFUSED, NOT_TOUCHED, TOUCHED, SEPARATED = range(4)

#: Fewer rows than these aren't worth another thread.
_FEW = 32

#: After the refusal of a law.
_OTHER_LAWS = (
    "; a law of one's own runs in the plain FMU (golf-impact run --set law=3, golf_impact.Impact)"
)

_OUTPUTS = sum(row.causality == "output" for row in BY_NAME.values())

#: The memory that rows.c shares. The last column of the values has instants.
_SPACE = np.dtype([
    ("values", float, (len(START) + 1, _ROWS)), ("results", float, (_OUTPUTS, _ROWS)),
    ("read", np.uint32, _OUTPUTS), ("ends", np.uint8, _ROWS), ("count", np.int32),
    ("outputs", np.int32),
], align=True)  # fmt: skip

#: The column of each value, and its start value.
_PLACES = {name: place for place, name in enumerate(START)}
_STARTS = np.array([[value] for value in START.values()])


def run_rows(
    outputs: Sequence[str], columns: Mapping[str, Any], number: int, threads: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Outputs of impacts, and how each ends; see `golf_impact.run_impacts`.

    Args:
        outputs: names.
        columns: inputs and parameters by name (SI units; start values for the others), numbers or
            arrays of shape (number,).
        number: how many impacts.
        threads: at most so many; by default `GOLF_IMPACT_THREADS` or all processors.

    Returns:
        Arrays of shape (outputs, number), NaN where a row is refused, and (number,).

    Raises:
        UserError: wasmtime can't be used here, or that isn't a number of threads.
    """
    most = number_of_threads(threads)
    found, ends = np.empty((len(outputs), number)), np.empty(number, np.uint8)
    size = min(_ROWS, max(_FEW, -(-number // (4 * most))))
    begins = range(0, number, size)
    pending = iter(begins)

    def work(_: int) -> None:
        with _borrowed() as engine:
            engine.prepare(outputs, columns, min(size, number))
            for begin in pending:
                part = slice(begin, min(begin + size, number))
                found[:, part], ends[part] = engine.run(columns, part)

    workers = min(most, len(begins))
    if workers < 2:
        work(0)
        return found, ends
    with ThreadPoolExecutor(workers) as executor:
        try:
            list(executor.map(work, range(workers)))
        finally:
            # After an interrupt threads end with their present rows.
            deque(pending, 0)
    return found, ends


def run_instants(
    outputs: Sequence[str], values: Mapping[str, float], instants: np.ndarray
) -> np.ndarray:
    """Outputs of one impact, of shape (outputs, instants); see `golf_impact.run_trajectory`.

    Args:
        outputs: names.
        values: inputs and parameters by name (SI units; start values for the others).
        instants: communication points, s since the start, that rise.

    Raises:
        UserError: wasmtime can't be used here, or the impact is refused.
    """
    found, reached = np.empty((len(outputs), len(instants))), 0.0
    with _borrowed() as engine:
        engine.prepare(outputs, values, 1)
        engine.check("begin", values, max(instants, default=0.0))
        for begin in range(0, len(instants), _ROWS):
            part = instants[begin : begin + _ROWS]
            engine.space["values"][-1, : len(part)] = part
            engine.space["count"] = len(part)
            engine.check("instants", values, reached)
            found[:, begin : begin + _ROWS] = engine.space["results"][: len(outputs), : len(part)]
            reached = part[-1]
    return found


def check_impact(values: Mapping[str, float]) -> None:
    """UserError: why this impact is refused."""
    with _borrowed() as engine:
        engine.prepare((), values, 1)
        engine.check("explain", values, 0)


def number_of_threads(given: int | None = None) -> int:
    """The given one, or that of `GOLF_IMPACT_THREADS`, or of all processors."""
    name = "GOLF_IMPACT_THREADS" if given is None else "threads"
    text = os.environ.get(name, "") if given is None else str(given)
    if not text:
        # Those that this process may use, where that is known.
        return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    if not text.isdecimal() or int(text) < 1:
        raise refused(name, text, "it must be a whole number of at least 1", f"{name} = {text}")
    return int(text)


class _Engine:
    """An instance of physics.wasm; for one thread at a time."""

    def __init__(self) -> None:
        engine, module = _module()
        import wasmtime

        self._store = wasmtime.Store(engine)
        self._exports: Any = wasmtime.Instance(self._store, module, []).exports(self._store)
        self.call("_initialize")
        # It never grows: the engine allocates nothing.
        memory: Any = self._exports["memory"]
        buffer: Any = memory.get_buffer_ptr(self._store)
        self._memory = np.frombuffer(buffer, np.uint8)
        if self.text("token") != digest():
            why = "of other sources than fmu_src/native has: run `python -m golf_build.wasm`"
            raise UserError(f"golf_impact/explore/physics.wasm is {why}")
        begin = self.call("space")
        self.space: Any = self._memory[begin : begin + _SPACE.itemsize].view(_SPACE)[0]

    def call(self, name: str, *arguments: float) -> Any:
        return self._exports[name](self._store, *arguments)

    def text(self, name: str) -> str:
        """The string to which an export points."""
        begin = self.call(name)
        return bytes(self._memory[begin : begin + 4096]).partition(b"\0")[0].decode()

    def prepare(self, outputs: Sequence[str], columns: Mapping[str, Any], number: int) -> None:
        """Set what is the same in all rows, up to so many of them."""
        space = self.space
        space["read"][: len(outputs)] = [BY_NAME[name].reference for name in outputs]
        space["outputs"], space["values"][:-1, :number] = len(outputs), _STARTS
        for name, value in columns.items():
            if not isinstance(value, np.ndarray):
                space["values"][_PLACES[name], :number] = value

    def run(self, columns: Mapping[str, Any], part: slice) -> Any:
        """Results and ends of these rows."""
        space, number = self.space, part.stop - part.start
        for name, value in columns.items():
            if isinstance(value, np.ndarray):
                space["values"][_PLACES[name], :number] = value[part]
        # Arguments in memory: wasmtime takes 5 us for each that a function has.
        space["count"] = number
        self.call("impacts")
        return space["results"][: space["outputs"], :number], space["ends"][:number]

    def check(self, name: str, values: Mapping[str, float], *arguments: float) -> None:
        """Call an export; UserError if it refuses these values."""
        place = self.call(name, *arguments)
        if place < 0:
            return
        sentence, variable = self.text("text"), (*START, "")[place]
        if variable == "law":
            sentence += _OTHER_LAWS
        value = values.get(variable, START.get(variable))
        raise refusal(sentence, variable, value)


_idle: list[_Engine] = []


@contextmanager
def _borrowed() -> Iterator[_Engine]:
    """An engine that no other thread uses."""
    engine = _idle.pop() if _idle else _Engine()
    try:
        yield engine
    finally:
        _idle.append(engine)


@atexit.register
def _free() -> None:
    """wasmtime's objects can't be freed any more while Python's modules go."""
    _idle.clear()
    _module.cache_clear()


@cache
def _module() -> Any:
    """wasmtime's engine, and physics.wasm for it."""
    try:
        import wasmtime
    # Of another platform it has no library; of some it says so by a RuntimeError.
    except (ImportError, OSError, RuntimeError) as error:
        raise UnavailableError(
            f"this needs wasmtime, which can't be loaded ({first_line(error)}): install a wheel of "
            "it for this platform, or use golf_impact.Impact and `golf-impact run`"
        ) from error
    config = wasmtime.Config()
    with suppress(wasmtime.WasmtimeError):
        # Compiled code in the user's cache folder; without one it is compiled in each process.
        config.cache = True
    engine = wasmtime.Engine(config)
    module = wasmtime.Module(engine, (files("golf_impact.explore") / "physics.wasm").read_bytes())
    return engine, module
