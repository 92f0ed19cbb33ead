"""An FMU that only registers variables: the floor for the time to instantiate ClubBallImpact.

It has as many variables of each kind as ClubBallImpact: 4 Real inputs, 9 Real parameters and an
Integer one, 19 Real and 3 Boolean outputs.
"""

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real

_FIXED = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
_FLAG = {"causality": Fmi2Causality.output, "variability": Fmi2Variability.discrete}


class EmptyWide(Fmi2Slave):
    """36 variables without meaning or unit, and a step that does nothing."""

    def __init__(self, **kwargs) -> None:
        super().__init__(**kwargs)
        for name, count, kind, value, options in (
            ("input", 4, Real, 0.0, {"causality": Fmi2Causality.input}),
            ("parameter", 9, Real, 0.0, _FIXED),
            ("choice", 1, Integer, 1, _FIXED),
            ("output", 19, Real, 0.0, {"causality": Fmi2Causality.output}),
            ("flag", 3, Boolean, False, _FLAG),
        ):
            for n in range(count):
                setattr(self, f"{name}{n}", value)
                self.register_variable(kind(f"{name}{n}", **options))

    def do_step(self, current_time: float, step_size: float) -> bool:
        return True
