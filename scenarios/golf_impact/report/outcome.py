"""Tables and checks: what a report consists of."""

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
        some = (f"{k} {sum(p)}{'' if all(p) else f' of {len(p)}'}" for k, p in counts.items() if p)
        parts.append(f"{sum(evidence)} of {len(evidence)} checks passed: {', '.join(some)}")
    if own:
        parts.append(f"consistency of the FMU with itself: {sum(own)} of {len(own)}")
    return "; ".join(parts)
