# The types of the names that `__init__.py` imports on first use.
from golf_impact.api import balls as balls
from golf_impact.api import run_impact as run_impact
from golf_impact.api import run_impacts as run_impacts
from golf_impact.api import run_trajectory as run_trajectory
from golf_impact.ball import Ball as Ball
from golf_impact.ball import read_ball as read_ball
from golf_impact.calibration.calibration import Calibration as Calibration
from golf_impact.calibration.calibration import calibrate as calibrate
from golf_impact.derivatives import sensitivities as sensitivities
from golf_impact.errors import UserError as UserError
from golf_impact.fmu import Impact as Impact
from golf_impact.shots import drive as drive
from golf_impact.sweeps import sweep as sweep

__version__: str
