"""Tables as labs and oscilloscopes export them: heads, units, delimiters, decimal commas.

Files of Tektronix (`TIME,CH1`, or rows beside the settings), Keysight (`x-axis,1` above
`second,Volt`) and LeCroy (`Time,Ampl`) are read as they are.
"""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from golf_impact.errors import UserError
from golf_impact.units import SYMBOLS, symbol_of

#: Other names of columns, in small letters.
_ALIASES = {"t": "time", "zeit": "time", "x-axis": "time", "f": "force", "kraft": "force"}

#: Units in words, and those of a sensor's signal in V.
_WORDS = {"second": "s", "sec": "s", "millisecond": "ms", "newton": "N", "volt": "V"}
_VOLTS = {"V": 1.0, "mV": 1e-3}

#: A name and its unit: `time [ms]`, `force (kN)`, `F/kN`, `t_us`.
_HEAD = re.compile(r"(.*?)\s*(?:\[(.*)\]|\((.*)\)|[/_ ]([^/_ ]+))")

#: A unit, perhaps with a number before it and over another one: `2 kN/V`.
_RATIO = re.compile(r"(\d*\.?\d*(?:[eE][+-]?\d+)?)\s*([^/]*)/?(.*)")

#: Lines in which a header is searched; rows that must be alike where there is none.
_SEARCHED, _ALIKE = 500, 20


class Head(NamedTuple):
    """Name and unit of a column."""

    name: str = ""  #: in small letters, one of ours if it is an alias
    unit: str = ""


def read_table(
    path: Path, names: Sequence[str], units: Sequence[str], chosen: str = ""
) -> tuple[list[np.ndarray], Callable[[int], str]]:
    """Columns of these names, the last one optional, and a function that gives a row's place.

    Args:
        path: a text file; its other columns may hold anything.
        names: of the columns, in small letters.
        units: their SI units, which they are converted to.
        chosen: their heads in the file, or their numbers, with a unit or a sensor's sensitivity:
            "t [ms],F", "TIME [s],CH2 [2 kN/V]", "1 [s],3 [10 mV/N]".

    Raises:
        UserError: it can't be read; the line, the column and what is expected are named.
    """
    lines = _lines(path)
    wanted = [_head(cell) for cell in chosen.split(",")][: len(names)] if chosen else []
    needed = wanted or [Head(name) for name in names[:-1]]
    heads, first, header = _header(lines[:_SEARCHED], {one.name for one in needed})
    rows = [n for n, line in enumerate(lines) if n >= first and _data(line)]
    have = f"its header is {header!r}" if header else "it has no header"
    if not header:
        count = len(_cells(lines[rows[0]])) if rows else 0
        named = count in (len(names) - 1, len(names))
        heads = [*map(Head, names)][:count] if named else [Head()] * count
    if not chosen:
        wanted = needed + [Head(names[-1])] * any(head.name == names[-1] for head in heads)
    places, factors = [], []
    for one, name, unit in zip(wanted, names, units):
        found = [at for at, head in enumerate(heads) if head.name == one.name]
        if not found and one.name.isdigit() and 0 < int(one.name) <= len(heads):
            found = [int(one.name) - 1]
        if len(found) != 1:
            what = f"{len(found)} columns" if found else "no column"
            raise UserError(
                f"{path} is refused: {what} {one.name}; {have}; expected {','.join(names[:-1])} or "
                f"{','.join(names)}; choose columns by name or number: --columns 'TIME [s],CH2 [2 "
                "kN/V]'"
            )
        own = heads[found[0]].unit
        places.append(found[0])
        factors.append(_factor(one.unit, own, unit))
        if not factors[-1]:
            known = ", ".join(symbol for symbol, (si, _) in SYMBOLS.items() if si == unit)
            known += ", or a sensor's sensitivity such as 2 kN/V or 10 mV/N" * (unit == "N")
            what = f"the unit {one.unit or own!r} of {name}"
            raise UserError(f"{path}: {what} is none of {known}; {have}")
    mark = _mark(lines[rows[0]]) if rows else ","
    texts = (lines[n] if mark == "," else lines[n].replace(",", ".") for n in rows)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # no rows: the caller's error is better
            table = np.loadtxt(texts, delimiter=mark, usecols=places, quotechar='"', ndmin=2)
    except ValueError:
        for n in rows:
            for place, name in zip(places, names):
                cell = "".join(_cells(lines[n])[place : place + 1])
                if not _is_number(cell, mark):
                    at = f"{path}, line {n + 1}, column {place + 1} ({name})"
                    raise UserError(f"{at}: {cell!r} is refused: it must be a number") from None
        raise
    columns = [*(table.reshape(-1, len(places)) * factors).T]
    return columns, lambda row: f"{path}, row {row + 1} (line {rows[row] + 1})"


def read_cells(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and cells of all rows, empty ones left out; UserError if it can't be read."""
    return [(n, _cells(line)) for n, line in enumerate(_lines(path), 1) if _data(line)]


def _lines(path: Path) -> list[str]:
    try:
        # Instruments write µ in their own 8 bits.
        lines = path.read_text(encoding="utf-8-sig", errors="replace").split("\n")
    except OSError as error:
        raise UserError(f"can't read {path}: {error.strerror}") from error
    if max(map(len, lines)) > (most := csv.field_size_limit()):
        raise UserError(f"can't read {path}: a line has more than {most} characters")
    return lines


def _data(line: str) -> str:
    """A line without its comment; empty if there is nothing in it but delimiters."""
    line = line.partition("#")[0]
    return line.strip(" ") if line.strip(" \t;,") else ""


def _mark(line: str) -> str | None:
    return next((mark for mark in "\t;," if mark in _data(line)), None)


def _cells(line: str) -> list[str]:
    """Cells of a line; a mark at its end begins none."""
    mark = _mark(line)
    if mark is None:
        return _data(line).split()
    row = [cell.strip() for cell in next(csv.reader([_data(line)], delimiter=mark))]
    return row if row[-1] else row[:-1]


def _is_number(text: str, mark: str | None) -> bool:
    try:
        float(text if mark == "," else text.replace(",", "."))
    except ValueError:
        return False
    return True


def _numeric(line: str) -> set[int]:
    """The numbers of the columns that hold a number."""
    return {n for n, cell in enumerate(_cells(line)) if _is_number(cell, _mark(line))}


def _header(lines: Sequence[str], names: set[str]) -> tuple[list[Head], int, str]:
    """Heads of the columns, if there are any, the first line of data, and the header as written.

    The header is the last line above the data with all of these names, or else with as many cells
    as the data; it may be a comment, and a line of units may be below it.
    """
    first = next((n for n, line in enumerate(lines) if _begins_data(lines[n:])), len(lines))
    texts = {n: text for n, line in enumerate(lines[:first]) if _data(text := line.strip("#%/ \r"))}
    units = _units(_cells(texts[max(texts)])) if texts else []
    below = f" / {texts.popitem()[1]}" if units else ""
    count = len(_cells(lines[first])) if first < len(lines) else None

    def likeness(n: int) -> tuple[bool, bool, int]:
        cells = _cells(texts[n])
        return names <= {_head(cell).name for cell in cells}, count in (None, len(cells)), n

    at = max(texts, key=likeness, default=-1)
    if at < 0 or not any(likeness(at)[:2]):
        return [], first, ""
    heads = [_head(cell) for cell in _cells(texts[at])]
    if units:
        heads = [Head(_head(cell).name, unit) for cell, unit in zip(_cells(texts[at]), units)]
    return heads, first, texts[at] + below


def _begins_data(lines: Sequence[str]) -> bool:
    """Whether rows of two numbers or more begin here; beside text they must be alike."""
    numeric = _numeric(lines[0])
    if len(numeric) < len(_cells(lines[0])):
        numeric = set.intersection(*(_numeric(line) for line in lines[:_ALIKE] if _data(line)))
    return len(numeric) > 1


def _head(cell: str) -> Head:
    name, unit, match = cell.strip(), "", _HEAD.fullmatch(cell.strip())
    if match and (match[4] is None or symbol_of(match[4]) in SYMBOLS):
        name, unit = match[1], (match[2] or match[3] or match[4] or "").strip()
    return Head(_ALIASES.get(name.strip().lower(), name.strip().lower()), unit)


def _units(cells: Sequence[str]) -> list[str]:
    """The cells of a line of units; none if it isn't one."""
    cells = [cell.strip("[]() ") for cell in cells]
    cells = [_WORDS.get(cell.lower().removesuffix("s"), cell) for cell in cells]
    known = any(symbol_of(cell) in SYMBOLS or cell in _VOLTS for cell in cells)
    return cells if known and not any(_is_number(cell, None) for cell in cells) else []


def _factor(given: str, own: str, unit: str) -> float:
    """From a column's given or own unit to the SI unit; 0 if it has another one.

    A sensitivity, 2 kN/V or 10 mV/N, is that of a sensor whose column is in V, or in mV by its own
    unit.
    """
    sizes = {symbol: size for symbol, (si, size) in SYMBOLS.items() if si == unit}
    symbol = symbol_of(given or own or unit)
    if symbol in sizes:
        return sizes[symbol]
    number, over, under = _RATIO.fullmatch(symbol).groups()  # type: ignore[union-attr]
    size = float(number) if number.strip(".") else 1.0
    if not under:
        return size * sizes.get(over or unit, 0.0)
    if over in sizes and under in _VOLTS:
        return size * sizes[over] / _VOLTS[under] * _VOLTS.get(own, 1.0)
    if over in _VOLTS and under in sizes:
        return sizes[under] / (size * _VOLTS[over]) * _VOLTS.get(own, 1.0)
    return 0.0
