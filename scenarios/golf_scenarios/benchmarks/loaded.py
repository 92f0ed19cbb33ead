"""Any FMU as a benchmark wants it: extracted once, its instances made and freed off the clock."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import fmpy

# Before an FMU brings its own copy, which has no binaries to build another FMU with.
import pythonfmu.builder  # noqa: F401
from fmpy.fmi2 import FMU2Slave


class LoadedFmu:
    """An extracted FMU 2.0 for co-simulation, for use in a `with` block.

    Args:
        path: the .fmu file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.description = fmpy.read_model_description(str(path))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        #: Where it is extracted.
        self.folder = ""
        self._alive: list[FMU2Slave] = []

    def __enter__(self) -> LoadedFmu:
        self.folder = tempfile.mkdtemp(prefix="golf-impact-bench-")
        fmpy.extract(str(self.path), self.folder)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for slave in list(self._alive):
            self.free(slave)
        shutil.rmtree(self.folder, ignore_errors=True)

    def blank(self, name: str = "bench") -> FMU2Slave:
        """An object of fmpy with the library loaded, not instantiated yet."""
        simulation = self.description.coSimulation
        assert simulation is not None
        return FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=simulation.modelIdentifier,
            instanceName=name,
        )

    def keep(self, slave: FMU2Slave) -> FMU2Slave:
        """Have it freed when the block ends, if it hasn't been by then."""
        self._alive.append(slave)
        return slave

    def instance(self, **values: float) -> FMU2Slave:
        """An initialized instance with these inputs and parameters; those without are defaults."""
        slave = self.blank()
        slave.instantiate()
        self.keep(slave)
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        self.set(slave, **values)
        slave.exitInitializationMode()
        return slave

    def set(self, slave: FMU2Slave, **values: float) -> None:
        """Set variables by name."""
        types = {v.name: v.type for v in self.description.modelVariables}
        for name, value in values.items():
            if types[name] == "Real":
                slave.setReal([self.references[name]], [value])
            else:
                slave.setInteger([self.references[name]], [int(value)])

    def find(self, names: Sequence[str]) -> list[int]:
        """Value references by name."""
        return [self.references[name] for name in names]

    def free(self, slave: FMU2Slave) -> None:
        """End the run and free the instance."""
        if slave in self._alive:
            self._alive.remove(slave)
        slave.terminate()
        slave.freeInstance()


def saved_start(slave: FMU2Slave) -> Any:
    """The state of an initialized instance: restoring it begins a new run."""
    return slave.getFMUstate()
