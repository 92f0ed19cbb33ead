"""What ClubBallImpact.fmu is compared with: the same impact, as others would compute it.

The question and the form of the answer: `problem` (Case, Outcome, errors). The right answer, to 30
digits: `reference`. Each peer is a module with `solve(case, dt or rtol) -> Outcome`:

- `explicit_euler`, `explicit_euler_numpy`: the source document's scheme, as plain Python and as
  NumPy code; order 1.
- `semi_implicit_euler`: order 1. `stormer_verlet`: order 2. `runge_kutta4`: order 4 (these two find
  events by `interpolation`).
- `solve_ivp`: SciPy's adaptive methods.

Three are FMUs, each packed by pythonfmu from one file alone:

- `document_fmu`: the document's scheme. · `empty_fmu`: what a call costs when nothing is computed.
- `empty_wide_fmu`: what instantiating costs with as many variables as ClubBallImpact has.
"""
