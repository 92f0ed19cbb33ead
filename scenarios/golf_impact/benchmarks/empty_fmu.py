"""The smallest ordinary FMU: what pythonfmu and FMI cost when the model costs nothing."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

_INPUTS = ("k", "b", "club_speed")
OUTPUTS = ("force", "club_position", "ball_position", "club_velocity", "ball_velocity")


class Empty(Fmi2Slave):
    """Some variables of ClubBallImpact, without unit, and a step that does nothing."""

    def __init__(self, **kwargs) -> None:
        super().__init__(**kwargs)
        for causality, names in ((Fmi2Causality.input, _INPUTS), (Fmi2Causality.output, OUTPUTS)):
            for name in names:
                setattr(self, name, 0.0)
                self.register_variable(Real(name, causality=causality))

    def do_step(self, current_time: float, step_size: float) -> bool:
        return True
