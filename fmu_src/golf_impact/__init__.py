"""The impact of a golf club on a ball: exact analytic phases, standard library only.

`variables` is the table of what the component shows, `parameters` what values are allowed, the
contact laws are one file each, `impact` is the sequence of phases, and `component` one instance
with its clock, modes and state, whatever interface drives it.
"""

__version__ = "0.1.0"
