"""Takes the FMU through an impact, by any steps, and notes what it says."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from golf_scenarios.fmu.file import current_fmu
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.stress.cases import ImpactCase, Steps

#: At an instant: every output by name.
Outputs = dict[str, Any]


class Driver(ImpactFmu):
    """The FMU, for as many impacts as are wanted; refusals are messages, not errors."""

    @cached_property
    def _columns(self) -> tuple[list[str], list[int], list[str], list[int]]:
        """Names and references of the Real and of the Boolean outputs."""
        outputs = [v for v in self.variables.values() if v.causality == "output"]
        reals, flags = ([v.name for v in outputs if v.type == t] for t in ("Real", "Boolean"))
        return reals, self.references(reals), flags, self.references(flags)

    def begin_run(self, values: dict[str, float], start_time: float = 0.0) -> None:
        """A new run, initialized with these inputs and parameters."""
        self.begin(values, start_time)
        self.slave.exitInitializationMode()

    def outputs(self) -> Outputs:
        """Every output now."""
        reals, real_references, flags, flag_references = self._columns
        now: Outputs = dict(zip(reals, self.slave.getReal(real_references)))
        return now | dict(zip(flags, map(bool, self.slave.getBoolean(flag_references))))

    def velocities(self) -> list[float]:
        """Of club and ball now, m/s."""
        return self.slave.getReal(self.references(("club_velocity", "ball_velocity")))

    def run(
        self, impact: ImpactCase, steps: Steps, see: Callable[[float, Outputs], None] | None = None
    ) -> Outputs:
        """The outputs at the end.

        Args:
            impact: what happens.
            steps: by segment.
            see: called with the last step (s) and the outputs after each one.
        """
        self.begin_run(impact.values, impact.start_time)
        point = impact.start_time
        for number, (segment, sizes) in enumerate(zip(impact.segments, steps, strict=True)):
            if number:
                self.set({"k": segment.k, "b": segment.b})
            for size in sizes:
                self.slave.doStep(point, size)
                point += size
                if see is not None:
                    see(size, self.outputs())
        return self.outputs()


def driver() -> Driver:
    """Of the FMU of the present sources, for use in a `with` block."""
    return Driver(current_fmu()[0])
