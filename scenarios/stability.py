"""Impacts far beyond golf by any communication steps: 80-digit arithmetic and invariants.

Errors are on the scales of golf_impact.evidence.scales. A seed repeats all impacts and steps.
"""

import random

import matplotlib.pyplot as plt
import numpy as np

from golf_impact.evidence.checks import check
from golf_impact.evidence.random_impacts import (
    critical_damping,
    extreme_impacts,
    random_impact,
)
from golf_impact.evidence.scales import TOLERANCE
from golf_impact.scenario import Result, main

CLAIMS = {
    "reference": "outputs agree with arithmetic of 80 digits",
    "patterns": "outputs at the end are the same by every pattern of steps",
    "momentum": "momentum changes by the force on the head and the drag alone",
    "energy": "energy rises by the work on the head alone, and falls by damping alone",
    "order": "forces, results so far and flags keep their bounds and their order",
    "state": "from a restored state outputs are the same to the last bit",
}
COLUMNS = ("", "largest", "tolerance", "numbers compared")


def list_impacts(seed, quick):
    """Name, impact, whether it is compared with the reference, and the number of equal steps."""
    impacts = [(name, case, True, 500 if quick else 2000) for name, case in extreme_impacts()]
    for n in range(150 if quick else 1000):
        case = random_impact(seed, n, pushed=n % 10 == 9)
        impacts.append((f"seed {seed}, number {n}", case, n % 10 in (0, 9), 64))
    return impacts


def plot(points):
    """Errors from the reference, against the number of steps and the damping ratio."""
    figure, (left, right) = plt.subplots(1, 2, sharey=True, figsize=(10.0, 4.2))
    numbers, ratios, errors = np.array(points).T
    errors = np.maximum(errors, 1e-18)
    left.loglog(numbers, errors, ".", alpha=0.4)
    left.set(xlabel="number of communication steps")
    left.set_ylabel("largest error of an impact (0: bottom)")
    right.loglog(np.maximum(ratios, 1e-7), errors, ".", alpha=0.4)
    right.set(xlabel="damping ratio ζ (none: left edge)")
    for axes in (left, right):
        axes.axhline(TOLERANCE, color="grey", ls=":", label="tolerance")
    left.legend(loc=(0.6, 0.85))
    figure.suptitle("Errors stay below the tolerance at any number of steps and any damping")
    return figure


def run(impact, quick=False, seed=20, track=iter):
    """Check the impacts; the cases of the result are the checks of stress.json."""
    checks = {n: {"worst": 0.0, "tolerance": TOLERANCE, "count": 0, "case": {}} for n in CLAIMS}
    checks["state"]["tolerance"] = 0.0
    impacts, points = list_impacts(seed, quick), {}
    for name, case, exact, equal in track(impacts):
        zeta = case.values["b"] / critical_damping(case.values)
        for which, output, number, error in check(impact, case, random.Random(name), exact, equal):
            found = checks[which]
            found["count"] += 1
            if not found["case"] or not error <= found["worst"]:
                where = {"impact": name, "output": output, "steps": number}
                found |= {"worst": float(error), "case": where | case.values}
            if which == "reference":
                point = points.setdefault((name, number), [number, zeta, 0.0])
                point[2] = max(point[2], error)
    exact = sum(row[2] for row in impacts)
    words = (
        f"Tried: {len(impacts)} impacts under both laws, the extremes and random ones of seed "
        f"{seed} (k 1e2 to 1e12 N/m, ζ 0 to 1e4, mass ratios 1e-6 to 1e6, changes of k and b in "
        "contact, a force on the head of every tenth); each by one step, equal steps (up to "
        f"{impacts[0][3]:,}), random steps of 1 ns to 1 s, and points 1 to 100 ns beside touch and "
        f"separation. {exact} of them were compared with arithmetic of 80 digits."
    )
    cells = [
        [CLAIMS[name], f"{row['worst']:.1e}", f"{row['tolerance']:g}", str(row["count"])]
        for name, row in checks.items()
    ]
    return Result(
        f"Impacts far beyond golf, seed {seed}",
        checks,
        [("Errors: laws 1 and 2, k 1e2 to 1e12 N/m, ζ 0 to 1e4", COLUMNS, cells)],
        {"stability": plot([*points.values()])},
        {CLAIMS[name]: row["worst"] <= row["tolerance"] for name, row in checks.items()},
        words,
    )


if __name__ == "__main__":
    main(run)
