"""Tables as labs, oscilloscopes, loggers and launch monitors export them.

The csv readers of pandas and pyarrow need delimiter, decimal mark, the number of lines to skip and
the units beforehand; finding these is what this module does, and a row is then two calls of float.
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
    """A column that is searched: words of its head, any of which names it."""

    name: str
    unit: str  #: SI
    heads: tuple[str, ...]  #: in small letters, letters and digits alone
    optional: bool = False


TIME = Column("time", "s", ("time", "t", "zeit", "xaxis", "xvalue", "seconds", "second"))
FORCE = Column("force", "N", ("force", "f", "kraft", "load", "fz", "newton"))
SIGMA = Column("sigma", "N", ("sigma", "σ", "std", "uncertainty", "unsicherheit"), True)
SPEED = Column("approach_speed", "m/s", ("approachspeed", "approachvelocity", "speed", "velocity",
    "v", "clubspeed", "clubheadspeed", "impactspeed", "geschwindigkeit"))  # fmt: skip
COR = Column("cor", "1", ("cor", "coefficientofrestitution", "restitution", "e", "stosszahl"))
COR_SIGMA = SIGMA._replace(unit="1")
CLUB = Column("club_speed", "m/s", ("clubspeed", "clubheadspeed", "headspeed", "swingspeed",
    "speedclub", "clubvelocity", "club"))  # fmt: skip
BALL = Column("ball_speed", "m/s", ("ballspeed", "speedball", "ballvelocity", "ball"))

#: Units in words; those of a sensor's signal in V; marks of units that don't matter here.
_WORDS = {
    "second": "s", "sec": "s", "millisecond": "ms", "msec": "ms", "microsecond": "us", "usec": "us",
    "newton": "N", "kilonewton": "kN", "volt": "V", "millivolt": "mV", "pound": "lbf",
}  # fmt: skip
_VOLTS = {"V": 1.0, "mV": 1e-3}
_OTHER = {"", "-", "sequence", "none", "a", "deg", "°", "rpm", "yd", "yds", "yards", "feet", "pts",
          "g", "°c", "degrees", "m/s2", "m/s²", "pc"}  # fmt: skip

#: Heads of columns that count rows; keys of the time between rows, of its inverse, of the start.
_COUNTS = ("x", "sequence", "index", "point", "points", "sample", "samples", "nr", "no", "row", "n")
_STEPS = re.compile(
    r"x?incr?(ement)?|tinc|d[xt]|delta[xt]|(sampl(e|ing)|abtast)(interval|intervall|period|periode|"
    r"zeit|time)|interval|timestep|timeinterval|hresolution|wf_?x?increment|xincrement"
)
_RATES = re.compile(r"(sampl(e|ing)?|abtast|mess)(rate|frequency|frequenz|freq)|hz")
_STARTS = re.compile(
    r"start|[xt]0|xorigin|xzero|[xh]offset|wf_?x?start_?offset|starttime|firstx|tstart"
)

#: A number as instruments write it, by its decimal mark: with marks of thousands.
_NUMBER = {
    mark: re.compile(
        rf"[-+−]?(?:\d{{1,3}}(?:[{other}'’ \u00a0\u202f]\d{{3}})+|\d+)?(?:[{mark}]\d*)?"
        r"(?:[eEdD][-+]?\d+)?"
    )
    for mark, other in ((".", ","), (",", "."))
}
_PLAIN = {
    mark: {**dict.fromkeys(map(ord, f"{other}'’ \u00a0\u202f")), ord(mark): ".", ord("−"): "-",
           ord("d"): "e", ord("D"): "e"}
    for mark, other in ((".", ","), (",", "."))
}  # fmt: skip
_OVERFLOW = re.compile(
    r"[-+]?(over.*|ov[fl]|ovrl|ol|clip(ped)?|inf(inity)?|∞|9{5,}|9*\.9{4,})", re.I
)
_CLOCK = re.compile(r".*\d?\d:\d\d.*|\d{1,4}[-/.]\d\d[-/.]\d{1,4}.*")
_SUMMARY = re.compile(
    r"(average|avg|mean|st(andar)?d|dev|median|min|max|total|mittel|durch).*", re.I
)
_LOOKED_AT = 2000

Head = tuple[str, str]


class Table(NamedTuple):
    """Columns in SI units by name."""

    columns: dict[str, np.ndarray]
    where: Callable[[int], str]  #: the place of a row (from 0)
    notes: list[str]  #: what was left out or assumed, in sentences
    clipped: bool = False  #: whether there were marks of an overflow
    bare: tuple[str, ...] = ()  #: columns whose unit stands nowhere


def read_table(
    path: Path, wanted: Sequence[Column], chosen: str = "", missing: float = 0.01
) -> Table:
    """Columns of a text file, in SI units.

    Args:
        path: in UTF-8, UTF-16 or 8 bits; its other columns may hold anything.
        wanted: what is searched.
        chosen: heads or numbers of these columns, with units or a sensor's sensitivity:
            "t [ms],F", "TIME [s],CH2 [2 kN/V]", "1 [s],3 [10 mV/N]".
        missing: share of rows that may be unreadable.

    Raises:
        UserError: it can't be read; the line, the column and what is expected are named.
    """
    lines = _lines(path)
    mark, cells = _delimited(lines)
    numeric = [{n for n, cell in enumerate(row) if _looks_numeric(cell)} for row in cells]
    tail = [frozenset(one) for one in numeric if one][-_LOOKED_AT:]
    common = Counter(tail[len(tail) // 2 :]).most_common()
    wide = [one for one, count in common if len(one) > 1 and count > 0.5 * common[0][1]]
    usual = max(wide, key=len) if wide else common[0][0] if common else frozenset()
    pure = [len(one) == sum(map(bool, row)) for one, row in zip(numeric, cells)]
    alike = [n for n, one in enumerate(numeric) if usual and usual <= one]
    if alike and pure[alike[-1]]:
        alike = [n for n in alike if pure[n]]
    first = alike[0] if alike else len(lines)
    while first and len(numeric[first - 1] & usual) > 0.7 * len(usual):
        first -= 1
    count = len(cells[first]) if first < len(lines) else 0
    texts = [one.strip() for one in re.split(r"[,;](?![^\[(]*[\])])", chosen)] if chosen else []
    heads, header, letters = _header(lines[:first], mark, count, wanted, texts)
    sampling = _sampling(lines[:first], mark)
    have = f"its header is {header!r}" if header else "it has no header"
    names = ",".join(one.name for one in wanted if not one.optional)
    advice = (
        f"; expected {names}; choose columns by name or number: --columns 'TIME [s],CH2 [2 kN/V]'"
    )
    if FORCE not in wanted:
        advice = f"; expected {names}; choose columns by name or number: --columns '1 [mph],2'"
    if letters and not heads and not chosen and not sampling:
        raise UserError(
            f"{path} is refused: the line {letters!r} above its numbers is no header of {count} columns{advice}"  # noqa: E501
        )
    heads = heads or [("", "")] * count
    if not header and not chosen and count == sum(not one.optional for one in wanted):
        heads = [(_plain(one.name), "") for one in wanted][:count]
    rows = [n for n in range(first, len(lines)) if cells[n]]
    while rows and not numeric[rows[-1]]:
        rows.pop()  # a footer
    if CLUB in wanted:
        rows = [n for n in rows if not any(map(_SUMMARY.fullmatch, cells[n]))]
    decimal = _decimal(
        [cells[n][c] for n in rows[:_LOOKED_AT] for c in usual if c < len(cells[n])], mark
    )
    if len(texts) == 1 and len(wanted) > 1 and wanted[0] is TIME and sampling:
        texts.insert(0, "row")
    columns: dict[str, np.ndarray] = {}
    bad: dict[int, tuple[int, str, str]] = {}
    clipped: dict[int, None] = {}
    bare: list[str] = []
    counts = False
    for n, one in enumerate(wanted):
        given = _head(texts[n]) if n < len(texts) else ("", "")
        if texts and not given[0] and (n >= len(texts) and one.optional):
            continue
        place = _place(one, given[0], heads, wanted)
        if place is None and one is TIME and (sampling or given[0] == "row"):
            place = -1
        if (
            one is TIME
            and sampling
            and isinstance(place, int)
            and rows
            and not cells[rows[0]][place]
        ):
            place = -1  # its cells are empty
        if place is None and one.optional and not given[0]:
            continue
        if place is None or isinstance(place, str):
            raise UserError(
                f"{path} is refused: {place or 'no'} column{'s' * bool(place)} {given[0] or one.name}; {have}{advice}"  # noqa: E501
            )
        own = heads[place][1] if place >= 0 else ""
        if not own and place >= 0 and rows and place < len(cells[rows[0]]):
            own = _unit(cells[rows[0]][place].partition(" ")[2])  # 95.3 mph
        factor = _factor(given[1], own, one.unit)
        counted = one is TIME and (place < 0 or _counts(cells, rows, place, decimal))
        if not factor and counted and (sampling or given[1]) and not given[1]:
            factor = 1.0
        if not factor:
            known = ", ".join(symbol for symbol, (si, _) in SYMBOLS.items() if si == one.unit)
            known += ", or a sensor's sensitivity such as 2 kN/V or 10 mV/N" * (one.unit == "N")
            raise UserError(
                f"{path}: the unit {given[1] or own!r} of {one.name} is none of {known}; {have}"
            )
        values = np.arange(float(len(rows))) if place < 0 else np.empty(len(rows))
        for at, row in enumerate(rows if place >= 0 else ()):
            cell = cells[row][place] if place < len(cells[row]) else ""
            try:
                values[at] = _value(cell, decimal)
            except ValueError:
                values[at] = math.inf if _OVERFLOW.fullmatch(cell) and one is not TIME else math.nan
            if math.isnan(values[at]):
                bad.setdefault(at, (place, one.name, cell))
        if one is FORCE:
            finite = np.abs(values[np.abs(values) < 9e36])
            nines = [c for c in (9999.9, 99999.0, 99999.9, 999999.0) if np.any(np.abs(values) == c)]
            for c in nines:
                if not np.any((finite > 0.5 * c) & (finite != c)):
                    values[np.abs(values) == c] = math.inf
            clipped = dict.fromkeys(np.flatnonzero(np.abs(values) >= 9e36).tolist())
        if counted and not given[1] and sampling and not _time_unit(own):
            values = sampling[0] * values + sampling[1]
            factor, counts = 1.0, True
        elif counted and not given[1] and not own and heads[place][0] in _COUNTS:
            raise UserError(
                f"{path} is refused: column {header.split(mark or ' ')[place]!r} counts rows: give the time between them: --columns '{place + 1} [1.2 us],{place + 2} [N]'"  # noqa: E501
            )
        columns[one.name] = values * factor
        if not given[1] and not own and not counts and one.unit != "1":
            bare.append(one.name)
    notes = []
    if bad:
        at = min(bad)
        place, name, cell = bad[at]
        if len(bad) > missing * len(rows):
            why = "a clock time: give seconds" if _CLOCK.fullmatch(cell) else "it must be a number"
            what = f"{path}, line {rows[at] + 1}, column {place + 1} ({name}): {cell!r} is refused: {why}"  # noqa: E501
            raise UserError(what + (f"; {len(bad)} rows can't be read" if len(bad) > 1 else ""))
        notes.append(
            f"{len(bad)} unreadable row{'s' * (len(bad) > 1)} left out, the first in line {rows[at] + 1}"  # noqa: E501
        )
    if clipped:
        notes.append(f"{len(clipped)} rows at a mark of overflow are left out: clipped")
    if bad or clipped:
        kept = [at for at in range(len(rows)) if at not in bad and at not in clipped]
        rows = [rows[at] for at in kept]
        columns = {name: values[kept] for name, values in columns.items()}
    return Table(
        columns,
        lambda row: f"{path}, row {row + 1} (line {rows[row] + 1})",
        notes,
        bool(clipped),
        tuple(bare),
    )


def _lines(path: Path) -> list[str]:
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise UserError(f"can't read {path}: {error.strerror}") from error
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = raw.decode("utf-16", errors="replace")
    elif raw[:200].count(b"\0") > 0.3 * len(raw[:200]):
        text = raw.decode("utf-16-le" if raw[1:2] == b"\0" else "utf-16-be", errors="replace")
    else:
        try:
            text = raw.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = raw.decode("cp1252", errors="replace")  # instruments write µ in 8 bits
    lines = re.split(r"\r*\n|\r", text)
    if max(map(len, lines)) > (most := csv.field_size_limit()):
        raise UserError(f"can't read {path}: a line has more than {most} characters")
    return lines


def _split(line: str, mark: str | None) -> list[str]:
    """Cells of a line; a comment behind numbers is left out, and a mark at its end begins none."""
    if "#" in line:
        before = line.partition("#")[0]
        if not before.strip() or all(
            map(_looks_numeric, re.split(r"[\t;, ]+", before.strip('"\t;, ').replace('"', "")))
        ):
            line = before
    if not line.strip("\t;, "):
        return []
    if mark is None:
        return line.split()
    row = next(csv.reader([line], delimiter=mark)) if '"' in line else line.split(mark)
    row = [cell.strip(" ") for cell in row]
    while row and not row[-1]:
        row.pop()
    return row


def _looks_numeric(cell: str) -> bool:
    number, _, unit = cell.partition(" ")
    if unit and symbol_of(unit) in SYMBOLS and not unit.isdigit():
        cell = number  # 95.3 mph
    return any(c.isdigit() for c in cell) and any(one.fullmatch(cell) for one in _NUMBER.values())


def _delimited(lines: Sequence[str]) -> tuple[str | None, list[list[str]]]:
    """The delimiter by which most cells are numbers, and the cells of all lines."""
    step = max(1, len(lines) // _LOOKED_AT)
    looked_at = [line for line in lines if line.strip()]
    looked_at = looked_at[len(looked_at) // 2 :: step]  # what is above the rows doesn't count

    def score(mark: str | None) -> tuple[float, int]:
        if mark and not any(mark in line for line in looked_at):
            return 0.0, 0
        if mark is None and not any(len(line.split()) > 1 for line in looked_at):
            return 0.0, 1  # one column, unless another mark is there
        rows = [[cell for cell in _split(line, mark) if cell] for line in looked_at]
        numbers = sum(_looks_numeric(cell) for row in rows for cell in row)
        # Lines without any number are headers.
        every = sum(len(row) for row in rows if any(map(_looks_numeric, row)))
        return numbers / max(every, 1), numbers

    mark = max(("\t", ";", ",", None), key=score)
    return mark, [_split(line, mark) for line in lines]


def _decimal(cells: Sequence[str], mark: str | None) -> str:
    """The decimal mark, by what can't be a mark of thousands."""
    commas = [cell for cell in cells if "," in cell]
    if not commas:
        return "."
    if any(cell.rfind(".") > cell.rfind(",") for cell in commas):
        return "."
    thousands = all(re.fullmatch(r"[-+]?[1-9]\d{0,2}(,\d{3})+", cell) for cell in commas)
    points = any("." in cell and "," not in cell for cell in cells)
    return "." if thousands and (points or mark == "," or len(commas) < 0.5 * len(cells)) else ","


def _value(cell: str, decimal: str) -> float:
    try:
        return float(cell if decimal == "." else cell.replace(",", ".") if "." not in cell else "?")
    except ValueError:
        if any(c.isdigit() for c in cell) and _NUMBER[decimal].fullmatch(cell):
            return float(cell.translate(_PLAIN[decimal]))
        # 95.3 mph in a column of such cells.
        number, _, unit = cell.partition(" ")
        if unit and not any(c.isdigit() for c in unit) and symbol_of(unit) in SYMBOLS:
            return _value(number, decimal)
        raise


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9σ]", "", name.lower())


def _unit(text: str) -> str:
    """A unit's symbol, from a symbol or a word, perhaps in brackets."""
    text = text.strip().strip("[]() ")
    return _WORDS.get(text.lower().removesuffix("s"), "mV" if text == "MV" else text)


def _known(text: str) -> bool:
    return symbol_of(_unit(text)) in SYMBOLS or _unit(text).replace("v", "V") in _VOLTS


def _head(cell: str) -> Head:
    """Name and unit: `time [ms]`, `F/kN`, `t_us`, `Time (s) Run #1`."""
    cell = cell.strip().strip('"')
    brackets = [*re.finditer(r"[\[(]([^\])]*)[\])]", cell)]
    if brackets:
        one = next((b for b in reversed(brackets) if _known(b[1])), brackets[-1])
        name = (cell[: one.start()] + cell[one.end() :]).strip()
        return name, _unit(one[1])
    match = re.fullmatch(r"(.+?)\s*[/_ ,]\s*([^/_ ,]+(?:/[^/_ ]+)?)", cell)
    if match and _known(match[2]) and not re.fullmatch(r"x-axis|[a-z]+ \d+", cell, re.I):
        return match[1].strip(), _unit(match[2])
    return cell, ""


def _header(
    above: Sequence[str],
    mark: str | None,
    count: int,
    wanted: Sequence[Column],
    chosen: Sequence[str],
) -> tuple[list[Head], str, str]:
    """Heads of the columns, the header as written, and the last line with letters."""
    texts, letters = [], ""
    for line in above[-500:]:
        text = line.strip("\r ").lstrip("#%!/ ")
        if not text.strip("\t;, "):
            continue
        if re.search(r"[^\W\d_]", text) and not line.lstrip().startswith(("#", "%", "//", "!")):
            letters = text.strip()
        for other in (mark, "\t", ";", ","):
            row = _split(text.replace("#", "\0"), other)
            row = [cell.replace("\0", "#") for cell in row]
            if other is None:
                row = re.split(r"\s+(?![\[(])", text.strip())
            if (other == mark and len(row) >= count) or len(row) == count:
                texts.append((text.strip(), row))
                break
    rows = [(text, row) for text, row in texts if not all(map(_looks_numeric, row))]
    units: list[str] = []
    if (
        rows
        and any(map(_known, rows[-1][1]))
        and all(_known(c) or _unit(c).lower() in _OTHER or _looks_numeric(c) for c in rows[-1][1])
    ):
        text, units = rows.pop()
        letters = letters if rows else ""
    needed = [one for one in wanted if not one.optional]
    picked = {_plain(_head(one)[0]) for one in chosen if not _head(one)[0].isdigit()} - {"row"}
    names = [
        (text, row) for text, row in rows
        if (picked and picked <= {_plain(_head(cell)[0]) for cell in row})
        or all(any(_matches(one, _head(cell)[0]) for cell in row) for one in needed)
    ]  # fmt: skip
    if units and not names and (not rows or picked <= {_plain(cell) for cell in units}) and picked:
        return [(cell, _unit(cell)) for cell in units], text, ""  # `Second,Volt` are both
    names = names or [
        (text, row) for text, row in rows if not any(map(_looks_numeric, row[1:]))
    ] or [(text, row) for text, row in rows[-1:] if units]  # fmt: skip
    if not names:
        if units:
            return [(cell, _unit(cell)) for cell in units], text, ""
        return [], "", letters
    header, row = names[-1]
    heads = [_head(cell) for cell in row]
    if units:
        below = [_unit(cell) if _known(cell) else "" for cell in units]
        heads = [
            (name, unit or (below[n] if n < len(below) else ""))
            for n, (name, unit) in enumerate(heads)
        ]
        header += f" / {text}"
    return heads, header, ""


def _matches(one: Column, name: str) -> bool:
    if _plain(name) in one.heads:
        return True
    words = re.findall(r"[a-z0-9σ]+", name.lower())
    return one in (TIME, FORCE, SIGMA, COR) and any(w in one.heads and len(w) > 1 for w in words)


def _place(
    one: Column, given: str, heads: Sequence[Head], wanted: Sequence[Column]
) -> int | str | None:
    """The number of a column; None if there is none, how many there are if not one."""
    if given:
        if given == "row":
            return -1 if one is TIME else None
        found = [n for n, (name, _) in enumerate(heads) if name and _plain(name) == _plain(given)]
        if not found and given.isdigit() and 0 < int(given) <= len(heads):
            found = [int(given) - 1]
    else:
        others = [other for other in wanted if other is not one]
        exact = [n for n, (name, _) in enumerate(heads) if _plain(name) in one.heads]
        if one in (CLUB, BALL):
            exact = [
                n
                for n in exact
                if _plain(heads[n][0]) != one.heads[-1]
                or SYMBOLS.get(symbol_of(heads[n][1]), ("",))[0] == "m/s"
                or one is BALL
            ]
        found = exact[:1] if exact and one in (CLUB, BALL) else exact or [
            n for n, (name, _) in enumerate(heads)
            if _matches(one, name) and not any(o.optional and _matches(o, name) for o in others)
        ]  # fmt: skip
        if not found and one in (TIME, FORCE):
            found = [
                n
                for n, (_, unit) in enumerate(heads)
                if SYMBOLS.get(symbol_of(unit), ("",))[0] == one.unit
            ]
            found = found if len(found) == 1 else []
        if not found and one is TIME:
            found = [n for n, (name, _) in enumerate(heads[:1]) if _plain(name) in _COUNTS]
    return None if not found else found[0] if len(found) == 1 else str(len(found))


def _time_unit(text: str) -> bool:
    return SYMBOLS.get(symbol_of(text), ("",))[0] == "s"


def _counts(cells: Sequence[list[str]], rows: Sequence[int], place: int, decimal: str) -> bool:
    """Whether a column counts rows."""
    try:
        some = [_value(cells[n][place], decimal) for n in rows[:50]]
    except (ValueError, IndexError):
        return False
    return len(some) > 1 and some[0] in (0.0, 1.0) and set(np.diff(some)) == {1.0}


def _sampling(above: Sequence[str], mark: str | None) -> tuple[float, float] | None:
    """Time between rows and start, s, as lines above the rows say; None if none does."""
    found: dict[str, float] = {}
    pairs: list[tuple[str, str]] = []
    before: list[str] = []
    for line in above:
        cells = [
            cell.strip(' "')
            for cell in re.split(r"[\t;,]" if mark in (",", None) else r"[\t;]", line)
        ]
        pairs += [(c, " ".join(cells[n + 1 : n + 3])) for n, c in enumerate(cells[:-1])]
        pairs += [
            (m[1], m[2])
            for m in re.finditer(
                r"([A-Za-z_][\w .]*?(?:\s*[\[(][^\])]*[\])])?)\s*[=:]\s*([-+\d.].*?)(?=[,;\t]|$)",
                line,
            )
        ]
        pairs += [*zip(before, cells)]  # `Start,Increment` above their numbers
        before = cells
    for key, text in pairs:
        name, unit = _head(key)
        key = re.sub(r"[^a-z0-9]", "", name.lower())
        number = re.match(r"[\"\s:=]*([-+]?[\d.,]+(?:[eE][-+]?\d+)?)\s*\"?\s*([^\s,;\"]*)", text)
        if not number or not re.search(r"\d", number[1]) or ":" in text:
            continue
        try:
            value = _value(number[1], "." if "." in number[1] or "," not in number[1] else ",")
        except ValueError:
            continue
        symbol = _unit(unit or number[2])
        size = SYMBOLS[symbol_of(symbol)][1] if _time_unit(symbol) else 1.0
        if _STEPS.fullmatch(key) and value > 0.0:
            found.setdefault("step", value * size)
        elif _RATES.fullmatch(key) and value > 0.0:
            prefix = {"k": 1e3, "m": 1e6, "g": 1e9}.get(symbol[:1].lower(), 1.0)
            found.setdefault("rate", value * (prefix if symbol.lower() not in ("", "s") else 1.0))
        elif _STARTS.fullmatch(key):
            found.setdefault("start", value * size)
    step = found.get("step") or (1.0 / found["rate"] if "rate" in found else 0.0)
    return (step, found.get("start", 0.0)) if step else None


def _factor(given: str, own: str, unit: str) -> float:
    """From a column's given or own unit to the SI unit; 0 if it has another one.

    A sensitivity, 2 kN/V or 10 mV/N, is that of a sensor whose column is in V, or in mV by its own
    unit; a number before a unit is a factor, 1.6 us.
    """
    text = (given or own or unit).strip()
    match = re.fullmatch(r"([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?)?\s*(.*)", text)
    number, rest = (match[1], match[2]) if match else (None, text)
    if rest == "" and text == "1":
        number, rest = None, "1"
    size = float(number.replace(",", ".")) if number else 1.0

    def si(symbol: str) -> float:
        symbol = {"lb": "lbf", "lbs": "lbf"}.get(symbol.lower(), symbol) if unit == "N" else symbol
        found, factor = SYMBOLS.get(symbol_of(_unit(symbol)), ("", 0.0))
        return factor if found == unit else 0.0

    if si(rest):
        return size * si(rest)
    over, _, under = (part.strip() for part in rest.partition("/"))
    volts = {name.lower(): factor for name, factor in _VOLTS.items()}
    signal = volts.get(_unit(own).lower(), 1.0)
    if si(over) and _unit(under).lower() in volts:
        return size * si(over) / volts[_unit(under).lower()] * signal
    if _unit(over).lower() in volts and si(under) and size:
        return si(under) / (size * volts[_unit(over).lower()]) * signal
    return 0.0
