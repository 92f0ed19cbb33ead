"""Tables as labs export them: units, delimiters, decimal commas, comments, several channels."""

from __future__ import annotations

import csv
import itertools
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from golf_impact.errors import UserError
from golf_impact.units import SYMBOLS, symbol_of

#: Names of columns in a header, in small letters, beside the first one, which is ours.
_ALIASES = {"time": {"t", "zeit"}, "force": {"f", "kraft"}, "sigma": {"σ"}}

#: A name and its unit: `time [ms]`, `force (kN)`, `F/kN`, `t_us`.
_HEAD = re.compile(r"(.*?)\s*(?:\[(.*)\]|\((.*)\)|[/_ ]([^/_ ]+))")


class Column(NamedTuple):
    """A column's head."""

    name: str  #: in small letters
    unit: str  #: its symbol; empty if there is none


class Table(NamedTuple):
    """Columns of a file."""

    columns: list[np.ndarray]  #: in the requested order, SI units, (n,)
    path: Path
    lines: Path | list[str]  #: the file, or what was read from a pipe
    first: int  #: the number of the line of the first row, from 0

    def where(self, row: int) -> str:
        """The place of a row (from 0), in words."""
        lines = itertools.islice(_lines(self.lines), self.first, None)
        numbers = (n for n, line in enumerate(lines, self.first + 1) if not _is_empty(line))
        return f"{self.path}, row {row + 1} (line {next(itertools.islice(numbers, row, None))})"


def read_table(path: Path, names: Sequence[str], units: Sequence[str], chosen: str = "") -> Table:
    """Columns of these names, the last one optional, in these SI units unless their heads differ.

    `chosen` are their heads in the file, or their numbers, with or without a unit: "t [ms],F".

    UserError: it can't be read; the line, the column and what is expected are named.
    """
    with _reading(path):
        # A file is read twice, a pipe can't be.
        source = path if path.is_file() else [*_lines(path)]
        head = [*itertools.islice(_lines(source), 500)]
        first, mark, cells = len(head), None, list[str]()
        for n, line in enumerate(head):
            mark = _mark(line)
            cells = _cells(line, mark)
            if len(cells) > 1 and all(_number(cell, mark) for cell in cells):
                first = n
                break
        heads, quoted = _heads(head[:first], len(cells) if first < len(head) else 0)
        places, factors = _choose(path, heads, quoted, len(cells), names, units, chosen)
        columns = _numbers(path, source, first, mark, places, names, factors)
        return Table(columns, path, source, first)


def read_cells(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and cells of all rows, empty ones left out; UserError if it can't be read."""
    with _reading(path):
        lines = enumerate(_lines(path), 1)
        return [(n, _cells(line, _mark(line))) for n, line in lines if not _is_empty(line)]


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, csv.Error) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise UserError(f"can't read {path}: {why}") from error


def _lines(source: Path | list[str]) -> Iterator[str]:
    if not isinstance(source, Path):
        yield from source
        return
    # Instruments write µ in their own 8 bits.
    with source.open(encoding="utf-8-sig", errors="replace") as file:
        yield from file


def _is_empty(line: str) -> bool:
    return not line.partition("#")[0].strip(" \t\r\n;,")


def _mark(line: str) -> str | None:
    return next((one for one in ("\t", ";", ",") if one in line), None)


def _cells(line: str, mark: str | None) -> list[str]:
    """Cells of a line; a mark at its end begins none."""
    line = line.partition("#")[0]
    if mark is None:
        return line.split()
    row = next(csv.reader([line.strip()], delimiter=mark), [])
    return [cell.strip() for cell in (row[:-1] if row and not row[-1] else row)]


def _number(text: str, mark: str | None) -> bool:
    try:
        float(text if mark == "," else text.replace(",", "."))
    except ValueError:
        return False
    return True


def _heads(lines: Sequence[str], count: int) -> tuple[list[Column], str]:
    """Heads of so many columns, and the line that has them as it was written."""
    above = [line.strip().lstrip("#%/ ") for line in lines if line.strip(" \t\r\n;,#%/")][-2:]
    rows = [_cells(line, _mark(line)) for line in above]
    if not rows or (count and len(rows[-1]) != count):
        return [], above[-1] if above else ""
    heads = [_column(cell) for cell in rows[-1]]
    # A line of units below one of names.
    symbols = [cell.strip("[]()") for cell in rows[-1]]
    if len({*map(len, rows)}) == 1 < len(rows) and any(symbol_of(s) in SYMBOLS for s in symbols):
        heads = [Column(cell.lower(), symbol) for cell, symbol in zip(rows[0], symbols)]
        return heads, above[0]
    return heads, above[-1]


def _column(cell: str) -> Column:
    match = _HEAD.fullmatch(cell.strip())
    if match:
        unit = next(filter(None, match.groups()[1:]), "")
        if match.group(4) is None or symbol_of(unit) in SYMBOLS:
            return Column(match.group(1).strip().lower(), unit)
    return Column(cell.strip().lower(), "")


def _choose(
    path: Path, heads: list[Column], quoted: str, count: int,
    names: Sequence[str], units: Sequence[str], chosen: str,
) -> tuple[list[int], list[float]]:  # fmt: skip
    """The numbers of the columns, and their factors to SI units."""
    wanted = [_column(cell) for cell in chosen.split(",")] if chosen else []
    have = f"its header is {quoted!r}" if quoted else "it has no header"
    places, factors = [], []
    for n, (name, unit) in enumerate(zip(names, units)):
        if chosen and n >= len(wanted):
            break
        fits = {wanted[n].name} if chosen else {name, *_ALIASES.get(name, ())}
        found = [at for at, head in enumerate(heads) if head.name in fits]
        if chosen and wanted[n].name.isdigit() and 0 < int(wanted[n].name) <= count:
            found = [int(wanted[n].name) - 1]
        if not heads and not chosen and len(names) - 1 <= count <= len(names):
            found = [n] if n < count else []
        if n == len(names) - 1 and not found and not chosen:
            break
        if len(found) != 1:
            what = f"{len(found)} columns" if found else "no column"
            raise UserError(
                f"{path} is refused: {what} {' or '.join(sorted(fits))}; {have}; expected "
                f"{','.join(names[:-1])} or {','.join(names)}, or name them: --columns 'NAME "
                f"[{unit}],…'"
            )
        symbol = (wanted[n].unit if chosen else "") or (heads[found[0]].unit if heads else "")
        base, size = SYMBOLS.get(symbol_of(symbol), ("", 0.0)) if symbol else (unit, 1.0)
        if base != unit:
            known = ", ".join(one for one, (si, _) in SYMBOLS.items() if si == unit)
            raise UserError(f"{path}: the unit {symbol!r} of {name} is none of {known}; {have}")
        places.append(found[0])
        factors.append(size)
    return places, factors


def _numbers(
    path: Path, source: Path | list[str], first: int, mark: str | None, places: list[int],
    names: Sequence[str], factors: list[float],
) -> list[np.ndarray]:  # fmt: skip
    lines: Iterator[str] = itertools.islice(_lines(source), first, None)
    if mark != ",":
        lines = (line.replace(",", ".") for line in lines)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # no rows: the caller's error is better
            table = np.loadtxt(lines, delimiter=mark, usecols=places, quotechar='"', ndmin=2)
    except ValueError:
        for n, line in itertools.islice(enumerate(_lines(source), 1), first, None):
            cells = _cells(line, mark)
            for place, name in zip(places, names):
                cell = cells[place] if place < len(cells) else ""
                if not _is_empty(line) and not _number(cell, mark):
                    where = f"{path}, line {n}, column {place + 1} ({name})"
                    raise UserError(f"{where}: {cell!r} is refused: it must be a number") from None
        raise
    return [column * factor for column, factor in zip(table.reshape(-1, len(places)).T, factors)]
