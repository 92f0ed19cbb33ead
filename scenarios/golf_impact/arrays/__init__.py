"""Impacts in this process, without an FMU: one by the scalar physics, many by NumPy arrays."""
