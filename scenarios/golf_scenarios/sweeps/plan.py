"""How the cases of a study go into the FMU and come out: what every worker needs to know."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain

import numpy as np
from fmpy.model_description import ScalarVariable

from golf_scenarios.errors import UserError
from golf_scenarios.facts.balls import ball
from golf_scenarios.sweeps.axes import Grid
from golf_scenarios.sweeps.study import Study


@dataclass(frozen=True)
class Plan:
    """What is set and read, in which order.

    Attributes:
        fixed: values of inputs and parameters that are the same in all cases, by name.
        varied: the Real inputs and parameters that aren't, in the order in which they are set.
        laws: the Integer `law`, if it isn't either.
        only_inputs: whether all that varies may still change after initialization.
        balls: by variable that a ball preset sets: its value by the ball's name.
        outputs: what is read, in order.
        booleans: those of them that are Booleans.
    """

    fixed: dict[str, float]
    varied: tuple[str, ...]
    laws: tuple[str, ...]
    only_inputs: bool
    balls: dict[str, dict[str, float]]
    outputs: tuple[str, ...]
    booleans: tuple[str, ...]

    def values(self, columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """What to set in these cases, by variable: the columns, and what balls stand for."""
        values = {name: column for name, column in columns.items() if name != "ball"}
        for name, of_ball in self.balls.items():
            kind = np.int64 if name == "law" else float
            values[name] = np.array([of_ball[one] for one in columns["ball"]], kind)
        return values


def plan(study: Study, variables: Mapping[str, ScalarVariable]) -> Plan:
    """The plan of a study for the FMU with these variables.

    Raises:
        UserError: the FMU has no such input, parameter or output.
    """
    settable = [v.name for v in variables.values() if v.causality in ("input", "parameter")]
    outputs = {v.name: v.type for v in variables.values() if v.causality == "output"}
    for name in study.names:
        if name not in (*settable, "ball"):
            raise UserError(
                f"there is no input or parameter {name}: choose from {', '.join(settable)} and ball"
            )
    for name in study.outputs:
        if name not in outputs:
            raise UserError(f"there is no output {name!r}: choose from {', '.join(outputs)}")
    # None for a distribution.
    values = {one.name: one.values if isinstance(one, Grid) else None for one in study.axes}
    names = values.pop("ball", None)
    presets = {} if names is None else {name: ball(name).values for name in names}
    # What balls set, unless it is swept itself; defaults where a ball says nothing.
    balls = {
        name: {of: preset.get(name, float(variables[name].start)) for of, preset in presets.items()}
        for name in sorted(set(chain(*presets.values())) - set(values))
    }
    values |= {name: np.array(list(of_ball.values())) for name, of_ball in balls.items()}
    fixed = {
        name: given[0].item()
        for name, given in values.items()
        if given is not None and (given == given[0]).all()
    }
    varied = [name for name in values if name not in fixed]
    return Plan(
        fixed=fixed,
        varied=tuple(name for name in varied if name != "law"),
        laws=tuple(name for name in varied if name == "law"),
        only_inputs=all(variables[name].causality == "input" for name in varied),
        balls=balls,
        outputs=study.outputs,
        booleans=tuple(name for name in study.outputs if outputs[name] == "Boolean"),
    )
