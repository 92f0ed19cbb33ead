"""One chunk of a sweep, in whichever process computes it; each process keeps one instance."""

from __future__ import annotations

import hashlib
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from multiprocessing.util import Finalize
from pathlib import Path

import numpy as np
from fmpy.fmi1 import FMICallException

from golf_scenarios.errors import UserError
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.sweeps.impacts import impacts
from golf_scenarios.sweeps.plan import Plan


@dataclass(frozen=True)
class FmuFile:
    """An FMU as it travels to other processes and machines.

    Attributes:
        digest: SHA-256 of the file, in hexadecimal.
        data: the file; empty for a process that has it already.
    """

    digest: str
    data: bytes = field(repr=False)

    @classmethod
    def read(cls, path: Path) -> FmuFile:
        """The file at a path.

        Raises:
            UserError: it can't be read.
        """
        try:
            data = path.read_bytes()
        except OSError as error:
            raise UserError(f"can't read {path}: {error.strerror}") from error
        return cls(hashlib.sha256(data).hexdigest(), data)

    @property
    def name_only(self) -> FmuFile:
        """The same without its content."""
        return replace(self, data=b"")


@dataclass(frozen=True)
class Chunk:
    """What one chunk gave.

    Attributes:
        cases: how many.
        text: their lines as CSV (UTF-8); empty if they weren't asked for.
        kept: the outputs that the caller asked for, doubles of shape (cases, kept); refused: NaN.
        refused: how many cases the FMU refused.
        first: the number of the first of them within the chunk, and why; None if there is none.
    """

    cases: int
    text: bytes
    kept: np.ndarray
    refused: int
    first: tuple[int, str] | None


@dataclass(frozen=True)
class Form:
    """What a chunk is to give back.

    Attributes:
        as_text: whether as lines of CSV.
        kept: which outputs also as numbers, by their place.
    """

    as_text: bool
    kept: tuple[int, ...]


_lock = threading.Lock()
#: The instance of this process with the digest of its file, and what closes it.
_loaded: tuple[str, ImpactFmu, ExitStack] | None = None


def run_chunk(fmu: FmuFile, plan: Plan, form: Form, columns: Mapping[str, np.ndarray]) -> Chunk:
    """Run the cases of one chunk, in any process: the FMU is loaded there when first needed.

    Args:
        fmu: the FMU.
        plan: what is set and read.
        form: what to give back.
        columns: the swept variables, arrays of shape (cases,).

    Raises:
        UserError: the FMU isn't what it should be, or can't be loaded here.
    """
    global _loaded
    with _lock:
        try:
            return computed(_instance(fmu), plan, form, columns)
        except FMICallException as error:
            # After an error the standard allows no call any more that the FMU must survive.
            _loaded = None
            raise UserError(f"the FMU broke down ({error}): run `golf-impact build`") from None


def computed(
    instance: ImpactFmu, plan: Plan, form: Form, columns: Mapping[str, np.ndarray]
) -> Chunk:
    """The same in an instance at hand."""
    results = impacts(instance, plan, plan.values(columns))
    return Chunk(
        cases=len(results.outputs),
        text=_text(plan, columns, results.outputs) if form.as_text else b"",
        kept=results.outputs[:, form.kept],
        refused=len(results.refused),
        first=(int(results.refused[0]), results.reason) if len(results.refused) else None,
    )


def _text(plan: Plan, columns: Mapping[str, np.ndarray], outputs: np.ndarray) -> bytes:
    """Lines of CSV; every double with as many digits as bring it back to the last bit."""
    parts: list[list[str]] = []
    for column in columns.values():
        values = column.tolist()
        parts.append(values if column.dtype == object else list(map(repr, values)))
    usable = ~np.isnan(outputs).any(axis=1) if outputs.shape[1] else np.ones(len(outputs), bool)
    for n, name in enumerate(plan.outputs):
        column = outputs[:, n]
        if usable.all():
            values = (column.astype(int) if name in plan.booleans else column).tolist()
            parts.append(list(map(repr, values)))
        else:
            kind = int if name in plan.booleans else float
            parts.append(
                [
                    repr(kind(value)) if good else ""
                    for value, good in zip(column.tolist(), usable.tolist())
                ]
            )
    return ("\n".join(map(",".join, zip(*parts))) + "\n").encode()


def _instance(fmu: FmuFile) -> ImpactFmu:
    global _loaded
    if _loaded is not None and _loaded[0] == fmu.digest:
        return _loaded[1]
    _close()
    stack = ExitStack()
    instance = stack.enter_context(unpacked(fmu))
    _loaded = (fmu.digest, instance, stack)
    # When the process ends: an FMU that is never freed may take it down then.
    Finalize(None, release, exitpriority=10)
    return instance


@contextmanager
def unpacked(fmu: FmuFile) -> Iterator[ImpactFmu]:
    """An instance of an FMU that came as bytes.

    Raises:
        UserError: the bytes aren't those that were sent, or can't be loaded here.
    """
    if hashlib.sha256(fmu.data).hexdigest() != fmu.digest:
        raise UserError("the FMU was damaged on its way to this process")
    with tempfile.TemporaryDirectory(prefix="golf-impact-") as folder:
        path = Path(folder, "ClubBallImpact.fmu")
        path.write_bytes(fmu.data)
        with ImpactFmu(path) as instance:
            yield instance


def load(fmu: FmuFile) -> None:
    """Load the FMU into this process now; chunks may then name it only."""
    with _lock:
        _instance(fmu)


def release() -> None:
    """Free the instance of this process, if there is one."""
    with _lock:
        _close()


def _close() -> None:
    global _loaded
    if _loaded is not None:
        loaded, _loaded = _loaded, None
        loaded[2].close()
