"""The scenarios by name, each imported only when it runs."""

import importlib
from types import ModuleType

from scenarios.errors import UserError

SCENARIOS = (
    "diagram",
    "baseline",
    "elastic",
    "club_speed",
    "compression",
    "old_ball",
    "fem",
    "validation",
    "speed_dependence",
    "rating",
    "laws",
    "finite_difference",
    "table1",
    "system",
    "model_exchange",
)


def scenario(name: str) -> ModuleType:
    """The module of a scenario: it has TITLE and run(fmu) -> Outcome.

    Raises:
        UserError: there is none of this name.
    """
    if name not in SCENARIOS:
        raise UserError(f"there is no scenario {name!r}: choose from {', '.join(SCENARIOS)}")
    return importlib.import_module(f"scenarios.{name}")
