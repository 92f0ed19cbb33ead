"""The scenarios by name, each imported only when it runs."""

import importlib.util
from pathlib import Path
from types import ModuleType

from golf_scenarios.errors import UserError

_ROOM = Path(__file__).resolve().parents[1]

#: The scripts: beside golf_scenarios in a checkout, inside it where it is installed.
FOLDER = _ROOM / "scripts" if (_ROOM / "scripts").is_dir() else _ROOM.parent

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
    spec = importlib.util.spec_from_file_location(f"golf_scenario_{name}", FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
