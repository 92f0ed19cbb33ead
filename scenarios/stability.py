"""Impacts far beyond golf by any communication steps, compared with 80-digit arithmetic.

Errors are on the scales of golf_impact.evidence.scales. A seed repeats all impacts and steps.
"""

import random

import matplotlib.pyplot as plt
import numpy as np

from golf_impact.evidence.checks import check
from golf_impact.evidence.random_impacts import critical_damping, random_impact
from golf_impact.evidence.scales import TOLERANCE
from golf_impact.scenario import Result, main

CLAIMS = {
    "one step": "by one step between changes, outputs agree with arithmetic of 80 digits",
    "equal steps": "and by equal steps",
    "random steps": "and by random ones",
    "steps beside events": "and by steps that end just before and after touch and separation",
    "state": "from a restored state outputs are the same to the last bit",
}
COLUMNS = ("", "largest", "tolerance", "numbers compared")


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
    impacts, points = 150 if quick else 1000, {}
    for n in track(range(impacts)):
        case, name = random_impact(seed, n, pushed=n % 10 == 9), f"seed {seed}, number {n}"
        zeta = case.values["b"] / critical_damping(case.values)
        for which, output, number, error in check(impact, case, random.Random(name)):
            found = checks[which]
            found["count"] += 1
            if not found["case"] or error > found["worst"] or np.isnan(error):
                where = {"impact": name, "output": output, "steps": number}
                found |= {"worst": float(error), "case": where | case.values}
            if which != "state":
                point = points.setdefault((n, which), [number, zeta, 0.0])
                point[2] = max(point[2], error)
    words = (
        f"Tried: {impacts} random impacts of seed {seed} under both laws (k 1e2 to 1e12 N/m, ζ 0 "
        "to 1e4, mass ratios 1e-6 to 1e6, changes of k and b in contact, a force on the head of "
        "every tenth); each by one step, up to 100 equal ones, random ones of 1 ns to 1 s, and "
        "steps that end 1 to 100 ns beside touch and separation."
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
