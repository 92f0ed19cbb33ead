"""The impacts of a study, by the physics in any process, or one at a time by an instance."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

import golf_physics
import numpy as np
from golf_physics.variables import VARIABLES

from golf_build import VERSION
from golf_impact.arrays.impacts import Outcome, check_names, one_by_one
from golf_impact.arrays.impacts import impacts as impacts_by_arrays
from golf_impact.ball import ball, conditions_of
from golf_impact.errors import UserError
from golf_impact.runs import ImpactRuns
from golf_impact.sweeps.study import Columns, Study

#: Variables of the physics by name.
PHYSICS: Mapping[str, Any] = {variable.name: variable for variable in VARIABLES}


@cache
def identity() -> str:
    """What decides the numbers of this process: the version, and a digest of the sources."""
    package, physics = Path(__file__).parents[1], Path(golf_physics.__file__).parent
    folders = physics, package / "arrays", package / "sweeps"
    files = [package / "runs.py", *chain(*(sorted(folder.rglob("*.py")) for folder in folders))]
    digests = b"".join(hashlib.sha256(file.read_bytes()).digest() for file in files)
    return f"golf-impact {VERSION}, physics {hashlib.sha256(digests).hexdigest()[:12]}"


@dataclass(frozen=True)
class Plan:
    """What every worker needs: what is set and read."""

    identity: str  # of the physics that the workers must have
    fixed: dict[str, float]  # inputs and parameters that are the same in all cases
    balls: dict[str, dict[str, float]]  # what ball presets set: values by variable and ball
    outputs: tuple[str, ...]  # what is read, in order

    def values(self, columns: Columns) -> dict[str, Any]:
        """Inputs and parameters in these cases: arrays of their shape, numbers if all are equal."""
        values: dict[str, Any] = {n: column for n, column in columns.items() if n != "ball"}
        varied = {name: table for name, table in self.balls.items() if name not in self.fixed}
        if varied:
            numbers = {preset: n for n, preset in enumerate(next(iter(varied.values())))}
            index = np.array([numbers[preset] for preset in columns["ball"].tolist()], int)
            values |= {n: np.array([*table.values()], float)[index] for n, table in varied.items()}
        return values | self.fixed


def make_plan(study: Study, variables: Mapping[str, Any]) -> Plan:
    """The plan of a study for the physics or an FMU of these variables; UserError if one lacks."""
    settable = [v.name for v in variables.values() if v.causality in ("input", "parameter")]
    outputs = [v.name for v in variables.values() if v.causality == "output"]
    check_names(study.outputs, study.names, outputs, [*settable, "ball"])
    grids = {axis.name: axis.values for axis in study.grid}
    chosen = [ball(name) for name in grids.pop("ball", ())]
    presets = {one.name: one.values for one in chosen}
    conditions = conditions_of(chosen, study.names)
    grids |= {name: np.array([value]) for name, value in conditions.items()}
    # What balls set, unless it is swept itself; defaults for what a ball doesn't set.
    balls = {
        name: {of: preset.get(name, variables[name].start) for of, preset in presets.items()}
        for name in sorted(set(chain(*presets.values())) - set(study.names))
    }
    grids |= {name: np.array(list(of_ball.values()), float) for name, of_ball in balls.items()}
    fixed = {n: column[0].item() for n, column in grids.items() if (column == column[0]).all()}
    return Plan(identity(), fixed, balls, study.outputs)


def impacts(plan: Plan, columns: Columns, fmu: ImpactRuns | None = None) -> Outcome:
    """Compute some cases in any process; `columns` are the swept variables, shape (cases,).

    UserError: this process has another physics than the one that made the plan.
    """
    number, values = len(next(iter(columns.values()))), plan.values(columns)
    if fmu is not None:
        values = {name: np.broadcast_to(value, number) for name, value in values.items()}
        return one_by_one(fmu, plan.outputs, values, np.arange(number))
    if identity() != plan.identity:
        raise UserError(
            f"a worker has {identity()}, and this process {plan.identity}: install the same "
            "golf-impact for all of them"
        )
    return impacts_by_arrays(plan.outputs, values, (number,))
