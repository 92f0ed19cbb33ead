"""What a scenario gives back: cases, tables, checks, trajectories, figures and words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure


@dataclass
class Table:
    """A table as it is printed: text cells, the first column naming the row."""

    title: str
    columns: list[str]
    rows: list[list[str]]


@dataclass(frozen=True)
class Check:
    """Something that the scenario claims and has looked at."""

    claim: str
    passed: bool
    detail: str


@dataclass
class Outcome:
    """All that one scenario found.

    Attributes:
        title: one line.
        cases: metrics by case; what results.json holds.
        commands: by case, the line that reopens it in `golf-impact explore`.
        tables: in the order in which they are shown.
        checks: what was claimed and whether it holds.
        trajectories: by file name without suffix: columns by name, arrays of one shape (n,).
        figures: by file name without suffix: a function that draws it, with the module `figures`.
        captions: of figures that have one, by the same names: what there is to see.
        words: the conclusions.
    """

    title: str
    cases: dict[str, dict[str, float]] = field(default_factory=dict)
    commands: dict[str, str] = field(default_factory=dict)
    tables: list[Table] = field(default_factory=list)
    checks: list[Check] = field(default_factory=list)
    trajectories: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    figures: dict[str, Callable[[Any], Figure]] = field(default_factory=dict)
    captions: dict[str, str] = field(default_factory=dict)
    words: list[str] = field(default_factory=list)

    def check(self, claim: str, passed: bool, detail: str = "") -> None:
        """Record a claim and whether it holds."""
        self.checks.append(Check(claim, bool(passed), detail))

    def check_close(
        self, claim: str, value: float, expected: float, tolerance: float, why: str = ""
    ) -> None:
        """Record that a value is within an absolute tolerance of what is expected, and why that."""
        off = abs(value - expected)
        detail = f"{value:.10g} against {expected:.10g}: off by {off:.2g}, allowed {tolerance:.2g}"
        self.check(claim, off <= tolerance, f"{detail} ({why})" if why else detail)
