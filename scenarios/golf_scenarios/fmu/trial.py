"""One impact through an FMU, in a process of its own.

An FMU that isn't ours, or has been damaged, may take its process down.
"""

import sys
from pathlib import Path

from golf_scenarios.errors import UserError
from golf_scenarios.fmu.impact_fmu import ImpactFmu


def main() -> None:
    """Try the FMU that the command line names; the last line on stderr says why it can't be run."""
    try:
        with ImpactFmu(Path(sys.argv[1])) as fmu:
            fmu.trajectory(points=3)
    except UserError as error:
        sys.exit(str(error))
