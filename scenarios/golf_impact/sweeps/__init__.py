"""`golf-impact sweep`: many impacts by the physics in arrays, or through an FMU."""

from golf_impact.sweeps.run import Stopped, Summary, Sweep, run_sweep
from golf_impact.sweeps.study import Study

__all__ = ["Stopped", "Study", "Summary", "Sweep", "run_sweep"]
