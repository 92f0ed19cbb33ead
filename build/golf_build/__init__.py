"""Builds the FMUs, and the system with their companions, from the sources in fmu_src.

`fmi2`, `fmi3`: ClubBallImpact for both versions of FMI, each a `packaging.Builder`. `system`: the
companions and the SSP file. `standalone`: any FMU with a Python of its own. `archive`: writing
files.
"""

from golf_physics import __version__ as VERSION  # noqa: N812 (a constant here)
from golf_physics.variables import BY_NAME, LAWS, UNITS

__all__ = ["BY_NAME", "LAWS", "UNITS", "VERSION"]
