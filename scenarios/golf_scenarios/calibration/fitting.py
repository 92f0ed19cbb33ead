"""Finds the parameters of a contact law: exactly where that can be, else by least squares.

Needs SciPy.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from golf_scenarios.calibration.contact_law import (
    LARGEST_EXPONENT,
    LEAST_EXPONENT,
    ContactLaw,
    Coordinates,
    Predictor,
    damping_coordinate,
)
from golf_scenarios.calibration.targets import (
    RESTITUTION,
    Conditions,
    Target,
    independent,
    restitution,
)
from golf_scenarios.errors import UserError
from golf_scenarios.fmu.impact_fmu import ImpactFmu

if TYPE_CHECKING:
    import numpy as np

#: Where the search looks first: ζ and n, far beyond any ball.
_ZETAS = (0.0, *(10.0 ** (-3.0 + 0.125 * i) for i in range(49)))
_EXPONENTS = (1.0, 1.1, 1.25, 1.4, 1.6, 1.8, 2.1, 2.5, 3.0, 4.0, 6.0, 8.5, 12.0)

#: How many of the best places found there are refined.
_STARTS = 8

#: A prediction of a law that keeps the bodies together is this many σ off.
_FAR = 1e9

#: Two answers are equally good if their χ² differ by less than this, and the same if their
#: coordinates do.
_EQUAL_CHI_SQUARED, _SAME_PLACE = 1e-6, 1e-4

#: A direction that changes the targets this much less than the best does is undetermined.
_UNDETERMINED = 1e-7


@dataclass
class Fit:
    """What was found for one law.

    Attributes:
        law: fitted.
        method: how.
        values: inputs and parameters of the FMU that the result needs, by name (SI units).
        standard_errors: of the free parameters, by name; None where it isn't defined.
        predicted: what the FMU gives for each kind of target, by name.
        residuals: (predicted - target)/σ of each target, by name.
        path: time since touch (s) and contact force (N).
        others: values of further answers that meet the targets just as well.
        notes: what there is to know about this fit.
    """

    law: ContactLaw
    method: str
    values: dict[str, float]
    standard_errors: dict[str, float | None]
    predicted: dict[str, float]
    residuals: dict[str, float]
    path: tuple[list[float], list[float]]
    others: list[dict[str, float]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def chi_squared(self) -> float:
        return sum(residual**2 for residual in self.residuals.values())

    @property
    def degrees_of_freedom(self) -> int:
        """Targets less free parameters."""
        return len(self.residuals) - len(self.law.free)

    @property
    def probability(self) -> float | None:
        """The chance of a χ² this large if law and σ were right; None without freedom."""
        if self.degrees_of_freedom == 0:
            return None
        from scipy.special import gammaincc

        return float(gammaincc(0.5 * self.degrees_of_freedom, 0.5 * self.chi_squared))


def missing(law: ContactLaw, targets: Mapping[str, Target]) -> str | None:
    """Why these targets can't tell the law's free parameters, or None if they can."""
    have, need = independent(targets), len(law.free)
    if have >= need:
        return None
    names = ", ".join(law.free[:-1]) + " and " + law.free[-1]
    why = f"{names} need {need} independent targets, these are {have}"
    if sum(name in RESTITUTION for name in targets) > 1:
        why += " (ball speed, club speed after and COR tell the damping only, and count as one)"
    return why


def fit(
    fmu: ImpactFmu, conditions: Conditions, targets: Mapping[str, Target], law: ContactLaw
) -> Fit:
    """The parameters of a law that meet these targets best.

    Two targets for two parameters of law 2, of which one is a speed or COR, have an exact inverse:
    that one gives ζ in closed form, the other one the size. All else is weighted least squares,
    started from the best places of a wide grid.

    Raises:
        UserError: no contact that ends comes near the targets, or they can't be computed with.
    """
    import numpy as np

    try:
        # What overflows is told below, in one line.
        with np.errstate(all="ignore"):
            search = _Search(Predictor(fmu, conditions, law), targets)
            for method, places in (
                ("closed form", search.exact),
                ("weighted least squares", search.least_squares),
            ):
                answers = places()
                if answers:
                    return search.described(answers[0], answers[1:], method)
    except (ArithmeticError, ValueError) as error:
        raise UserError(
            f"{law.title}: the targets or their σ are too small or too large for doubles ({error})"
        ) from error
    raise UserError(f"{law.title}: no contact that ends comes near these targets")


class _Search:
    def __init__(self, predictor: Predictor, targets: Mapping[str, Target]) -> None:
        self.predictor = predictor
        self.targets = targets
        law, conditions = predictor.law, predictor.conditions
        # A length of the right order: only its logarithm is searched.
        time, peak, force = (
            targets[name].value if name in targets else 0.0
            for name in ("contact_time", "time_of_max_force", "max_force")
        )
        v = conditions.club_speed
        if time > 0.0 or peak > 0.0:
            self.length = v * (time or 2.0 * peak) / math.pi
        elif force > 0.0:
            self.length = conditions.reduced_mass * v * v / force
        else:
            self.length = 1.5e-4 * v
        self.exponents = _EXPONENTS if law.exponent is None else (law.exponent,)
        self.free_exponent = law.exponent is None
        zetas = set(_ZETAS)
        if law.law == 2:
            # A speed tells ζ: without these, a valley may lie between two points.
            told = [restitution(t, conditions)[0] for n, t in targets.items() if n in RESTITUTION]
            zetas |= {_zeta(e) for e in told if 0.0 < e < 1.0}
        self.zetas = sorted(zetas)

    def residuals(self, predicted: Mapping[str, float] | None) -> list[float]:
        """(predicted - target)/σ, in the targets' order."""
        if predicted is None:
            return [_FAR] * len(self.targets)
        return [(predicted[name] - t.value) / t.sigma for name, t in self.targets.items()]

    # Exact inverse

    def exact(self) -> list[Coordinates]:
        """The answer without a search, in a list; an empty one if there is none this way."""
        speeds = [t for name, t in self.targets.items() if name in RESTITUTION]
        sizes = [t for name, t in self.targets.items() if name not in RESTITUTION]
        if self.predictor.law.law != 2 or self.free_exponent or len(speeds) != 1 or len(sizes) != 1:
            return []
        size, (cor, _) = sizes[0], restitution(speeds[0], self.predictor.conditions)
        if not 0.0 < cor < 1.0:
            return []
        at = Coordinates(self.length, damping_coordinate(_zeta(cor)), self.exponents[0])
        predicted = self.predictor.predict(at)
        if predicted is None or predicted[size.name] <= 0.0 or size.value <= 0.0:
            return []
        ratio = size.value / predicted[size.name]
        length = self.length * (1.0 / ratio if size.name == "max_force" else ratio)
        return [Coordinates(length, at.damping, at.exponent)]

    # Least squares

    def least_squares(self) -> list[Coordinates]:
        """The best answer, and all that are as good: the least damped first, then by exponent."""
        refined = [at for start in self._starts() if (at := self._refine(start))]
        if not refined:
            return []
        best = min(chi for chi, _ in refined)
        good = [at for chi, at in refined if chi <= best + _EQUAL_CHI_SQUARED * max(1.0, best)]
        good.sort(key=lambda at: (round(at.damping, 6), at.exponent))
        places: list[Coordinates] = []
        for place in good:
            if not any(_same(place, other) for other in places):
                places.append(place)
        return places

    def _starts(self) -> list[Coordinates]:
        """The best places of a grid in ζ and n, each with the length that suits it."""
        grid: dict[tuple[int, int], tuple[float, Coordinates]] = {}
        for j, n in enumerate(self.exponents):
            for i, zeta in enumerate(self.zetas):
                at = Coordinates(self.length, damping_coordinate(zeta), n)
                predicted = self.predictor.predict(at)
                if predicted is None:
                    continue
                scale = self._scale(predicted)
                scaled = {
                    "contact_time": predicted["contact_time"] * scale,
                    "time_of_max_force": predicted["time_of_max_force"] * scale,
                    "max_force": predicted["max_force"] / scale,
                }
                chi = sum(r * r for r in self.residuals({**predicted, **scaled}))
                grid[i, j] = (chi, Coordinates(self.length * scale, at.damping, n))

        def lowest(i: int, j: int) -> bool:
            near = [(i + p, j + q) for p in (-1, 0, 1) for q in (-1, 0, 1)]
            return all(grid[i, j][0] <= grid[place][0] for place in near if place in grid)

        order = sorted(grid, key=lambda place: grid[place][0])
        valleys = [place for place in order if lowest(*place)]
        others = [place for place in order if place not in valleys]
        return [grid[place][1] for place in (valleys + others)[:_STARTS]]

    def _scale(self, predicted: Mapping[str, float]) -> float:
        """By what to multiply the length so that times and forces are met best (in logarithms)."""
        total = weights = 0.0
        for name, sign in (("contact_time", 1.0), ("time_of_max_force", 1.0), ("max_force", -1.0)):
            wanted = self.targets.get(name)
            if wanted and wanted.value > 0.0 and predicted[name] > 0.0:
                weight = (wanted.value / wanted.sigma) ** 2
                weights += weight
                total += weight * sign * math.log(wanted.value / predicted[name])
        return math.exp(total / weights) if weights else 1.0

    def _refine(self, start: Coordinates) -> tuple[float, Coordinates] | None:
        """χ² and place of the minimum that a start leads to."""
        x = self._solved(start, max_nfev=200).x
        n = float(x[2]) if self.free_exponent else start.exponent
        at = Coordinates(start.length * math.exp(x[0]), float(x[1]), n)
        predicted = self.predictor.predict(at)
        if predicted is None:
            return None
        return sum(r * r for r in self.residuals(predicted)), at

    def _solved(self, start: Coordinates, max_nfev: int) -> Any:
        """SciPy's least squares in (ln L, z, n), where ln L is 0 at the start."""
        from scipy.optimize import least_squares

        def residuals(x: np.ndarray) -> list[float]:
            n = float(x[2]) if self.free_exponent else start.exponent
            place = Coordinates(start.length * math.exp(x[0]), float(x[1]), n)
            return self.residuals(self.predictor.predict(place))

        number = len(self.predictor.law.free)
        return least_squares(
            residuals,
            [0.0, start.damping, start.exponent][:number],
            jac="3-point",
            bounds=(
                [-math.inf, 0.0, LEAST_EXPONENT][:number],
                [math.inf, math.inf, LARGEST_EXPONENT][:number],
            ),
            method="trf",
            x_scale=1.0,
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=max_nfev,
        )

    # What was found

    def described(self, at: Coordinates, others: list[Coordinates], method: str) -> Fit:
        notes = []
        no_damping = at.damping < 1e-9
        if no_damping:
            at = Coordinates(at.length, 0.0, at.exponent)
            notes.append(
                "the damping b is at its limit 0: these targets ask for no damping, or for less"
            )
        predicted = self.predictor.predict(at)
        assert predicted is not None
        if predicted["time_of_max_force"] == 0.0:
            notes.append("the force is largest at first touch: a dashpot more than a ball")
        end = self.free_exponent and not LEAST_EXPONENT < at.exponent < LARGEST_EXPONENT
        if end:
            notes.append(f"the exponent is at its limit {at.exponent:g}")
        errors = self._standard_errors(at, [False, no_damping, end])
        unknown = [name for name, error in errors.items() if error is None]
        if unknown:
            notes.append(f"no standard error is defined for {' and '.join(unknown)}")
        return Fit(
            law=self.predictor.law,
            method=method,
            values=self.predictor.values(at),
            standard_errors=errors,
            predicted=predicted,
            residuals=dict(zip(self.targets, self.residuals(predicted), strict=True)),
            path=self.predictor.path(at),
            others=[self.predictor.values(other) for other in others],
            notes=notes,
        )

    def _standard_errors(self, at: Coordinates, at_limit: list[bool]) -> dict[str, float | None]:
        """From the Jacobian of the residuals; a parameter at its limit has none."""
        import numpy as np

        free = self.predictor.law.free
        moving = [n for n in range(len(free)) if not at_limit[n]]
        jacobian = self._solved(at, max_nfev=1).jac[:, moving]
        _, singular, directions = np.linalg.svd(jacobian, full_matrices=False)
        if len(singular) < len(moving) or singular[-1] <= _UNDETERMINED * singular[0]:
            return dict.fromkeys(free)
        spread = directions.T / singular
        by_parameter = np.array(self.predictor.sensitivities(at))[: len(free), moving] @ spread
        errors = np.sqrt((by_parameter**2).sum(axis=1)).tolist()
        return {name: None if at_limit[n] else errors[n] for n, name in enumerate(free)}


def _same(a: Coordinates, b: Coordinates) -> bool:
    return (
        abs(math.log(a.length / b.length)) < _SAME_PLACE
        and abs(a.damping - b.damping) < _SAME_PLACE
        and abs(a.exponent - b.exponent) < _SAME_PLACE
    )


def _zeta(cor: float) -> float:
    """ζ of a COR under law 2: e = exp(-2 ζ s), ζ = cos θ, s = θ/sin θ (cosh, sinh beyond 1).

    Schwager & Pöschel, Granular Matter 9, 465–469 (2007).
    """
    from scipy.optimize import brentq

    half = -0.5 * math.log(cor)
    tight = {"xtol": 1e-300, "rtol": 1e-15}
    if half < 0.5:
        # φ = π/2 - θ keeps its digits where damping is small.
        phi = brentq(lambda phi: (0.5 * math.pi - phi) * math.tan(phi) - half, 0.0, 1.0, **tight)
        return math.sin(phi)
    if half < 1.0:
        return math.cos(brentq(lambda t: t / math.tan(t) - half, 1e-9, 1.5, **tight))
    return math.cosh(brentq(lambda t: t / math.tanh(t) - half, 1e-9, half + 1.0, **tight))
