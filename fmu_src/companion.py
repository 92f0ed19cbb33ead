"""What the companion FMUs share: variables made from tables, refusals, and state.

A refused value leaves the old one; steps are refused until the variable is set right.
"""

import json
from binascii import crc32
from collections.abc import Callable
from math import isfinite
from operator import attrgetter

from host.at_exit import prepare_process
from host.messages import Messages
from pythonfmu import Boolean, Fmi2Slave, Real

_Rows = tuple[tuple, ...]

#: Stands in `_refused` for a state that is refused: until the next step only.
_STATE = "state"


def _with_checksum(body: bytes) -> bytes:
    """A JSON object without its end, ended by a checksum."""
    return body + f', "checksum": {crc32(body)}}}'.encode()


class Companion(Fmi2Slave):
    """A slave whose variables are its attributes.

    `_step` takes a step, or returns the reason for a refusal.
    """

    #: Parameters and inputs, rows of name, unit (None: Boolean), start, least and greatest allowed
    #: value, description; outputs, rows of name, unit (None: Boolean), description.
    tables: tuple[_Rows, _Rows, _Rows]
    #: Attributes of the state beside the variables; their objects are immutable or only extended.
    inside: tuple[str, ...] = ()
    #: Those of them that are serialized as arguments (`begins`, or a tuple), and their types.
    objects: tuple[tuple[str, Callable], ...] = ()
    #: How many steps have been accepted since the instance was made.
    _steps = 0

    def __init__(self, start: dict[str, float], **kwargs) -> None:
        """`start`: start values that differ from those of the tables, by name."""
        super().__init__(**kwargs)
        prepare_process(self.resources, f"linux64/{self.modelName}.so")
        self._report = Messages(self.log_queue, kwargs, lambda: self._steps)
        #: Why steps are refused, by the variable to be corrected.
        self._refused: dict[str, str] = {}
        #: Whether parameters can't be set any more.
        self._fixed = False
        for fixed, rows in zip((True, False, False), self.tables):
            for name, unit, *values, _ in rows:
                default, *bounds = values or [0.0 if unit else False]
                setattr(self, name, start.get(name, default))
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
                self._report(refused[name])
            self._refused = refused

        return assign

    def _no_setter(self, value: float) -> None:
        self._report("an output can't be set")

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

    def _state_names(self) -> tuple[str, ...]:
        return "_fixed", "_refused", *self.inside, *(v.name for v in self.vars.values())

    def _get_fmu_state(self) -> dict:
        return {name: getattr(self, name) for name in self._state_names()}

    def _set_fmu_state(self, state: dict | None) -> None:
        if state is not None and tuple(state) == self._state_names():
            self.__dict__.update(state)
            self._steps += 1
            return
        text = "a state that this FMU didn't make is refused; it has no effect"
        self._refused = {**self._refused, _STATE: text}
        self._report(text)

    @staticmethod
    def _fmu_state_to_bytes(state: dict | None) -> bytes:
        if state is None:
            return b""
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
