"""Finds the parameters of a contact law: exactly where that can be, else by least squares.

Needs SciPy.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from golf_impact.calibration.contact_law import LIMITS, ContactLaw, Coordinates, Predictor
from golf_impact.calibration.targets import RESTITUTION, Conditions, Target, restitution
from golf_impact.errors import UserError
from golf_impact.fmu.impact_fmu import ImpactFmu

#: Where the search looks first: ζ and n, far beyond any ball.
_ZETAS = (0.0, *(10.0 ** (-3.0 + 0.125 * i) for i in range(49)))
_EXPONENTS = (1.0, 1.1, 1.25, 1.4, 1.6, 1.8, 2.1, 2.5, 3.0, 4.0, 6.0, 8.5, 12.0)

#: Times are proportional to the size of a contact, forces to its inverse.
_POWERS = {"contact_time": 1, "time_of_max_force": 1, "max_force": -1}

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
    """What was found for one law."""

    law: ContactLaw
    method: str
    values: dict[str, float]  #: the FMU's inputs and parameters that the result needs, SI units
    standard_errors: dict[str, float | None]  #: of the free parameters; None where not defined
    predicted: dict[str, float]  #: what the FMU gives for each kind of target
    residuals: dict[str, float]  #: (predicted - target)/σ of each target
    path: dict[str, np.ndarray]  #: `time` since touch (s) and contact `force` (N), (301,) each
    others: list[dict[str, float]]  #: values of further answers that meet the targets as well
    notes: list[str]  #: what there is to know about this fit

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
    speeds = sum(name in RESTITUTION for name in targets)
    have, need = len(targets) - speeds + (speeds > 0), len(law.free)
    if have >= need:
        return None
    *names, last = law.free
    why = f"{', '.join(names)} and {last} need {need} independent targets, these are {have}"
    if speeds > 1:
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
    try:
        # What overflows is told below, in one line.
        with np.errstate(all="ignore"):
            search = _Search(Predictor(fmu, conditions, law), targets)
            if answers := search.exact():
                return search.described(answers, "closed form")
            if answers := search.least_squares():
                return search.described(answers, "weighted least squares")
    except (ArithmeticError, ValueError) as error:
        raise UserError(
            f"{law.title}: the targets or their σ are too small or too large for doubles ({error})"
        ) from error
    raise UserError(f"{law.title}: no contact that ends comes near these targets")


class _Search:
    def __init__(self, predictor: Predictor, targets: Mapping[str, Target]) -> None:
        self.predictor = predictor
        self.targets = targets
        self.law, conditions = predictor.law, predictor.conditions
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
        #: What the speeds and the COR among the targets tell, under law 2.
        self.told = [restitution(t, conditions)[0] for n, t in targets.items() if n in RESTITUTION]

    def residuals(self, predicted: Mapping[str, float] | None) -> list[float]:
        """(predicted - target)/σ, in the targets' order."""
        if predicted is None:
            return [_FAR] * len(self.targets)
        return [(predicted[name] - t.value) / t.sigma for name, t in self.targets.items()]

    def chi_squared(self, predicted: Mapping[str, float]) -> float:
        return sum(r * r for r in self.residuals(predicted))

    def exact(self) -> list[Coordinates]:
        """The answer without a search, in a list; an empty one if there is none this way."""
        sizes = [t for name, t in self.targets.items() if name not in RESTITUTION]
        n, one_of_each = self.law.exponent, len(self.told) == len(sizes) == 1
        if self.law.law != 2 or n is None or not one_of_each or not 0.0 < self.told[0] < 1.0:
            return []
        (size,), at = sizes, Coordinates.of(self.length, _zeta(self.told[0]), n)
        predicted = self.predictor.predict(at)
        if predicted is None or predicted[size.name] <= 0.0 or size.value <= 0.0:
            return []
        ratio = size.value / predicted[size.name]
        scale = ratio if _POWERS[size.name] > 0 else 1.0 / ratio
        return [replace(at, length=self.length * scale)]

    def least_squares(self) -> list[Coordinates]:
        """The best answer, and all that are as good: the least damped first, then by exponent."""
        refined = [at for start in self._starts() if (at := self._refine(start))]
        best = min((chi for chi, _ in refined), default=0.0)
        good = [at for chi, at in refined if chi <= best + _EQUAL_CHI_SQUARED * max(1.0, best)]
        good.sort(key=lambda at: (round(at.damping, 6), at.exponent))
        places: list[Coordinates] = []
        for place in good:
            if not any(_same(place, other) for other in places):
                places.append(place)
        return places

    def _starts(self) -> list[Coordinates]:
        """The best places of a grid in ζ and n, each with the length that suits it."""
        zetas = set(_ZETAS)
        if self.law.law == 2:
            # A speed tells ζ: without these, a valley may lie between two points.
            zetas |= {_zeta(e) for e in self.told if 0.0 < e < 1.0}
        grid: dict[tuple[int, int], tuple[float, Coordinates]] = {}
        for j, n in enumerate(_EXPONENTS if self.law.exponent is None else (self.law.exponent,)):
            for i, zeta in enumerate(sorted(zetas)):
                at = Coordinates.of(self.length, zeta, n)
                predicted = self.predictor.predict(at)
                if predicted is None:
                    continue
                scale = self._scale(predicted)
                for name, power in _POWERS.items():
                    one = predicted[name]
                    predicted[name] = one * scale if power > 0 else one / scale
                chi = self.chi_squared(predicted)
                grid[i, j] = (chi, replace(at, length=self.length * scale))

        def lowest(i: int, j: int) -> bool:
            near = [(i + p, j + q) for p in (-1, 0, 1) for q in (-1, 0, 1)]
            return all(grid[i, j][0] <= grid[place][0] for place in near if place in grid)

        order = sorted(grid, key=lambda place: (not lowest(*place), grid[place][0]))
        return [grid[place][1] for place in order[:_STARTS]]

    def _scale(self, predicted: Mapping[str, float]) -> float:
        """By what to multiply the length so that times and forces are met best (in logarithms)."""
        total = weights = 0.0
        for name, power in _POWERS.items():
            wanted = self.targets.get(name)
            if wanted and wanted.value > 0.0 and predicted[name] > 0.0:
                weight = (wanted.value / wanted.sigma) ** 2
                weights += weight
                total += weight * power * math.log(wanted.value / predicted[name])
        return math.exp(total / weights) if weights else 1.0

    def _refine(self, start: Coordinates) -> tuple[float, Coordinates] | None:
        """χ² and place of the minimum that a start leads to."""
        at = self._place(start, self._solved(start, max_nfev=200).x)
        predicted = self.predictor.predict(at)
        return None if predicted is None else (self.chi_squared(predicted), at)

    def _place(self, start: Coordinates, x: np.ndarray) -> Coordinates:
        """Of (ln L, z, n), where ln L is 0 at the start, and n is left out where it isn't free."""
        n = float(x[2]) if self.law.exponent is None else start.exponent
        return Coordinates(start.length * math.exp(x[0]), float(x[1]), n)

    def _solved(self, start: Coordinates, max_nfev: int) -> Any:
        from scipy.optimize import least_squares

        number = len(self.law.free)
        bounds = [(-math.inf, math.inf), (0.0, math.inf), LIMITS][:number]
        return least_squares(
            lambda x: self.residuals(self.predictor.predict(self._place(start, x))),
            [0.0, start.damping, start.exponent][:number],
            jac="3-point",
            bounds=tuple(zip(*bounds)),
            **dict.fromkeys(("xtol", "ftol", "gtol"), 1e-15),
            max_nfev=max_nfev,
        )

    def described(self, answers: list[Coordinates], method: str) -> Fit:
        """The first answer, with the others beside it."""
        at, *others = answers
        notes = []
        no_damping = at.damping < 1e-9
        if no_damping:
            at = replace(at, damping=0.0)
            notes.append(
                "the damping b is at its limit 0: these targets ask for no damping, or for less"
            )
        predicted = self.predictor.predict(at)
        assert predicted is not None
        if predicted["time_of_max_force"] == 0.0:
            notes.append("the force is largest at first touch: a dashpot more than a ball")
        end = self.law.exponent is None and at.exponent in LIMITS
        if end:
            notes.append(f"the exponent is at its limit {at.exponent:g}")
        errors = self._standard_errors(at, [False, no_damping, end])
        unknown = [name for name, error in errors.items() if error is None]
        if unknown:
            notes.append(f"no standard error is defined for {' and '.join(unknown)}")
        return Fit(
            law=self.law,
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
        free = self.law.free
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
    differences = (math.log(a.length / b.length), a.damping - b.damping, a.exponent - b.exponent)
    return all(abs(difference) < _SAME_PLACE for difference in differences)


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
