"""Many impacts in one instance of the FMU: as few calls per impact as FMI allows.

The instance is brought once to where all cases are still the same, and that state is saved. Each
impact then restores it, sets what varies in one call, makes one communication step that is longer
than the contact, and reads all outputs in one call. The calls go straight to the FMU's functions,
with the addresses of rows in NumPy arrays: fmpy's own methods copy each value twice.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException

from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.sweeps.plan import Plan

_POINTER, _DOUBLE, _SIZE, _INT = ctypes.c_void_p, ctypes.c_double, ctypes.c_size_t, ctypes.c_int

#: Types of the arguments after the component, for addresses in place of typed pointers.
_FUNCTIONS = {
    "fmi2SetFMUstate": (_POINTER,),
    "fmi2ExitInitializationMode": (),
    "fmi2SetReal": (_POINTER, _SIZE, _POINTER),
    "fmi2SetInteger": (_POINTER, _SIZE, _POINTER),
    "fmi2DoStep": (_DOUBLE, _DOUBLE, _INT),
    "fmi2GetReal": (_POINTER, _SIZE, _POINTER),
    "fmi2GetBoolean": (_POINTER, _SIZE, _POINTER),
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
    rows = np.column_stack([values[name] for name in plan.varied]) if plan.varied else None
    inputs = _Table(fmu, plan.varied, rows)
    law = values["law"].reshape(-1, 1) if plan.law_varies else None
    laws = _Table(fmu, ("law",) if plan.law_varies else (), law, np.intc)
    real_names = tuple(name for name in plan.outputs if name not in plan.booleans)
    flag_names = tuple(name for name in plan.outputs if name in plan.booleans)
    reals = _Table(fmu, real_names, np.zeros((number, len(real_names))))
    flags = _Table(fmu, flag_names, np.zeros((number, len(flag_names))), np.intc)
    steps = np.broadcast_to(fmu.horizon({**plan.fixed, **values}), (number,)).tolist()
    start = _prepared(fmu, plan)
    try:
        refused = _run(fmu, start.value, not plan.only_inputs, steps, inputs, laws, reals, flags)
        # A number that leaves the range of a double is known only when it is read.
        unusable = np.isnan(reals.rows).any(axis=1)
        unusable[refused] = True
        reason = fmu.messages[0] if fmu.messages else "it leaves the range of a double"
    finally:
        fmu.slave.freeFMUstate(start)
    outputs = np.empty((number, len(plan.outputs)))
    for n, name in enumerate(plan.outputs):
        table, names = (flags, flag_names) if name in plan.booleans else (reals, real_names)
        outputs[:, n] = table.rows[:, names.index(name)]
    outputs[unusable] = math.nan
    return outputs, reason if unusable.any() else ""


class _Table:
    """Rows of values beside the FMU's references of the columns, as addresses."""

    def __init__(
        self, fmu: ImpactFmu, names: tuple[str, ...], rows: np.ndarray | None, kind: Any = float
    ) -> None:
        self.width = len(names)
        self._references = (ctypes.c_uint * self.width)(*fmu.references(names))
        self.references = ctypes.addressof(self._references)
        self.rows = np.ascontiguousarray(np.empty((0, 0)) if rows is None else rows, dtype=kind)
        self.address = self.rows.ctypes.data
        self.stride = self.width * self.rows.itemsize


def _prepared(fmu: ImpactFmu, plan: Plan) -> Any:
    """The state in which the cases begin to differ, to be freed by the caller."""
    slave = fmu.slave
    fmu.messages.clear()
    fmu.begin(plan.fixed)
    if plan.only_inputs:
        refusals = list(fmu.messages)
        slave.exitInitializationMode()
        # What the defaults of varied inputs make of the fixed values says nothing about the cases.
        fmu.messages[:] = refusals
    return slave.getFMUstate()


def _run(
    fmu: ImpactFmu,
    start: int,
    initializing: bool,
    steps: list[float],
    inputs: _Table,
    laws: _Table,
    reals: _Table,
    flags: _Table,
) -> list[int]:
    """The loop over the cases; returns the numbers of those that were refused."""
    restore, leave_initialization, set_real, set_integer, do_step, get_real, get_boolean = (
        _function(fmu, name, arguments) for name, arguments in _FUNCTIONS.items()
    )
    component = fmu.slave.component
    refused: list[int] = []
    input_at, law_at, real_at, flag_at = (t.address for t in (inputs, laws, reals, flags))
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
    return refused


def _function(fmu: ImpactFmu, name: str, arguments: tuple) -> Any:
    address = ctypes.cast(getattr(fmu.slave.dll, name), _POINTER).value
    assert address is not None
    return ctypes.CFUNCTYPE(_INT, _POINTER, *arguments)(address)
