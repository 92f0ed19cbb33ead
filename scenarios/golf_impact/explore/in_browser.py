"""The physics that lies in the FMU, without an FMI importer: what an exported page runs."""

import json
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


class RefusedError(Exception):
    """The message of the component."""


class Instance:
    """One instance with the methods of `ImpactFmu` that the page needs.

    Args:
        package: the name of the physics package in the FMU, golf_physics_<digest>.
    """

    def __init__(self, package: str) -> None:
        self._variables = import_module(f"{package}.variables").VARIABLES
        self._references = {one.name: n for n, one in enumerate(self._variables)}
        self.messages: list[str] = []
        component: Any = import_module(f"{package}.component.component").Component
        self._component = component(self.messages.append)
        self._fresh = self._component.snapshot()

    def start(self, **values: float) -> None:
        """A new run with these inputs and parameters (start values for the others).

        Raises:
            RefusedError: the component refuses a value.
        """
        component = self._component
        self.messages.clear()
        component.restore(self._fresh)
        component.set_up(0.0)
        component.enter_initialization()
        for name, value in values.items():
            type_ = self._variables[self._references[name]].type
            if type_ != "Real":
                if value not in (1, 2):
                    raise RefusedError(f"{name} = {value!r} is refused: it must be 1 or 2")
                value = int(value)
            component.set_values([self._references[name]], [value], type_)
        component.exit_initialization()
        if self.messages:
            raise RefusedError(self.messages[0])

    def step(self, point: float, size: float) -> None:
        """One communication step.

        Raises:
            RefusedError: the component refuses it.
        """
        if not self._component.step(point, size):
            raise RefusedError(self.messages[-1])

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Values of Real variables, by name."""
        # The component's list may go on after the values.
        return dict(zip(names, self._component.reals([self._references[name] for name in names])))

    def read_flag(self, name: str) -> bool:
        """The value of a Boolean variable."""
        return bool(self._component.discretes([self._references[name]], "Boolean")[0])


class Companion:
    """One instance of a companion FMU, with pythonfmu's own runtime, likewise.

    Args:
        module: the name of its module in the FMU, launch_<digest>.
        name: of its class.
    """

    def __init__(self, module: str, name: str) -> None:
        self._class: Any = getattr(import_module(module), name)
        self._slave: Any = None

    def start(self, **values: float) -> None:
        """A new run with these inputs and parameters (start values for the others)."""
        self._slave = self._class(instance_name="page", resources="/")
        self.set(values)

    def set(self, values: Mapping[str, float]) -> None:
        """Set inputs and parameters.

        Raises:
            RefusedError: a value is refused.
        """
        setters = {one.name: one.setter for one in self._slave.vars.values()}
        for name, value in values.items():
            setters[name](value)
        if messages := self._messages():
            raise RefusedError(messages[0])

    def step(self, point: float, size: float) -> None:
        """One communication step.

        Raises:
            RefusedError: it is refused.
        """
        if not self._slave.do_step(point, size):
            raise RefusedError("; ".join(self._messages()))

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Values of variables, by name."""
        return {name: getattr(self._slave, name) for name in names}

    def _messages(self) -> list[str]:
        return [self._slave.log_queue.pop(0).msg for _ in range(len(self._slave.log_queue))]


def answering(
    package: str, launch: str, flight: str, facts: str
) -> tuple[Callable[[str], str], str]:
    """What the worker of an exported page needs.

    Args:
        package: the name of the physics package in the FMU.
        launch: of the module in Launch.fmu.
        flight: of the module in BallFlight.fmu.
        facts: those of `Evaluator`, as JSON.

    Returns:
        A function from a request to its answer, and the result of the check; all of it as JSON.
    """
    from .evaluator import Evaluator

    companions = Companion(launch, "Launch"), Companion(flight, "BallFlight")
    evaluator = Evaluator((Instance(package), *companions), RefusedError, json.loads(facts))
    return lambda request: json.dumps(evaluator(json.loads(request))), json.dumps(evaluator.check())
