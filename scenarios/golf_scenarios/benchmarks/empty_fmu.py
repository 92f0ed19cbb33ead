"""The smallest ordinary FMU: what pythonfmu and FMI cost when the model costs nothing."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Empty(Fmi2Slave):
    """Three inputs, five outputs that stay 0, all without unit, and a step that does nothing."""

    def __init__(self, **kwargs) -> None:
        super().__init__(**kwargs)
        self.input1 = self.input2 = self.input3 = 0.0
        self.output1 = self.output2 = self.output3 = self.output4 = self.output5 = 0.0
        for name in ("input1", "input2", "input3"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name in ("output1", "output2", "output3", "output4", "output5"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:
        return True
