"""ClubBallImpact.fmu, driven by fmpy."""

import errno
import math
import shutil
import signal
import sys
import tempfile
import threading
import weakref
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import fmpy
import numpy as np
from fmpy import fmi2
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from numpy.typing import ArrayLike

from golf_impact.data.errors import (
    UnavailableError,
    UserError,
    first_line,
    refusal,
    refused,
    unknown_name,
)
from golf_impact.data.quantities import undefined_results
from golf_impact.data.runs import FLAGS, METRICS, PATH, ImpactArrays, Named, horizon, instants_of
from golf_impact.data.units import number
from golf_impact.fmu.current import current_fmu, current_system
from golf_impact.fmu.file import check_fmu, check_temporary_folder

Entered = TypeVar("Entered", bound="Fmu")

#: What fmpy's setter needs, by type of the variable.
_KINDS: dict[str, type] = {"Real": float, "Integer": int, "Boolean": bool}


@contextmanager
def _interrupts_wait() -> Iterator[None]:
    """KeyboardInterrupt is raised at the end of this block, in the main thread of Python.

    pythonfmu takes one that is raised while it makes an instance for a failure of the FMU. Then
    our FMUs defer interrupts by themselves (fmu_src/host/interrupts.py).
    """
    before = signal.getsignal(signal.SIGINT)
    if before is not signal.default_int_handler or threading.current_thread().name != "MainThread":
        yield
        return
    waiting: list[int] = []
    signal.signal(signal.SIGINT, lambda number, frame: waiting.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        for name, module in [*sys.modules.items()]:
            if name.endswith(".host.interrupts"):
                module.defer_interrupts()
    if waiting:
        raise KeyboardInterrupt


def _is_needed(member: str) -> bool:
    """Whether an instance on this platform needs this file of an FMU."""
    return member.startswith(("modelDescription", "resources/", f"binaries/{fmpy.platform}/"))


class _Closed:
    """Takes the place of an instance that has been freed: a call of it would end Python."""

    def __getattr__(self, name: str) -> NoReturn:
        raise UserError("this FMU is closed, at the end of its `with` block: open another one")


class Fmu:
    """An FMU 2.0 for co-simulation, extracted and instantiated once for any number of runs.

    FMPy's example `efficient_loops.py` does the same. For use in a `with` block, and in one thread.

    Attributes:
        path: the .fmu file.
        folder: where what an instance needs of it is extracted.
        description: fmpy's ModelDescription.
        instance: fmpy's FMU2Slave, instantiated.
        references: value references by name.

    Raises:
        UserError: the file can't be loaded.
    """

    def __init__(self, path: Path) -> None:
        check_temporary_folder()
        self.path = path
        self._messages: list[str] = []
        self.folder = ""
        try:
            self.description = fmpy.read_model_description(str(path))
            self.folder = tempfile.mkdtemp(prefix="golf-impact-")
            # Also without a `with` block.
            self._remove = weakref.finalize(self, shutil.rmtree, self.folder, ignore_errors=True)
            fmpy.extract(str(path), self.folder, include=_is_needed)
            self.instance = self._instantiate()
        except Exception as error:  # fmpy raises Exception itself
            shutil.rmtree(self.folder, ignore_errors=True)
            full = isinstance(error, OSError) and error.errno == errno.ENOSPC
            what = "set TMPDIR to another folder" if full else f"run `golf-impact doctor {path}`"
            raise UserError(f"{path} can't be loaded ({first_line(error)}): {what}") from error
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.references = {name: v.valueReference for name, v in self.variables.items()}
        self._outputs = {
            name: v.valueReference
            for name, v in self.variables.items()
            if v.causality == "output" and v.type == "Real"
        }
        # Restoring this state is far cheaper than reset, which makes a new Python object.
        self._initial = self.instance.getFMUstate()

    def _instantiate(self) -> FMU2Slave:
        # Not by fmpy.instantiate_fmu, whose loggers go through a library with one of them per
        # process: that of another instance, which may have been freed.
        memory = fmi2.defaultCallbacks
        callbacks = fmi2.fmi2CallbackFunctions(
            fmi2.fmi2CallbackLoggerTYPE(self._log), memory.allocateMemory, memory.freeMemory
        )
        instance = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=self.description.modelName,
        )
        with _interrupts_wait():
            instance.instantiate(callbacks=callbacks, loggingOn=True)
        return instance

    def __enter__(self: Entered) -> Entered:
        return self

    def __exit__(self, *_: object) -> None:
        if not isinstance(self.instance, _Closed):
            self.instance.freeFMUstate(self._initial)
            self.instance.freeInstance()
            self.instance = _Closed()
        self._remove()

    def simulate(
        self,
        stop_time: float = 1e-3,
        output: Sequence[str] = METRICS,
        output_interval: float | None = None,
        **options: Any,
    ) -> Any:
        """`fmpy.simulate_fmu` of this instance, with its own arguments and its structured array.

        Args:
            stop_time: s.
            output: the variables to record.
            output_interval: communication step size, s; by default one step.
            options: others of `fmpy.simulate_fmu`, such as `start_values` and `input`.

        Raises:
            UserError: the FMU rejects a value or a step (`simulate_fmu` returns the rows before),
                or has no variable of a name.
        """
        for name in output:
            if name not in self.references:
                raise unknown_name("output", name, self._outputs)
        options["start_values"] = self._numbers(options.get("start_values", {}))
        self.instance.setFMUstate(self._initial)
        with self._refusals():
            return fmpy.simulate_fmu(
                self.folder,
                model_description=self.description,
                fmu_instance=self.instance,
                stop_time=stop_time,
                output=output,
                output_interval=output_interval or stop_time,
                **options,
            )

    def start(self, start_time: float = 0.0, /, **values: float | str) -> None:
        """Begin a run at this time (s) with these inputs and parameters.

        SI units, or text with a unit; start values for the others.
        """
        self._start(self._numbers(values), start_time)

    def _start(self, values: Mapping[str, float], start_time: float = 0.0) -> None:
        self.instance.setFMUstate(self._initial)
        self.instance.setupExperiment(startTime=start_time)
        self.instance.enterInitializationMode()
        for name, value in values.items():
            kind = self.variables[name].type
            with self._refusals(name, value):
                setter = getattr(self.instance, f"set{kind}")
                setter([self.references[name]], [_KINDS[kind](value)])
        with self._refusals():
            self.instance.exitInitializationMode()

    def step(self, point: float, size: float) -> None:
        """Make a communication step of `size` s from `point`, s."""
        with self._refusals():
            self.instance.doStep(point, size)

    def read(self, names: Iterable[str]) -> Named[float]:
        """Values of Real outputs, or of one, at this communication point by name (SI units)."""
        names = [names] if isinstance(names, str) else [*names]
        try:
            references = [self._outputs[name] for name in names]
        except KeyError as error:
            raise unknown_name("Real output", error.args[0], self._outputs) from None
        return Named(zip(names, self.instance.getReal(references), strict=True))

    def read_flag(self, name: str) -> bool:
        """Value of a Boolean output at this communication point."""
        if name not in self.variables or self.variables[name].type != "Boolean":
            flags = [one for one, variable in self.variables.items() if variable.type == "Boolean"]
            raise unknown_name("Boolean output", name, flags)
        return bool(self.instance.getBoolean([self.references[name]])[0])

    def _numbers(self, values: Mapping[str, Any]) -> dict[str, float]:
        """The values of inputs and parameters in SI units; a UserError if one isn't any."""
        numbers = {}
        for name, given in values.items():
            variable = self.variables.get(name)
            if variable is None or variable.causality == "output":
                known = [n for n, v in self.variables.items() if v.causality != "output"]
                raise unknown_name("input or parameter", name, known)
            value = numbers[name] = number(name, given)
            if variable.type == "Integer" and not (value == value // 1 and abs(value) < 2**31):
                # fmpy would cut it.
                reason = "it must be a whole number"
                raise refused(name, value, reason)
        return numbers

    def _log(self, host: Any, instance: Any, status: int, category: Any, text: bytes) -> None:
        self._messages.append(text.decode("utf-8", "replace"))

    @contextmanager
    def _refusals(self, variable: str = "", value: float | None = None) -> Iterator[None]:
        """A refusal in this block becomes a UserError: fmpy goes on after a discarded step."""
        self._messages.clear()
        try:
            yield
        except FMICallException as error:
            if not self._messages:
                raise UserError(f"{self.path} failed ({first_line(error)})") from error
        if self._messages:
            raise refusal(self._messages[0], variable, value)


class Impact(Fmu):
    """ClubBallImpact.fmu, extracted and instantiated once for any number of impacts.

    A context manager; attributes and `simulate` are those of `Fmu`. Called with outputs and values,
    it computes an impact as `golf_impact.run_impact` does, with the same arguments and results.

    Args:
        path: an .fmu file (FMI 2.0); by default `current_fmu()`.

    Raises:
        UserError: the file is missing, damaged, another FMU, or can't be loaded; later, the FMU
            rejects a value, or has no variable of a name.

    Example:
        >>> with Impact() as impact:
        ...     found = impact(["smash_factor"], law=2)
        ...     path = impact.simulate(1e-3, ["force"], 1e-4, start_values={"law": 2})
        >>> round(found["smash_factor"], 4), path["force"][:3].round().tolist()
        (1.5842, [315.0, 3575.0, 5841.0])
    """

    def __init__(self, path: Path | str | None = None) -> None:
        self._built = path is None
        super().__init__(current_fmu() if path is None else check_fmu(Path(path)))

    def __call__(self, outputs: Iterable[str] = METRICS, **values: float | str) -> Named[float]:
        """Compute an impact in one communication step; see `golf_impact.run_impact`.

        Results have no value if the bodies don't touch or separate within the step.
        """
        numbers = self._numbers(values)
        self._start(numbers)
        self.step(0.0, horizon(numbers))
        if numbers.get("club_force") and self.read_flag("separated"):
            # To separation: the head would go on accelerating, for seconds after 0.6 ms.
            end = sum(self.read(("touch_time", "contact_time")).values())
            self._start(numbers)
            self.step(0.0, end * (1.0 + 2.0**-51))
        results = self.read(outputs)
        undefined = undefined_results(self.read_flag("touched"), self.read_flag("separated"))
        results.update((name, undefined[name]) for name in undefined.keys() & results.keys())
        return results

    def trajectory(
        self, points: int = 301, outputs: Iterable[str] = PATH, **values: float | str
    ) -> Named[np.ndarray]:
        """Sample an impact; see `golf_impact.run_trajectory`."""
        numbers = self._numbers(values)
        touch, contact = self(("touch_time", "contact_time"), **numbers).values()
        times = instants_of(numbers, touch, contact, points)
        self._start(numbers)
        if times[0]:
            self.step(0.0, times[0])
        return Named({"time": times, **self.sample(times, outputs)})

    def sample(self, times: np.ndarray, names: Iterable[str]) -> dict[str, np.ndarray]:
        """Record Real outputs (SI units) by name at these times (s), the first of which is now."""
        first = self.read(names)
        rows = [list(first.values())]
        for before, time in pairwise(times):
            self.step(before, time - before)
            rows.append(list(self.read(first).values()))
        return dict(zip(first, np.array(rows).T.copy(), strict=True))

    def many(self, outputs: Sequence[str], **columns: ArrayLike) -> ImpactArrays:
        """Compute impacts one after another; see `golf_impact.run_impacts`.

        Args:
            outputs: Real or Boolean outputs.
            columns: inputs and parameters by name (SI units): numbers, or arrays of shape (cases,).
        """
        reals = [name for name in outputs if name not in FLAGS]
        nothing = {name: False if name in FLAGS else math.nan for name in outputs}
        rows, refused, reason = [], [], ""
        for row in zip(*(column.tolist() for column in np.broadcast_arrays(*columns.values()))):
            try:
                found = nothing | self(reals, **dict(zip(columns, row)))
                rows.append({n: x if n in reals else self.read_flag(n) for n, x in found.items()})
                refused.append(False)
            except UserError as error:
                rows.append(nothing)
                refused.append(True)
                reason = reason or str(error)
        table = {name: np.array([row[name] for row in rows]) for name in outputs}
        return ImpactArrays(table, np.array(refused), reason)

    def companion(self, file: str) -> Path:
        """Launch.fmu or GolfSwing.ssp: of the current sources, or that beside the given `path`.

        Raises:
            UnavailableError: there is none beside it.
        """
        if self._built:
            return current_system() if file.endswith(".ssp") else current_fmu(Path(file).stem)
        path = self.path.with_name(file)
        if not path.is_file():
            raise UnavailableError(f"there is no {file} beside {self.path}")
        return path
