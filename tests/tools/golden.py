"""Golden rows, which pin the reference: `python tests/tools/golden.py` adds new power laws.

The others were computed once, by methods of which the reference has nothing: linear laws by matrix
exponentials of 60 digits, power laws by another quadrature, with events found by bisection.
"""

import json
from pathlib import Path

import mpmath
from cases import CASES, POWER_LAW, golden

from golf_impact.evidence.reference import Reference

FILE = Path(__file__).parents[1] / "data" / "golden.json"

#: After separation, and on the way.
ENDS = (
    "smash_factor", "coefficient_of_restitution", "club_velocity", "ball_velocity", "impulse",
    "max_force", "max_compression", "contact_time", "time_of_max_force", "contact_displacement",
)  # fmt: skip
PATH = ("contact_time", "force", "compression", "club_velocity", "ball_velocity", "impulse")


def by_the_reference(name):
    """The rows of a case of the power law."""
    impact = Reference(CASES[name].values)
    time = impact.parting - impact.touch
    rows = [
        (names, impact.outputs(impact.touch + time * share / 1000))
        for names, share in ((ENDS, 2000), (PATH, 1), (PATH, 250), (PATH, 800), (PATH, 995))
    ]
    return [{name: mpmath.nstr(row[name], 25) for name in names} for names, row in rows]


if __name__ == "__main__":
    content = golden()
    known = content["power law"]
    known |= {name: by_the_reference(name) for name in POWER_LAW if name not in known}
    FILE.write_text(json.dumps(content, indent=1) + "\n")
