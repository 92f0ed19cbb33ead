"""Styles of lines and points in figures: one style for one thing. Doesn't import matplotlib."""

from typing import Any, NamedTuple

#: Okabe & Ito's colours, which common colour vision deficiencies keep distinct, and a darker one.
BLUE, ORANGE, GREEN, SKY = "#0072B2", "#E69F00", "#009E73", "#56B4E9"
VERMILION, PURPLE, BLACK, INDIGO = "#D55E00", "#CC79A7", "#000000", "#332288"


class Style(NamedTuple):
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


_LAW_1 = Style(VERMILION, "--", "s")
_KELVIN_VOIGT = Style(GREEN, "-.", "^")
_TSUJI = Style(PURPLE, ":", "D")
_POWER_LAW = Style(INDIGO, "-", "o")
_LESS, _MORE = Style("#74B9E6", "--", "v"), Style("#00304F", "-.", "^")

#: The style of each thing in all figures: bodies, contact laws and the balls that follow them, and
#: a smaller or larger value of a quantity than the baseline's.
STYLES = {
    "club": Style(ORANGE, "--", "s"),
    "ball": Style(BLUE),
    "less": _LESS,
    "baseline": Style(BLUE),
    "more": _MORE,
    "law 1": _LAW_1,
    "law 2": _KELVIN_VOIGT,
    "Tsuji": _TSUJI,
    "power law": _POWER_LAW,
    "document": _LAW_1,
    "document-old": Style("#882255", (0, (4, 1, 1, 1, 1, 1)), "X"),
    "roh-lee-linear": _KELVIN_VOIGT,
    "roh-lee-tsuji": _TSUJI,
    "roh-lee": _POWER_LAW,
    "penner": Style(SKY, "-", "v"),
    "tour": Style(BLACK, (0, (6, 2)), "*"),
    "rating-low": _LESS,
    "rating-mid": Style(BLUE, "-", "h"),
    "rating-high": Style(_MORE.colour, "-.", "P"),
    # Methods, with Tol's muted colours.
    "this FMU, metrics only": Style(BLACK, "", "*"),
    "this FMU, read every step": Style(BLUE, "-", "."),
    "the document's scheme as FMU": Style(VERMILION, "-", "s"),
    "explicit Euler, Python": Style(VERMILION, ":", "o"),
    "explicit Euler, C FMU": Style("#999933", "-", "o"),
    "Runge–Kutta 4, C FMU": Style("#999933", "--", "D"),
    "Störmer–Verlet": Style("#117733", "-", "^"),
    "Runge–Kutta 4": Style("#117733", "--", "D"),
    "SciPy RK45": Style("#44AA99", "-", "v"),
    "SciPy DOP853": Style("#44AA99", "--", "P"),
    "SciPy LSODA": Style("#AA4499", "-", "<"),
    "SciPy Radau": Style("#AA4499", "--", ">"),
}
