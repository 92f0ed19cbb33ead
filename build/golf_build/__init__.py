"""Builds the FMUs, and the system with their companions, from the sources in fmu_src."""

from golf_physics import __version__ as VERSION  # noqa: N812 (a constant here)

__all__ = ["VERSION"]
