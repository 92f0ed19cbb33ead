"""The FMUs: built where they are out of date, loaded by fmpy, checked where they don't run."""

from golf_impact.fmu.current import builder_of, current_fmu, current_native, current_system
from golf_impact.fmu.impact import Fmu, Impact

__all__ = ["Fmu", "Impact", "builder_of", "current_fmu", "current_native", "current_system"]
