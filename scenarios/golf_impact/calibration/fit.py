"""Finds the parameters of a contact law by weighted least squares from several starts.

Needs SciPy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from golf_impact.calibration.measurements import RESTITUTION, Measurements, restitution
from golf_impact.calibration.model import LINE, ContactLaw, Model
from golf_impact.calibration.pulse import centre_and_width, impulse_ratio, noise
from golf_impact.errors import UserError
from golf_impact.facts.closed_forms import half_contact
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.fmu.uncertainty import gradient

#: Damping ratios and exponents of the starts, and how many of the best starts are refined.
_ZETAS = 10.0 ** np.linspace(-3.0, 3.0, 49)
_EXPONENTS = (1.05, 1.25, 1.5, 1.8, 2.2, 3.0, 4.5, 8.5, 12.0)
_STARTS = 8

#: The same with a curve, which is expensive to evaluate, and whose impulse gives ζ: factors on it.
_CURVE_FACTORS, _CURVE_EXPONENTS, _CURVE_STARTS = (0.5, 1.0, 2.0), (1.1, 1.5, 2.0, 2.6), 3

#: Starts are refined on this many rows of a curve, the best of them on all.
_ROWS = 50

#: How often touch may move on to the next row at the end.
_ROUNDS = 3

#: Times are proportional to the size of a contact, forces to its inverse.
_POWERS = {"contact_time": 1, "time_of_max_force": 1, "max_force": -1}

#: The residual, in σ, where the bodies never separate.
_FAR = 1e9

#: Two minima are equally good if their χ² differ by less than this, and the same if their
#: coordinates do.
_EQUAL_CHI_SQUARED, _SAME_PLACE = 1e-6, 1e-4

#: A coordinate is held at a limit if χ² there is no larger, but for rounding.
_EQUAL = 1.0 + 1e-7

#: A direction that changes the data this much less than the best does is undetermined.
_UNDETERMINED = 1e-7

#: Parameters are rounded to this fraction of their standard error (all others fixed).
_ROUNDING = 1e-3


@dataclass
class Fit:
    """The best parameters of one law; arrays over all measured values have the shape (n,)."""

    law: ContactLaw
    title: str  #: of the law
    free: tuple[str, ...]  #: the FMU's names of the fitted parameters
    values: dict[str, float]  #: the FMU's inputs and parameters of this impact, SI units
    touch: tuple[float, float | None]  #: instant by the curve's clock and standard error, s
    standard_errors: dict[str, float | None]  #: of the free parameters; None where not defined
    covariance: np.ndarray  #: of the free parameters, (p, p); NaN where not defined
    predicted: dict[str, float]  #: scalar targets as the FMU gives them
    model: np.ndarray  #: all measured values as the FMU gives them
    model_errors: np.ndarray  #: their standard errors
    sigma: np.ndarray  #: standard deviations of the measured values
    estimated: tuple[str, ...]  #: groups of measurements whose σ follows from the residuals
    residuals: np.ndarray  #: (model − measured)/σ
    aic: float  #: Akaike's information criterion
    others: list[dict[str, float]]  #: values of further minima that are as good
    notes: list[str]

    @property
    def chi_squared(self) -> float:
        return float(self.residuals @ self.residuals)

    @property
    def degrees_of_freedom(self) -> int:
        """Measured values less fitted parameters, the instant of touch among them."""
        return len(self.residuals) - len(self.free) - (self.touch[1] is not None)

    @property
    def probability(self) -> float | None:
        """The chance of a χ² this large if law and σ are right; None if χ² has no meaning."""
        if self.degrees_of_freedom <= 0 or self.estimated:
            return None
        from scipy.special import gammaincc

        return float(gammaincc(0.5 * self.degrees_of_freedom, 0.5 * self.chi_squared))

    @property
    def coverage(self) -> float:
        """Half the width of a 95 % interval in standard errors: Student's t or normal."""
        from scipy.special import stdtrit

        return float(stdtrit(max(1, self.degrees_of_freedom) if self.estimated else 1e9, 0.975))

    def as_json(self) -> dict[str, Any]:
        """The part of calibrate.json that every fit has."""
        errors = self.standard_errors.items()
        return {
            "exponent": self.values.get("exponent"),
            "parameters": {
                n: {"value": self.values[n], "standard_error": error} for n, error in errors
            },
            **{"covariance": self.covariance.tolist(), "predicted": self.predicted},
            **{"chi_squared": self.chi_squared, "degrees_of_freedom": self.degrees_of_freedom},
            **{"probability": self.probability, "aic": self.aic},
        }


def missing(law: ContactLaw, data: Measurements) -> str | None:
    """Why these measurements can't determine the law's free parameters, or None if they can."""
    line = data.cor_speeds is not None
    if law.law == 1 and line:
        return "its damping has no COR line (--cor-speeds): take --law 2"
    speeds = sum(name in RESTITUTION for name in data.targets)
    sizes = len(data.targets) - speeds
    have, free = sizes + (line or speeds > 0), ("k", "b", "exponent")[: 2 + (law.exponent is None)]
    only_line = line and not sizes and law.exponent is not None
    if data.curve is not None or only_line or have >= len(free):
        return None
    *names, last = free
    why = f"too few targets: {', '.join(names)} and {last} need {len(free)} independent ones"
    if speeds + line > 1:
        why += " (ball speed, club speed after and COR depend on the damping only: they count once)"
    return f"{why}, these are {have}"


def fit(fmu: ImpactFmu, data: Measurements, law: ContactLaw) -> Fit:
    """The parameters of a law that meet these measurements best.

    Weighted least squares (SciPy's trust region reflective method) from the best of several starts.
    A σ that isn't given is estimated from the residuals, for each series separately.

    Raises:
        UserError: no contact that ends comes near the measurements, or they leave the range of
            double precision.
    """
    try:
        with np.errstate(all="ignore"):
            return _Search(Model(fmu, data, law)).fit()
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
        raise UserError(
            f"{law.title}: the measurements or their σ are too small or too large for double "
            f"precision ({error})"
        ) from error


class _Search:
    def __init__(self, model: Model) -> None:
        self.model, self.law, data = model, model.law, model.data
        self.data = data
        series = data.series
        self.estimated = tuple(name for name, one in series.items() if one.sigma is None)
        sigma = [np.array([target.sigma for target in data.targets.values()])]
        for name, one in series.items():
            guess = 0.01 if name == "cor_speeds" else max(noise(one.y), 1e-3 * one.y.max())
            sigma.append(np.full(len(one.y), guess) if one.sigma is None else one.sigma)
        self.sigma = np.concatenate(sigma)
        self.low, self.high = model.bounds
        #: Coordinates that aren't held at a limit.
        self.moving = np.ones(len(self.low), bool)

    # Least squares

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """(model − measured)/σ."""
        return self._weighted(self.model.predict(self.model.values(x), self.model.touch(x)))

    def _weighted(self, predicted: np.ndarray | None) -> np.ndarray:
        if predicted is None:
            return np.full(len(self.sigma), _FAR)
        return (predicted - self.data.values) / self.sigma

    def chi_squared(self, x: np.ndarray) -> float:
        return float(np.sum(self.residuals(x) ** 2))

    def solve(
        self, start: np.ndarray, tolerance: float = 1e-15, touch: tuple[float, float] | None = None
    ) -> Any:
        """SciPy's result from one start; `x` has all coordinates, `jac` the moving ones.

        `touch` bounds that coordinate further.
        """
        from scipy.optimize import least_squares

        low, high = self.low.copy(), self.high.copy()
        if touch:
            low[-1], high[-1] = touch
        moving, x = self.moving, start.copy()

        def at(some: np.ndarray) -> np.ndarray:
            x[moving] = some
            return self.residuals(x)

        result = least_squares(
            at,
            np.clip(start, low, high)[moving],
            # A difference of 1e-6 is far above the FMU's rounding; a curve's is worth the speed.
            **({"jac": "3-point"} if self.data.curve is None else {"diff_step": 1e-6}),
            bounds=(low[moving], high[moving]),
            x_scale="jac",
            **dict.fromkeys(("xtol", "ftol", "gtol"), tolerance),
            max_nfev=200,
        )
        x[moving] = result.x
        result.x = x
        return result

    def minima(self) -> list[np.ndarray]:
        """The best minimum and all that are as good: the least damped first, then by exponent."""
        tolerance = 1e-15 if self.data.curve is None else 1e-8
        refined = [(2.0 * r.cost, r.x) for r in (self.solve(x, tolerance) for x in self._starts())]
        best = min((chi for chi, _ in refined), default=math.inf)
        if best >= _FAR:
            raise UserError(f"{self.law.title}: no contact that ends comes near these measurements")
        limit = best + _EQUAL_CHI_SQUARED * max(1.0, best)
        places: list[np.ndarray] = []
        if self.data.curve is not None:
            return [min(refined, key=lambda pair: pair[0])[1]]
        for _, x in sorted(
            (pair for pair in refined if pair[0] <= limit),
            key=lambda pair: tuple(np.round(pair[1][1:], 6)),
        ):
            if not any(np.allclose(x, other, 0.0, _SAME_PLACE) for other in places):
                places.append(x)
        return places

    def _starts(self) -> list[np.ndarray]:
        """The best places of a grid in ζ and n, each with the length and touch that suit it."""
        model, data, names = self.model, self.data, self.model.coordinates
        restitutions = [
            restitution(t, data.conditions)[0] for n, t in data.targets.items() if n in RESTITUTION
        ]
        zetas, number = set(_ZETAS.tolist()), _STARTS
        exponents: tuple[float, ...] = _EXPONENTS
        if data.curve is not None:
            restitutions.append(impulse_ratio(data.curve, model.momentum) - 1.0)
            zeta = _zeta_of(min(max(restitutions[-1], 0.05), 0.98))
            zetas, exponents = {zeta * one for one in _CURVE_FACTORS}, _CURVE_EXPONENTS
            number = _CURVE_STARTS
        if self.law.law == 2:
            # Otherwise a narrow valley may lie between two points.
            zetas |= {_zeta_of(e) for e in restitutions if 0.0 < e < 1.0}
        places: list[dict[str, float]] = [
            {"damping": z if z <= 1.0 else 1.0 + math.log(z)} for z in sorted(zetas)
        ]
        if data.cor_speeds is not None:
            one = data.cor_speeds
            slope, rest = np.polyfit(one.x, one.y, 1, w=1.0 / self.sigma[data.groups["cor_speeds"]])
            places = [{LINE[0]: min(max(rest, 1e-3), 0.999), LINE[1]: max(-slope, 1e-6)}]
        ranked: list[tuple[float, np.ndarray]] = []
        for place in places:
            for n in exponents if "exponent" in names else (self.law.exponent or 1.0,):
                at = {"length": math.log(1.5e-4 * data.conditions.club_speed), "touch": 0.0}
                x = np.array([{**at, **place, "exponent": n}[name] for name in names])
                if data.sized and not self._scaled(x):
                    continue
                ranked.append((self.chi_squared(x), x))
        ranked.sort(key=lambda pair: pair[0])
        return [x for chi, x in ranked if chi < _FAR][:number]

    def _scaled(self, x: np.ndarray) -> bool:
        """Set length and touch to those that suit the data best; False if nothing separates."""
        model, data = self.model, self.data
        try:
            predicted = model.scalars(model.values(x))
            if predicted is None:
                return False
            if data.curve is not None:
                path = model.fmu.trajectory(61, ("force",), **model.values(x))
                centre, width = centre_and_width(path["time"], path["force"])
                x[0] += math.log(model.pulse[1] / width)
                x[-1] = -centre / width
                return True
        except (UserError, OverflowError):
            return False
        total = weights = 0.0
        for name, power in _POWERS.items():
            wanted = data.targets.get(name)
            if wanted and wanted.value > 0.0 and predicted[name] > 0.0:
                weight = (wanted.value / wanted.sigma) ** 2
                weights += weight
                total += weight * power * math.log(wanted.value / predicted[name])
        x[0] += total / weights if weights else 0.0
        return True

    def fit(self) -> Fit:
        places = self._thinned().minima()
        result = self._best(places[0])
        for _ in range(10):
            before = self.sigma.copy()
            self._estimate_sigma(result)
            if len(self.data.groups) == 1 or np.allclose(before, self.sigma, 0.01):
                break
            result = self.solve(result.x)
        return self._described(result, places[1:])

    def _thinned(self) -> _Search:
        """The same on few rows of the curve."""
        curve = self.data.curve
        if curve is None or len(curve.y) < 2 * _ROWS:
            return self
        some = slice(None, None, len(curve.y) // _ROWS)
        sigma = None if curve.sigma is None else curve.sigma[some]
        thinned = replace(curve, x=curve.x[some], y=curve.y[some], sigma=sigma)
        search = _Search(Model(self.model.fmu, replace(self.data, curve=thinned), self.law))
        # The coordinate of touch is the same then.
        search.model.pulse = self.model.pulse
        return search

    def _best(self, x: np.ndarray) -> Any:
        """The minimum on all data; coordinates at a limit are held there."""
        result = self._between_rows(self.solve(x, 1e-10 if self.data.curve is not None else 1e-15))
        for n, ends in enumerate(zip(self.low, self.high)):
            for end in ends:
                held = result.x.copy()
                held[n] = end
                if (
                    abs(result.x[n] - end) < 0.02
                    and self.chi_squared(held) <= 2.0 * result.cost * _EQUAL
                ):
                    self.moving[n] = False
                    result = self.solve(held)
        return result

    def _between_rows(self, result: Any) -> Any:
        """The best minimum with touch between two rows of the curve.

        Law 2's force jumps to b·v at touch if n = 1 (and nearly so just above), so that χ² jumps
        where touch passes a row; between two rows it is smooth.
        """
        if self.data.curve is None or self.law.law == 1:
            return result
        centre, width = self.model.pulse
        rows = (self.data.curve.x - centre) / width
        tried: dict[int, Any] = {}
        for _ in range(_ROUNDS):
            here = int(np.searchsorted(rows, result.x[-1]))
            for n in (here - 1, here, here + 1):
                if n not in tried and 0 < n < len(rows):
                    tried[n] = self.solve(result.x, 1e-8, (rows[n - 1], rows[n]))
            best = min([result, *tried.values()], key=lambda one: one.cost)
            if best.cost >= result.cost * (1.0 - 1e-6):
                return best
            result = best
        return result

    # Statistics

    def _estimate_sigma(self, result: Any) -> None:
        """σ of the series without: residuals over rows less the parameters that they determine."""
        leverage = np.sum(np.linalg.qr(result.jac)[0] ** 2, axis=1)
        for name in self.estimated:
            rows = self.data.groups[name]
            freedom = max(rows.stop - rows.start - float(leverage[rows].sum()), 1.0)
            # Data computed without noise leave residuals of rounding only.
            least = 1e-9 * float(np.abs(self.data.values[rows]).max()) / self.sigma[rows.start]
            self.sigma[rows] *= max(math.sqrt(np.sum(result.fun[rows] ** 2) / freedom), least)

    def _described(self, result: Any, others: list[np.ndarray]) -> Fit:
        model, x, free = self.model, result.x, self.model.free
        values, touch = model.values(x), model.touch(x)
        held = [name for name, moves in zip(model.coordinates, self.moving) if not moves]
        held = ["b" if name == "damping" else name for name in held]
        varied = [name for name in free if name not in held]
        # Derivatives of the weighted model: rows as `varied`, then the instant of touch.
        jacobian = gradient(lambda at: self._weighted(model.predict(at, touch)), values, varied)
        covariance, model_errors = _covariance(jacobian)
        if self.data.curve is not None:
            # The force rises steeply or jumps at touch. So the derivative is a difference over two
            # standard errors of touch, to the side on which no row comes near that rise.
            here, step = self._weighted(model.predict(values, touch)), 0.05 * model.pulse[1]
            for _ in range(4):
                ends = [
                    (s, self._weighted(model.predict(values, touch + s))) for s in (step, -step)
                ]
                slope = min(((end - here) / s for s, end in ends), key=np.linalg.norm)
                both = np.vstack([jacobian.reshape(len(varied), -1), slope])
                covariance, model_errors = _covariance(both)
                step = min(2.0 * np.nan_to_num(math.sqrt(covariance[-1, -1])) or step, step)
            jacobian = both
        errors = np.sqrt(np.diag(covariance))
        if np.isfinite(errors).all():
            unit = _ROUNDING / np.linalg.norm(jacobian, axis=1)
        else:
            unit = [1e-6 * abs(values[name]) for name in varied]
        for name, one in zip(varied, unit):
            values[name] = _rounded(values[name], float(one))
        predicted, scalars = model.predict(values, touch), model.scalars(values)
        assert predicted is not None
        assert scalars is not None
        residuals = self._weighted(predicted)
        full = np.full((len(free), len(free)), math.nan)
        at = [free.index(name) for name in varied]
        full[np.ix_(at, at)] = covariance[: len(at), : len(at)]
        known = {n: float(e) if e == e else None for n, e in zip(varied, errors)}
        return Fit(
            law=self.law,
            title=model.title,
            free=free,
            values=values,
            touch=(touch, float(errors[-1]) if model.data.curve is not None else None),
            standard_errors={name: known.get(name) for name in free},
            covariance=full,
            predicted=scalars,
            model=predicted,
            model_errors=self.sigma * model_errors,
            sigma=self.sigma,
            estimated=self.estimated,
            residuals=residuals,
            aic=self._aic(residuals),
            others=[model.values(other) for other in others],
            notes=_notes(values, held, [n for n in varied if known[n] is None], scalars),
        )

    def _aic(self, residuals: np.ndarray) -> float:
        """−2 ln(likelihood) + 2 · parameters, but for a constant of the data.

        A σ that is estimated counts as a parameter, with its likeliest value.
        """
        total = 2.0 * (int(self.moving.sum()) + len(self.estimated))
        for name, rows in self.data.groups.items():
            square = float(np.sum(residuals[rows] ** 2))
            if name in self.estimated:
                number = rows.stop - rows.start
                total += number * math.log(square * self.sigma[rows.start] ** 2 / number)
            else:
                total += square
        return total


def _covariance(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(J Jᵀ)⁻¹, and the standard errors of the weighted model; NaN if J's rank is deficient."""
    p, n = jacobian.shape
    scale = np.linalg.norm(jacobian, axis=1)
    undefined = np.full((p, p), math.nan), np.full(n, math.nan)
    if not (np.isfinite(scale).all() and scale.all()) or p > n:
        return undefined
    left, singular, right = np.linalg.svd((jacobian.T / scale), full_matrices=False)
    if singular[-1] <= _UNDETERMINED * singular[0]:
        return undefined
    spread = (right.T / singular) / scale[:, None]
    return spread @ spread.T, np.linalg.norm(left, axis=1)


def _notes(
    values: dict[str, float], held: list[str], unknown: list[str], scalars: dict[str, float]
) -> list[str]:
    notes = [f"{n} is at its limit {values[n]:g}: no standard error is defined" for n in held]
    if unknown:
        notes.append(f"no standard error is defined for {' and '.join(unknown)}")
    if scalars.get("time_of_max_force") == 0.0:
        notes.append("the force is largest at first touch: a dashpot more than a ball")
    return notes


def _rounded(value: float, unit: float) -> float:
    """To the power of ten below a unit."""
    if not (0.0 < unit < math.inf):
        return value
    return round(value, -math.floor(math.log10(unit)))


def _zeta_of(cor: float) -> float:
    """The damping ratio of a COR under law 2, from a table: for starts."""
    table = [math.exp(-2.0 * zeta * half_contact(zeta)) for zeta in _ZETAS[::-1].tolist()]
    return float(np.exp(np.interp(cor, table, np.log(_ZETAS[::-1]))))
