"""The FMUs: built where they are out of date, loaded by fmpy, checked where they don't run."""

from golf_impact.fmu.current import (
    builder_of as builder_of,
)
from golf_impact.fmu.current import (
    current_fmu as current_fmu,
)
from golf_impact.fmu.current import (
    current_native as current_native,
)
from golf_impact.fmu.current import (
    current_system as current_system,
)
from golf_impact.fmu.current import (
    default_path as default_path,
)
from golf_impact.fmu.impact import Fmu as Fmu
from golf_impact.fmu.impact import Impact as Impact
