"""Many impacts in one instance of the FMU: as few calls per impact as FMI allows.

The instance is brought once to where all cases are still the same, and that state is saved. Each
impact then restores it, sets what varies in one call, makes one communication step that is longer
than the contact, and reads all outputs in one call. The calls go straight to the FMU's functions,
with the addresses of rows in NumPy arrays: fmpy's own methods copy each value twice.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ScalarVariable

from golf_impact.errors import UserError
from golf_impact.facts.balls import ball
from golf_impact.facts.quantities import undefined_results
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.sweeps.axes import Grid
from golf_impact.sweeps.study import Study

_POINTER, _DOUBLE, _INT = ctypes.c_void_p, ctypes.c_double, ctypes.c_int
_VALUES = (_POINTER, ctypes.c_size_t, _POINTER)

#: Types of the arguments after the component, for addresses in place of typed pointers.
_FUNCTIONS = {
    "fmi2SetFMUstate": (_POINTER,),
    "fmi2ExitInitializationMode": (),
    "fmi2SetReal": _VALUES,
    "fmi2SetInteger": _VALUES,
    "fmi2DoStep": (_DOUBLE, _DOUBLE, _INT),
    "fmi2GetReal": _VALUES,
    "fmi2GetBoolean": _VALUES,
}

_DISCARD = 2


@dataclass(frozen=True)
class Plan:
    """What is set and read, in which order: what every worker needs to know of a study."""

    fixed: dict[str, float]  # inputs and parameters that are the same in all cases
    varied: tuple[str, ...]  # the Real ones that aren't, in the order in which they are set
    laws: tuple[str, ...]  # the Integer `law`, if it isn't either
    only_inputs: bool  # whether all that varies may still change after initialization
    balls: dict[str, dict[str, float]]  # what ball presets set: values by variable and ball
    outputs: tuple[str, ...]  # what is read, in order
    booleans: tuple[str, ...]  # those of them that are Booleans

    def values(self, columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """What to set in these cases, by variable: the columns, and what balls stand for."""
        values = {name: column for name, column in columns.items() if name != "ball"}
        for name, of_ball in self.balls.items():
            kind = np.int64 if name == "law" else float
            values[name] = np.array([of_ball[one] for one in columns["ball"]], kind)
        return values


def plan(study: Study, variables: Mapping[str, ScalarVariable]) -> Plan:
    """The plan of a study for the FMU with these variables; UserError if it lacks one."""
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
    varied = tuple(name for name in values if name not in fixed and name != "law")
    laws = ("law",) if "law" in values and "law" not in fixed else ()
    only_inputs = all(variables[name].causality == "input" for name in (*varied, *laws))
    booleans = tuple(name for name in study.outputs if outputs[name] == "Boolean")
    return Plan(fixed, varied, laws, only_inputs, balls, study.outputs, booleans)


class Results(NamedTuple):
    """Results of some cases."""

    #: Doubles of shape (cases, outputs): Booleans are 0 and 1. NaN where the FMU refused a case,
    #: and what has no value without a contact or a separation (`undefined_results`).
    outputs: np.ndarray
    refused: np.ndarray  #: whether the FMU refused a case, shape (cases,)
    reason: str  #: why it refused the first of these; empty if there is none


def impacts(fmu: ImpactFmu, plan: Plan, values: Mapping[str, np.ndarray]) -> Results:
    """Run these cases, whatever the instance did before; FMICallException if it breaks down.

    `values` is what varies (and possibly more), by variable: arrays of shape (cases,).
    """
    number = len(next(iter(values.values())))
    inputs = _Rows(fmu, plan.varied, number, float)
    laws = _Rows(fmu, plan.laws, number, np.intc)
    for rows in (inputs, laws):
        for column, name in zip(rows.values.T, rows.names):
            column[:] = values[name]
    reals = _Rows(fmu, [name for name in plan.outputs if name not in plan.booleans], number, float)
    # Results depend on whether there was a contact and a separation.
    flags = _Rows(fmu, sorted({*plan.booleans, "touched", "separated"}), number, np.intc)
    steps = np.broadcast_to(fmu.horizon({**plan.fixed, **values}), number).tolist()
    restore, leave_initialization, set_real, set_integer, do_step, get_real, get_boolean = (
        ctypes.CFUNCTYPE(_INT, _POINTER, *arguments)((name, fmu.slave.dll))
        for name, arguments in _FUNCTIONS.items()
    )
    component = fmu.slave.component
    fmu.messages.clear()
    fmu.begin(plan.fixed)
    if plan.only_inputs:
        refusals = list(fmu.messages)
        fmu.end_initialization()
        # What the defaults of varied inputs make of the fixed values says nothing about the cases.
        fmu.messages[:] = refusals
    state = fmu.slave.getFMUstate()
    start, initializing = state.value, not plan.only_inputs
    input_at, law_at, real_at, flag_at = (rows.address for rows in (inputs, laws, reals, flags))
    refused: list[int] = []
    try:
        for n, size in enumerate(steps):
            restore(component, start)
            if inputs.width:
                set_real(component, inputs.references, inputs.width, input_at)
                input_at += inputs.stride
            if laws.width:
                set_integer(component, laws.references, 1, law_at)
                law_at += laws.stride
            if initializing:
                leave_initialization(component)
            status = do_step(component, 0.0, size, 1)
            if status:
                if status > _DISCARD:
                    raise FMICallException("fmi2DoStep", status)
                refused.append(n)
            else:
                if reals.width:
                    get_real(component, reals.references, reals.width, real_at)
                get_boolean(component, flags.references, flags.width, flag_at)
            real_at += reals.stride
            flag_at += flags.stride
    finally:
        fmu.slave.freeFMUstate(state)
    columns = dict(zip([*reals.names, *flags.names], [*reals.values.T, *flags.values.T]))
    outputs = np.stack([columns[name] for name in plan.outputs], axis=1).astype(float)
    # A number that leaves the range of a double is known only when it is read.
    unusable = np.isnan(outputs).any(axis=1)
    unusable[refused] = True
    outputs[unusable] = math.nan
    for touched in (False, True):
        without = (columns["touched"] == touched) & (columns["separated"] == 0)
        for name in undefined_results(touched, False).keys() & {*plan.outputs}:
            outputs[without, plan.outputs.index(name)] = math.nan
    reason = fmu.messages[0] if fmu.messages else "it leaves the range of a double"
    return Results(outputs, unusable, reason if unusable.any() else "")


class _Rows:
    """Values of these variables, a row a case, and the FMU's references of them, as addresses."""

    def __init__(self, fmu: ImpactFmu, names: Sequence[str], cases: int, kind: type) -> None:
        self.names, self.width = names, len(names)
        self.values: np.ndarray = np.zeros((cases, self.width), kind)
        self._references = (ctypes.c_uint * self.width)(*fmu.references(names))
        self.references = ctypes.addressof(self._references)
        self.address = self.values.ctypes.data
        self.stride = self.width * self.values.itemsize
