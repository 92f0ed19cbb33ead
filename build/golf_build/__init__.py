"""Builds the FMUs, and the system with their companions, from the sources in fmu_src."""

from golf_physics import __version__ as VERSION  # noqa: N812 (a constant here)
from golf_physics.variables import BY_NAME, UNITS

from golf_build.native_header import NATIVE_LAWS

__all__ = ["BY_NAME", "NATIVE_LAWS", "UNITS", "VERSION"]
