"""Builds ClubBallImpact.fmu from a checkout; nothing of it needs to be installed.

python build/build_fmu.py [FILE]
"""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "fmu_src")]

from golf_build.fmi2 import BUILDER  # noqa: E402

if __name__ == "__main__":
    print(BUILDER.build(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / f"{BUILDER.name}.fmu"))
