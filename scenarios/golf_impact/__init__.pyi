# The types of the names that `__init__.py` imports on first use.
from golf_impact.api import balls as balls
from golf_impact.api import run_impact as run_impact
from golf_impact.api import run_impacts as run_impacts
from golf_impact.api import run_trajectory as run_trajectory
from golf_impact.data.balls import Ball as Ball
from golf_impact.data.balls import read_ball as read_ball
from golf_impact.data.errors import UserError as UserError
from golf_impact.fmu import Impact as Impact
from golf_impact.studies.calibrate.calibration import Calibration as Calibration
from golf_impact.studies.calibrate.calibration import calibrate as calibrate
from golf_impact.studies.drive import drive as drive
from golf_impact.studies.sensitivities import sensitivities as sensitivities
from golf_impact.studies.sweep.sweep import sweep as sweep

__version__: str
