"""The same impact, as others would compute it.

The question and the form of the answer: `problem` (Case, Outcome, errors). Each peer is a module
with `solve(case, dt or rtol) -> Outcome`:

- `explicit_euler`: the source document's scheme; order 1.
- `semi_implicit_euler`: order 1. `stormer_verlet`: order 2. `runge_kutta4`: order 4 (these two find
  events by `interpolation`).
- `solve_ivp`: SciPy's adaptive methods.
- `document_fmu`: the document's scheme as an FMU; `document_scheme` drives it.
"""
