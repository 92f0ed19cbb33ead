"""Which of several uncertain variables an output depends on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from golf_impact.sweeps.study import Study

#: Points of the design: each costs an impact for every variable and two more.
_POINTS = 1024


def sobol_indices(
    study: Study, drawn: np.ndarray, outputs_of: Callable[[dict[str, np.ndarray]], np.ndarray]
) -> dict[str, float] | None:
    """First-order Sobol indices of an output by variable (Saltelli 2010).

    They are the shares of the output's variance that each variable explains separately, from a
    design with impacts of its own.

    Args:
        study: two independent distributions or more, with no grid beside them.
        drawn: the output in all cases of the study, shape (cases,), NaN where refused.
        outputs_of: the output, shape (n,), from columns of all swept variables.

    Returns:
        None where no design is possible: another study, a case that the FMU refuses, or an output
        that is the same in all cases.
    """
    axes = study.distributions
    # But for rounding: S under law 1 is the same at any speed.
    varies = np.ptp(drawn) > 1e-12 * np.abs(drawn).max()  # not if one is NaN
    if len(axes) < 2 or study.varied_grid or not varies:
        return None
    from scipy import stats

    def outputs_at(points: np.ndarray) -> np.ndarray:
        columns = {one.name: values for one, values in zip(axes, points)}
        columns |= {one.name: np.repeat(one.values, points.shape[1]) for one in study.grid}
        outputs = outputs_of({name: columns[name] for name in study.names})
        if not np.isfinite(outputs).all():
            raise FloatingPointError
        return outputs

    try:
        indices = stats.sobol_indices(
            func=outputs_at,
            n=_POINTS,
            dists=[one.of_scipy() for one in axes],
            random_state=np.random.default_rng(study.seed),
        )
    except FloatingPointError:
        return None
    return {one.name: index for one, index in zip(axes, indices.first_order.tolist())}
