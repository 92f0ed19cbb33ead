"""The source document: its printed numbers and statements, and how they are read here.

Its numbers (document.toml) are those of an explicit Euler scheme, stopped a few samples after the
end of contact; they differ by some tenths of a per cent from the exact solution of its equations.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from golf_impact.data.files import read_toml
from golf_impact.data.quantities import QUANTITIES, derived, describe, format_percent

#: The numerical error of the document, relative: the exact solution may differ from a printed
#: number by this and half a printed digit. The largest errors are 0.53 % in COR at k = 2e6 N/m
#: (0.0051; half a digit is 0.005) and 0.48 % in the ball speed printed there.
NUMERICAL_ERROR = 0.005

#: A table of a result: title, columns, rows of texts.
Table = tuple[str, list[str], list[list[str]]]


@dataclass(frozen=True)
class Printed:
    """A printed number: `text`, in a unit that is `scale` SI units."""

    text: str
    scale: float = 1.0

    @property
    def value(self) -> float:
        """The number in SI units."""
        return float(self.text) * self.scale

    @property
    def half_digit(self) -> float:
        """Half a unit of the last printed digit, in SI units."""
        return 0.5 * 10.0 ** -len(self.text.partition(".")[2]) * self.scale

    def is_near(self, value: float, halves: float = 1.0) -> bool:
        """Whether a value (SI) is within so many half units of the last printed digit."""
        return abs(value - self.value) <= halves * self.half_digit


class Case(NamedTuple):
    """A case of the document."""

    values: dict[str, float]  #: inputs (SI units) that differ from the FMU's start values
    printed: dict[str, Printed]  #: by quantity


class Deviation(NamedTuple):
    """A printed number (in SI units) that the document's own scheme doesn't give."""

    case: str  #: in words
    printed: str
    scheme: str  #: what the scheme gives
    remark: str


_DATA = read_toml(Path(__file__).with_suffix(".toml"))

#: Units, in SI units, of what isn't printed in SI units: µs and %.
_SCALES = {"contact_time": 1e-6, "energy_efficiency": 0.01}


def _printed(texts: Any) -> dict[str, Printed]:
    """Numbers by quantity; a list has those of a case or of a row of a table."""
    if isinstance(texts, list):
        names = next(n for n in (_DATA["of_a_case"], _DATA["of_a_row"]) if len(n) == len(texts))
        texts = dict(zip(names, texts))
    return {name: Printed(text, _SCALES.get(name, 1.0)) for name, text in texts.items()}


#: The cases by name.
CASES = {
    name: Case(case["values"], _printed(case["printed"])) for name, case in _DATA["cases"].items()
}

#: Name, unit, and as texts the value in Table 1 and the one that gives the printed numbers.
PARAMETERS = _DATA["parameters"]
TABLE_1 = {name: float(printed) for name, _, printed, _ in PARAMETERS}

#: The figures of Roh & Lee (SI units).
ROH_LEE = _DATA["roh_lee"]

#: By case and quantity.
NOT_REPRODUCED = {tuple(row.pop("at")): Deviation(**row) for row in _DATA["not_reproduced"]}

#: What the document says that can't be taken literally (`printed`), why (`problem`), how it is read
#: here (`reading`), and the `file` and the `symbol` in it that implement it.
READINGS: list[dict[str, str]] = _DATA["readings"]


def compare(name: str, results: Mapping[str, float]) -> Table:
    """A table of a case: each printed number beside the exact one, and its deviation in %."""
    values, printed = CASES[name]
    exact, rows = derived(results, values), []
    for quantity, number in printed.items():
        about, value = QUANTITIES[quantity], exact[quantity]
        deviation = format_percent(number.value / value - 1.0)
        rows.append([about.label, number.text, about.format_value(value), deviation])
    title = f"{name}: {describe(values)}"
    return title, ["", "document", "exact", "deviation (%)"], rows


def agrees(name: str, results: Mapping[str, float]) -> bool:
    """Whether every printed number of a case is the exact one within its numerical error."""
    values, printed = CASES[name]
    exact = derived(results, values)
    return all(
        abs(exact[quantity] - number.value) <= NUMERICAL_ERROR * number.value + number.half_digit
        for quantity, number in printed.items()
    )


def tables() -> list[Table]:
    """How the document is read here, its parameters, and what its scheme doesn't give."""
    readings = [
        [row["printed"], row["problem"], row["reading"], f"{row['file']}: {row['symbol']}"]
        for row in READINGS
    ]
    columns = ["the document says", "why not literally", "how it is read here", "implemented in"]
    parameters = [[f"{name} ({unit})", *values] for name, unit, *values in PARAMETERS]
    not_reproduced = [list(deviation) for deviation in NOT_REPRODUCED.values()]
    return [
        ("What the document says and how it is read", columns, readings),
        (
            "Table 1 and the values that the printed results come from",
            ["parameter", "Table 1", "used"],
            parameters,
        ),
        (
            "Printed numbers that the document's scheme doesn't reproduce",
            ["number", "printed", "its scheme gives", "remark"],
            not_reproduced,
        ),
    ]
