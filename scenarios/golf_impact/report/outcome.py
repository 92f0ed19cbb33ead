"""Tables and checks: what a report consists of."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, NamedTuple, get_args

#: What a check compares a result of the FMU with; report.html explains them.
Kind = Literal["documents", "closed forms", "invariants", "statements", "consistency"]
KINDS: tuple[Kind, ...] = get_args(Kind)


class Table(NamedTuple):
    """A table as it is printed: cells of text (or rich.text.Text), the first one names the row."""

    title: str
    columns: list[str]
    rows: list[list[Any]]


class Check(NamedTuple):
    """A claim, and whether it holds."""

    claim: str  #: states what is compared
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
