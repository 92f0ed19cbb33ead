"""What a sweep computes: the swept variables, their cases in order, and the outputs."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any

import numpy as np

from golf_impact.errors import UserError, missing_package
from golf_impact.sweeps.axes import Axis, Distribution, Grid, axis

#: What is read unless a study says otherwise: what the end of a contact tells. Law 1 has to search
#: for the extremes (max_force ...), and Booleans take a call of their own.
OUTPUTS = (
    "smash_factor",
    "coefficient_of_restitution",
    "energy_efficiency",
    "club_velocity",
    "ball_velocity",
    "contact_time",
)

#: How samples lie: independent, Latin hypercube, scrambled Sobol sequence.
DESIGNS = ("random", "lhs", "sobol")

#: SciPy's Sobol sequence has so many points.
_MOST_OF_SOBOL = 2**30


@dataclass(frozen=True)
class Study:
    """A parametric study.

    The cases are those of the grid, the last axis running fastest; where an axis is a distribution,
    every point of the grid gets the same samples (one where there is no distribution), which run
    faster than all.
    """

    axes: tuple[Axis, ...]
    outputs: tuple[str, ...] = OUTPUTS
    number_of_samples: int = 1
    seed: int = 0
    design: str = "random"

    @classmethod
    def of(
        cls,
        sets: Mapping[str, Any],
        outputs: Sequence[str] | None = None,
        number_of_samples: int | None = None,
        seed: int = 0,
        design: str = "random",
    ) -> Study:
        """The study that a user describes.

        Args:
            sets: by variable: a number, a list, or text as in `--set`: "0.5e6:2e6:100",
                "log:1e5:1e7:50", "0,9,12", "normal:45:2", "uniform:30:50".
            outputs: of the FMU; `OUTPUTS` by default.
            number_of_samples: needed with a distribution.
            seed: of the samples, at least 0.
            design: "random", "lhs" (Latin hypercube) or "sobol".

        Raises:
            UserError: an axis, an output or a number isn't allowed.
        """
        axes = tuple(axis(name, given) for name, given in sets.items())
        chosen = OUTPUTS if outputs is None else tuple(name.strip() for name in outputs)
        number = 1 if number_of_samples is None else number_of_samples
        study = cls(axes, chosen, number, seed, design)
        random, samples = study.distributions, f"--samples {number:,}"
        for refused, why in (
            (not axes, "nothing is swept: give --set NAME=LO:HI:COUNT, e.g. k=0.5e6:2e6:100"),
            (not chosen, "outputs is an empty list: name one at least, or leave it out"),
            (len({*chosen}) < len(chosen), f"--outputs {','.join(chosen)} names one output twice"),
            (design not in DESIGNS, f"--design {design} is unknown: it is {', '.join(DESIGNS)}"),
            (seed < 0, f"--seed {seed} is refused: it must be at least 0"),
            (
                random and number_of_samples is None,
                "a distribution is swept: say with --samples how many to draw",
            ),
            (
                number_of_samples is not None and not random,
                f"{samples} has no distribution to draw from, e.g. --set club_speed=normal:45:2",
            ),
            (number < 1, f"{samples} is refused: it must be at least 1"),
            (
                design == "sobol" and number > _MOST_OF_SOBOL,
                f"{samples} is refused: the design sobol gives at most {_MOST_OF_SOBOL:,}",
            ),
        ):
            if refused:
                raise UserError(why)
        return study

    @property
    def grid(self) -> tuple[Grid, ...]:
        """The axes that are rows of values."""
        return tuple(one for one in self.axes if isinstance(one, Grid))

    @property
    def varied_grid(self) -> tuple[Grid, ...]:
        """Those of them with more than one value."""
        return tuple(one for one in self.grid if len(one.values) > 1)

    @property
    def distributions(self) -> tuple[Distribution, ...]:
        return tuple(one for one in self.axes if isinstance(one, Distribution))

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(one.name for one in self.axes)

    @cached_property
    def cases(self) -> int:
        return prod(len(one.values) for one in self.grid) * self.number_of_samples

    @property
    def memory(self) -> int:
        """About the bytes that it takes at most, with its picture; chunks come on top."""
        return 40 * self.cases + 64 * self.number_of_samples * len(self.distributions)

    def columns(self, index: np.ndarray) -> dict[str, np.ndarray]:
        """Arrays of the swept variables' values in the cases of these numbers (from 0), by name.

        Each is a function of the case's number alone: chunks of any size give the same.
        """
        columns: dict[str, np.ndarray] = {}
        stride = self.number_of_samples
        for one in reversed(self.axes):
            if isinstance(one, Grid):
                columns[one.name] = one.values[index // stride % len(one.values)]
                stride *= len(one.values)
            else:
                columns[one.name] = self._drawn[one.name][index % self.number_of_samples]
        return {name: columns[name] for name in self.names}

    @cached_property
    def _drawn(self) -> dict[str, np.ndarray]:
        """The samples by variable, shape (number_of_samples,)."""
        generator, number = np.random.default_rng(self.seed), self.number_of_samples
        axes = self.distributions
        if self.design == "random":
            return {one.name: one.draw(generator, number) for one in axes}
        try:
            from scipy.stats import qmc
        except ImportError as error:
            otherwise = ", or use --design random"
            raise missing_package(
                f"the design {self.design}", "SciPy", "sweep", otherwise
            ) from error
        if self.design == "lhs":
            # Its dimensions are independent: one by one they take less memory.
            units = (qmc.LatinHypercube(1, seed=generator).random(number)[:, 0] for _ in axes)
        else:
            with warnings.catch_warnings():
                # Balanced only for powers of 2: any other number is still a fair sample.
                warnings.simplefilter("ignore", UserWarning)
                units = iter(qmc.Sobol(len(axes), seed=generator).random(number).T)
        return {one.name: one.of_scipy().ppf(next(units)) for one in axes}
