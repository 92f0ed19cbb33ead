"""How the cases of a study go into the FMU and come out: what every worker needs to know."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from fmpy.model_description import ScalarVariable

from golf_scenarios.errors import UserError
from golf_scenarios.sweeps.axes import Grid
from golf_scenarios.sweeps.study import Study


@dataclass(frozen=True)
class Plan:
    """What is set and read, in which order.

    Attributes:
        fixed: values of inputs and parameters that are the same in all cases, by name.
        varied: the Real inputs and parameters that aren't, in the order in which they are set.
        law_varies: whether the Integer `law` is another one.
        only_inputs: whether all that varies may still change after initialization.
        balls: by variable that a ball preset sets: its value by the ball's name.
        outputs: what is read, in order.
        booleans: those of them that are Booleans.
    """

    fixed: dict[str, float]
    varied: tuple[str, ...]
    law_varies: bool
    only_inputs: bool
    balls: dict[str, dict[str, float]]
    outputs: tuple[str, ...]
    booleans: frozenset[str]

    def values(self, columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """What to set in these cases, by variable: the columns, and what balls stand for."""
        values = {name: column for name, column in columns.items() if name != "ball"}
        for name, of_ball in self.balls.items():
            kind = np.int64 if name == "law" else float
            values[name] = np.array([of_ball[ball] for ball in columns["ball"]], kind)
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
    balls = _balls(study, variables)
    candidates = {one.name: one.values if isinstance(one, Grid) else None for one in study.axes}
    candidates |= {name: np.array(list(of_ball.values())) for name, of_ball in balls.items()}
    candidates.pop("ball", None)
    fixed: dict[str, float] = {}
    varied: list[str] = []
    for name, values in candidates.items():
        if values is not None and (values == values[0]).all():
            fixed[name] = values[0].item()
        else:
            varied.append(name)
    return Plan(
        fixed=fixed,
        varied=tuple(name for name in varied if name != "law"),
        law_varies="law" in varied,
        only_inputs=all(variables[name].causality == "input" for name in varied),
        balls=balls,
        outputs=study.outputs,
        booleans=frozenset(name for name in study.outputs if outputs[name] == "Boolean"),
    )


def _balls(study: Study, variables: Mapping[str, ScalarVariable]) -> dict[str, dict[str, float]]:
    """What balls set, unless it is swept itself; defaults where a ball says nothing."""
    from golf_scenarios.facts.balls import ball

    names = next((one.values for one in study.grid if one.name == "ball"), ())
    presets = {name: ball(name).values for name in names}
    concerned = {name for preset in presets.values() for name in preset} - set(study.names)
    return {
        name: {of: preset.get(name, float(variables[name].start)) for of, preset in presets.items()}
        for name in sorted(concerned)
    }
