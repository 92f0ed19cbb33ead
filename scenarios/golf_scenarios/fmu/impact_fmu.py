"""Drives the FMU through fmpy: one extraction, one instance, as many impacts as a scene wants."""

import math
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import fmpy
import numpy as np

# Before an FMU brings its own copy, which has no binaries to build another FMU with.
import pythonfmu.builder  # noqa: F401
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    fmi2Discard,
)

from golf_scenarios.errors import UserError
from golf_scenarios.fmu.archive import flaw
from golf_scenarios.fmu.file import check_temporary_folder

#: One communication step that is longer than any contact here; the answer doesn't depend on it.
HORIZON = 1.0

#: What a metrics-only scene reads once, at the end of its one step.
METRICS = (
    "club_velocity",
    "ball_velocity",
    "touch_time",
    "smash_factor",
    "coefficient_of_restitution",
    "energy_efficiency",
    "contact_time",
    "max_force",
    "time_of_max_force",
    "max_compression",
    "contact_displacement",
    "impulse",
    "momentum",
    "kinetic_energy",
)

#: What a scene may set.
INPUTS = (
    "k",
    "b",
    "club_speed",
    "m_club",
    "m_ball",
    "ball_diameter",
    "ball_speed",
    "gap",
    "law",
    "exponent",
    "reference_compression",
)

FLAGS = ("touched", "in_contact", "separated")

#: What a trajectory samples unless it is told otherwise.
PATH = ("force", "club_position", "ball_position", "club_velocity", "ball_velocity", "compression")


class ImpactFmu:
    """The FMU, extracted and instantiated once, for use in a `with` block.

    Args:
        path: the .fmu file.

    Raises:
        UserError: the file is missing, corrupt or another FMU.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        why = flaw(path)
        if why is not None:
            raise UserError(why)
        try:
            self.description = fmpy.read_model_description(str(path))
        except Exception as error:  # whatever zip, XML and fmpy make of a broken file
            raise UserError(
                f"{path} is no readable FMU ({_in_a_line(error)}): run `golf-impact build`"
            ) from error
        self.variables = {v.name: v for v in self.description.modelVariables}
        if "smash_factor" not in self.variables:
            raise UserError(f"{path} is another FMU ({self.description.modelName}), not this one")
        if self.description.fmiVersion != "2.0" or self.description.coSimulation is None:
            raise UserError(
                f"{path} is no FMU for co-simulation of FMI 2.0, which is needed here: run "
                "`golf-impact build`"
            )
        missing = [n for n in (*INPUTS, *METRICS, *PATH, *FLAGS) if n not in self.variables]
        if missing:
            raise UserError(
                f"{path} lacks {', '.join(missing)}, so it is of another version: run "
                "`golf-impact build`"
            )
        self.messages: list[str] = []
        self._folder: str | None = None
        self._slave: FMU2Slave | None = None
        self._fresh: Any = None

    def __enter__(self) -> "ImpactFmu":
        self._folder = tempfile.mkdtemp(prefix="golf-impact-")
        try:
            self._extract(self._folder)
            slave = FMU2Slave(
                guid=self.description.guid,
                unzipDirectory=self._folder,
                modelIdentifier=self.description.coSimulation.modelIdentifier,
                instanceName="impact",
            )
            slave.instantiate(callbacks=self._callbacks(), loggingOn=True)
            # Restoring this state is far cheaper than a reset, which makes a new instance.
            self._fresh = slave.getFMUstate()
        except Exception as error:
            shutil.rmtree(self._folder, ignore_errors=True)
            if isinstance(error, UserError):
                raise
            why = _in_a_line(error)
            raise UserError(
                f"{self.path} can't be loaded ({why}): run `golf-impact build`"
            ) from error
        self._slave = slave
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        slave = self.slave
        # After an error that isn't a refusal further calls may crash the process.
        failed = isinstance(error, FMICallException)
        if not failed:
            slave.freeFMUstate(self._fresh)
            slave.terminate()
            slave.freeInstance()
        self._slave = None
        assert self._folder is not None
        shutil.rmtree(self._folder, ignore_errors=True)
        if failed:
            said = f": {_in_a_line(self.messages[-1])}" if self.messages else ""
            raise UserError(f"{self.path} failed ({_in_a_line(str(error))}{said})") from error

    def _extract(self, folder: str) -> None:
        """Extract the FMU where pythonfmu can load it, and see that what it needs is there."""
        check_temporary_folder()
        try:
            fmpy.extract(str(self.path), folder)
        except OSError as error:
            raise UserError(
                f"{self.path} can't be extracted into {folder}: {error.strerror or error}"
            ) from error
        module = Path(folder, "resources", "slavemodule.txt")
        if not module.is_file():
            raise OSError("resources/slavemodule.txt is missing")
        if not module.with_name(f"{module.read_text().strip()}.py").is_file():
            raise OSError("its Python module is missing")

    def _callbacks(self) -> fmi2CallbackFunctions:
        def log(environment, instance, status, category, message) -> None:
            self.messages.append(message.decode("utf-8", "replace"))

        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(log)
        callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)
        return callbacks

    @property
    def slave(self) -> FMU2Slave:
        """Fmpy's instance, for calls that aren't here."""
        assert self._slave is not None, "use ImpactFmu in a with block"
        return self._slave

    def references(self, names: Sequence[str]) -> list[int]:
        """Value references of variables by name."""
        return [self.variables[name].valueReference for name in names]

    def start(self, **values: float) -> None:
        """A new run with these inputs and parameters (defaults for the others).

        Raises:
            UserError: the FMU refuses a value, or doesn't know the variable.
        """
        self.begin(**values)
        self.slave.exitInitializationMode()
        if self.messages:
            raise UserError(self.messages[0])

    def begin(self, **values: float) -> None:
        """A new run as far as initialization mode, where more can be set; `messages` has refusals.

        Raises:
            UserError: the FMU doesn't know the variable.
        """
        slave = self.slave
        slave.setFMUstate(self._fresh)
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        self.messages.clear()
        for name, value in values.items():
            self._set(name, value)

    def _set(self, name: str, value: float) -> None:
        variable = self.variables.get(name)
        if variable is None or variable.causality not in ("input", "parameter"):
            known = [v.name for v in self.variables.values() if v.causality != "output"]
            raise UserError(
                f"there is no input or parameter {name}: choose from {', '.join(known)}"
            )
        reference = [variable.valueReference]
        if variable.type == "Integer":
            if not abs(value) < 2**31 or value != int(value):
                raise UserError(f"{name} = {value!r} is refused: it must be a whole number, 1 or 2")
            self.slave.setInteger(reference, [int(value)])
        else:
            self.slave.setReal(reference, [value])

    def step(self, point: float, size: float) -> None:
        """One communication step.

        Raises:
            UserError: the FMU refuses it.
        """
        try:
            self.slave.doStep(point, size)
        except FMICallException as error:
            if error.status != fmi2Discard:
                raise
            message = self.messages[-1] if self.messages else _in_a_line(error)
            raise UserError(message) from error

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Values of Real variables at this communication point, by name."""
        return dict(zip(names, self.slave.getReal(self.references(names)), strict=True))

    def flag(self, name: str) -> bool:
        """Value of a Boolean output."""
        return bool(self.slave.getBoolean(self.references([name]))[0])

    def impact(self, outputs: Sequence[str] = METRICS, **values: Any) -> dict[str, float]:
        """One impact in one communication step: metrics only.

        Args:
            outputs: the Real outputs to read.
            values: inputs and parameters by name; defaults for the others.

        Returns:
            The outputs by name.

        Raises:
            UserError: the FMU refuses a value.
        """
        self.start(**values)
        self.step(0.0, self.horizon(values))
        return self.read(outputs)

    def horizon(self, values: Mapping[str, float]) -> float:
        """A step long enough for the bodies to meet and, if they do, to part, s."""
        gap = values.get("gap", 0.0)
        club = values.get("club_speed", self.default("club_speed"))
        closing = club - values.get("ball_speed", 0.0)
        contact = 20.0 * self._half_period(values)
        return max(HORIZON, contact) + (gap / closing if gap and closing > 0.0 else 0.0)

    def _half_period(self, values: Mapping[str, float]) -> float:
        """The contact time without damping, s: π √(μ/k), or nearly so with an exponent."""

        def given(name: str) -> float:
            return values.get(name, self.default(name))

        mu = 1.0 / (1.0 / given("m_club") + 1.0 / given("m_ball"))
        period = math.pi * math.sqrt(mu / given("k"))
        n, length = given("exponent"), given("reference_compression")
        closing = abs(given("club_speed") - given("ball_speed"))
        if n > 1.0 and closing:
            # Kinetic energy μ v²/2 = k d_r^(1-n) d^(n+1)/(n+1) at the largest compression d.
            ratio = closing * period / (math.pi * length)
            compression = length * (0.5 * (n + 1.0) * ratio * ratio) ** (1.0 / (n + 1.0))
            period = math.pi * compression / closing
        return period

    def default(self, name: str) -> float:
        """The start value of an input or parameter."""
        return float(self.variables[name].start)

    def trajectory(
        self, points: int = 301, names: Sequence[str] = PATH, **values: Any
    ) -> dict[str, np.ndarray]:
        """One impact, sampled over the contact with a margin on either side.

        Args:
            points: number of samples.
            names: the Real outputs to record.
            values: inputs and parameters by name; defaults for the others.

        Returns:
            `time` (s) and the outputs, arrays of shape (points,).

        Raises:
            UserError: the FMU refuses a value.
        """
        found = self.impact(("touch_time", "contact_time"), **values)
        touch, contact = found["touch_time"], found["contact_time"]
        if not self.flag("separated"):
            # Not parted within the horizon: show the time in which the contact takes shape.
            contact = 10.0 * self._half_period(values)
        if touch + contact / points == touch:
            raise UserError(
                f"a contact of {contact:g} s after {touch:g} s of approach is too short to sample: "
                "a host's time is a double; choose a smaller gap or a faster approach"
            )
        margin = 0.1 * contact
        begin = max(0.0, touch - margin)
        self.start(**values)
        if begin:
            self.step(0.0, begin)
        times = np.linspace(begin, touch + contact + margin, points)
        references = self.references(names)
        table = np.empty((points, len(names)))
        table[0] = self.slave.getReal(references)
        for n in range(1, points):
            self.step(times[n - 1], times[n] - times[n - 1])
            table[n] = self.slave.getReal(references)
        return {"time": times, **{name: table[:, i] for i, name in enumerate(names)}}


def _in_a_line(error: BaseException | str) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0]
