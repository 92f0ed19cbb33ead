"""Golden rows, which pin the references of the tests.

`python tests/tools/golden.py` writes those of the power law anew. Those of linear laws were
computed once, by matrix exponentials of 60 digits, from which the reference has nothing.
"""

import json
from pathlib import Path

import mpmath
from cases import CASES, POWER_LAW, golden
from quadrature import PowerLawContact

FILE = Path(__file__).parents[1] / "data" / "golden.json"


def texts(outputs):
    return {output: mpmath.nstr(value, 25) for output, value in outputs.items()}


def by_quadrature(name):
    """The row of a case of the power law: after separation, and on the way."""
    contact = PowerLawContact(**CASES[name].values)
    return [texts(row) for row in (contact.outputs(), *contact.path())]


if __name__ == "__main__":
    rows = {name: by_quadrature(name) for name in POWER_LAW}
    FILE.write_text(json.dumps(golden() | {"power law": rows}, indent=1) + "\n")
