"""What the companion FMUs have alike: variables made from tables, and how a host is told no.

A refused value leaves the old one; steps are refused until the variable is set right.
"""

import json
from collections.abc import Callable
from math import isfinite
from operator import attrgetter

from host.at_exit import release_at_exit
from pythonfmu import Boolean, Fmi2Slave, Real
from pythonfmu.enums import Fmi2Status

_Rows = tuple[tuple, ...]


class Companion(Fmi2Slave):
    """A slave whose variables are its attributes. Its `_step` takes a step, or says why not.

    Args:
        parameters, inputs: rows of name, unit (None: Boolean), start, least and greatest allowed
            value, description.
        outputs: rows of name, unit (None: Boolean), description.
    """

    #: What belongs to the state beside the variables: never changed in place, only known further.
    inside: tuple[str, ...] = ()
    #: What is said of numbers that can't be computed.
    beyond = "{}"

    def __init__(self, parameters: _Rows, inputs: _Rows, outputs: _Rows, **kwargs) -> None:
        super().__init__(**kwargs)
        release_at_exit(self.resources, f"linux64/{self.modelName}.so")
        #: Why steps are refused, by the variable to be corrected.
        self._refused: dict[str, str] = {}
        #: Whether parameters can't be set any more.
        self._fixed = False
        for fixed, rows in ((True, parameters), (False, inputs), (False, outputs)):
            for name, unit, *values, _ in rows:
                start, *bounds = values or [0.0 if unit else False]
                setattr(self, name, start)
                setter = self._setter(name, fixed, *bounds) if bounds else self._no_setter
                # Not more: modelDescription.xml is made from the same tables.
                self.register_variable((Real if unit else Boolean)(name, setter=setter))

    def _setter(self, name: str, fixed: bool, low: float, high: float) -> Callable[[float], None]:
        """Of a parameter (`fixed`) or an input that may be from low to high."""

        def assign(value: float) -> None:
            refused = dict(self._refused)
            refused.pop(name, None)
            if value != getattr(self, name):
                if not low <= value <= high:
                    refused[name] = f"it must be {low:g} to {high:g}"
                elif fixed and self._fixed:
                    refused[name] = "a parameter is fixed now"
                else:
                    setattr(self, name, value)
            if name in refused:
                refused[name] = f"{name} = {value!r} is refused: {refused[name]}"
                self.log(refused[name], Fmi2Status.error)
            self._refused = refused

        return assign

    def _no_setter(self, value: float) -> None:
        self.log("an output can't be set", Fmi2Status.error)

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        """What it does begins when the host steps; the standalone FMU gives the first alone."""

    def exit_initialization_mode(self):
        problem = self._problem()
        if problem:
            self.log(problem, Fmi2Status.error)

    def do_step(self, current_time: float, step_size: float) -> bool:
        problem = self._problem()
        if not (step_size > 0.0 and isfinite(current_time + step_size)):
            problem = f"step size = {step_size!r} s is refused: it must be > 0"
        try:
            problem = problem or self._step(current_time, step_size)
        except (ArithmeticError, ValueError) as error:
            problem = self.beyond.format(error)
        if problem:
            self.log(problem, Fmi2Status.error)
        return not problem

    def _problem(self) -> str | None:
        """Why no step can be taken; if one can, the parameters are fixed."""
        problem = "; ".join(self._refused.values()) or None
        if not problem and not self._fixed:
            problem = self._begin()
            self._fixed = not problem
        return problem

    def _begin(self) -> str | None:
        """Use the parameters, or say why they can't be used."""
        return None

    def _get_fmu_state(self) -> dict:
        names = ("_fixed", "_refused", *self.inside, *(one.name for one in self.vars.values()))
        return {name: getattr(self, name) for name in names}

    def _set_fmu_state(self, state: dict) -> None:
        self.__dict__.update(state)

    @staticmethod
    def _fmu_state_to_bytes(state: dict) -> bytes:
        # A motion is made again from what it begins with.
        return json.dumps(state, default=attrgetter("begins")).encode()
