"""Builds the FMUs, and the system of three, from the sources in fmu_src."""
