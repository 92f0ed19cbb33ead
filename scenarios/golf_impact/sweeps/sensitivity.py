"""Which of several uncertain variables an output depends on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from golf_impact.sweeps.study import Study, unit_samples

#: From columns of all swept variables to an output, shape (cases,).
_Model = Callable[[dict[str, np.ndarray]], np.ndarray]

#: Points of the design for Sobol indices: each costs an impact for every variable and two more.
_POINTS = 1024
#: Rank correlations of more cases than this gain nothing.
_MOST_RANKED = 100_000


@dataclass(frozen=True)
class Sensitivity:
    """How much each variable matters: first-order Sobol indices, or rank correlations."""

    values: dict[str, float]
    label: str  # what they are, for an axis
    note: str  # how they were found, in a sentence


def sensitivity(study: Study, drawn: np.ndarray, outputs_of: _Model) -> Sensitivity | None:
    """First-order Sobol indices where a design for them is possible, else rank correlations.

    The design needs impacts of its own, and independent distributions: no grid beside them, and no
    case that the FMU refuses. None if the output is the same in all cases.

    `drawn` is the output in all cases, shape (cases,), NaN where refused; `outputs_of` gives it for
    columns of all swept variables.
    """
    usable = np.flatnonzero(np.isfinite(drawn))
    if len(usable) < 3:
        return None
    least, greatest = drawn[usable].min(), drawn[usable].max()
    # But for rounding: S under law 1 is the same at any speed.
    if greatest - least <= 1e-12 * max(abs(least), abs(greatest)):
        return None
    if not study.varied_grid and len(usable) == len(drawn):
        indices = _sobol(study, outputs_of)
        if indices is not None:
            return indices
    from scipy.stats import spearmanr

    usable = usable[:: -(-len(usable) // _MOST_RANKED)]
    columns, outputs = study.columns_at(usable), drawn[usable]
    names = (one.name for one in study.distributions)
    return Sensitivity(
        {name: float(spearmanr(columns[name], outputs).statistic) for name in names},
        "Spearman's rank correlation",
        "Spearman's rank correlations of the cases themselves; Sobol indices need independent "
        "distributions alone and no refused case.",
    )


def _sobol(study: Study, outputs_of: _Model) -> Sensitivity | None:
    """Saltelli's design by a Sobol sequence; scipy.stats.sobol_indices has the estimators."""
    from scipy.stats import sobol_indices

    axes = study.distributions
    number = len(axes)
    unit = unit_samples(2 * number, _POINTS, np.random.default_rng(study.seed), "sobol")
    a, b = unit[:, :number], unit[:, number:]
    points = np.concatenate(
        [a, b, *(np.where(np.arange(number) == n, b, a) for n in range(number))]
    )
    columns = {one.name: one.from_unit(points[:, n]) for n, one in enumerate(axes)}
    columns |= {one.name: np.repeat(one.values, len(points)) for one in study.grid}
    outputs = outputs_of({name: columns[name] for name in study.names})
    if not np.isfinite(outputs).all():
        return None
    # SciPy's estimator fails for one variable, which explains all by itself.
    indices = np.ones(1)
    if number > 1:
        f_a, f_b, *f_ab = outputs.reshape(number + 2, 1, _POINTS)
        given = {"f_A": f_a, "f_B": f_b, "f_AB": np.array(f_ab)}
        indices = np.ravel(sobol_indices(func=given, n=_POINTS).first_order)
    return Sensitivity(
        dict(zip((one.name for one in axes), indices.tolist(), strict=True)),
        "first-order Sobol index",
        f"First-order Sobol indices (Saltelli 2010) of {len(points):,} impacts of their own: the "
        "share of the output's variance that each variable explains by itself.",
    )
