"""Impacts far beyond golf through the FMU, against a reference of 80 digits and invariants."""
