"""ClubBallImpact.fmu: FMI 2.0, co-simulation."""

from golf_physics.variables import UNITS, VARIABLES

from golf_build.packaging import Builder

#: Outputs that are 0 at the start whatever the other variables are. Systems feed them back: without
#: this an importer must take that for an algebraic loop in initialization.
ZERO_AT_START = ("mean_force", "impulse")

_ENTRY = '''"""The entry point of the FMU; pythonfmu compiles this file anew for every instance."""

import {package}.club_ball_impact as face


class ClubBallImpact(face.ClubBallImpact):
    # The most frequent calls are looked up by name, in this class first.
    _set_fmu_state = face.ClubBallImpact._set_fmu_state
    do_step = face.ClubBallImpact.do_step
    get_real = face.ClubBallImpact.get_real
    set_real = face.ClubBallImpact.set_real

    # pythonfmu 0.7.0 crashes on the second instance of a class without a method in its body.
    def terminate(self):
        face.ClubBallImpact.terminate(self)
'''


_TABLES = {"rows": VARIABLES, "units": UNITS, "constant": ZERO_AT_START}
BUILDER = Builder(2, "ClubBallImpact", "club_ball_impact", _ENTRY, _TABLES)
