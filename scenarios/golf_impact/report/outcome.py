"""The result of a scenario: cases, tables, checks, trajectories, figures and conclusions."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure


#: What a check compares a result of the FMU with.
Kind = Literal["documents", "closed forms", "invariants", "statements", "consistency"]

KINDS: dict[Kind, str] = {
    "documents": "with what a publication prints or states",
    "closed forms": "with a solution of the same equations that is written independently of the "
    "FMU: a closed form or another integration",
    "invariants": "with what holds for every impact: balances of momentum and energy, symmetries",
    "statements": "with what the scenario itself states: a trend, a threshold",
    "consistency": "with other outputs of the same FMU, which is no evidence that either is right",
}


@dataclass
class Table:
    """A table as it is printed: cells of text (or rich.text.Text), the first one names the row."""

    title: str
    columns: list[str]
    rows: list[list[Any]]


@dataclass(frozen=True)
class Check:
    """A claim, and whether it holds."""

    claim: str  #: says what is compared with what
    passed: bool
    detail: str  #: the numbers
    kind: Kind


def summarize_checks(checks: Iterable[Check]) -> str:
    """How many checks passed, by kind; comparisons of the FMU with itself are counted apart."""
    counts = {kind: [check.passed for check in checks if check.kind == kind] for kind in KINDS}
    own = counts.pop("consistency")
    parts = []
    if evidence := [passed for of_kind in counts.values() for passed in of_kind]:
        kinds = (f"{kind} {_count(passed)}" for kind, passed in counts.items() if passed)
        parts.append(f"{sum(evidence)} of {len(evidence)} checks passed: {', '.join(kinds)}")
    if own:
        parts.append(f"consistency of the FMU with itself: {sum(own)} of {len(own)}")
    return "; ".join(parts)


def _count(passed: list[bool]) -> str:
    return str(len(passed)) if all(passed) else f"{sum(passed)} of {len(passed)}"


@dataclass
class Outcome:
    """The results of one scenario; figures and trajectories by file name without suffix."""

    title: str
    #: Metrics by case, as in results.json (SI units).
    cases: dict[str, dict[str, float]] = field(default_factory=dict)
    #: By case, the command that opens it in `golf-impact explore`.
    commands: dict[str, str] = field(default_factory=dict)
    tables: list[Table] = field(default_factory=list)
    checks: list[Check] = field(default_factory=list)
    #: Printed numbers that are known not to be reproduced, each in a sentence.
    deviations: list[str] = field(default_factory=list)
    #: Columns by name, arrays of one shape (n,).
    trajectories: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    #: Functions that plot them, given the module `figures`, and their captions.
    figures: dict[str, Callable[[Any], Figure]] = field(default_factory=dict)
    captions: dict[str, str] = field(default_factory=dict)
    #: The conclusion in a sentence, for the summary of all scenarios; empty if there is none.
    verdict: str = ""
    #: Of the names of its results.json and report.html, if it has files of its own.
    prefix: str = ""
    words: list[str] = field(default_factory=list)

    def check(self, claim: str, passed: bool, detail: str = "", kind: Kind = "statements") -> None:
        """Record a claim, which says what is compared with what; `detail` has the numbers."""
        self.checks.append(Check(claim, bool(passed), detail, kind))

    def check_close(
        self,
        claim: str,
        value: float,
        expected: float,
        tolerance: float,
        why: str = "",
        kind: Kind = "closed forms",
    ) -> None:
        """Record whether a value is within an absolute tolerance of the expected one.

        `claim` says what is compared with what, `why` is the reason for the tolerance.
        """
        error = abs(value - expected)
        detail = f"{value:.10g} against {expected:.10g}: error {error:.2g}, allowed {tolerance:.2g}"
        self.check(claim, error <= tolerance, f"{detail} ({why})" if why else detail, kind)
