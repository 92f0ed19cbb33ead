"""Columns, in SI units, of the text files of oscilloscopes, loggers and launch monitors.

The readers of pandas and pyarrow take the delimiter, the decimal mark, the header and the lines to
skip as arguments. Finding these, the units and the line of what can't be read is what is done here;
after it, reading is one `float` per cell.
"""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from golf_impact.data.errors import UserError
from golf_impact.data.units import SYMBOLS, symbol_of


class Column(NamedTuple):
    """A column that is searched."""

    name: str
    unit: str  #: SI
    heads: tuple[str, ...]  #: its names in files, also as a word of a longer name
    optional: bool = False


TIME = Column("time", "s", ("time", "t", "zeit", "temps", "tiempo", "tempo", "second", "seconds",
    "xaxis", "xvalue"))  # fmt: skip
FORCE = Column("force", "N", ("force", "f", "fz", "kraft", "load", "newton", "fuerza", "forza"))
SIGMA = Column("sigma", "N", ("sigma", "σ", "std", "uncertainty", "unsicherheit"), True)
SPEED = Column("approach_speed", "m/s", ("speed", "velocity", "v", "geschwindigkeit"))
COR = Column("cor", "1", ("cor", "restitution", "e", "stosszahl", "stoßzahl"))
COR_SIGMA = SIGMA._replace(unit="1")
CLUB = Column("club_speed", "m/s", ("clubspeed", "clubheadspeed", "headspeed", "swingspeed",
    "clubvelocity", "club"))  # fmt: skip
BALL = Column("ball_speed", "m/s", ("ballspeed", "ballvelocity", "ball"))

#: Units in words, sizes of those of a sensor's signal, and what else a line of units may contain.
_WORDS = {"second": "s", "sec": "s", "millisecond": "ms", "msec": "ms", "microsecond": "us",
    "usec": "us", "newton": "N", "kilonewton": "kN", "volt": "V", "millivolt": "mV",
    "pound": "lbf", "lb": "lbf"}  # fmt: skip
_VOLTS = {"v": 1.0, "mv": 1e-3, "uv": 1e-6}
_BESIDE_UNITS = re.compile(
    r"|-|sequence|none|a|pc|deg|°|°?c|rpm|yds?|yards|feet|pts|m/s[2²]|(?![xh])\w*\W?unit\w*", re.I
)

#: Heads of columns that count rows; keys above them of the time between rows, of its inverse, of
#: the first time.
_COUNTS = ("x", "sequence", "index", "point", "points", "sample", "samples", "nr", "no", "row", "n")
_STEP = re.compile(
    r"(x|t|wf|wfx)?(inc|incr|increment)|hresolution|d[xt]|delta[xt]|(time|x)?interval|timestep|"
    r"(sample|sampling|abtast)(interval|intervall|period|periode|time|zeit)"
)
_RATE = re.compile(r"(sample|sampling|abtast|mess|scan)(rate|freq|frequency|frequenz)|rate|hz|fs")
_START = re.compile(r"(h|x|t|wf)?(start|offset|startoffset|origin|org|zero|0)(time)?|firstx")

_CLOCK = re.compile(r".*\d:\d\d.*|\d{1,4}[-/.]\d\d?[-/.]\d{1,4}\D.*")
_OVERFLOW = re.compile(r"[-+]?(over.*|ov[fl]|ovrl|ol|clip(ped)?|inf(inity)?|∞|\*+)", re.I)
_SUMMARY = re.compile(r"(average|avg|mean|st(andar)?d|dev|median|min|max|total|mittel).*", re.I)

#: A number with marks of thousands, and perhaps its unit, by decimal mark.
_NUMBERS = {
    mark: re.compile(
        rf"([-+]?(?=[{mark}]?\d)(?:\d{{1,3}}(?:[{other}' ]\d{{3}})+(?!\d)|\d*)(?:[{mark}]\d*)?"
        r"(?:[eEdD][-+]?\d+)?)\s*([^\W\d_]\S*)?"
    )
    for mark, other in ((".", ","), (",", "."))
}


class Table(NamedTuple):
    """Columns in SI units by name."""

    columns: dict[str, np.ndarray]
    where: Callable[[int], str]  #: the place of a row (from 0)
    notes: list[str]  #: what was left out, in sentences
    clipped: bool  #: whether there were marks of an overflow
    bare: tuple[str, ...]  #: columns whose unit stands nowhere


class _Head(NamedTuple):
    name: str
    unit: str = ""

    @classmethod
    def of(cls, cell: str) -> _Head:
        """From `time [ms]`, `F/kN`, `t_us`, `CH1 in V`, `Time (s) Run #1`."""
        if brackets := [*re.finditer(r"[\[(]([^\])]*)[\])]", cell)]:
            one = next((b for b in reversed(brackets) if _is_unit(b[1])), brackets[-1])
            return cls((cell[: one.start()] + cell[one.end() :]).strip(), _unit(one[1]))
        match = re.fullmatch(r"(.*?)(?:\s*[/_,|]\s*|(?:^|\s)in\s+|\s+)([^\s_,|]+)", cell)
        return cls(match[1], _unit(match[2])) if match and _is_unit(match[2]) else cls(cell)

    @property
    def key(self) -> str:
        return re.sub(r"[\W_]", "", self.name.lower())

    def names(self, one: Column) -> bool:
        """Whether a word of it is a name of this column."""
        words = [self.key, *re.findall(r"[^\W_]+", self.name.lower())]
        return any(h == w or (len(h) > 3 and h in w) for w in words for h in one.heads)


def read_table(
    path: Path, wanted: Sequence[Column], chosen: str = "", missing: float = 0.01
) -> Table:
    """Columns of a text file, in SI units.

    Args:
        path: in UTF-8, UTF-16 or 8 bits; its other columns may hold anything.
        wanted: what is searched.
        chosen: heads or numbers of these columns, with units or a sensor's sensitivity:
            "t [ms],F", "TIME [s],CH2 [2 kN/V]", "1 [s],3 [10 mV/N]"; `row` counts rows.
        missing: share of rows that may be unreadable.

    Raises:
        UserError: it can't be read; the line, the column and what is expected are named.
    """
    lines = _decode(path)
    mark, cells = _split(lines)
    first, stop = _find_rows(cells)
    picked = [_Head.of(one.strip()) for one in re.split(r"[,;](?![^\[(]*[\])])", chosen) if one]
    sampling = _find_sampling(lines[:first], mark) if TIME in wanted else None
    if sampling and len(picked) == 1:
        picked.insert(0, _Head("row"))
    width = Counter(map(len, cells[first:stop])).most_common(1)[0][0] if stop else 0
    heads, header, below = _find_heads(lines[:first], mark, width, wanted, picked)
    # Below the header a row is one also if its numbers can't be read.
    while first > below and cells[first - 1] and _is_number(cells[first - 1][0]):
        first -= 1
    rows = [n for n in range(first, stop) if cells[n]]
    if CLUB in wanted:
        rows = [n for n in rows if not any(map(_SUMMARY.fullmatch, cells[n]))]
    decimal = _find_decimal([cell for n in rows[:2000] for cell in cells[n]], mark)
    needed = [one.name for one in wanted if not one.optional]
    have = f"its header is {header!r}" if header else "it has no header"
    have += f"; expected {','.join(needed)}; choose columns by name or number: --columns "
    have += "'TIME [s],CH2 [2 kN/V]'" if FORCE in wanted else "'1 [mph],2'"
    letters = [line.strip() for line in lines[:first] if re.match(r"\s*[^\W\d_]", line)]
    if letters and not (header or picked):
        why = f"the line {letters[-1]!r} above its numbers is no header of {width} columns"
        raise UserError(f"{path} is refused: {why}; {have}")

    columns: dict[str, np.ndarray] = {}
    bad: dict[int, tuple[int, str]] = {}
    clipped, bare = np.zeros(len(rows), bool), []
    for n, one in enumerate(wanted):
        given = picked[n] if n < len(picked) else _Head("")
        if one.optional and picked and not given.name:
            continue
        places = _places(one, given, heads, wanted)
        if not (header or picked) and width == len(needed):
            places = [n] * (n < width)
        timeless = not any(_cell(cells[row], p) for p in places for row in rows[:9])
        if one is TIME and (given.key == "row" or (sampling and timeless)):
            places = [-1]
        if len(places) != 1 or not rows:
            if one.optional and not (places or given.name):
                continue
            what = f"{len(places) or 'no'} column{'s' * bool(places)} {given.name or one.name}"
            raise UserError(f"{path} is refused: {what}; {have}")
        place, own = places[0], heads[places[0]].unit
        found = [_number(_cell(cells[row], place), decimal) for row in rows]
        values, own = np.array([value for value, _ in found]), own or found[0][1]
        if place < 0:
            values, own = np.arange(float(len(rows))), ""
        bad = dict.fromkeys(np.flatnonzero(np.isnan(values)).tolist(), (place, one.name)) | bad
        if one is FORCE:
            clipped = _are_overflows(values)
        factor, start = _factor(given.unit, own, one.unit), 0.0
        counts = one is TIME and not given.unit and not _size(own, "s")
        counts = counts and (place < 0 or set(np.diff(values[:50])) == {1.0})
        if counts and (sampling or place < 0 or heads[place].key in _COUNTS):
            if not sampling:
                why = f"column {given.name or heads[place].name!r} counts rows"
                how = "give the time between them: --columns 'row [1.2 us],2 [N]'"
                raise UserError(f"{path} is refused: {why}: {how}")
            factor, start = sampling
        elif not (given.unit or own):
            bare.append(one.name)
        if not factor:
            known = ", ".join(symbol for symbol, (si, _) in SYMBOLS.items() if si == one.unit)
            known += ", or a sensor's sensitivity such as 2 kN/V or 10 mV/N" * (one is FORCE)
            why = f"the unit {given.unit or own!r} of {one.name} is none of {known}"
            raise UserError(f"{path}: {why}; {have}")
        columns[one.name] = start + factor * values

    notes = []
    if bad:
        at = min(bad)
        (place, name), line = bad[at], rows[at] + 1
        cell = _cell(cells[rows[at]], place)
        if len(bad) > missing * len(rows):
            why = "a clock time: give seconds" if _CLOCK.fullmatch(cell) else "it must be a number"
            more = f"; {len(bad)} rows can't be read" * (len(bad) > 1)
            what = f"{path}, line {line}, column {place + 1} ({name}): {cell!r} is refused: {why}"
            raise UserError(what + more, name, cell, why)
        notes.append(f"{len(bad)} unreadable rows left out, the first in line {line}")
    if clipped.any():
        notes.append(f"{clipped.sum()} rows at a mark of overflow are left out: clipped")
    kept = [at for at in range(len(rows)) if not (at in bad or clipped[at])]
    return Table(
        {name: values[kept] for name, values in columns.items()},
        lambda row: f"{path}, row {row + 1} (line {rows[kept[row]] + 1})",
        notes,
        bool(clipped.any()),
        tuple(bare),
    )


def _decode(path: Path) -> list[str]:
    """Lines of text in any usual encoding."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise UserError(f"can't read {path}: {error.strerror}") from error
    encoding = "utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    if encoding == "utf-8-sig" and raw[:400].count(b"\0") > 0.3 * len(raw[:400]):
        encoding = "utf-16-le" if raw[1] == 0 else "utf-16-be"
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError:
        text = raw.decode("cp1252", "replace")  # instruments write µ in 8 bits
    text = text.translate(str.maketrans("−’\u00a0\u202f", "-'  "))
    lines = re.split(r"\r*\n|\r", text)
    if max(map(len, lines)) > (most := csv.field_size_limit()):
        raise UserError(f"can't read {path}: a line has more than {most} characters")
    return lines


def _split(lines: Sequence[str]) -> tuple[str | None, list[list[str]]]:
    """The delimiter by which most cells of the second half are numbers; cells of all lines."""
    some = [line for line in lines if line.strip()]
    some = some[len(some) // 2 :: max(1, len(some) // 2000)]

    def score(mark: str | None) -> tuple[float, int]:
        rows = [[cell for cell in _cells(line, mark) if cell] for line in some]
        numbers = [sum(map(_is_number, row)) for row in rows]
        every = sum(len(row) if number else 1 for row, number in zip(rows, numbers))
        return sum(numbers) / max(every, 1), sum(numbers)

    marks = [mark for mark in "\t;," if any(mark in line for line in some)]
    mark = max((*marks, None), key=score)
    return mark, [_cells(line, mark) for line in lines]


def _cells(line: str, mark: str | None) -> list[str]:
    """Cells of a line; a mark at its end begins none, and a comment may follow numbers."""
    if "#" in line and re.match(r'["\s]*[-+.]?\d[^#]*\s#', line):
        line = line.partition("#")[0].rstrip()
    if mark is None:
        return line.replace('"', "").split()
    row = next(csv.reader([line], delimiter=mark)) if '"' in line else line.split(mark)
    row = [cell.strip(" ") for cell in row]
    while row and not row[-1]:
        row.pop()
    return row


def _cell(row: Sequence[str], place: int) -> str:
    return row[place] if place < len(row) else ""


def _find_rows(cells: Sequence[list[str]]) -> tuple[int, int]:
    """The longest run of lines with numbers in the same columns and few others among them."""
    numeric = [frozenset(n for n, cell in enumerate(row) if _is_number(cell)) for row in cells]
    kinds = [(one, len(one) == sum(map(bool, row))) for one, row in zip(numeric, cells)]
    some = [kind for kind in kinds if kind[0]]
    if not some:
        return len(cells), 0
    usual, pure = Counter(some[len(some) // 2 :]).most_common(1)[0][0]
    alike = [usual <= one and (len(usual) > 1 or p or not pure) for one, p in kinds]
    stop = len(alike) - alike[::-1].index(True)
    while stop < len(cells) and numeric[stop] & usual and kinds[stop][1]:
        stop += 1  # the last row may be cut
    # The start by which rows outweigh other lines most; one with some numbers may be a bad row.
    gains = [
        1.0 if good else -0.5 if one & usual else -2.0 * bool(row)
        for good, one, row in zip(alike, numeric, cells)
    ]
    sums = np.cumsum([0.0, *gains[:stop]])
    first = len(sums) - 1 - int(np.argmin(sums[::-1]))
    return first, stop


def _find_heads(
    above: Sequence[str],
    mark: str | None,
    width: int,
    wanted: Sequence[Column],
    picked: Sequence[_Head],
) -> tuple[list[_Head], str, int]:
    """Names and units of columns, the header as written, and the number of the line below it."""
    needs = {head.key for head in picked if not head.name.isdigit()} - {"row"}
    lines = [(at, _header_cells(line, mark, width)) for at, line in enumerate(above)][-500:]
    lines = [(at, row) for at, row in lines[::-1] if not all(map(_is_number, row))]

    def is_complete(row: Sequence[str]) -> bool:
        heads = [_Head.of(cell) for cell in row]
        if needs:
            return needs <= {head.key for head in heads}
        return all(one.optional or any(head.names(one) for head in heads) for one in wanted)

    units = next((one for one in lines if _are_units(one[1])), (-1, []))
    texts = [one for one in lines if needs or not _are_units(one[1])]
    usual = [(at, row) for at, row in texts if units[1] or not any(map(_is_number, row[1:]))]
    names = next((one for one in texts if is_complete(one[1])), None)
    names = names or next((one for one in usual if one != units), (-1, []))
    heads = [_Head.of(cell) for cell in names[1] or [""] * max(width, len(units[1]))]
    if names == units and names[1]:
        heads = [_Head(cell) for cell in names[1]]  # `Second,Volt` are both
    for n, cell in enumerate(units[1][: len(heads)]):
        if _is_unit(cell) and not heads[n].unit:
            heads[n] = _Head(heads[n].name, _unit(cell))
    used = sorted({names[0], units[0]} - {-1})
    return heads, " / ".join(above[at].strip() for at in used), max(names[0], units[0]) + 1


def _header_cells(line: str, mark: str | None, width: int) -> list[str]:
    """Cells of a line above the rows, by their delimiter or another one."""
    text = line.strip().lstrip("#%!/ ").strip()
    rows = [_cells(text, one) for one in (mark or "\t", "\t", ";", ",")]
    if mark is None:
        rows += [re.split(r"\s{2,}", text), re.split(r"\s+(?![\[(])", text)]
    wide = len(rows[0]) >= max(width, 1) and (mark or not width)
    return rows[0] if wide else next((row for row in rows if text and len(row) == width), [])


def _find_sampling(above: Sequence[str], mark: str | None) -> tuple[float, float] | None:
    """Time between rows and that of the first, s, if lines above the rows have them."""
    found: dict[str, float] = {}
    before: list[str] = []
    for line in above:
        marks = r"[\t;=:,]" if mark in (",", None) else r"[\t;=:]"
        line = re.sub(r"\d+:\d\d\S*", "", line)  # a clock time
        cells = [one.strip(' "#') for one in re.split(rf"{marks}|\s+(?=[-+]?[.\d])", line)]
        pairs = [(key, cell) for n, key in enumerate(cells) for cell in cells[n + 1 : n + 3]]
        for key, cell in [*pairs, *zip(before, cells)]:
            head = _Head.of(key)
            number = _NUMBERS["," if "," in cell else "."].fullmatch(cell)
            if not number:
                continue
            value = _float(number[1], "," if "," in cell else ".")
            unit = head.unit or _unit(number[2] or "")
            if _STEP.fullmatch(head.key) and value > 0.0:
                found.setdefault("step", value * (_size(unit, "s") or 1.0))
            elif _RATE.fullmatch(head.key) and value > 0.0:
                prefix = {"k": 1e3, "m": 1e6, "g": 1e9}.get(unit[:1].lower(), 1.0)
                found.setdefault("rate", value * prefix)
            elif _START.fullmatch(head.key):
                found.setdefault("start", value * (_size(unit, "s") or 1.0))
        before = cells
    if not found.keys() & {"step", "rate"}:
        return None
    return found.get("step") or 1.0 / found["rate"], found.get("start", 0.0)


def _places(
    one: Column, given: _Head, heads: Sequence[_Head], wanted: Sequence[Column]
) -> list[int]:
    """The numbers of the columns that this may be."""
    if given.name:
        named = [n for n, head in enumerate(heads) if head.key and head.key == given.key]
        number = int(given.name) if given.name.isdecimal() else 0
        return named or [number - 1] * (0 < number <= len(heads))
    others = [other for other in wanted if other.optional and other is not one]
    speeds = one in (CLUB, BALL)
    exact = [
        n for n, head in enumerate(heads)
        if head.key in one.heads and not (head.key == "club" and _size(head.unit, "m/s") == 0.0)
    ]  # fmt: skip
    if exact:
        return exact[:1] if speeds else exact
    found = [
        n for n, head in enumerate(heads)
        if head.names(one) and not speeds and not any(map(head.names, others))
    ]  # fmt: skip
    if not found and one in (TIME, FORCE):
        found = [n for n, head in enumerate(heads) if _size(head.unit, one.unit)]
        found = (
            found
            if len(found) == 1
            else [n for n, head in enumerate(heads[:1]) if one is TIME and head.key in _COUNTS]
        )
    return found


def _find_decimal(cells: Sequence[str], mark: str | None) -> str:
    """The decimal mark, by what can't be a mark of thousands."""
    commas = [cell for cell in cells if "," in cell and _is_number(cell)]
    if not commas or any(cell.rfind(".") > cell.rfind(",") for cell in commas):
        return "."
    thousands = all(re.fullmatch(r"[-+]?[1-9]\d{0,2}(,\d{3})+", cell) for cell in commas)
    points = any("." in cell and "," not in cell for cell in cells)
    return "." if thousands and (points or mark == "," or len(commas) < 0.5 * len(cells)) else ","


def _number(cell: str, decimal: str) -> tuple[float, str]:
    """Its value, and its unit if it has one; infinite for a mark of overflow, otherwise NaN."""
    match = _NUMBERS[decimal].fullmatch(cell)
    if match and (not match[2] or _is_unit(match[2])):
        return _float(match[1], decimal), _unit(match[2] or "")
    return (math.inf if _OVERFLOW.fullmatch(cell) else math.nan), ""


def _float(text: str, decimal: str) -> float:
    try:
        return float(text if decimal == "." else text.replace(",", "."))
    except ValueError:
        digits = re.sub(r"[' ]" + ("|," if decimal == "." else r"|\."), "", text)
        return float(re.sub("[dD]", "e", digits.replace(",", ".")))


def _is_number(cell: str) -> bool:
    matches = (number.fullmatch(cell) for number in _NUMBERS.values())
    return any(match and (not match[2] or _is_unit(match[2])) for match in matches)


def _are_overflows(values: np.ndarray) -> np.ndarray:
    """Infinite values, those of 9.9E+37, and the largest if its digits are nines and far above."""
    sizes = np.abs(values)
    largest, *others = np.unique(sizes[sizes < 9e36])[::-1][:2].tolist() or [0.0]
    nines = (
        re.fullmatch(r"(?=.{4})9+\.?9*", f"{largest:.8g}")
        and max(others, default=0.0) < 0.5 * largest
    )
    return (sizes >= 9e36) | (sizes == largest if nines else False)


def _unit(text: str) -> str:
    """A unit's symbol from a symbol or a word, perhaps in brackets or behind a channel (CH1:V)."""
    text = text.rpartition(":")[2].strip("[]() ")
    return _WORDS.get(text.lower().removesuffix("s"), "mV" if text == "MV" else text)


def _is_unit(text: str) -> bool:
    unit = _unit(text)
    return unit.lower() in _VOLTS or (symbol_of(unit) in SYMBOLS and not unit.isdigit())


def _are_units(row: Sequence[str]) -> bool:
    beside = (_BESIDE_UNITS.fullmatch(_unit(cell)) or _is_number(cell) for cell in row)
    units = [*map(_is_unit, row)]
    return any(units) and all(a or b for a, b in zip(units, beside))


def _size(symbol: str, unit: str) -> float:
    """Of a unit in the SI unit; 0 if it is one of something else."""
    found, size = SYMBOLS.get(symbol_of(_unit(symbol)), ("", 0.0))
    return size if found == unit else 0.0


def _factor(given: str, own: str, unit: str) -> float:
    """From a column's given or own unit to the SI unit; 0 if it has another one.

    A sensitivity, 2 kN/V or 10 mV/N, is that of a sensor whose column is in V, or in mV by its own
    unit; a number before a unit is a factor, 1.6 us.
    """
    match = re.fullmatch(r"([-+\d.,]+(?:[eE][-+]?\d+)?)\s*(\D.*)", given or own or unit)
    try:
        number = float(match[1].replace(",", ".")) if match else 1.0
    except ValueError:
        return 0.0
    symbol = match[2] if match else given or own or unit
    if _size(symbol, unit):
        return number * _size(symbol, unit)
    over, _, under = symbol.partition("/")
    signal = _VOLTS.get(_unit(own).lower(), 1.0)
    if volts := _VOLTS.get(_unit(under).lower()):
        return number * _size(over, unit) / volts * signal
    volts = _VOLTS.get(_unit(over).lower(), 0.0)
    return _size(under, unit) / (number * volts) * signal if number * volts else 0.0
