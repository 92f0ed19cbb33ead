"""Drives FMUs through fmpy, call by call: instances, initialization, messages, refused values."""

import shutil
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

import fmpy
import numpy as np

# Imported before an FMU imports its own copy, which lacks the binaries to build another FMU with.
import pythonfmu.builder  # noqa: F401
import pythonfmu3.builder  # noqa: F401
from fmpy import fmi2
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave

from golf_build import system
from golf_build.packaging import packaged
from golf_impact.errors import UserError, first_line, unknown_name
from golf_impact.fmu import builder_of
from golf_impact.runs import ImpactRuns, Named

Entered = TypeVar("Entered", bound="LoadedFmu")


def build_fmu(out, fmi=2):
    """Build ClubBallImpact.fmu."""
    return builder_of(fmi=fmi).build(out)


def build_plain_fmu(script, folder):
    """Package a self-contained slave with pythonfmu, without additions."""
    with packaged(2, script.stem, script.read_bytes(), {}) as fmu:
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(fmu, folder))


#: fmpy's setters and the types that they need, by type of the variable in FMI 2.0 and 3.0.
_SETTERS: dict[str, tuple[str, type]] = {
    "Real": ("setReal", float),
    "Float64": ("setFloat64", float),
    "Integer": ("setInteger", int),
    "Enumeration": ("setInt64", int),
    "Boolean": ("setBoolean", bool),
}


class LoadedFmu:
    """An FMU 2.0 for co-simulation, for use in a `with` block."""

    #: What FMI calls a floating point variable, and what fmpy calls a state.
    _real, _state = "Real", "FMUstate"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.description = fmpy.read_model_description(str(path))
        self.variables = {v.name: v for v in self.description.modelVariables}
        #: Messages of the FMU through its logger since the last `start`.
        self.messages: list[str] = []
        #: Values that it refused in the last `set`: messages by variable.
        self.refused: dict[str, str] = {}
        #: The folder into which it is extracted.
        self.folder = ""
        #: Instances with their initial states, as far as these are kept.
        self._instances: dict[Any, Any] = {}

    def __enter__(self: Entered) -> Entered:
        self.folder = tempfile.mkdtemp(prefix="golf-impact-")
        fmpy.extract(str(self.path), self.folder)
        return self

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        # After an error other than a rejected value further calls may crash the process.
        if not isinstance(error, FMICallException):
            for instance in list(self._instances):
                self.free(instance)
        vars(self).pop("slave", None)
        shutil.rmtree(self.folder, ignore_errors=True)

    def new_instance(self, kind: Any = FMU2Slave) -> Any:
        """An fmpy instance with its library loaded, to be instantiated; freed with the block."""
        assert self.folder, "use it in a with block"
        instance = kind(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="impact",
        )
        self._instances[instance] = None
        return instance

    def free(self, instance: Any) -> None:
        """Terminate and free an instance before the end of the block."""
        if state := self._instances.pop(instance):
            getattr(instance, f"free{self._state}")(state)
        instance.terminate()
        instance.freeInstance()

    def _kept_instance(self, kind: Any, **options: Any) -> Any:
        instance = self.new_instance(kind)
        instance.instantiate(**options)
        # Restoring this state is far cheaper than a reset, which makes a new Python object.
        self._instances[instance] = getattr(instance, f"get{self._state}")()
        return instance

    def restore_initial_state(self, instance: Any) -> None:
        """Restore the state that an instance had just after instantiation."""
        getattr(instance, f"set{self._state}")(self._instances[instance])

    def instance(self, **values: float) -> FMU2Slave:
        """Make a further instance, initialized with these inputs and parameters (SI units)."""
        slave = self.new_instance()
        slave.instantiate()
        self._initialize(slave, values)
        slave.exitInitializationMode()
        return slave

    def _initialize(self, slave: Any, values: dict[str, float], start_time: float = 0.0) -> None:
        slave.setupExperiment(startTime=start_time)
        slave.enterInitializationMode()
        self.set(values, slave)

    @cached_property
    def slave(self) -> Any:
        """The instance that every run uses, from its initial state; made on first use."""

        def log(environment, instance, status, category, message) -> None:
            self.messages.append(message.decode("utf-8", "replace"))

        logger, memory = fmi2.fmi2CallbackLoggerTYPE(log), fmi2.defaultCallbacks
        callbacks = fmi2.fmi2CallbackFunctions(logger, memory.allocateMemory, memory.freeMemory)
        return self._kept_instance(FMU2Slave, callbacks=callbacks, loggingOn=True)

    def references(self, names: Sequence[str]) -> list[int]:
        """The value references of variables; UserError if there is none of a name."""
        try:
            return [self.variables[name].valueReference for name in names]
        except KeyError as error:
            known = [n for n, v in self.variables.items() if v.causality == "output"]
            raise unknown_name("output", error.args[0], known) from None

    @cached_property
    def real_outputs(self) -> list[str]:
        """The names of its floating point outputs."""
        kinds = ("output", self._real)
        return [n for n, v in self.variables.items() if (v.causality, v.type) == kinds]

    def default(self, name: str) -> float:
        """The start value of an input or parameter."""
        return float(self.variables[name].start)

    def begin(self, values: dict[str, float], start_time: float = 0.0) -> None:
        """Begin a run and stop in initialization mode, where more values can be set.

        A value that the FMU rejects is a message; UserError for a name that it doesn't have.
        """
        self.restore_initial_state(self.slave)
        self._initialize(self.slave, values, start_time)

    def end_initialization(self) -> None:
        """Begin to step; refusals are messages, for which the native FMU returns Error."""
        try:
            self.slave.exitInitializationMode()
        except FMICallException as error:
            if error.status != fmi2.fmi2Error or not self.messages:
                raise

    def begin_run(self, values: dict[str, float], start_time: float = 0.0) -> None:
        """Begin a run with these inputs and parameters; refusals are messages."""
        self.begin(values, start_time)
        self.end_initialization()

    def start(self, **values: float) -> None:
        """Begin a run with these inputs and parameters (SI units; defaults for the others).

        UserError: the FMU rejects a value, or has no variable of a name.
        """
        self.messages.clear()
        self.begin_run(values)
        if self.messages:
            variable = next(iter(self.refused), "")
            raise UserError(self.messages[0], variable, values.get(variable))

    def set(self, values: dict[str, float], slave: Any = None) -> None:
        """Set inputs and parameters (SI units), by default of `self.slave`.

        UserError: the FMU has no such input or parameter, or it takes whole numbers only.
        """
        slave = self.slave if slave is None else slave
        self.refused = {}
        for name, value in values.items():
            variable = self.variables.get(name)
            if variable is None or variable.causality not in ("input", "parameter"):
                known = [n for n, v in self.variables.items() if v.causality != "output"]
                raise unknown_name("input or parameter", name, known)
            setter, of_type = _SETTERS[variable.type]
            if of_type is int and not (abs(value) < 2**31 and value == int(value)):
                reason = "it must be a whole number, 1 or 2"
                raise UserError(f"{name} = {value!r} is refused: {reason}", name, value, reason)
            before = len(self.messages)
            getattr(slave, setter)([variable.valueReference], [of_type(value)])
            if len(self.messages) > before:
                self.refused[name] = self.messages[-1]

    def step(self, point: float, size: float) -> None:
        """Make a communication step of `size` s from `point`, s; UserError if it is discarded."""
        try:
            self.slave.doStep(point, size)
        except FMICallException as error:
            if error.status != fmi2.fmi2Discard:
                raise
            raise UserError(self.messages[-1] if self.messages else first_line(error)) from error

    def read(self, names: Sequence[str]) -> Named[float]:
        """Values of floating point variables at this communication point, by name (SI units).

        UserError: the FMU has no variable of a name, or it has another type.
        """
        references = self.references(names)
        for name in names:
            if (kind := self.variables[name].type) != self._real:
                raise UserError(f"{name} is {kind}: only {self._real} outputs are read")
        values = getattr(self.slave, f"get{self._real}")(references)
        return Named(zip(names, values, strict=True))

    def read_flag(self, name: str) -> bool:
        """Value of a Boolean variable at this communication point."""
        return bool(self.slave.getBoolean(self.references([name]))[0])

    def simulate(
        self, outputs: Sequence[str], instance: Any = None, **options: Any
    ) -> dict[str, float]:
        """The outputs (SI units) at the end of fmpy.simulate_fmu, in this or a new instance."""
        if instance is not None:
            self.restore_initial_state(instance)
        rows = fmpy.simulate_fmu(
            self.folder,
            model_description=self.description,
            fmu_instance=instance,
            output=outputs,
            record_events=False,
            **options,
        )
        return {name: float(rows[name][-1]) for name in outputs}


class LoadedFmu3(LoadedFmu):
    """An FMU 3.0 with one instance for co-simulation and one for Model Exchange."""

    _real, _state = "Float64", "FMUState"

    def __enter__(self) -> "LoadedFmu3":
        super().__enter__()
        self.model = self._kept_instance(FMU3Model)
        self.slave = self._kept_instance(FMU3Slave, eventModeUsed=True)
        return self

    def _initialize(self, slave: Any, values: dict[str, float], start_time: float = 0.0) -> None:
        slave.enterInitializationMode(startTime=start_time)
        self.set(values, slave)


class ImpactFmu(ImpactRuns, LoadedFmu):
    """ClubBallImpact.fmu."""


def extract_fmus(ssp: Path, folder: Path) -> dict[str, Path]:
    """The FMUs of an .ssp file, extracted into a folder: paths by the names of the components."""
    fmpy.extract(ssp, folder)
    return {fmu.stem: fmu for fmu in sorted(folder.rglob("*.fmu"))}


def run_ssp(ssp: Path, step: float, stop: float) -> dict[str, np.ndarray]:
    """Run a system's .ssp file in fmpy.ssp by a communication step size to a stop time, s.

    Returns `time` (s, end of each step) and every connector by "Component.variable".
    """
    from fmpy.ssp.simulation import simulate_ssp

    # fmpy adds up its steps: half a step less, and it ends at the stop time.
    rows = simulate_ssp(str(ssp), stop_time=stop - 0.5 * step, step_size=step)
    columns = {name: np.asarray(rows[name], dtype=float) for name in rows.dtype.names[1:]}
    return {"time": step * np.arange(1, len(rows) + 1), **columns}


def run_system(
    fmus: Mapping[str, Path],
    steps: Iterable[float],
    values: Mapping[str, Mapping[str, float]] | None = None,
    rollback: bool = False,
) -> dict[str, np.ndarray]:
    """Run components of the system in parallel: an output reaches the others in the next step.

    Args:
        fmus: files by the names of the components: Swing, ClubBallImpact, perhaps the others.
        steps: communication step sizes, s, of any sizes.
        values: parameters by component, where they aren't the start values.
        rollback: whether the Swing's part of a step is repeated, from the state before it,
            whenever the impulse at its end differs from the one that the Swing has used.

    Returns:
        `time` (s, end of each step) and every Real output by "Component.variable".

    Raises:
        UserError: a component refuses a value or a step.
    """
    with ExitStack() as stack:
        loaded = {name: stack.enter_context(LoadedFmu(path)) for name, path in fmus.items()}
        for name, fmu in loaded.items():
            fmu.start(**(values or {}).get(name, {}))
        wires = [wire for wire in system.CONNECTIONS if wire[0] in loaded and wire[2] in loaded]
        swing, impact = loaded["Swing"], loaded["ClubBallImpact"]
        # Its own start value is a speed at which it would touch the ball at once.
        impact.set(swing.read(["club_speed"]))
        time, rows = 0.0, []
        for size in steps:
            used = swing.read(["impulse"])
            before = swing.slave.getFMUstate() if rollback else None
            for fmu in loaded.values():
                fmu.step(time, size)
            if rollback:
                known = impact.read(["impulse"])
                if known != used:
                    swing.slave.setFMUstate(before)
                    swing.set(known)
                    swing.step(time, size)
                swing.slave.freeFMUstate(before)
            for start, output, end, name in wires:
                source = loaded[start]
                flag = source.variables[output].type == "Boolean"
                value = source.read_flag(output) if flag else source.read([output])[output]
                loaded[end].set({name: value})
            time += size
            read = (fmu.read(fmu.real_outputs).values() for fmu in loaded.values())
            rows.append([time, *chain.from_iterable(read)])
        names = (f"{name}.{output}" for name, fmu in loaded.items() for output in fmu.real_outputs)
        return dict(zip(("time", *names), np.array(rows).T, strict=True))
