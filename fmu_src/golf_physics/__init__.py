"""The impact of a golf club on a ball: exact analytic phases, standard library only.

`variables` is the table of the FMU's variables, `parameters` the values that are allowed, `laws`
has one file for each contact law, `impact` is the sequence of phases, and `component` one instance
with its clock, modes and state, independent of the FMI version.
"""

__version__ = "0.1.0"
