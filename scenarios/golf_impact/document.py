"""The source document: its equations and printed numbers, and how they are read here.

Its numbers (document.toml) are those of an explicit Euler scheme, stopped a few samples after the
end of contact; they differ by some tenths of a per cent from the exact solution of its equations.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from golf_impact.toml import read_toml

#: The step of the document's scheme, s.
TIME_STEP = 0.5e-6

#: The document's program continues for 2 or 3 samples after the end of contact, until the bodies
#: are this far apart, m; 35 to 48 µm give the same printed numbers.
END_GAP = 36e-6

#: The numerical error of the document, relative: the exact solution may differ from a printed
#: number by this and half a printed digit. The largest errors are 0.53 % in COR at k = 2e6 N/m
#: (0.0051; half a digit is 0.005) and 0.48 % in the ball speed printed there.
NUMERICAL_ERROR = 0.005


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


class Deviation(NamedTuple):
    """A printed number (in SI units) that the document's own scheme doesn't give."""

    case: str  #: in words
    printed: str
    scheme: str  #: what the scheme gives
    remark: str


_DATA = read_toml(Path(__file__).with_suffix(".toml"))

#: Units, in SI units, of what isn't printed in SI units: µs and %.
_SCALES = {"contact_time": 1e-6, "energy_efficiency": 0.01, "energy lost": 0.01}


def _printed(names: Iterable[str], texts: Iterable[str]) -> dict[str, Printed]:
    pairs = zip(names, texts, strict=True)
    return {name: Printed(text, _SCALES.get(name, 1.0)) for name, text in pairs}


#: Name, unit, and as texts the value in Table 1 and the one that gives the printed numbers.
PARAMETERS = _DATA["parameters"]
TABLE_1 = {name: float(printed) for name, _, printed, _ in PARAMETERS}
USED = {name: float(used) for name, _, _, used in PARAMETERS}

_CASE, _ROW = _DATA["of_a_case"], _DATA["of_a_row"]
_SOFT, _ENVELOPE = _DATA["elastic_soft"], _DATA["envelope"]

# Printed numbers by metric; of several cases by club speed (m/s), k (N/m), or k and b (N·s/m).
BASELINE = _printed(_CASE, _DATA["baseline"])
ELASTIC = _printed(_CASE, _DATA["elastic"])
ELASTIC_SOFT = _printed(_SOFT.keys(), _SOFT.values())
CLUB_SPEED = {speed: _printed(_ROW, texts) for speed, *texts in _DATA["club_speed"]}
COMPRESSION = {k: _printed(_ROW, texts) for k, *texts in _DATA["compression"]}
OLD_BALL = {(k, b): _printed(_ROW, texts) for k, b, *texts in _DATA["old_ball"]}

#: The figures of Roh & Lee (SI units), and the document's rough calculation with them.
ROH_LEE = _DATA["roh_lee"]
ENVELOPE = _printed(_ENVELOPE.keys(), _ENVELOPE.values())

#: By case and metric of the scenario finite_difference, which checks these values.
NOT_REPRODUCED = {tuple(row.pop("at")): Deviation(**row) for row in _DATA["not_reproduced"]}

#: What the document says that can't be taken literally (`printed`), why (`problem`), how it is read
#: here (`reading`), and the `file` and beginning of the `line` that implement it.
READINGS: list[dict[str, str]] = _DATA["readings"]

#: Title and columns of the tables of these, of the parameters and of the numbers not reproduced.
TABLES: list[dict[str, Any]] = _DATA["tables"]
