"""Builds the FMUs, and the system of three, from the sources in fmu_src.

`fmi2`, `fmi3`: ClubBallImpact for both versions of FMI, each a `packaging.Builder`. `system`: two
companions and the SSP file. `description`: what their XML shares. `archive`: files, whole ones.
"""

from golf_physics import __version__ as VERSION  # noqa: N812 (a constant to everybody else)

__all__ = ["VERSION"]
