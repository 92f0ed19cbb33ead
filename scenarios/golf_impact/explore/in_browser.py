"""The slave classes inside the FMUs, without an FMI importer: for exported pages."""

import json
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from .evaluator import Evaluator


class RefusedError(Exception):
    """The message of an FMU."""


class Instance:
    """One instance of an FMU, with the methods of `LoadedFmu` that the page needs.

    They raise a RefusedError where the FMU refuses something.

    Args:
        module: the FMU's Python module.
        model: the name of its slave class.
        variables: value reference and FMI 2.0 type of each variable, by name.
    """

    def __init__(self, module: str, model: str, variables: Mapping[str, tuple[int, str]]) -> None:
        self._class: Any = getattr(import_module(module), model)
        self._variables = variables
        self._slave: Any = None

    def start(self, **values: float) -> None:
        """Begin a run with these inputs and parameters (start values for the others)."""
        self._slave = self._class(instance_name="page", resources="/")
        self._slave.setup_experiment(0.0)
        self._slave.enter_initialization_mode()
        for name, value in values.items():
            reference, type_ = self._variables[name]
            if type_ == "Integer" and value != int(value):
                why = "it must be a whole number, 1 or 2"
                raise RefusedError(f"{name} = {value!r} is refused: {why}")
            getattr(self._slave, f"set_{type_.lower()}")([reference], [value])
        self._slave.exit_initialization_mode()
        self._check(True)

    def step(self, point: float, size: float) -> None:
        """Make a communication step."""
        self._check(self._slave.do_step(point, size))

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Values of Real variables, by name."""
        # The slave's list of values may be longer.
        return dict(zip(names, self._slave.get_real([self._variables[name][0] for name in names])))

    def read_flag(self, name: str) -> bool:
        """Value of a Boolean variable."""
        return bool(self._slave.get_boolean([self._variables[name][0]])[0])

    def _check(self, accepted: bool) -> None:
        messages = [item.msg for item in self._slave.log_queue]
        self._slave.log_queue.clear()
        if messages or not accepted:
            raise RefusedError(messages[0 if accepted else -1])


def make_evaluator() -> Callable[[str], str]:
    """The evaluator of an exported page, from and to JSON; facts.json is beside this file."""
    fmus, facts = json.loads(Path(__file__).with_name("facts.json").read_text())
    evaluator = Evaluator([Instance(*one) for one in fmus], RefusedError, facts)
    return lambda request: json.dumps(evaluator(json.loads(request)))
