"""What pythonfmu and FMI cost when the model costs nothing: variables, and an empty step.

It has as many variables of each kind as ClubBallImpact, and some of their names, without units.
"""

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real

OUTPUTS = ("smash_factor", "coefficient_of_restitution", "energy_efficiency")
_INPUT, _OUTPUT = {"causality": Fmi2Causality.input}, {"causality": Fmi2Causality.output}
_FLAG = {"causality": Fmi2Causality.output, "variability": Fmi2Variability.discrete}
_FIXED = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}


class Empty(Fmi2Slave):
    def __init__(self, **kwargs) -> None:
        super().__init__(**kwargs)
        for kind, start, options, names in (
            (Real, 0.0, _INPUT, ("k", "b", "club_speed", "club_force")),
            (Real, 0.0, _FIXED, (f"parameter{n}" for n in range(9))),
            (Integer, 1, _FIXED, ("law",)),
            (Real, 0.0, _OUTPUT, (*OUTPUTS, *(f"output{n}" for n in range(16)))),
            (Boolean, False, _FLAG, (f"flag{n}" for n in range(3))),
        ):
            for name in names:
                setattr(self, name, start)
                self.register_variable(kind(name, **options))

    def do_step(self, current_time: float, step_size: float) -> bool:
        return True
