"""Tables as labs and oscilloscopes export them: heads, units, delimiters, decimal commas.

Files of Tektronix (`TIME,CH1`, or rows beside the settings), Keysight (`x-axis,1` above
`second,Volt`) and LeCroy (`Time,Ampl`) are read as they are.
"""

from __future__ import annotations

import csv
import itertools
import re
import warnings
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from golf_impact.errors import UserError
from golf_impact.units import SYMBOLS, symbol_of

#: Names of columns in a header, in small letters, beside the first one, which is ours.
_ALIASES = {"time": {"t", "zeit", "x-axis"}, "force": {"f", "kraft"}, "sigma": {"σ"}}

#: Units in words, and those of a sensor's signal in V.
_WORDS = {"second": "s", "sec": "s", "millisecond": "ms", "newton": "N", "volt": "V"}
_VOLTS = {"V": 1.0, "mV": 1e-3}

#: A name and its unit: `time [ms]`, `force (kN)`, `F/kN`, `t_us`.
_HEAD = re.compile(r"(.*?)\s*(?:\[(.*)\]|\((.*)\)|[/_ ]([^/_ ]+))")

#: A unit with a number before it: `2 kN/V`.
_SIZE = re.compile(r"(\d*\.?\d*(?:[eE][+-]?\d+)?)\s*(.*)")

#: Lines in which a header is searched; rows that must be alike where there is none.
_SEARCHED, _ALIKE = 500, 20


class Head(NamedTuple):
    """Name and unit of a column."""

    name: str  #: in small letters
    unit: str  #: empty if there is none


class Table(NamedTuple):
    """Columns of a file."""

    columns: list[np.ndarray]  #: in the requested order, SI units, (n,)
    path: Path
    lines: Path | list[str]  #: the file, or what was read from a pipe
    first: int  #: the number of the line of the first row, from 0

    def where(self, row: int) -> str:
        """The place of a row (from 0), in words."""
        lines = itertools.islice(_lines(self.lines), self.first, None)
        numbers = (n for n, line in enumerate(lines, self.first + 1) if _data(line))
        return f"{self.path}, row {row + 1} (line {next(itertools.islice(numbers, row, None))})"


def read_table(path: Path, names: Sequence[str], units: Sequence[str], chosen: str = "") -> Table:
    """Columns of these names, the last one optional, in these SI units unless their heads differ.

    Args:
        path: a text file; its other columns may hold anything.
        names: of the columns, in small letters.
        units: their SI units.
        chosen: their heads in the file, or their numbers, with a unit or a sensor's sensitivity:
            "t [ms],F", "TIME [s],CH2 [2 kN/V]", "1 [s],3 [10 mV/N]".

    Raises:
        UserError: it can't be read; the line, the column and what is expected are named.
    """
    with reading(path):
        # A file is read twice, a pipe can't be.
        source = path if path.is_file() else [*_lines(path)]
        lines = [*itertools.islice(_lines(source), _SEARCHED)]
        wanted = [_head(cell) for cell in chosen.split(",")][: len(names)] if chosen else []
        fits = [{one.name} for one in wanted] or [{n, *_ALIASES.get(n, ())} for n in names]
        heads, first, header = _header(lines, fits if wanted else fits[:-1])
        cells = _cells(lines[first]) if first < len(lines) else []
        have = f"its header is {header!r}" if header else "it has no header"
        places, factors = [], []
        for n, (fit, name, unit) in enumerate(zip(fits, names, units)):
            found = [at for at, head in enumerate(heads) if head.name in fit]
            given = wanted[n] if wanted else Head("", "")
            if not found and given.name.isdigit() and 0 < int(given.name) <= len(cells):
                found = [int(given.name) - 1]
            elif not heads and not wanted and len(names) - 1 <= len(cells) <= len(names):
                found = [n] if n < len(cells) else []
            if not found and not wanted and n == len(names) - 1:
                break
            if len(found) != 1:
                what = f"{len(found)} columns" if found else "no column"
                raise UserError(
                    f"{path} is refused: {what} {' or '.join(sorted(fit))}; {have}; expected "
                    f"{','.join(names[:-1])} or {','.join(names)}; choose columns by name or "
                    "number: --columns 'TIME [s],CH2 [2 kN/V]'"
                )
            own = heads[found[0]].unit if heads else ""
            size = _size(given.unit, own, unit)
            if size is None:
                known = ", ".join(one for one, (si, _) in SYMBOLS.items() if si == unit)
                known += ", or a sensor's sensitivity such as 2 kN/V or 10 mV/N" * (unit == "N")
                word = given.unit or own
                raise UserError(f"{path}: the unit {word!r} of {name} is none of {known}; {have}")
            places.append(found[0])
            factors.append(size)
        columns = _numbers(path, source, first, places, names)
        return Table([c * size for c, size in zip(columns, factors)], path, source, first)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Errors of reading this file become a UserError."""
    try:
        yield
    except (OSError, csv.Error) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise UserError(f"can't read {path}: {why}") from error


def read_cells(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and cells of all rows, empty ones left out; UserError if it can't be read."""
    with reading(path):
        return [(n, _cells(line)) for n, line in enumerate(_lines(path), 1) if _data(line)]


def _lines(source: Path | list[str]) -> Iterator[str]:
    if not isinstance(source, Path):
        yield from source
        return
    # Instruments write µ in their own 8 bits.
    with source.open(encoding="utf-8-sig", errors="replace") as file:
        yield from file


def _data(line: str) -> str:
    """A line without its comment; empty if there is nothing in it."""
    line = line.partition("#")[0]
    return line.strip(" \r\n") if line.strip(" \t\r\n;,") else ""


def _mark(line: str) -> str | None:
    return next((one for one in ("\t", ";", ",") if one in line), None)


def _cells(line: str) -> list[str]:
    """Cells of a line; a mark at its end begins none."""
    line = _data(line)
    mark = _mark(line)
    if mark is None:
        return line.split()
    row = [cell.strip() for cell in next(csv.reader([line], delimiter=mark), [])]
    return row[:-1] if row and not row[-1] else row


def _is_number(text: str, mark: str | None) -> bool:
    try:
        float(text if mark == "," else text.replace(",", "."))
    except ValueError:
        return False
    return True


def _numeric(line: str) -> set[int]:
    """The numbers of the columns that hold a number."""
    mark = _mark(_data(line))
    return {n for n, cell in enumerate(_cells(line)) if _is_number(cell, mark)}


def _header(lines: Sequence[str], fits: Sequence[Collection[str]]) -> tuple[list[Head], int, str]:
    """Heads of the columns, if there are any, the first line of data, and the header as written.

    The header is the first line with a name of each of `fits`, or what is above the numbers.
    """
    # It may be a comment.
    texts = [line.strip().lstrip("#%/ ") for line in lines]
    rows = [[_head(cell) for cell in _cells(text)] for text in texts]
    filled = [n for n, row in enumerate(rows) if row]
    names = [{head.name for head in row} for row in rows]
    at = next((n for n in filled if all(not names[n].isdisjoint(fit) for fit in fits)), None)
    first = len(lines)
    if at is None:
        first = next((n for n in filled if _begins_data(lines[n:])), first)
        above = [n for n in filled if n < first][-2:]
        count = len(_cells(lines[first])) if first < len(lines) else 0
        alike = [n for n in above if len(rows[n]) == count]
        if not alike:
            return [], first, texts[above[-1]] if above and not count else ""
        at = alike[0] if len(alike) > 1 and _units(texts[alike[1]]) else alike[-1]
    heads, below = rows[at], [n for n in filled if n > at and _data(lines[n])]
    header = texts[at]
    if below and (units := _units(texts[below[0]])):
        heads = [Head(cell.lower(), unit) for cell, unit in zip(_cells(header), units)]
        header = f"{header} / {texts[below.pop(0)]}"
    return heads, below[0] if below else len(lines), header


def _begins_data(lines: Sequence[str]) -> bool:
    """Whether rows of two numbers or more begin here; beside text they must be alike."""
    numeric = _numeric(lines[0])
    if len(numeric) < 2 or len(numeric) == len(_cells(lines[0])):
        return len(numeric) > 1
    rows = (_numeric(line) for line in itertools.islice(filter(_data, lines), _ALIKE))
    return len(set.intersection(*rows)) > 1


def _head(cell: str) -> Head:
    match = _HEAD.fullmatch(cell.strip())
    if match:
        unit = next(filter(None, match.groups()[1:]), "").strip()
        if match.group(4) is None or symbol_of(unit) in SYMBOLS:
            return Head(match.group(1).strip().lower(), unit)
    return Head(cell.strip().lower(), "")


def _units(line: str) -> list[str]:
    """The cells of a line of units; none if it isn't one."""
    cells = [cell.strip("[]() ") for cell in _cells(line)]
    cells = [_WORDS.get(cell.lower().removesuffix("s"), cell) for cell in cells]
    known = any(symbol_of(cell) in SYMBOLS or cell in _VOLTS for cell in cells)
    return cells if known and not _numeric(line) else []


def _size(given: str, own: str, unit: str) -> float | None:
    """Factor of a column from its given or its own unit to the SI unit; None if it has none.

    A sensitivity, 2 kN/V or 10 mV/N, is that of a sensor whose column is in V, or in mV by its own
    unit.
    """
    number, symbol = _SIZE.fullmatch(given or own).groups()  # type: ignore[union-attr]
    size = float(number) if number.strip(".") else 1.0
    if not symbol and not given:
        return 1.0
    base, factor = SYMBOLS.get(symbol_of(symbol or unit), ("", 0.0))
    if base == unit:
        return size * factor
    over, _, under = (part.strip() for part in symbol.partition("/"))
    for sensor, volts, inverse in ((over, under, False), (under, over, True)):
        base, factor = SYMBOLS.get(symbol_of(sensor), ("", 0.0))
        if base == unit and volts in _VOLTS:
            ratio = factor / (size * _VOLTS[volts]) if inverse else size * factor / _VOLTS[volts]
            return ratio * _VOLTS.get(own, 1.0)
    return None


def _numbers(
    path: Path, source: Path | list[str], first: int, places: list[int], names: Sequence[str]
) -> list[np.ndarray]:
    lines: Iterator[str] = itertools.islice(_lines(source), first, None)
    mark = next((_mark(_data(line)) for line in lines if _data(line)), None)
    lines = itertools.islice(_lines(source), first, None)
    if mark != ",":
        lines = (line.replace(",", ".") for line in lines)
    # Lines of delimiters alone are no rows.
    lines = (line for line in lines if line.strip(" \t\r\n;,"))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # no rows: the caller's error is better
            table = np.loadtxt(lines, delimiter=mark, usecols=places, quotechar='"', ndmin=2)
    except ValueError:
        for n, line in itertools.islice(enumerate(_lines(source), 1), first, None):
            cells = _cells(line)
            for place, name in zip(places, names):
                cell = cells[place] if place < len(cells) else ""
                if _data(line) and not _is_number(cell, mark):
                    where = f"{path}, line {n}, column {place + 1} ({name})"
                    raise UserError(f"{where}: {cell!r} is refused: it must be a number") from None
        raise
    return [*table.reshape(-1, len(places)).T]
