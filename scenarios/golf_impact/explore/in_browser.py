"""The physics that lies in the FMU, without an FMI importer: what an exported page runs."""

import json
from collections.abc import Callable, Sequence
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

    def flag(self, name: str) -> bool:
        """The value of a Boolean variable."""
        return bool(self._component.discretes([self._references[name]], "Boolean")[0])


def answering(package: str, facts: str) -> tuple[Callable[[str], str], str]:
    """What the worker of an exported page needs.

    Args:
        package: the name of the physics package in the FMU.
        facts: `Answers`' as JSON.

    Returns:
        A function from a request to its answer, and the result of the check; all of it as JSON.
    """
    from .answers import Answers

    answers = Answers(Instance(package), RefusedError, json.loads(facts))
    return lambda request: json.dumps(answers(json.loads(request))), json.dumps(answers.check())
