"""The system of three FMUs: built, and run by fmpy.ssp."""

from pathlib import Path

import numpy as np

from golf_build import standalone as alone
from golf_build import system
from golf_scenarios.errors import UserError
from golf_scenarios.stopping import held


def build_system(folder: Path, impact: Path, standalone: bool = False) -> list[Path]:
    """Build the companion FMUs and the .ssp around an existing ClubBallImpact.fmu.

    Raises:
        UserError: a file can't be written.
    """
    try:
        with held():
            if standalone:
                return system.build(folder, impact, alone.standalone, alone.SUFFIX)
            return system.build(folder, impact)
    except alone.StandaloneError as error:
        raise UserError(str(error)) from error
    except OSError as error:
        raise UserError(f"can't write into {folder}: {error.strerror or error}") from error


def run_ssp(ssp: Path, step: float, stop: float) -> dict[str, np.ndarray]:
    """Run the system in fmpy.ssp.

    Args:
        ssp: the .ssp file.
        step: communication step size, s.
        stop: end of the run, s.

    Returns:
        `time` (s, end of each step) and every connector by "Component.variable".
    """
    from fmpy.ssp.simulation import simulate_ssp

    # fmpy adds up its steps; half a step less ends it where it should.
    rows = simulate_ssp(str(ssp), stop_time=stop - 0.5 * step, step_size=step)
    columns = {name: np.asarray(rows[name], dtype=float) for name in rows.dtype.names[1:]}
    return {"time": step * np.arange(1, len(rows) + 1), **columns}
