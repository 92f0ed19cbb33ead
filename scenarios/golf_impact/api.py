"""The public functions of `golf_impact`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.calibration.calibration import Calibration, calibrate  # noqa: F401
from golf_impact.errors import UserError  # noqa: F401
from golf_impact.facts.balls import BALLS, Ball, read_ball  # noqa: F401
from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.runs import METRICS, PATH
from golf_impact.sweeps import Study, Summary, run_sweep  # noqa: F401


def load_fmu(path: Path | str | None = None) -> ImpactFmu:
    """Open the FMU, for many impacts in one instance; use it in a `with` block.

    Args:
        path: an .fmu file; by default that of the current sources, built if necessary.

    Raises:
        UserError: it can't be read, built or loaded.
    """
    return ImpactFmu(current_fmu()[0] if path is None else Path(path))


def balls() -> dict[str, Ball]:
    """The preset balls by name; `ball.values` are inputs and parameters of the FMU (SI units)."""
    return dict(BALLS)


def run_impact(outputs: Sequence[str] = METRICS, **values: float) -> dict[str, float]:
    """Compute an impact with the FMU.

    Args:
        outputs: the Real outputs to read after it.
        values: inputs and parameters of the FMU by name (SI units); defaults for the others.

    Returns:
        The outputs by name (SI units). Results of a completed impact are NaN where there is none:
        smash_factor, coefficient_of_restitution, energy_efficiency, contact_time and
        contact_displacement without a separation; without a contact also touch_time and
        time_of_max_force. Momentary outputs, such as velocities, are then those at the end of the
        simulated time (1 s or more).

    Raises:
        UserError: the FMU rejects a value, or has no variable of a name.
    """
    return ScalarImpacts().impact(outputs, **values)


def run_trajectory(
    points: int = 301, outputs: Sequence[str] = PATH, **values: float
) -> dict[str, np.ndarray]:
    """Sample an impact with the FMU, over the contact and a tenth of it before and after.

    Args:
        points: number of samples.
        outputs: the Real outputs to record.
        values: inputs and parameters of the FMU by name (SI units); defaults for the others.

    Returns:
        `time` (s) and the outputs (SI units) by name, arrays of shape (points,).

    Raises:
        UserError: the FMU rejects a value, or has no variable of a name.
    """
    return ScalarImpacts().trajectory(points, outputs, **values)
