"""An FMU that only registers variables: the floor for the time to instantiate ClubBallImpact.

It has as many variables of each kind as ClubBallImpact: 3 Real inputs, 9 Real parameters and an
Integer one, 19 Real and 3 Boolean outputs.
"""

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.variables import ScalarVariable

INPUTS, PARAMETERS, INTEGER_PARAMETERS, OUTPUTS, BOOLEAN_OUTPUTS = 3, 9, 1, 19, 3


class EmptyWide(Fmi2Slave):
    """35 variables without meaning or unit, and a step that does nothing."""

    def __init__(self, **kwargs) -> None:
        super().__init__(**kwargs)
        output, parameter = Fmi2Causality.output, Fmi2Causality.parameter
        fixed, discrete = Fmi2Variability.fixed, Fmi2Variability.discrete
        for n in range(INPUTS):
            self._add(Real(f"input{n}", causality=Fmi2Causality.input), 0.0)
        for n in range(PARAMETERS):
            self._add(Real(f"parameter{n}", causality=parameter, variability=fixed), 0.0)
        for n in range(INTEGER_PARAMETERS):
            self._add(Integer(f"choice{n}", causality=parameter, variability=fixed), 1)
        for n in range(OUTPUTS):
            self._add(Real(f"output{n}", causality=output), 0.0)
        for n in range(BOOLEAN_OUTPUTS):
            self._add(Boolean(f"flag{n}", causality=output, variability=discrete), False)

    def _add(self, variable: ScalarVariable, value: float | bool) -> None:
        setattr(self, variable.name, value)
        self.register_variable(variable)

    def do_step(self, current_time: float, step_size: float) -> bool:
        return True
