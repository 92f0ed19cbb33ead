"""What `import golf_impact` offers to those who have the package."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from golf_impact.calibration.calibration import Calibration, calibrate
from golf_impact.errors import UserError
from golf_impact.facts.balls import BALLS, Ball, read_ball
from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.impact_fmu import METRICS, PATH, ImpactFmu
from golf_impact.sweeps import Study, Summary, run_sweep

__all__ = [
    "Ball",
    "Calibration",
    "ImpactFmu",
    "Study",
    "Summary",
    "UserError",
    "balls",
    "calibrate",
    "load_fmu",
    "read_ball",
    "run_impact",
    "run_sweep",
    "run_trajectory",
]


def load_fmu(path: Path | str | None = None) -> ImpactFmu:
    """The FMU, to be used in a `with` block: for many impacts in one instance.

    It is an .fmu file, or by default that of the present sources, built if need be. UserError if it
    can't be read, built or loaded.
    """
    return ImpactFmu(current_fmu()[0] if path is None else Path(path))


def balls() -> dict[str, Ball]:
    """The balls by name; `**ball.values` are the FMU's inputs and parameters (SI units)."""
    return dict(BALLS)


def run_impact(outputs: Sequence[str] = METRICS, **values: float) -> dict[str, float]:
    """One impact through the FMU: its outputs by name (SI units).

    Args:
        outputs: the Real outputs to read when it is over.
        values: inputs and parameters of the FMU by name (SI units); defaults for the others.

    Raises:
        UserError: the FMU doesn't know or refuses a value.
    """
    with load_fmu() as fmu:
        return fmu.impact(outputs, **values)


def run_trajectory(
    points: int = 301, outputs: Sequence[str] = PATH, **values: float
) -> dict[str, np.ndarray]:
    """One impact through the FMU, sampled over the contact with a margin on either side.

    Args:
        points: number of samples.
        outputs: the Real outputs to record.
        values: inputs and parameters of the FMU by name (SI units); defaults for the others.

    Returns:
        `time` (s) and the outputs by name, arrays of shape (points,).

    Raises:
        UserError: the FMU doesn't know or refuses a value.
    """
    with load_fmu() as fmu:
        return fmu.trajectory(points, outputs, **values)
