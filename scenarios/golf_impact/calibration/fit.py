"""The parameters of a contact law by weighted least squares through the FMU. Needs SciPy."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from golf_impact.calibration.measurements import RESTITUTION, TARGETS, Measurements, number
from golf_impact.calibration.pulse import contact_rows, impulse_ratio, noise
from golf_impact.errors import UserError
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.fmu.uncertainty import RANGES, gradient

#: The parameters of COR = first − second · approach speed; they replace b.
LINE = ("restitution_at_rest", "restitution_slope")

#: Damping ratios and exponents of the starts, and exponents with a curve, whose impulse gives ζ.
_ZETAS, _EXPONENTS = (1e-3, 0.02, 0.1, 0.3, 0.8, 3.0, 30.0), (1.05, 1.5, 2.2, 4.0, 9.0)
_CURVE_EXPONENTS = (1.1, 1.5, 2.0, 2.6)

#: Starts are refined on about this many rows of a curve, the best of them on all.
_ROWS = 50

#: The unit of the coordinate of touch, s.
_CLOCK = 1e-4

#: The residual, in σ, where the bodies never separate.
_FAR = 1e9

#: Two minima are equally good if their χ² differ by less than this, and the same if their
#: coordinates do.
_EQUAL_CHI_SQUARED, _SAME_PLACE = 1e-6, 1e-4

#: A direction that changes the data this much less than the best does is undetermined.
_UNDETERMINED = 1e-7

#: Parameters are rounded to this fraction of their standard error (all others fixed).
_ROUNDING = 1e-3


@dataclass(frozen=True)
class ContactLaw:
    """A law, and whether its exponent is free."""

    law: int  #: 1 (absolute) or 2 (relative)
    exponent: float | None  #: n, or None if it is free
    reference_compression: float = 0.005  #: d_r, at which k and b hold, m

    @classmethod
    def of(cls, law: int, exponent: float | str, reference_compression: float) -> ContactLaw:
        """From options: the exponent is a number or "free"; UserError if there is no such law."""
        number(reference_compression, "reference_compression")
        n = None if str(exponent).strip().lower() == "free" else number(exponent, "exponent")
        if law == 1 and n != 1.0:
            raise UserError(
                f"--exponent {exponent} is refused with --law 1 (absolute), which is linear: leave "
                "it out, or take --law 2"
            )
        return cls(law, n, reference_compression)

    @property
    def title(self) -> str:
        if self.exponent is None:
            return "power law, n free"
        if self.exponent == 1.0:
            return "Kelvin–Voigt" if self.law == 2 else "absolute"
        return f"{'Tsuji' if self.exponent == 1.5 else 'power law'}, n = {self.exponent:g}"

    @property
    def options(self) -> str:
        """As options of the command line."""
        n = "free" if self.exponent is None else f"{self.exponent:g}"
        return "--law 1" if self.law == 1 else f"--exponent {n}"


class Estimate(NamedTuple):
    """A fitted value in SI units; the standard error is None where it isn't defined."""

    value: float
    standard_error: float | None


@dataclass
class Fit:
    """The best parameters of one law; arrays over all measured values have the shape (n,)."""

    law: ContactLaw
    title: str  #: of the law
    values: dict[str, float]  #: the FMU's inputs and parameters of this impact, SI units
    parameters: dict[str, Estimate]  #: those of them that were fitted
    covariance: np.ndarray  #: of the parameters, (p, p); NaN where not defined
    touch: Estimate | None  #: the instant by the curve's clock, s
    predicted: dict[str, float]  #: scalar targets as the FMU gives them
    model: np.ndarray  #: all measured values as the FMU gives them
    model_errors: np.ndarray  #: their standard errors
    sigma: np.ndarray  #: standard deviations of the measured values
    residuals: np.ndarray  #: (model − measured)/σ
    estimated: tuple[str, ...]  #: groups of measurements whose σ follows from the residuals
    aic: float  #: Akaike's information criterion
    others: list[dict[str, float]]  #: values of further minima that are as good
    held: list[str]  #: parameters at a limit

    @property
    def chi_squared(self) -> float:
        return float(self.residuals @ self.residuals)

    @property
    def degrees_of_freedom(self) -> int:
        """Measured values less fitted parameters, the instant of touch among them."""
        return len(self.residuals) - len(self.parameters) - (self.touch is not None)

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
        parameters = {name: one._asdict() for name, one in self.parameters.items()}
        names = ("predicted", "chi_squared", "degrees_of_freedom", "probability", "aic")
        return {
            **{"exponent": self.values.get("exponent"), "parameters": parameters},
            **{"covariance": self.covariance.tolist()},
            **{name: getattr(self, name) for name in names},
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
    return (
        f"too few targets: {', '.join(free)} need {len(free)} independent ones, these are {have} "
        "(ball speed, club speed after and COR depend on the damping only: they count once)"
    )


def fit(fmu: ImpactFmu, data: Measurements, law: ContactLaw) -> Fit:
    """The parameters of a law that meet these measurements best.

    Weighted least squares (SciPy's dogbox method) from several starts. A σ that isn't given is
    estimated from the residuals, for each series separately.

    Raises:
        UserError: no contact that ends comes near the measurements, or they leave the range of
            double precision.
    """
    few, curve = data, data.curve
    if curve is not None and (step := len(curve.y) // _ROWS) > 1:
        sigma = None if curve.sigma is None else curve.sigma[::step]
        thinned = replace(curve, x=curve.x[::step], y=curve.y[::step], sigma=sigma)
        few = replace(data, series={**data.series, "curve": thinned})
    try:
        with np.errstate(all="ignore"):
            return _Problem(fmu, data, law).fit(_Problem(fmu, few, law).minima())
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
        raise UserError(
            f"{law.title}: the measurements or their σ are too small or too large for double "
            f"precision ({error})"
        ) from error


class _Problem:
    """One law and the measurements that it has to meet.

    The coordinates of a fit suit least squares better than k and b. With v the club speed,
    m = (n + 1)/2 and ω = √(m k/μ) at the reference compression, the length L with
    ω (L/d_r)^(m − 1) = m v/L is the compression that the speed would reach without damping, up to a
    factor of order 1; ζ = b/(2 μ ω). Then speeds depend on ζ alone, times are proportional to L and
    forces to 1/L, whatever d_r is. They are

    - length: ln(L/1 m),
    - exponent: n, if free,
    - damping: arsinh ζ, or the two parameters of a COR line,
    - touch: the instant of touch since the first row of the curve, if there is one, in `_CLOCK`.
    """

    def __init__(self, fmu: ImpactFmu, data: Measurements, law: ContactLaw) -> None:
        self.fmu, self.data, self.law = fmu, data, law
        line = data.cor_speeds is not None
        damping = LINE if line else ("damping",)
        exponent = ["exponent"] if law.exponent is None and data.sized else []
        size, touch = ["length"] * data.sized, ["touch"] * (data.curve is not None)
        self.coordinates = (*size, *damping, *exponent, *touch)
        #: The FMU's names of what is fitted.
        self.free = [*["k"] * data.sized, *["b"] * (not line), *exponent, *LINE * line]
        ranges = {name: ends[:2] for name, ends in RANGES.items()} | {"damping": (0.0, 12.0)}
        bounds = (ranges.get(name, (-math.inf, math.inf)) for name in self.coordinates)
        self.low, self.high = np.array(list(bounds)).T
        titles = [law.title] * data.sized + ["COR line"] * line
        self.title = " with ".join(titles) or law.title
        self.estimated = tuple(name for name, one in data.series.items() if one.sigma is None)
        sigma = [np.array([target.sigma for target in data.targets.values()])]
        for name, one in data.series.items():
            guess = 0.01 if name == "cor_speeds" else max(noise(one.y), 1e-3 * one.y.max())
            sigma.append(np.full(len(one.y), guess) if one.sigma is None else one.sigma)
        self.sigma = np.concatenate(sigma)

    # The model

    def values(self, x: np.ndarray) -> dict[str, float]:
        """Inputs and parameters of the FMU at these coordinates, by name (SI units)."""
        at = dict(zip(self.coordinates, map(float, x)))
        impact, d = self.data.conditions, self.law.reference_compression
        values: dict[str, float] = {"law": self.law.law}
        if "length" in at:
            length, n = math.exp(at["length"]), at.get("exponent", self.law.exponent or 1.0)
            m = 0.5 * (n + 1.0)
            omega = m * (impact.club_speed / length) * (d / length) ** (m - 1.0)
            k = impact.reduced_mass * omega * omega / m
            values |= {"k": k, "exponent": n, "reference_compression": d}
            if "damping" in at:
                values["b"] = 2.0 * math.sinh(at["damping"]) * impact.reduced_mass * omega
        return values | {name: at[name] for name in LINE if name in at} | vars(impact)

    def touch(self, x: np.ndarray) -> float:
        """The instant of touch by the curve's clock at these coordinates, s; 0 without a curve."""
        return self.data.curve.x[0] + _CLOCK * float(x[-1]) if self.data.curve else 0.0

    def scalars(self, values: Mapping[str, float]) -> dict[str, float]:
        """Scalar targets by name; NaN if the bodies never separate, times and forces need a k."""
        names = [name for name in TARGETS if self.data.sized or name in RESTITUTION]
        given = self.fmu.impact([TARGETS[name][0] for name in names], **values)
        return {name: given[TARGETS[name][0]] for name in names}

    def predict(self, values: Mapping[str, float], touch: float) -> np.ndarray:
        """All measured values as the FMU gives them; NaN if the bodies never separate."""
        cor, data = TARGETS["cor"][0], self.data
        scalars = self.scalars(values)
        parts: list[Any] = [[scalars[name] for name in data.targets]]
        if data.curve is not None:
            instants = data.curve.x - touch
            inside = (instants > 0.0) & (instants < scalars["contact_time"])
            force = np.zeros(len(instants)) if scalars["cor"] > 0.0 else instants * math.nan
            self.fmu.start(**values)
            times = np.concatenate([[0.0], instants[inside]])
            force[inside] = self.fmu.sampled(times, ("force",))["force"][1:]
            parts.append(force)
        if data.cor_speeds is not None:
            cases = ({**values, "club_speed": v} for v in data.cor_speeds.x.tolist())
            parts.append([self.fmu.impact((cor,), **case)[cor] for case in cases])
        return np.concatenate(parts)

    def weighted(self, values: Mapping[str, float], touch: float) -> np.ndarray:
        """(model − measured)/σ; large where there is no contact that ends."""
        try:
            residuals = (self.predict(values, touch) - self.data.values) / self.sigma
        except (UserError, OverflowError):
            # Far from any ball values may leave the FMU's range; the search has to turn back.
            return np.full(len(self.sigma), _FAR)
        return residuals if np.isfinite(residuals).all() else np.full(len(residuals), _FAR)

    # Least squares

    def solve(self, start: np.ndarray, tolerance: float, touch: Any = ()) -> Any:
        """SciPy's result from one start; `touch` bounds that coordinate further."""
        from scipy.optimize import least_squares

        low, high = self.low.copy(), self.high.copy()
        if touch:
            low[-1], high[-1] = touch
        return least_squares(
            lambda x: self.weighted(self.values(x), self.touch(x)),
            np.clip(start, low, high),
            # A difference of 1e-6 is far above the FMU's rounding; a curve's is worth the speed.
            **({"jac": "3-point"} if self.data.curve is None else {"diff_step": 1e-6}),
            # Of SciPy's methods the one that ends exactly at a limit.
            method="dogbox",
            bounds=(low, high),
            x_scale="jac",
            **dict.fromkeys(("xtol", "ftol", "gtol"), tolerance),
            max_nfev=100,
        )

    def minima(self) -> list[np.ndarray]:
        """The best minimum and all that are as good: the least damped first, then by exponent."""
        tolerance = 1e-15 if self.data.curve is None else 1e-8
        refined = [self.solve(x, tolerance) for x in self.starts()]
        best = min(result.cost for result in refined)
        if best >= _FAR:
            raise UserError(f"{self.law.title}: no contact that ends comes near these measurements")
        equal = [r.x for r in refined if 2.0 * (r.cost - best) <= _EQUAL_CHI_SQUARED * (1.0 + best)]
        places: list[np.ndarray] = []
        for x in sorted(equal, key=lambda x: tuple(np.round(x[1:], 6))):
            if not any(np.allclose(x, other, 0.0, _SAME_PLACE) for other in places):
                places.append(x)
        return places[:1] if self.data.curve is not None else places

    def starts(self) -> list[np.ndarray]:
        """A grid of ζ and n, each with the length and touch of an undamped linear contact."""
        impact, curve, scalars = self.data.conditions, self.data.curve, self.data.targets
        momentum = impact.reduced_mass * impact.club_speed
        zetas, exponents = _ZETAS, _EXPONENTS
        omega, touch = math.pi / 5e-4, 0.0
        for name, one in scalars.items():
            if name == "max_force":
                omega = one.value / momentum
            elif "time" in name:
                omega = (math.pi if name == "contact_time" else 0.5 * math.pi) / one.value
        if curve is not None:
            rows = contact_rows(curve.y)
            omega = math.pi / (1.1 * np.ptp(curve.x[rows]))
            touch = (curve.x[rows[0]] - 0.2 / omega - curve.x[0]) / _CLOCK
            cor = min(max(impulse_ratio(curve, momentum) - 1.0, 0.05), 0.98)
            zetas, exponents = (-math.log(cor) / math.pi,), _CURVE_EXPONENTS
        at = {"touch": touch}
        if self.data.cor_speeds is not None:
            one, zetas = self.data.cor_speeds, (0.1,)
            weights = 1.0 / self.sigma[self.data.groups["cor_speeds"]]
            slope, rest = np.polyfit(one.x, one.y, 1, w=weights)
            at |= {LINE[0]: rest, LINE[1]: -slope}
        grid = itertools.product(zetas, exponents if "exponent" in self.coordinates else (1.0,))
        starts = []
        for zeta, n in grid:
            length = math.log(0.5 * (n + 1.0) * impact.club_speed / omega)
            at |= {"length": length, "damping": math.asinh(zeta), "exponent": n}
            starts.append(np.array([at[name] for name in self.coordinates]))
        return starts

    def fit(self, places: list[np.ndarray]) -> Fit:
        result = self.between_rows(self.solve(places[0], 1e-10 if self.data.curve else 1e-15))
        for _ in range(10):
            before = self.sigma.copy()
            self.estimate_sigma(result)
            if len(self.data.groups) == 1 or np.allclose(before, self.sigma, 0.01):
                break
            result = self.solve(result.x, 1e-10)
        return self.described(result, [self.values(x) for x in places[1:]])

    def between_rows(self, result: Any) -> Any:
        """The best minimum with touch between two rows of the curve.

        Law 2's force jumps to b·v at touch if n = 1 (and nearly so just above), so that χ² jumps
        where touch passes a row; between two rows it is smooth.
        """
        curve = self.data.curve
        if curve is None or self.law.law == 1:
            return result
        rows = (curve.x - curve.x[0]) / _CLOCK
        here = int(np.searchsorted(rows, result.x[-1]))
        cells = [(rows[n - 1], rows[n]) for n in range(max(here - 2, 1), min(here + 3, len(rows)))]
        return min(
            [result, *(self.solve(result.x, 1e-8, cell) for cell in cells)],
            key=lambda one: one.cost,
        )

    # Statistics

    def estimate_sigma(self, result: Any) -> None:
        """σ of the series without: residuals over rows less the parameters that they determine."""
        leverage = np.sum(np.linalg.qr(result.jac)[0] ** 2, axis=1)
        for name in self.estimated:
            rows = self.data.groups[name]
            freedom = max(rows.stop - rows.start - float(leverage[rows].sum()), 1.0)
            # Data computed without noise leave residuals of rounding only.
            least = 1e-9 * float(np.abs(self.data.values[rows]).max()) / self.sigma[rows.start]
            self.sigma[rows] *= max(math.sqrt(np.sum(result.fun[rows] ** 2) / freedom), least)

    def described(self, result: Any, others: list[dict[str, float]]) -> Fit:
        values, touch, free = self.values(result.x), self.touch(result.x), self.free
        ends = zip(self.coordinates, result.active_mask.tolist())
        held = ["b" if name == "damping" else name for name, end in ends if end and name != "touch"]
        varied = [name for name in free if name not in held]
        # Derivatives of the weighted model: rows as `varied`, then the instant of touch.
        jacobian = gradient(lambda at: self.weighted(at, touch), values, varied)
        jacobian = jacobian.reshape(len(varied), -1)
        covariance, model_errors = _covariance(jacobian)
        if self.data.curve is not None:
            # The force rises steeply or jumps at touch. So the derivative is a difference over two
            # standard errors of touch, to the side on which no row comes near that rise.
            here, step, inner = self.weighted(values, touch), 5e-2 * _CLOCK, jacobian
            for _ in range(4):
                slopes = [(self.weighted(values, touch + s) - here) / s for s in (step, -step)]
                jacobian = np.vstack([inner, min(slopes, key=lambda one: float(one @ one))])
                covariance, model_errors = _covariance(jacobian)
                step = min(2.0 * np.nan_to_num(math.sqrt(covariance[-1, -1])) or step, step)
        errors = [error if error == error else None for error in np.sqrt(np.diag(covariance))]
        for name, slope in zip(varied, jacobian):
            unit = _ROUNDING / float(np.linalg.norm(slope))
            if None in errors:
                unit = 1e-6 * abs(values[name])
            if 0.0 < unit < math.inf:
                values[name] = round(values[name], -math.floor(math.log10(unit)))
        model = self.predict(values, touch)
        residuals = (model - self.data.values) / self.sigma
        full = np.full((len(free), len(free)), math.nan)
        at = [free.index(name) for name in varied]
        full[np.ix_(at, at)] = covariance[: len(at), : len(at)]
        known = dict(zip(varied, errors))
        return Fit(
            law=self.law,
            title=self.title,
            values=values,
            parameters={name: Estimate(values[name], known.get(name)) for name in free},
            covariance=full,
            touch=Estimate(touch, errors[-1]) if self.data.curve else None,
            predicted=self.scalars(values),
            model=model,
            model_errors=self.sigma * model_errors,
            sigma=self.sigma,
            residuals=residuals,
            estimated=self.estimated,
            aic=self.aic(residuals, len(self.coordinates) - len(held)),
            others=others,
            held=held,
        )

    def aic(self, residuals: np.ndarray, fitted: int) -> float:
        """−2 ln(likelihood) + 2 · fitted parameters, but for a constant of the data.

        A σ that is estimated counts as a parameter, with its likeliest value.
        """
        total = 2.0 * (fitted + len(self.estimated))
        for name, rows in self.data.groups.items():
            square = float(np.sum(residuals[rows] ** 2))
            if name in self.estimated:
                number = rows.stop - rows.start
                square = number * math.log(square * self.sigma[rows.start] ** 2 / number)
            total += square
        return total


def _covariance(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(J Jᵀ)⁻¹, and the standard errors of the weighted model; NaN if J's rank is deficient."""
    p, n = jacobian.shape
    scale = np.linalg.norm(jacobian, axis=1)
    if np.isfinite(scale).all() and scale.all() and p <= n:
        left, singular, right = np.linalg.svd((jacobian.T / scale), full_matrices=False)
        if p == 0 or singular[-1] > _UNDETERMINED * singular[0]:
            spread = (right.T / singular) / scale[:, None]
            return spread @ spread.T, np.linalg.norm(left, axis=1)
    return np.full((p, p), math.nan), np.full(n, math.nan)
