"""What was checked how often, and the worst case of each check."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Invariant:
    """What must hold, and how well it did; errors are without unit."""

    claim: str  #: in words
    tolerance: float  #: the largest error that passes
    worst: float = 0.0  #: the largest error seen
    count: int = 0  #: of evaluations
    failures: int = 0
    #: Where the worst error was seen: everything needed to see it again.
    case: Mapping[str, Any] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether it was evaluated, and never failed."""
        return self.count > 0 and self.failures == 0


class Ledger:
    """Checks by name; each claim is its name, its statement and the largest error that passes."""

    def __init__(self, *claims: tuple[str, str, float]) -> None:
        self.checks = {name: Invariant(claim, tolerance) for name, claim, tolerance in claims}

    def record(self, name: str, error: float, case: Mapping[str, Any], **where: Any) -> None:
        """Note one error of a check; `where` adds to the case, if this is the worst so far."""
        check = self.checks[name]
        check.count += 1
        check.failures += not error <= check.tolerance  # NaN is bad
        if not check.case or math.isnan(error) or error > check.worst:
            check.worst, check.case = error, {**case, **where}
