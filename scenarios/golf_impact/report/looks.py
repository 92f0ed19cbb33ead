"""Styles of lines and points in figures: one style for one thing. Doesn't import matplotlib."""

from typing import Any, NamedTuple

#: Okabe & Ito's colours, which common colour vision deficiencies keep distinct, and a darker one.
BLUE, ORANGE, GREEN, SKY = "#0072B2", "#E69F00", "#009E73", "#56B4E9"
VERMILION, PURPLE, BLACK, INDIGO = "#D55E00", "#CC79A7", "#000000", "#332288"


class Look(NamedTuple):
    """Colour, dashes and marker; the last two distinguish curves without colour."""

    colour: str
    dashes: Any = "-"
    marker: str = "o"

    @property
    def line(self) -> dict[str, Any]:
        """Keyword arguments of `plot` for a line."""
        return {"color": self.colour, "ls": self.dashes}

    @property
    def points(self) -> dict[str, Any]:
        """Keyword arguments of `plot` for a line with markers."""
        return {**self.line, "marker": self.marker}


_LAW_1 = Look(VERMILION, "--", "s")
_KELVIN_VOIGT = Look(GREEN, "-.", "^")
_TSUJI = Look(PURPLE, ":", "D")
_POWER_LAW = Look(INDIGO, "-", "o")
_LESS, _MORE = Look("#74B9E6", "--", "v"), Look("#00304F", "-.", "^")

#: The style of each thing in all figures: bodies, contact laws and the balls that follow them, and
#: a smaller or larger value of a quantity than the baseline's.
LOOKS = {
    "club": Look(ORANGE, "--", "s"),
    "ball": Look(BLUE),
    "less": _LESS,
    "baseline": Look(BLUE),
    "more": _MORE,
    "law 1": _LAW_1,
    "law 2": _KELVIN_VOIGT,
    "Tsuji": _TSUJI,
    "power law": _POWER_LAW,
    "document": _LAW_1,
    "document-old": Look("#882255", (0, (4, 1, 1, 1, 1, 1)), "X"),
    "roh-lee-linear": _KELVIN_VOIGT,
    "roh-lee-tsuji": _TSUJI,
    "roh-lee": _POWER_LAW,
    "penner": Look(SKY, "-", "v"),
    "tour": Look(BLACK, (0, (6, 2)), "*"),
    "rating-low": _LESS,
    "rating-mid": Look(BLUE, "-", "h"),
    "rating-high": Look(_MORE.colour, "-.", "P"),
    # Methods, with Tol's muted colours.
    "this FMU, metrics only": Look(BLACK, "", "*"),
    "this FMU, read every step": Look(BLUE, "-", "."),
    "the document's scheme as FMU": Look(VERMILION, "-", "s"),
    "explicit Euler, Python": Look(VERMILION, ":", "o"),
    "explicit Euler, C FMU": Look("#999933", "-", "o"),
    "Runge–Kutta 4, C FMU": Look("#999933", "--", "D"),
    "Störmer–Verlet": Look("#117733", "-", "^"),
    "Runge–Kutta 4": Look("#117733", "--", "D"),
    "SciPy RK45": Look("#44AA99", "-", "v"),
    "SciPy DOP853": Look("#44AA99", "--", "P"),
    "SciPy LSODA": Look("#AA4499", "-", "<"),
    "SciPy Radau": Look("#AA4499", "--", ">"),
}
