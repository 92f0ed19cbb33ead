"""Where the samples of distributions lie: drawn independently, or evenly by a design."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from golf_scenarios.errors import lacking
from golf_scenarios.sweeps.axes import Distribution

#: Independent, Latin hypercube, scrambled Sobol sequence.
DESIGNS = ("random", "lhs", "sobol")


def samples(
    distributions: Sequence[Distribution], number: int, seed: int, design: str
) -> dict[str, np.ndarray]:
    """So many samples of each distribution, by variable: arrays of shape (number,).

    They depend on the arguments alone.

    Raises:
        UserError: the design needs a package that is missing.
    """
    generator = np.random.default_rng(seed)
    if design == "random":
        return {one.name: one.drawn(generator, number) for one in distributions}
    if design == "lhs":
        # The dimensions of a Latin hypercube are independent: one by one they take less memory.
        return {
            one.name: one.from_unit(unit_samples(1, number, generator, design)[:, 0])
            for one in distributions
        }
    unit = unit_samples(len(distributions), number, generator, design)
    return {one.name: one.from_unit(unit[:, n]) for n, one in enumerate(distributions)}


def unit_samples(
    dimensions: int, number: int, generator: np.random.Generator, design: str
) -> np.ndarray:
    """Points of a design in the unit cube, shape (number, dimensions).

    Raises:
        UserError: SciPy is missing.
    """
    try:
        from scipy.stats import qmc
    except ImportError as error:
        raise lacking(
            f"the design {design}", "SciPy", "sweep", ", or use --design random"
        ) from error
    if design == "lhs":
        return qmc.LatinHypercube(dimensions, seed=generator).random(number)
    with warnings.catch_warnings():
        # Balanced only for powers of 2: any other number is still a fair sample.
        warnings.simplefilter("ignore", UserWarning)
        return qmc.Sobol(dimensions, scramble=True, seed=generator).random(number)
