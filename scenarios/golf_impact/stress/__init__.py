"""Impacts far beyond golf through the FMU, against a reference of 80 digits and invariants.

- `cases`, `special_points`, `driver`: impacts and steps, and how they are run. · `reference`: the
  exact results. · `scales`: what an error is relative to.
- `invariants`, `stability`: the checks. · `all`: all of them, and the long runs.
"""
