"""Single impacts by the scalar physics: the FMU's numbers to the last bit, in microseconds."""

from __future__ import annotations

from golf_physics.instance import Instance

from golf_impact.errors import UserError
from golf_impact.runs import ImpactRuns


class ScalarImpacts(ImpactRuns, Instance):
    """Impacts by one instance of the physics; methods raise UserError for what it refuses."""

    error = UserError
