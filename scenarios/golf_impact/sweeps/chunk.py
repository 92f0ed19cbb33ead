"""One chunk of a sweep, in whichever process computes it; each process keeps one instance."""

from __future__ import annotations

import hashlib
import tempfile
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from multiprocessing.util import Finalize
from pathlib import Path

import numpy as np
from fmpy.fmi1 import FMICallException

from golf_impact.errors import UserError
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.sweeps.impacts import Plan, Results, impacts


@dataclass(frozen=True)
class FmuFile:
    """An FMU as it travels to other processes and machines."""

    digest: str  # SHA-256, in hexadecimal
    data: bytes = field(repr=False)

    @classmethod
    def read(cls, path: Path) -> FmuFile:
        data = path.read_bytes()
        return cls(hashlib.sha256(data).hexdigest(), data)


_lock = threading.RLock()
#: The instance of this process by the digest of its file, if there is one.
_loaded: dict[str, ImpactFmu] = {}


def run_chunk(
    fmu: FmuFile, plan: Plan, as_text: bool, columns: Mapping[str, np.ndarray]
) -> tuple[bytes, Results]:
    """Run the cases of one chunk, in any process: the FMU is loaded there when first needed.

    `columns` are the swept variables, arrays of shape (cases,). Returns the cases as lines of CSV
    (UTF-8; empty without `as_text`), and their results. UserError if the FMU isn't what it should
    be, or can't be loaded here.
    """
    with _lock:
        try:
            results = impacts(instance_of(fmu), plan, plan.values(columns))
        except FMICallException as error:
            # After an error the standard allows no call any more that the FMU must survive.
            _loaded.clear()
            raise UserError(f"the FMU broke down ({error}): run `golf-impact build`") from None
    return _text(plan, columns, results.outputs) if as_text else b"", results


def _text(plan: Plan, columns: Mapping[str, np.ndarray], outputs: np.ndarray) -> bytes:
    """Lines of CSV; every double with as many digits as bring it back to the last bit."""
    cells: list[list[str]] = []
    for column in columns.values():
        values = column.tolist()
        cells.append(values if column.dtype == object else list(map(repr, values)))
    for name, column in zip(plan.outputs, outputs.T):
        values = np.nan_to_num(column).astype(int) if name in plan.booleans else column
        cells.append(list(map(repr, values.tolist())))
        for n in np.flatnonzero(np.isnan(column)).tolist():
            cells[-1][n] = ""
    return ("\n".join(map(",".join, zip(*cells))) + "\n").encode()


def instance_of(fmu: FmuFile) -> ImpactFmu:
    """This process's instance, loaded if need be."""
    with _lock:
        if fmu.digest not in _loaded:
            release()
            if hashlib.sha256(fmu.data).hexdigest() != fmu.digest:
                raise UserError("the FMU was damaged on its way to this process")
            with tempfile.TemporaryDirectory(prefix="golf-impact-") as folder:
                path = Path(folder, "ClubBallImpact.fmu")
                path.write_bytes(fmu.data)
                _loaded[fmu.digest] = ImpactFmu(path).__enter__()
            # When the process ends: an FMU that is never freed may take it down then.
            Finalize(None, release, exitpriority=10)
        return _loaded[fmu.digest]


def release() -> None:
    """Free the instance of this process, if there is one."""
    with _lock:
        for digest in list(_loaded):
            _loaded.pop(digest).__exit__(None, None, None)
