"""Many impacts in one instance of the FMU: as few calls per impact as FMI allows.

The instance is brought once to the last state that all cases have in common, which is saved. Each
impact restores it, sets what varies in one call, makes one communication step that is longer than
the contact, and reads all outputs in one call. The FMU's functions are called directly, with rows
of arrays that NumPy sees too: fmpy's own methods copy each value twice.
"""

from __future__ import annotations

import ctypes
import hashlib
import math
import tempfile
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from fmpy.fmi1 import FMICallException

from golf_impact.errors import UserError
from golf_impact.facts.balls import ball
from golf_impact.facts.quantities import undefined_results
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.sweeps.study import Study

_DISCARD = 2


@dataclass(frozen=True)
class Plan:
    """What every worker needs: the FMU, and what it sets and reads, in order."""

    digest: str  # SHA-256 of the FMU's file, in hexadecimal
    data: bytes = field(repr=False)  # the file
    fixed: dict[str, float]  # inputs and parameters that are the same in all cases
    varied: tuple[str, ...]  # those that aren't, in the order in which they are set
    balls: dict[str, dict[str, float]]  # what ball presets set: values by variable and ball
    outputs: tuple[str, ...]  # what is read, in order
    booleans: tuple[str, ...]  # those of them that are Booleans

    def values(self, columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """What to set in these cases, by variable: the columns, and the values of balls."""
        values = {name: column for name, column in columns.items() if name != "ball"}
        for name, of_ball in self.balls.items():
            kind = np.int64 if name == "law" else float
            values[name] = np.array([of_ball[preset] for preset in columns["ball"]], kind)
        return values


def make_plan(study: Study, fmu: ImpactFmu) -> Plan:
    """The plan of a study for this FMU; UserError if it lacks a variable."""
    variables, data = fmu.variables, fmu.path.read_bytes()
    settable = [v.name for v in variables.values() if v.causality in ("input", "parameter")]
    outputs = {v.name: v.type for v in variables.values() if v.causality == "output"}
    for kind, names, known in (
        ("input or parameter", study.names, [*settable, "ball"]),
        ("output", study.outputs, outputs),
    ):
        for name in names:
            if name not in known:
                raise UserError(f"there is no {kind} {name!r}: choose from {', '.join(known)}")
    grids = {axis.name: axis.values for axis in study.grid}
    presets = {name: ball(name).values for name in grids.pop("ball", ())}
    # What balls set, unless it is swept itself; defaults for what a ball doesn't set.
    balls = {
        name: {of: preset.get(name, fmu.default(name)) for of, preset in presets.items()}
        for name in sorted(set(chain(*presets.values())) - set(study.names))
    }
    grids |= {name: np.array(list(of_ball.values())) for name, of_ball in balls.items()}
    fixed = {
        name: column[0].item() for name, column in grids.items() if (column == column[0]).all()
    }
    varied = [name for name in (*study.names, *balls) if name not in (*fixed, "ball")]
    booleans = tuple(name for name in study.outputs if outputs[name] == "Boolean")
    digest = hashlib.sha256(data).hexdigest()
    return Plan(digest, data, fixed, tuple(varied), balls, study.outputs, booleans)


class Results(NamedTuple):
    """Results of some cases."""

    #: Doubles of shape (cases, outputs): Booleans are 0 and 1. NaN where the FMU refused a case,
    #: and what has no value without a contact or a separation (`undefined_results`).
    outputs: np.ndarray
    refused: np.ndarray  #: whether the FMU refused a case, shape (cases,)
    reason: str  #: why it refused the first of these; empty if there is none


_lock = threading.RLock()
#: The instance of this process, if any, by the digest of its file.
_loaded: dict[str, ImpactFmu] = {}


def load(plan: Plan) -> ImpactFmu:
    """This process's instance of the FMU, loaded if necessary; UserError if it can't be."""
    if plan.digest not in _loaded:
        release()
        if hashlib.sha256(plan.data).hexdigest() != plan.digest:
            raise UserError("the FMU was damaged on its way to this process")
        with tempfile.TemporaryDirectory(prefix="golf-impact-") as folder:
            path = Path(folder, "ClubBallImpact.fmu")
            path.write_bytes(plan.data)
            _loaded[plan.digest] = ImpactFmu(path).__enter__()
        # When the process ends: an FMU that is never freed may crash it then.
        Finalize(None, release, exitpriority=10)
    return _loaded[plan.digest]


def release() -> None:
    """Free the instance of this process, if any."""
    with _lock:
        for digest in list(_loaded):
            _loaded.pop(digest).__exit__(None, None, None)


def run_chunk(
    plan: Plan, as_text: bool, columns: Mapping[str, np.ndarray]
) -> tuple[bytes, Results]:
    """Run some cases, in any process: lines of CSV (UTF-8; optional), and results of `impacts`."""
    results = impacts(plan, columns)
    if not as_text:
        return b"", results
    # Doubles get as many digits as a lossless conversion needs.
    cells = [list(map(str, column.tolist())) for column in columns.values()]
    for name, column in zip(plan.outputs, results.outputs.T):
        values = np.nan_to_num(column).astype(int) if name in plan.booleans else column
        cells.append(list(map(repr, values.tolist())))
        for n in np.flatnonzero(np.isnan(column)).tolist():
            cells[-1][n] = ""
    return ("\n".join(map(",".join, zip(*cells))) + "\n").encode(), results


def impacts(plan: Plan, columns: Mapping[str, np.ndarray]) -> Results:
    """Run some cases; `columns` are the swept variables, arrays of shape (cases,).

    UserError: the FMU is damaged, can't be loaded here, or breaks down.
    """
    with _lock:
        try:
            return _run(load(plan), plan, plan.values(columns))
        except FMICallException as error:
            # After an error the standard allows no further calls.
            _loaded.clear()
            raise UserError(f"the FMU broke down ({error}): run `golf-impact build`") from None


def _run(fmu: ImpactFmu, plan: Plan, values: Mapping[str, np.ndarray]) -> Results:
    number = len(next(iter(values.values())))
    steps = np.broadcast_to(fmu.horizon({**plan.fixed, **values}), number).tolist()
    # All inputs and parameters are Real but for the law.
    inputs = _Table(fmu, [n for n in plan.varied if n != "law"], number, ctypes.c_double)
    laws = _Table(fmu, [n for n in plan.varied if n == "law"], number, ctypes.c_int)
    for name, column in (inputs.columns | laws.columns).items():
        column[:] = values[name]
    # Results depend on whether there was a contact and a separation.
    names = sorted({*plan.booleans, "touched", "separated"})
    flags = _Table(fmu, names, number, ctypes.c_int)
    reals = _Table(fmu, [n for n in plan.outputs if n not in names], number, ctypes.c_double)
    dll, component = fmu.slave.dll, ctypes.c_void_p(fmu.slave.component)
    restore, leave_initialization = dll["fmi2SetFMUstate"], dll["fmi2ExitInitializationMode"]
    set_real, set_integer, do_step = dll["fmi2SetReal"], dll["fmi2SetInteger"], dll["fmi2DoStep"]
    get_real, get_boolean = dll["fmi2GetReal"], dll["fmi2GetBoolean"]
    # What may still change after initialization.
    only_inputs = all(fmu.variables[name].causality == "input" for name in plan.varied)
    begin, refused = ctypes.c_double(0.0), np.zeros(number, bool)
    fmu.messages.clear()
    fmu.begin(plan.fixed)
    if only_inputs:
        refusals = list(fmu.messages)
        fmu.end_initialization()
        # Refusals due to the defaults of varied inputs don't concern the cases.
        fmu.messages[:] = refusals
    start = fmu.slave.getFMUstate()
    try:
        for n, (size, *row) in enumerate(
            zip(steps, inputs.rows, laws.rows, reals.rows, flags.rows)
        ):
            restore(component, start)
            if inputs.width:
                set_real(component, inputs.references, inputs.width, row[0])
            if laws.width:
                set_integer(component, laws.references, laws.width, row[1])
            if not only_inputs:
                leave_initialization(component)
            status = do_step(component, begin, ctypes.c_double(size), 1)
            if status > _DISCARD:
                raise FMICallException("fmi2DoStep", status)
            refused[n] = status
            if not status:
                if reals.width:
                    get_real(component, reals.references, reals.width, row[2])
                get_boolean(component, flags.references, flags.width, row[3])
    finally:
        fmu.slave.freeFMUstate(start)
    read = reals.columns | flags.columns
    outputs = np.stack([read[name] for name in plan.outputs], axis=1).astype(float)
    # Overflow is detected only when an output is read.
    refused |= np.isnan(outputs).any(axis=1)
    outputs[refused] = math.nan
    for touched in (False, True):
        without = (read["touched"] == touched) & (read["separated"] == 0)
        for name in undefined_results(touched, False).keys() & {*plan.outputs}:
            outputs[without, plan.outputs.index(name)] = math.nan
    reason = fmu.messages[0] if fmu.messages else "it leaves the range of a double"
    return Results(outputs, refused, reason if refused.any() else "")


class _Table:
    """Values of these variables in rows for C functions, one a case, and in columns for NumPy."""

    def __init__(self, fmu: ImpactFmu, names: Sequence[str], cases: int, kind: Any) -> None:
        self.width = ctypes.c_size_t(len(names))
        self.references = (ctypes.c_uint * len(names))(*fmu.references(names))
        self.rows = (kind * len(names) * cases)()
        self.columns = dict(zip(names, np.ctypeslib.as_array(self.rows).T))
