"""Columns, in SI units, of the text files of oscilloscopes, loggers and launch monitors.

The readers of pandas and pyarrow take the delimiter, the decimal mark, the header and the lines to
skip as arguments. Finding these, the units and the line of what can't be read is what is done here;
after it, reading is one `float` per cell.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Collection, Iterable, Sequence
from itertools import chain, zip_longest
from pathlib import Path
from statistics import mode
from typing import NamedTuple

import numpy as np

from golf_impact.data.errors import UserError
from golf_impact.data.units import SYMBOLS, symbol_of


class Column(NamedTuple):
    """A column that is searched."""

    name: str
    unit: str  #: SI
    heads: tuple[str, ...]  #: its names in files
    whole: bool = False  #: whether a name must be the whole head; otherwise it may be a word of it
    optional: bool = False


TIME = Column("time", "s", ("time", "t", "zeit", "temps", "tiempo", "tempo", "second", "seconds",
    "xaxis", "xvalue"))  # fmt: skip
FORCE = Column("force", "N", ("force", "f", "fz", "kraft", "load", "newton", "fuerza", "forza"))
SIGMA = Column("sigma", "N", ("sigma", "σ", "std", "uncertainty", "unsicherheit"), optional=True)
SPEED = Column("approach_speed", "m/s", ("speed", "velocity", "v", "geschwindigkeit"))
COR = Column("cor", "1", ("cor", "restitution", "e", "stosszahl", "stoßzahl"))
COR_SIGMA = SIGMA._replace(unit="1")
CLUB = Column("club_speed", "m/s", ("clubspeed", "clubheadspeed", "headspeed", "swingspeed",
    "clubvelocity", "club"), whole=True)  # fmt: skip
BALL = Column("ball_speed", "m/s", ("ballspeed", "ballvelocity", "ball"), whole=True)

#: Units in words, those of a sensor's signal, and what else a line of units may contain.
_WORDS = {"second": "s", "sec": "s", "millisecond": "ms", "msec": "ms", "microsecond": "us",
    "usec": "us", "newton": "N", "kilonewton": "kN", "pound": "lbf", "lb": "lbf"}  # fmt: skip
_VOLTS = {"v": 1.0, "volt": 1.0, "mv": 1e-3, "millivolt": 1e-3, "uv": 1e-6}
_BESIDE_UNITS = re.compile(
    r"-*|sequence|none|a|pc|deg|°|°?c|rpm|yds?|yards|feet|pts|m/s[2²]|((vertical|v|y)\W?)?units?:?",
    re.I,
)

#: Heads of columns that count rows; settings above the rows: the time between them, its inverse,
#: the first time, and whose unit is named.
_COUNTS = ("x", "sequence", "index", "point", "points", "sample", "samples", "nr", "no", "row", "n")
_SETTINGS = {
    "step": r"(x|t|wfx?)?incr?(ement)?|hresolution|(d|delta)[xt]|(time|x)?interval|timestep|"
    r"(sampl(e|ing)|abtast)(intervall?|periode?|time|zeit)",
    "rate": r"(sampl(e|ing)|abtast|mess|scan)(rate|freq(uency)?|frequenz)|rate|hz|fs",
    "start": r"(h|x|t|wf)?(start|offset|startoffset|origin|org|zero)(time)?|[xt]0|firstx",
}
_HERTZ = re.compile(r"[kmg]$|[kmg]?(?=hz|s(a|ps|/s))", re.I)
_UNIT_OF = re.compile(r"\W*(units?( of)?|einheit)\W*", re.I)
#: What may stand before the heads or units of all columns.
_LABEL = re.compile(r"\W*(headers|units?|einheit(en)?)\W*", re.I)

_CLOCK = re.compile(r".*\d:\d\d.*|\d{1,4}[-/.]\d\d?[-/.]\d{1,4}\D.*")
_OVERFLOW = re.compile(r"[-+#]?(over.*|ov[flr]\w?|ovrl|ol|clip(ped)?|inf(inity)?|∞|\*+)", re.I)
_MISSING = re.compile(r"-+|#?n/?a|nan|null|none|\?", re.I)
_SUMMARY = re.compile(r"(average|avg|mean|st(andar)?d|dev|median|min|max|total|mittel).*", re.I)

#: A number with marks of thousands, and perhaps its unit, by decimal mark.
_NUMBERS = {
    mark: re.compile(
        rf"([-+]?(?=[{mark}]?\d)(?:[1-9]\d{{0,2}}(?:[{other}' ]\d{{3}})+(?!\d)|\d*)(?:[{mark}]\d*)?"
        r"(?:[eEdD][-+]?\d+)?)\s*([^\W\d_].*)?"
    )
    for mark, other in ((".", ","), (",", "."))
}
_SMALL = re.compile(r"[-+]?\d{1,3}")
#: Its digits as Python writes them, by decimal mark.
_PYTHONS = {".": str.maketrans("dD", "ee", ",' "), ",": str.maketrans(",dD", ".ee", ".' ")}


class Table(NamedTuple):
    """Columns in SI units by name."""

    columns: dict[str, np.ndarray]
    places: np.ndarray  #: of the rows, "line 5"
    notes: list[str]  #: what was left out, in sentences
    clipped: bool  #: whether there were marks of an overflow
    bare: list[str]  #: columns whose unit stands nowhere


class _Head(NamedTuple):
    name: str = ""
    unit: str = ""

    @classmethod
    def of(cls, cell: str) -> _Head:
        """From `time [ms]`, `F/kN`, `t_us`, `CH1 in V`, `Time (s) Run #1`."""
        if brackets := [*re.finditer(r"[\[({<]([^\])}>]*)[\])}>]", cell)]:
            one = next((b for b in reversed(brackets) if _is_unit(b[1])), brackets[-1])
            return cls((cell[: one.start()] + cell[one.end() :]).strip(), one[1])
        match = re.fullmatch(r"(.*?)(?:\s*[/_,|.]+\s*|(?:^|\s)in\s+|\s+)([^\s_,|.]+)\.?", cell)
        return cls(match[1], match[2]) if match and _is_unit(match[2]) else cls(cell)

    @property
    def key(self) -> str:
        return re.sub(r"[\W_]", "", self.name.lower())

    def names(self, one: Column) -> bool:
        """Whether it, or a word of it, is a name of this column."""
        if one.whole:  # club and ball alone may be their kinds
            return self.key in one.heads and (bool(self.unit) or self.key not in ("club", "ball"))
        words = [self.key, *re.findall(r"[^\W_]+", self.name.lower())]
        return any(h == w or (len(h) > 3 and h in w) for w in words for h in one.heads)


class _Text(NamedTuple):
    """The rows of a file, and what is above them."""

    path: Path
    lines: list[int]  #: of the rows, from 1
    heads: list[_Head]  #: of columns; the last one counts rows
    columns: list[tuple[str, ...]]
    decimal: str
    #: Time between rows and that of the first, s; units of columns by their names.
    settings: dict[str, float]
    units: dict[str, str]
    known: str  #: the header and what is expected, for messages

    def error(self, why: str) -> UserError:
        return UserError(f"{self.path} is refused: {why}; {self.known}")


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
    picked = [_Head.of(one.strip()) for one in re.split(r"[,;](?![^\[(]*[\])])", chosen) if one]
    try:
        text = _read_text(path, wanted, picked)
    except ValueError as error:
        raise UserError(f"{path} is refused: {error}") from error
    if not text.lines:
        raise text.error("it has no row of numbers")
    if "step" in text.settings and len(picked) == 1:
        picked = [_Head("row"), *picked]
    columns: dict[str, np.ndarray] = {}
    bad: dict[int, tuple[int, str]] = {}
    clipped, bare, unit = np.zeros(len(text.lines), bool), [], ""
    for one, given in zip(wanted, [*picked, *[_Head()] * len(wanted)]):
        places = _places(text, one, given, wanted)
        if one.optional and not given.name and (picked or not places):
            continue
        if len(places) != 1:
            what = f"{len(places) or 'no'} column{'s' * bool(places)} {given.name or one.name}"
            raise text.error(what)
        (place,) = places
        values, own = _values(text, place)
        if one in (CLUB, BALL):
            values[values <= 0.0] = math.nan  # not measured
        bad = dict.fromkeys(np.flatnonzero(np.isnan(values)).tolist(), (place, one.name)) | bad
        if one is FORCE:
            clipped = _are_overflows(values)
        unit = given.unit or own or text.units.get(one.name) or unit * (one.optional or one is BALL)
        factor, start = _factor(unit, own, one.unit), 0.0
        if one is TIME and not given.unit and _counts(text, place, values, own):
            if "step" not in text.settings:
                why = f"column {given.name or text.heads[place].name!r} counts rows"
                how = "give the time between them: --columns 'row [1.2 us],2 [N]'"
                raise UserError(f"{path} is refused: {why}: {how}")
            factor, start = text.settings["step"], text.settings.get("start", 0.0)
        elif not unit:
            bare.append(one.name)
        if not factor:
            known = ", ".join(symbol for symbol, (si, _) in SYMBOLS.items() if si == one.unit)
            known += ", or a sensor's sensitivity such as 2 kN/V or 10 mV/N" * (one is FORCE)
            raise text.error(f"the unit {unit!r} of {one.name} is none of {known}")
        columns[one.name] = start + factor * values

    notes = []
    if bad:
        at = min(bad)
        place, name = bad[at]
        cell = text.columns[place][at]
        if len(bad) > missing * len(text.lines):
            why = "a clock time: give seconds" if _CLOCK.fullmatch(cell) else "it must be a number"
            more = f"; {len(bad)} rows can't be read" * (len(bad) > 1)
            where = f"{path}, line {text.lines[at]}, column {place + 1} ({name})"
            raise UserError(f"{where}: {cell!r} is refused: {why}{more}", name, cell, why)
        notes.append(f"{len(bad)} unreadable rows left out, the first in line {text.lines[at]}")
    if clipped.any():
        notes.append(f"{clipped.sum()} rows at a mark of overflow are left out: clipped")
    kept = ~clipped
    kept[[*bad]] = False
    columns = {name: values[kept] for name, values in columns.items()}
    rows = np.array([f"line {n}" for n in text.lines])[kept]
    return Table(columns, rows, notes, bool(clipped.any()), bare)


def _read_text(path: Path, wanted: Sequence[Column], picked: Sequence[_Head]) -> _Text:
    """Rows and heads of a file.

    ValueError: it can't be known what commas are, or there are several segments.
    """
    lines = _decode(path)
    mark, cells = _split(lines)
    first, stop = _find_rows(cells)
    above = lines[:first]
    width = mode(map(len, cells[first:stop])) if stop else 0
    heads, used = _find_heads(above, mark, width, wanted, picked)
    header, below = " / ".join(lines[n].strip() for n in used), max(used, default=-1) + 1
    titles = {lines[n] for n in used}
    start = min(map(lines.index, titles), default=0)
    again = [
        n for n in range(len(lines)) if lines[n] in titles and any(map(_begins, cells[start:n]))
    ]
    if TIME in wanted and again:
        what = f"the header is there again in line {again[0] + 1}, a further segment begins there"
        raise ValueError(f"{what}: save one segment as a file")
    # Below the header a row is one also if its numbers can't be read.
    first = next((n for n in range(below, first) if _begins(cells[n])), first)
    rows = [n for n in range(first, stop) if cells[n]]
    if CLUB in wanted:
        rows = [n for n in rows if not any(map(_SUMMARY.fullmatch, cells[n]))]
    columns = [*zip_longest(*(cells[n] for n in rows), fillvalue="")]
    decimal = _find_decimal(columns, "." if mark == "," else "")
    names = [one.name for one in wanted if not one.optional]
    letters = any(re.match(r"\s*[^\W\d_]", line) for line in above)
    if not (header or picked or letters) and width == len(names):
        heads = [_Head(name) for name in names]
    columns += [("",) * len(rows)] * (len(heads) - len(columns))
    columns.append(tuple(map(str, range(len(rows)))))
    known = f"its header is {header!r}" if header else f"it has {width} columns without a header"
    known += f"; expected {','.join(names)}; choose columns by name or number: --columns "
    known += "'TIME [s],CH2 [2 kN/V]'" if FORCE in wanted else "'1 [mph],2'"
    heads = [*heads, *[_Head()] * (len(columns) - 1 - len(heads)), _Head("row")]
    found = _find_settings(above, mark, decimal, wanted) if TIME in wanted else ({}, {})
    return _Text(path, [n + 1 for n in rows], heads, columns, decimal, *found, known)


def _decode(path: Path) -> list[str]:
    """Lines of text in any usual encoding."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise UserError(f"can't read {path}: {error.strerror}") from error
    encoding = "utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    if b"\0" in raw[:2]:
        encoding = "utf-16-be" if raw.startswith(b"\0") else "utf-16-le"
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError:
        text = raw.decode("cp1252", "replace")  # instruments write µ in 8 bits
    text = text.translate(str.maketrans("−’\u00a0\u202f", "-'  "))
    lines = re.split(r"\r*\n|\r", text)
    if max(map(len, lines)) > (most := csv.field_size_limit()):
        raise UserError(f"can't read {path}: a line has more than {most} characters")
    for n, line in enumerate(lines[:-1]):
        if re.search(r'(^|[\t;,])"[^"]*$', line):  # a cell of two lines
            lines[n : n + 2] = "", f"{line} {lines[n + 1]}"
    return lines


def _split(lines: Sequence[str]) -> tuple[str | None, list[list[str]]]:
    """The delimiter by which most cells of the second half are numbers; cells of all lines."""
    some = [line for line in lines if line.strip()]
    head = next((line for line in reversed(some) if not _NUMBERS[","].fullmatch(line)), ",")
    some = some[len(some) // 2 :][:2000]

    def score(mark: str | None) -> tuple[float, int]:
        rows = [[cell for cell in _cells(line, mark) if cell] for line in some]
        numbers = [sum(map(_is_number, row)) for row in rows]
        every = sum(len(row) if number else 1 for row, number in zip(rows, numbers))
        return sum(numbers) / (every or 1), sum(numbers)

    marks = [mark for mark in "\t;,|" if any(mark in line for line in some)]
    # Lines of a number with a decimal comma each: below a header of one cell, or as 0,05.
    if marks == [","] and all(map(_NUMBERS[","].fullmatch, some)):
        zeros = re.search(r"(?m)^\W?\d*,0\d+$", "\n".join(lines))
        marks = marks if "," in head and not zeros else []
    mark = max((*marks, None), key=score)
    cells = [_cells(line, mark) for line in lines]
    for row in cells:
        while row and not row[-1]:
            row.pop()
    return mark, cells


def _cells(line: str, mark: str | None) -> list[str]:
    """Cells of a line; a comment may follow numbers."""
    if "#" in line and re.match(r'["\s]*[-+.]?\d[^#]*\s#', line):
        line = line.partition("#")[0].rstrip()
    if mark is None:
        return line.replace('"', "").split()
    row = next(csv.reader([line], delimiter=mark)) if '"' in line else line.split(mark)
    return [cell.strip(" ") for cell in row]


def _find_rows(cells: Sequence[list[str]]) -> tuple[int, int]:
    """The longest run of lines with numbers in the same columns and few others among them."""
    numeric = [
        frozenset(n for n, cell in enumerate(row) if _is_number(cell) or _MISSING.fullmatch(cell))
        for row in cells
    ]
    kinds = [(one, len(one) == sum(map(bool, row))) for one, row in zip(numeric, cells)]
    some = [kind for kind in kinds if kind[0]]
    if not some:
        return len(cells), 0
    usual, pure = mode(some[len(some) // 2 :])
    alike = [usual <= one and (len(usual) > 1 or p or not pure) for one, p in kinds]
    stop = len(alike) - alike[::-1].index(True)
    while stop < len(cells) and min(usual) in numeric[stop]:
        stop += 1  # the last row may be cut
    # The start by which rows outweigh other lines most; one with some numbers may be a bad row.
    gains = [
        1.0 if good else -0.5 if one & usual else -2.0 * bool(row)
        for good, one, row in zip(alike, numeric, cells)
    ]
    sums = np.cumsum([*gains[stop - 1 :: -1]])
    return stop - 1 - int(np.argmax(sums)), stop


def _find_heads(
    above: Sequence[str],
    mark: str | None,
    width: int,
    wanted: Sequence[Column],
    picked: Sequence[_Head],
) -> tuple[list[_Head], list[int]]:
    """Names and units of columns, and the numbers of the lines that have them."""
    needs = {head.key for head in picked if not head.name.isdigit()} - {"row"}
    lines = [(at, _header_cells(line, mark, width)) for at, line in enumerate(above)]
    lines = [(at, row) for at, row in lines[::-1] if not all(map(_is_number, row))]

    def is_complete(row: Sequence[str]) -> bool:
        heads = [_Head.of(cell) for cell in row]
        if needs:
            return needs <= {head.key for head in heads}
        return all(one.optional or any(head.names(one) for head in heads) for one in wanted)

    units = next((one for one in lines if _are_units(one[1])), (-1, []))
    texts = [one for one in lines if needs or not _are_units(one[1])]
    usual = [(at, row) for at, row in texts if units[1] or not any(map(_is_number, row))]
    names = next((one for one in texts if is_complete(one[1])), None)
    names = names or next((one for one in usual if one != units), (-1, []))
    heads = [_Head.of(cell) for cell in names[1] or [""] * len(units[1])]
    if names == units:
        heads = [_Head(cell) for cell in names[1]]  # `Second,Volt` are both
    for n, cell in enumerate(units[1][: len(heads)]):
        if _is_unit(cell) and not heads[n].unit:
            heads[n] = _Head(heads[n].name, cell)
    return heads, sorted({names[0], units[0]} - {-1})


def _header_cells(line: str, mark: str | None, width: int) -> list[str]:
    """Cells of a line above the rows, by their delimiter or another one."""
    if not (text := re.sub(r"^[ #%!/]+", "", line.rstrip(" "))):
        return []
    row = _cells(text, mark or "\t")
    if len(row) > width and _LABEL.fullmatch(row[0]):
        row = row[1:]
    if (mark or not width) and (len(row) >= width or (len(row) > 1 and _are_units(row))):
        return row
    rows = [*(_cells(text, one) for one in "\t;,"), re.split(r"\s{2,}", text)]
    rows += [re.split(r"\s+(?![\[(])", text)] * (mark is None)
    return next((row for row in rows if len(row) == width), [])


def _find_settings(
    above: Sequence[str], mark: str | None, decimal: str, wanted: Sequence[Column]
) -> tuple[dict[str, float], dict[str, str]]:
    """`step` and `start`, s, of rows without a time; units of columns by their names."""
    found: dict[str, float] = {}
    units_of: dict[str, str] = {}
    before: list[str] = []
    for line in above:
        if mark == "," and not re.search("[:=]", line):
            line = "\t".join(_cells(line, ","))
        line = re.sub(r'\d+:\d\d\S*|"', "", line)  # a clock time
        cells = re.split(
            r"[\t;]|[=:][\s,]*|,(?!\d)|(?<!\d),|(?<!\d)\s+(?=[-+]?[.\d])", line.strip(" #")
        )
        # A key is above its number, or before it, perhaps with a cell between them.
        pairs = [*zip(before, range(len(cells)))]
        pairs += [(key, n) for gap in (2, 1) for n, key in enumerate(cells[:-gap], gap)]
        for key, n in pairs:
            head = _Head.of(key)
            kind = next((k for k, keys in _SETTINGS.items() if re.fullmatch(keys, head.key)), "")
            if not kind:
                continue
            value, unit = _parse(cells[n], _find_decimal([[cells[n]]], decimal) or ".")
            if math.isnan(value) or (value <= 0.0 and kind != "start"):
                continue
            units = (unit, head.unit, *cells[n + 1 : n + 2])
            if kind == "rate":
                prefix = next((one[0] for one in map(_HERTZ.match, units) if one), "")
                value *= {"": 1.0, "k": 1e3, "m": 1e6, "g": 1e9}[prefix.lower()]
                found["step"] = 1.0 / value
            else:
                found[kind] = value * next((size for si, size in map(_si, units) if si == "s"), 1.0)
        for key, cell in zip(cells, [*cells[1:], ""]):
            head = _Head.of(_UNIT_OF.sub("", key))
            for one in wanted if not _is_number(cell) else []:
                for unit in (head.unit, cell):
                    if head.key in (*one.heads, "horizontal") and _si(unit)[0] == one.unit:
                        units_of[one.name] = unit
        before = cells
    return found, units_of


def _places(text: _Text, one: Column, given: _Head, wanted: Sequence[Column]) -> list[int]:
    """The numbers of the columns that this may be."""
    heads, rows = text.heads, len(text.heads) - 1
    others = [other for other in wanted if other.optional and other is not one]
    if given.key == "row":
        return [rows]
    if given.name:
        number = int(given.name) if given.name.isdecimal() else 0
        found = [n for n, head in enumerate(heads) if head.key and head.key == given.key]
        found = found or [number - 1] * (0 < number <= rows)
    else:
        named = [n for n, head in enumerate(heads) if head.names(one)]
        found = [n for n in named if heads[n].key in one.heads]
        found = found or [n for n in named if not any(map(heads[n].names, others))]
        if not found and one in (TIME, FORCE):
            found = [n for n, head in enumerate(heads) if _si(head.unit)[0] == one.unit]
            if len(found) != 1:
                found = [0] * (one is TIME and heads[0].key in _COUNTS)
    empty = not any(cell for n in found for cell in text.columns[n])
    return [rows] if empty and one is TIME and "step" in text.settings else found


def _values(text: _Text, place: int) -> tuple[np.ndarray, str]:
    """Numbers of a column, NaN where there is none or it has another unit, and their unit."""
    found = [_number(cell, text.decimal or ".") for cell in text.columns[place]]
    own = text.heads[place].unit or found[0][1]
    return np.array([v if not u or _si(u) == _si(own) else math.nan for v, u in found]), own


def _counts(text: _Text, place: int, values: np.ndarray, unit: str) -> bool:
    """Whether a column counts rows, from any number on; of a decimated record in larger steps."""
    read = np.flatnonzero(np.isfinite(values))
    if _si(unit)[0] == "s":
        return False
    if text.heads[place].key in _COUNTS:
        return not np.any(values[read] % 1.0)
    return "step" in text.settings and not np.any(np.diff(values[read] - read))


def _find_decimal(columns: Iterable[Collection[str]], usual: str = "") -> str:
    """The decimal mark by which most numbers with a mark are some; empty if none has a mark.

    Numbers such as 1,250 may be of either kind, as `usual` says; in a column that has 999 too they
    have marks of thousands. Otherwise a ValueError.
    """
    commas = [[cell for cell in dict.fromkeys(column) if "," in cell] for column in columns]
    points = [cell for column in columns for cell in column if "." in cell]
    if not any(commas) and usual != ",":
        return "." if points else usual
    marked = [*chain(points, *commas)]
    point, comma = (sum(map(bool, map(one.fullmatch, marked))) for one in _NUMBERS.values())
    if point != comma:
        return "." if point > comma else ","
    for column, cells in zip(columns, commas):
        either = [*filter(_NUMBERS["."].fullmatch, cells)]
        if either and not usual and not any(map(_SMALL.fullmatch, column)):
            values = " or ".join(f"{_parse(either[0], mark)[0]:.10g}" for mark in _NUMBERS)
            how = "write numbers with a decimal point, without marks of thousands"
            raise ValueError(f"{either[0]!r} may be {values}: {how}")
    return usual or "."


def _parse(cell: str, decimal: str) -> tuple[float, str]:
    """A number, otherwise NaN, and the text behind it."""
    match = _NUMBERS[decimal].fullmatch(cell)
    return (
        (float(match[1].translate(_PYTHONS[decimal])), match[2] or "") if match else (math.nan, "")
    )


def _number(cell: str, decimal: str) -> tuple[float, str]:
    """Its value, and its unit if it has one; infinite for a mark of overflow, otherwise NaN."""
    value, unit = _parse(cell, decimal)
    if math.isnan(value) and _OVERFLOW.fullmatch(cell):
        return math.inf, ""
    return (value, unit) if not unit or _is_unit(unit) else (math.nan, "")


def _is_number(cell: str) -> bool:
    return any(math.isfinite(_number(cell, mark)[0]) for mark in _NUMBERS)


def _begins(row: Sequence[str]) -> bool:
    """Whether a row begins with a number."""
    return bool(row) and _is_number(row[0])


def _are_overflows(values: np.ndarray) -> np.ndarray:
    """Infinite values, those of 9.9E+37, and the largest if its digits are nines and far above."""
    sizes = np.abs(values)
    *_, other, largest = [0.0, 0.0, *np.unique(sizes[sizes < 9e36])]
    nines = re.fullmatch(r"(?=.{4})9+\.?9*", f"{largest:.8g}")
    alone = bool(nines) and other < 0.5 * largest
    return (sizes >= 9e36) | (alone & (sizes == largest))


def _si(text: str) -> tuple[str, float]:
    """The SI unit of a unit, V of a sensor's signal, and its size in it; "" of what is none.

    A unit is a symbol or a word, perhaps in brackets or behind a channel (CH1:V).
    """
    unit = text.rpartition(":")[2].strip("[](){}<> ")
    word = unit.lower().removesuffix("s")
    if volts := _VOLTS.get(word):
        return "V", volts
    return SYMBOLS.get(symbol_of(_WORDS.get(word, unit)), ("", 0.0))


def _is_unit(text: str) -> bool:
    return bool(_si(text)[0]) and not text.isdigit()


def _are_units(row: Sequence[str]) -> bool:
    rest = [cell.strip("[](){}<> ") for cell in row if not (_is_unit(cell) or _is_number(cell))]
    return any(map(_is_unit, row)) and all(map(_BESIDE_UNITS.fullmatch, rest))


def _factor(text: str, own: str, unit: str) -> float:
    """From a unit to the SI unit; 0 if it is one of something else.

    A sensitivity, 2 kN/V or 10 mV/N, is that of a sensor whose column is in V, or in mV by its own
    unit; a number before a unit is a factor, 1.6 us.
    """
    if not text:
        return 1.0
    value, symbol = _parse(text, "." if "." in text else ",")
    if not symbol:
        value, symbol = 1.0, text
    si, size = _si(symbol)
    if si == unit:
        return value * size
    (over, of_over), (under, of_under) = map(_si, symbol.partition("/")[::2])
    signal = _si(own)[1] if _si(own)[0] == "V" else 1.0
    if (over, under) == (unit, "V"):
        return value * of_over / of_under * signal
    return signal * of_under / (value * of_over) if (over, under) == ("V", unit) and value else 0.0
