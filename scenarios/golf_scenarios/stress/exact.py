"""The right outcome of a peer's case, to 30 digits."""

from golf_scenarios.peers.problem import Case, Outcome
from golf_scenarios.stress.reference import Reference


def solve(case: Case) -> Outcome:
    """The outcome as mpmath numbers, of a case whose bodies part within its time limit."""
    reference = Reference({**vars(case), "gap": 0.0})
    reference.step(case.time_limit)
    outputs = reference.outputs()
    return Outcome(*(outputs[name] for name in Outcome._fields))
