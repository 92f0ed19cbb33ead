"""Styles of lines and points in figures: one style for one thing. Doesn't import matplotlib."""

from pathlib import Path
from typing import Any, NamedTuple

from golf_impact.toml import read_toml

#: Okabe & Ito's colours, which common colour vision deficiencies keep distinct.
BLUE, ORANGE, GREEN, SKY = "#0072B2", "#E69F00", "#009E73", "#56B4E9"
VERMILION, BLACK = "#D55E00", "#000000"


class Style(NamedTuple):
    """Colour, dashes and marker; the last two distinguish curves without colour."""

    colour: str
    dashes: Any
    marker: str

    @property
    def line(self) -> dict[str, Any]:
        """Keyword arguments of `plot` for a line."""
        return {"color": self.colour, "ls": self.dashes}

    @property
    def points(self) -> dict[str, Any]:
        """Keyword arguments of `plot` for a line with markers."""
        return {**self.line, "marker": self.marker}


#: The style of each thing in all figures; dashes of given lengths are a tuple to matplotlib.
STYLES = {
    name: Style(colour, dashes if isinstance(dashes, str) else (0, tuple(dashes)), marker)
    for name, (colour, dashes, marker) in read_toml(Path(__file__).with_suffix(".toml")).items()
}
