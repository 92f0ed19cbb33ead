"""ClubBallImpact.fmu: FMI 2.0, co-simulation."""

from golf_physics.variables import LAWS, UNITS, VARIABLES

from golf_build.packaging import PythonBuilder

_ENTRY = '''"""The entry point of the FMU; pythonfmu compiles this file anew for every instance."""

from {package} import VALUES
from {package}.{module} import {model} as Adapter


class {model}(Adapter):
    # The most frequent calls are looked up by name, in this class first.
    _set_fmu_state = Adapter._set_fmu_state
    do_step = Adapter.do_step
    get_real = Adapter.get_real
    set_real = Adapter.set_real

    # pythonfmu 0.7.0 crashes on the second instance of a class without a method in its body.
    def __init__(self, **kwargs):
        Adapter.__init__(self, VALUES, **kwargs)
'''

_ABOUT = (
    "Impact of a golf club on a ball: contact force, smash factor, restitution, energy. Start "
    "values reproduce the source document (law 1); law 2 is the one to use"
)

#: Those of the native FMUs, too. The outputs in `constant` are 0 at the start whatever the other
#: variables are. Systems feed them back: without this an importer must take that for an algebraic
#: loop in initialization.
TABLES = {
    "rows": VARIABLES,
    "description": _ABOUT,
    # One contact. fmusim takes times within 1e-5 s for equal.
    "experiment": (1e-3, 2e-5),
    "units": UNITS,
    "laws": LAWS,
    "constant": ("mean_force", "impulse"),
    "discrete": ("touch_time",),
}

_SOURCES = ("club_ball_impact.py", "golf_physics", "host")
BUILDER = PythonBuilder("ClubBallImpact", TABLES, sources=_SOURCES, entry=_ENTRY)
