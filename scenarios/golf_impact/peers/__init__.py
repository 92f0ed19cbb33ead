"""Other methods for the same impact.

`problem`: case, outcome and errors. `stepping`: methods of order 1 to 4, in plain Python.
`solve_ivp`: SciPy's adaptive methods. `document_fmu`: the source document's scheme as an FMU;
`document_scheme` drives it. `compiled`: stepping methods in C, as FMUs.
"""
