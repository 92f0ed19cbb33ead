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
    """All that one scenario found; figures and trajectories by file name without suffix."""

    title: str
    #: Metrics by case; what results.json holds.
    cases: dict[str, dict[str, float]] = field(default_factory=dict)
    #: By case, the line that reopens it in `golf-impact explore`.
    commands: dict[str, str] = field(default_factory=dict)
    tables: list[Table] = field(default_factory=list)
    checks: list[Check] = field(default_factory=list)
    #: Columns by name, arrays of one shape (n,).
    trajectories: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    #: Functions that draw them, with the module `figures`, and what there is to see.
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
