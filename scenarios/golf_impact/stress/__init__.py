"""Impacts far beyond golf through the FMU, against a reference of 80 digits and invariants.

- `cases`, `special_points`, `driver`: impacts and steps, and how they are run. · `reference`: the
  right answer. · `scales`: what an error is measured by.
- `invariants`, `long_runs`, `stability`: the checks, noted in a `ledger`. · `all`: all of them.
"""
