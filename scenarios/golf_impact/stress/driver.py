"""Runs an impact through the FMU in steps of any sizes and records its outputs."""

from typing import Any

from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.runs import FLAGS
from golf_impact.stress.cases import ImpactCase, Steps

#: At an instant: every output by name.
Outputs = dict[str, Any]


class Driver(ImpactFmu):
    """The FMU, for any number of impacts; refusals are messages, not errors."""

    def outputs(self) -> Outputs:
        return {**self.read(self.real_outputs), **{flag: self.read_flag(flag) for flag in FLAGS}}

    def run(self, impact: ImpactCase, steps: Steps) -> list[Outputs]:
        """The outputs after each of these steps through an impact."""
        self.begin_run(impact.values, impact.start_time)
        inputs = self.references(("k", "b", "club_force"))
        point, path = impact.start_time, []
        for step in steps:
            self.slave.setReal(inputs, (step.k, step.b, step.club_force))
            self.slave.doStep(point, step.length)
            point += step.length
            path.append(self.outputs())
        return path


def driver() -> Driver:
    """Of the FMU of the present sources, for use in a `with` block."""
    return Driver(current_fmu()[0])
