"""`golf-impact sweep`: many impacts by the physics in arrays, or through an FMU.

From Python: `run_sweep(Study.of({"k": "0.5e6:2e6:100", "b": "0,9,12"}), "k.csv")`. With
`executor=` any executor of the interface of concurrent.futures takes the chunks.
"""

from golf_impact.sweeps.run import Stopped, Summary, Sweep, run_sweep
from golf_impact.sweeps.study import Study

__all__ = ["Stopped", "Study", "Summary", "Sweep", "run_sweep"]
