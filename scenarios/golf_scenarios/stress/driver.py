"""Takes the FMU through an impact, by any steps, and notes what it says."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from golf_scenarios.fmu.file import current_fmu
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.stress.cases import ImpactCase, Steps

#: At an instant: every output by name.
Outputs = dict[str, Any]


class Driver:
    """One instance of the FMU, for as many impacts as are wanted."""

    def __init__(self, fmu: ImpactFmu) -> None:
        self._fmu = fmu
        self.slave = fmu.slave
        self.messages = fmu.messages
        outputs = [v for v in fmu.variables.values() if v.causality == "output"]
        #: Names of the Real and of the Boolean outputs.
        self.reals = [v.name for v in outputs if v.type == "Real"]
        self.flags = [v.name for v in outputs if v.type == "Boolean"]
        self._real_references = fmu.references(self.reals)
        self._flag_references = fmu.references(self.flags)
        self._k_b = fmu.references(("k", "b"))
        self._separated = fmu.references(("separated",))
        self._velocities = fmu.references(("club_velocity", "ball_velocity"))

    def begin(self, values: dict[str, float], start_time: float = 0.0) -> None:
        """A new run."""
        self._fmu.begin(values, start_time)
        self.slave.exitInitializationMode()

    def set_inputs(self, k: float, b: float) -> None:
        """For the steps to come."""
        self.slave.setReal(self._k_b, [k, b])

    def read(self) -> Outputs:
        """Every output now."""
        outputs: Outputs = dict(zip(self.reals, self.slave.getReal(self._real_references)))
        flags = self.slave.getBoolean(self._flag_references)
        return outputs | {name: bool(flag) for name, flag in zip(self.flags, flags)}

    def separated(self) -> bool:
        """Whether contact is over."""
        return bool(self.slave.getBoolean(self._separated)[0])

    def velocities(self) -> list[float]:
        """Of club and ball now, m/s."""
        return self.slave.getReal(self._velocities)

    def run(
        self, impact: ImpactCase, steps: Steps, see: Callable[[float, Outputs], None] | None = None
    ) -> Outputs:
        """The outputs at the end.

        Args:
            impact: what happens.
            steps: by segment.
            see: called with the last step (s) and the outputs after each one.
        """
        self.begin(impact.values, impact.start_time)
        point = impact.start_time
        for number, (segment, sizes) in enumerate(zip(impact.segments, steps, strict=True)):
            if number:
                self.set_inputs(segment.k, segment.b)
            for size in sizes:
                self.slave.doStep(point, size)
                point += size
                if see is not None:
                    see(size, self.read())
        return self.read()


@contextmanager
def opened() -> Iterator[tuple[Driver, ImpactFmu]]:
    """The FMU of the present sources."""
    with ImpactFmu(current_fmu()[0]) as fmu:
        yield Driver(fmu), fmu
