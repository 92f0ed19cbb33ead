"""The smallest ordinary FMU: what pythonfmu and FMI cost when the model costs nothing."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Empty(Fmi2Slave):
    """Three inputs, five outputs that stay 0, all without unit, and a step that does nothing."""

    def __init__(self, **kwargs) -> None:
        super().__init__(**kwargs)
        for causality, count in ((Fmi2Causality.input, 3), (Fmi2Causality.output, 5)):
            for n in range(1, count + 1):
                setattr(self, f"{causality.name}{n}", 0.0)
                self.register_variable(Real(f"{causality.name}{n}", causality=causality))

    def do_step(self, current_time: float, step_size: float) -> bool:
        return True
