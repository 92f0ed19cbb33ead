"""What the companion FMUs share: variables made from tables, refusals, and state.

A refused value leaves the old one; steps are refused until the variable is set right.
"""

import json
from binascii import crc32
from collections.abc import Callable
from functools import partial
from math import isfinite
from operator import attrgetter

from host.at_exit import prepare_process
from host.messages import Messages
from pythonfmu import Boolean, Fmi2Slave, Real

#: Stands in `_refused` for a state that is refused: until the next step only.
_STATE = "state"


def _with_checksum(body: bytes) -> bytes:
    """A JSON object without its end, ended by a checksum."""
    return body + f', "checksum": {crc32(body)}}}'.encode()


class Companion(Fmi2Slave):
    """A slave whose variables are its attributes.

    `_step` takes a step, or returns the reason for a refusal.

    Args:
        rows: of each variable name, causality, type, unit, start, least and greatest allowed value.
    """

    #: Attributes of the state beside the variables; their objects are immutable or only extended.
    inside: tuple[str, ...] = ()
    #: Those of them that are serialized as arguments (`begins`, or a tuple), and their types.
    objects: tuple[tuple[str, Callable], ...] = ()
    #: How many steps have been accepted since the instance was made.
    _steps = 0

    def __init__(self, rows: list[tuple], **kwargs) -> None:
        super().__init__(**kwargs)
        prepare_process(self.resources, f"linux64/{self.modelName}.so")
        self._report = Messages(self.log_queue, kwargs, lambda: self._steps)
        #: Why steps are refused, by the variable to be corrected.
        self._refused: dict[str, str] = {}
        #: Whether parameters can't be set any more.
        self._fixed = False
        for name, causality, kind, _, start, low, high in rows:
            make, zero = (Real, 0.0) if kind == "Real" else (Boolean, False)
            setattr(self, name, zero if start is None else start)
            # Not more: modelDescription.xml is made from the same tables.
            setter = partial(self._assign, name, causality, low, high)
            self.register_variable(make(name, setter=setter))
        self._state_names = "_fixed", "_refused", *self.inside, *(row[0] for row in rows)

    def _assign(self, name: str, causality: str, low: float, high: float, value: float) -> None:
        """Set a variable, or refuse the value."""
        refused, why = dict(self._refused), ""
        refused.pop(name, None)
        if causality == "output":
            self._report("an output can't be set")
        elif value == getattr(self, name):
            pass
        elif not low <= value <= high:
            why = f"it must be {low:g} to {high:g}"
        elif causality == "parameter" and self._fixed:
            why = "a parameter is fixed now"
        else:
            setattr(self, name, value)
        if why:
            refused[name] = f"{name} = {value!r} is refused: {why}"
            self._report(refused[name])
        self._refused = refused

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        """Has no effect; the standalone FMU passes the start time alone."""

    def exit_initialization_mode(self) -> bool:
        problem = self._problem()
        if problem and not self._refused:
            self._report(problem)
        # pythonfmu drops it; the standalone FMU's loader returns Error if it is false.
        return not problem

    def do_step(self, current_time: float, step_size: float) -> bool:
        problem = self._problem()
        if not (step_size > 0.0 and isfinite(current_time + step_size)):
            problem = f"step size = {step_size!r} s is refused: it must be > 0"
        try:
            problem = problem or self._step(current_time, step_size)
        except (ArithmeticError, ValueError) as error:
            problem = f"this step can't be computed: {error}"
        if problem:
            self._report(problem)
            self._refused = {name: text for name, text in self._refused.items() if name != _STATE}
        else:
            self._steps += 1
        return not problem

    def _problem(self) -> str | None:
        """Why no step can be taken; if one can, the parameters are fixed."""
        problem = "; ".join(self._refused.values()) or None
        if not problem and not self._fixed:
            problem = self._begin()
            self._fixed = not problem
        return problem

    def _begin(self) -> str | None:
        """Use the parameters; or return why they can't be used."""
        return None

    def _get_fmu_state(self) -> dict:
        return {name: getattr(self, name) for name in self._state_names}

    def _set_fmu_state(self, state: dict | None) -> None:
        if state is not None and tuple(state) == self._state_names:
            self.__dict__.update(state)
            self._steps += 1
            return
        text = "a state that this FMU didn't make is refused; it has no effect"
        self._refused = {**self._refused, _STATE: text}
        self._report(text)

    @staticmethod
    def _fmu_state_to_bytes(state: dict | None) -> bytes:
        # A motion is computed again from its initial values.
        return _with_checksum(json.dumps(state, default=attrgetter("begins")).encode()[:-1])

    @classmethod
    def _fmu_state_from_bytes(cls, data: bytes) -> dict | None:
        """The state that became these bytes, or None if they are none of this FMU's."""
        body = data.rpartition(b', "checksum": ')[0]
        if data != _with_checksum(body):
            return None
        try:
            state = json.loads(body + b"}")
            for name, make in cls.objects:
                state[name] = state[name] and make(*state[name])
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            return None
        return state
