"""Single impacts by the scalar physics: the FMU's numbers to the last bit, in microseconds."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from golf_physics.instance import Instance

from golf_impact.errors import UserError
from golf_impact.runs import ImpactRuns


class ScalarImpacts(ImpactRuns, Instance):
    """Impacts by one instance of the physics; methods raise UserError for what it refuses."""

    error = UserError

    def sample(self, times: np.ndarray, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Record Real outputs at these times (s); the first is the current communication point.

        Returns them (SI units) by name, arrays of the shape of `times`.
        """
        rows = [list(self.read(names).values())]
        for before, time in itertools.pairwise(times):
            self.step(before, time - before)
            rows.append(list(self.read(names).values()))
        return dict(zip(names, np.array(rows).T.copy(), strict=True))
