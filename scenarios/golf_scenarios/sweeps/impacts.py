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
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException

from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.sweeps.plan import Plan

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


def impacts(fmu: ImpactFmu, plan: Plan, values: Mapping[str, np.ndarray]) -> tuple[np.ndarray, str]:
    """Run these cases.

    Args:
        fmu: the instance; whatever it did before doesn't matter.
        plan: what is fixed, varied and read.
        values: what varies (and possibly more), by variable: arrays of shape (cases,).

    Returns:
        The outputs, doubles of shape (cases, outputs): Booleans are 0 and 1, those of cases that
        the FMU refused NaN. And why it refused the first of these; empty if there is none.

    Raises:
        FMICallException: the FMU broke down.
    """
    number = len(next(iter(values.values())))
    inputs = _Rows(fmu, plan.varied, number, float, values)
    laws = _Rows(fmu, plan.laws, number, np.intc, values)
    reals = _Rows(fmu, [n for n in plan.outputs if n not in plan.booleans], number, float)
    flags = _Rows(fmu, plan.booleans, number, np.intc)
    steps = np.broadcast_to(fmu.horizon({**plan.fixed, **values}), number).tolist()
    restore, leave_initialization, set_real, set_integer, do_step, get_real, get_boolean = (
        ctypes.CFUNCTYPE(_INT, _POINTER, *arguments)((name, fmu.slave.dll))
        for name, arguments in _FUNCTIONS.items()
    )
    component = fmu.slave.component
    state = _state_where_cases_differ(fmu, plan)
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
                if flags.width:
                    get_boolean(component, flags.references, flags.width, flag_at)
            real_at += reals.stride
            flag_at += flags.stride
    finally:
        fmu.slave.freeFMUstate(state)
    outputs: np.ndarray = np.empty((number, len(plan.outputs)))
    for rows in (reals, flags):
        outputs[:, [plan.outputs.index(name) for name in rows.names]] = rows.values
    # A number that leaves the range of a double is known only when it is read.
    unusable = np.isnan(outputs).any(axis=1)
    unusable[refused] = True
    outputs[unusable] = math.nan
    reason = fmu.messages[0] if fmu.messages else "it leaves the range of a double"
    return outputs, reason if unusable.any() else ""


class _Rows:
    """Values of these variables, a row a case, and the FMU's references of them, as addresses."""

    def __init__(
        self,
        fmu: ImpactFmu,
        names: Sequence[str],
        number: int,
        kind: type,
        given: Mapping[str, np.ndarray] | None = None,
    ) -> None:
        self.names, self.width = names, len(names)
        self._references = (ctypes.c_uint * self.width)(*fmu.references(names))
        self.references = ctypes.addressof(self._references)
        self.values: np.ndarray = np.zeros((number, self.width), kind)
        if given:
            for column, name in enumerate(names):
                self.values[:, column] = given[name]
        self.address = self.values.ctypes.data
        self.stride = self.width * self.values.itemsize


def _state_where_cases_differ(fmu: ImpactFmu, plan: Plan) -> Any:
    """The state in which they begin to, to be freed by the caller."""
    fmu.messages.clear()
    fmu.begin(plan.fixed)
    if plan.only_inputs:
        refusals = list(fmu.messages)
        fmu.slave.exitInitializationMode()
        # What the defaults of varied inputs make of the fixed values says nothing about the cases.
        fmu.messages[:] = refusals
    return fmu.slave.getFMUstate()
