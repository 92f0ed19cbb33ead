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

#: Damping ratios and exponents of the starts, and how many of the best of them are refined; the
#: impulse of a curve gives its ζ.
_ZETAS, _EXPONENTS = (1e-3, 0.02, 0.1, 0.3, 0.8, 3.0, 30.0), (1.05, 1.5, 2.2, 4.0, 9.0)
_REFINED = 20

#: Starts are refined on about this many rows of a curve, the best of them on all.
_ROWS = 50

#: The unit of the coordinate of touch, s; the residual, in σ, where the bodies never separate, and
#: the largest of all; parameters are rounded to this fraction of their standard error.
_CLOCK, _FAR, _ROUNDING = 1e-4, 1e9, 1e-3


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
            why = "with --law 1 (absolute), which is linear: leave it out, or take --law 2"
            raise UserError(f"--exponent {exponent} is refused {why}")
        return cls(law, n, reference_compression)

    @property
    def title(self) -> str:
        if self.exponent is None:
            return "power law, n free"
        if self.exponent == 1.0:
            return "Kelvin–Voigt" if self.law == 2 else "absolute"
        return f"{'Tsuji' if self.exponent == 1.5 else 'power law'}, n = {self.exponent:g}"


class Estimate(NamedTuple):
    """A fitted value in SI units; the standard error is None where it isn't defined."""

    value: float
    standard_error: float | None


@dataclass
class Fit:
    """The best parameters of one law; arrays over all measured values have the shape (n,)."""

    law: ContactLaw
    title: str
    values: dict[str, float]  #: the FMU's inputs and parameters of this impact, SI units
    parameters: dict[str, Estimate]  #: those of them that were fitted
    covariance: np.ndarray  #: of the parameters, (p, p); NaN where not defined
    touch: Estimate | None  #: the instant by the curve's clock, s
    predicted: dict[str, float]  #: scalar targets as the FMU gives them
    residuals: np.ndarray  #: (model − measured)/σ
    sigma: np.ndarray  #: standard deviations of the measured values
    model_errors: np.ndarray  #: standard errors of the model at the measured values
    estimated: tuple[str, ...]  #: groups of measurements whose σ follows from the residuals
    aic: float  #: Akaike's information criterion
    others: list[dict[str, float]]  #: values of further minima that are as good

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
        from scipy.special import chdtrc

        tested = self.degrees_of_freedom > 0 and not self.estimated
        return float(chdtrc(self.degrees_of_freedom, self.chi_squared)) if tested else None

    @property
    def coverage(self) -> float:
        """Half the width of a 95 % interval in standard errors: Student's t or normal."""
        from scipy.special import stdtrit

        return float(stdtrit(max(1, self.degrees_of_freedom) if self.estimated else 1e9, 0.975))

    def as_json(self) -> dict[str, Any]:
        """The part of calibrate.json that every fit has."""
        names = ("predicted", "chi_squared", "degrees_of_freedom", "probability", "aic")
        return {
            "exponent": self.values.get("exponent"),
            "parameters": {name: one._asdict() for name, one in self.parameters.items()},
            "covariance": self.covariance.tolist(),
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
    - damping: arsinh ζ, or the two parameters of a COR line,
    - exponent: n, if free,
    - touch: the instant of touch since the first row of the curve, if there is one, in `_CLOCK`.
    """

    def __init__(self, fmu: ImpactFmu, data: Measurements, law: ContactLaw) -> None:
        self.fmu, self.data, self.law = fmu, data, law
        line, sized = data.cor_speeds is not None, data.sized
        exponent = ["exponent"] if law.exponent is None and sized else []
        damping, touch = LINE if line else ("damping",), ["touch"] * (data.curve is not None)
        self.coordinates = (*["length"] * sized, *damping, *exponent, *touch)
        #: The FMU's names of what is fitted.
        self.free = [*["k"] * sized, *["b"] * (not line), *exponent, *LINE * line]
        ranges = {name: ends[:2] for name, ends in RANGES.items()} | {"damping": (0.0, 12.0)}
        unbounded = (-math.inf, math.inf)
        self.bounds = np.array([ranges.get(name, unbounded) for name in self.coordinates]).T
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
        """Scalar targets by name; NaN if the bodies never separate. Times and forces need a k."""
        outputs = {n: TARGETS[n][0] for n in TARGETS if self.data.sized or n in RESTITUTION}
        given = self.fmu.impact(list(outputs.values()), **values)
        return {name: given[output] for name, output in outputs.items()}

    def residuals(self, values: Mapping[str, float], touch: float) -> np.ndarray:
        """(model − measured)/σ; large where there is no contact that ends."""
        data, cor, far = self.data, TARGETS["cor"][0], np.full(len(self.sigma), _FAR)
        try:
            scalars = self.scalars(values)
            parts: list[Any] = [[scalars[name] for name in data.targets]]
            if data.curve is not None:
                instants = data.curve.x - touch
                inside = (instants > 0.0) & (instants < scalars["contact_time"])
                force = np.where(math.isnan(scalars["cor"]), math.nan, np.zeros(len(instants)))
                self.fmu.start(**values)
                times = np.concatenate([[0.0], instants[inside]])
                force[inside] = self.fmu.sample(times, ("force",))["force"][1:]
                parts.append(force)
            if data.cor_speeds is not None:
                cases = ({**values, "club_speed": v} for v in data.cor_speeds.x.tolist())
                parts.append([self.fmu.impact((cor,), **case)[cor] for case in cases])
        except (UserError, OverflowError):
            # Far from any ball values may leave the FMU's range; the search has to turn back.
            return far
        residuals = (np.concatenate(parts) - data.values) / self.sigma
        return residuals if np.all(np.abs(residuals) < _FAR) else far

    # Least squares

    def solve(self, start: np.ndarray, tolerance: float) -> Any:
        """SciPy's result from one start."""
        from scipy.optimize import least_squares

        return least_squares(
            lambda x: self.residuals(self.values(x), self.touch(x)),
            np.clip(start, *self.bounds),
            # A difference of 1e-6 is far above the FMU's rounding; a curve's is worth the speed.
            **({"jac": "3-point"} if self.data.curve is None else {"diff_step": 1e-6}),
            # Of SciPy's methods the one that ends exactly at a limit.
            method="dogbox",
            bounds=self.bounds,
            x_scale="jac",
            **dict.fromkeys(("xtol", "ftol", "gtol"), tolerance),
            max_nfev=100,
        )

    def minima(self) -> list[np.ndarray]:
        """The best minimum and all that are as good: the least damped first, then by exponent."""
        refined = sorted((self.solve(x, 1e-3) for x in self.starts()), key=lambda r: r.cost)
        tolerance = 1e-15 if self.data.curve is None else 1e-8
        number = _REFINED if self.data.curve is None else 4
        refined = [self.solve(result.x, tolerance) for result in refined[:number]]
        best = min(refined, key=lambda r: r.cost)
        if best.cost >= _FAR:
            raise UserError(f"{self.law.title}: no contact that ends comes near these measurements")
        if self.data.curve is not None:
            return [best.x]
        equal = [r.x for r in refined if r.cost - best.cost <= 5e-7 * (1.0 + best.cost)]
        places: list[np.ndarray] = []
        for x in sorted(equal, key=lambda x: tuple(np.round(x[1:], 6))):
            if not any(np.allclose(x, other, 0.0, 1e-4) for other in places):
                places.append(x)
        return places

    def starts(self) -> list[np.ndarray]:
        """A grid of ζ and n, each with the length and touch of an undamped linear contact."""
        impact, curve, line = self.data.conditions, self.data.curve, self.data.cor_speeds
        momentum = impact.reduced_mass * impact.club_speed
        omega, at, zetas, touches = math.pi / 5e-4, dict[str, float](), list(_ZETAS), [0.0]
        for name, one in self.data.targets.items():
            if name == "max_force":
                omega = one.value / momentum
            elif name not in RESTITUTION:
                omega = (math.pi if name == "contact_time" else 0.5 * math.pi) / one.value
        if curve is not None:
            rows = contact_rows(curve.y)
            omega = math.pi / (1.1 * float(np.ptp(curve.x[rows])))
            first = (curve.x[rows[0]] - curve.x[0]) / _CLOCK
            touches = [first - late / (omega * _CLOCK) for late in (0.0, 0.2, 0.4)]
            cor = min(max(impulse_ratio(curve, momentum) - 1.0, 0.05), 0.98)
            zetas = [-math.log(cor) / math.pi]
        if line is not None:
            weights, zetas = 1.0 / self.sigma[self.data.groups["cor_speeds"]], [0.1]
            slope, rest = np.polyfit(line.x, line.y, 1, w=weights)
            at |= {LINE[0]: rest, LINE[1]: -slope}
        starts = []
        exponents = _EXPONENTS if "exponent" in self.coordinates else _EXPONENTS[:1]
        for zeta, n, touch in itertools.product(zetas, exponents, touches):
            length = math.log(0.5 * (n + 1.0) * impact.club_speed / omega)
            at |= {"length": length, "damping": math.asinh(zeta), "exponent": n, "touch": touch}
            starts.append(np.array([at[name] for name in self.coordinates]))
        return starts

    def fit(self, places: list[np.ndarray]) -> Fit:
        """The best minimum from the first of these places; the others are as good as that."""
        data, free = self.data, self.free
        result = self.solve(places[0], 1e-15 if data.curve is None else 1e-10)
        if data.curve is not None:
            # Law 2's force jumps or rises steeply at touch, so that χ² has a minimum between any
            # two rows: the best of the neighbouring ones.
            row = float(np.median(np.diff(data.curve.x))) / _CLOCK
            shifts = np.outer((-4.0, -2.0, -1.0, 1.0, 2.0), np.eye(len(result.x))[-1] * row)
            near = [result, *(self.solve(result.x + shift, 1e-8) for shift in shifts)]
            result = min(near, key=lambda one: one.cost)
        for _ in range(10):
            before = self.sigma.copy()
            self.estimate_sigma(result)
            if len(data.groups) == 1 or np.allclose(before, self.sigma, 0.01):
                break
            result = self.solve(result.x, 1e-10)
        values, touch = self.values(result.x), self.touch(result.x)
        ends = dict(zip(self.coordinates, result.active_mask))
        ends["b"] = ends.get("damping", 0)
        varied = [name for name in free if not ends.get(name)]
        jacobian = self.jacobian(values, touch, varied)
        covariance = _covariance(jacobian)
        for name, slope in zip(varied, jacobian):
            unit = _ROUNDING / float(np.linalg.norm(slope))
            if np.isnan(covariance).any():
                unit = 1e-6 * abs(values[name])
            if 0.0 < unit < math.inf:
                values[name] = round(values[name], -math.floor(math.log10(unit)))
        residuals = self.residuals(values, touch)
        # NaN for parameters at a limit.
        at = [free.index(name) for name in varied]
        full = np.full((len(free), len(free)), math.nan)
        full[np.ix_(at, at)] = covariance[: len(at), : len(at)]
        errors = [error if error == error else None for error in np.sqrt(np.diag(full)).tolist()]
        model_variance = np.einsum("in,ij,jn->n", jacobian, covariance, jacobian)
        titles = [self.law.title] * data.sized + ["COR line"] * (data.cor_speeds is not None)
        return Fit(
            law=self.law,
            title=" with ".join(titles) or self.law.title,
            values=values,
            parameters={n: Estimate(values[n], e) for n, e in zip(free, errors)},
            covariance=full,
            touch=Estimate(touch, math.sqrt(covariance[-1, -1])) if data.curve else None,
            predicted=self.scalars(values),
            residuals=residuals,
            sigma=self.sigma,
            model_errors=self.sigma * np.sqrt(model_variance),
            estimated=self.estimated,
            aic=self.aic(residuals, len(jacobian)),
            others=[self.values(x) for x in places[1:]],
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

    def jacobian(self, values: dict[str, float], touch: float, names: list[str]) -> np.ndarray:
        """Derivatives of the residuals: a row for each parameter, and one for touch."""
        inner = gradient(lambda at: self.residuals(at, touch), values, names)
        jacobian = inner = inner.reshape(len(names), -1)
        # The force rises steeply or jumps at touch. So the derivative is a difference over two
        # standard errors of touch, to the side on which no row comes near that rise.
        here, step = self.residuals(values, touch), 0.05 * _CLOCK
        for _ in range(4 if self.data.curve else 0):
            slopes = [(self.residuals(values, touch + s) - here) / s for s in (step, -step)]
            jacobian = np.vstack([inner, min(slopes, key=lambda one: float(one @ one))])
            variance = _covariance(jacobian)[-1, -1]
            step = min(2.0 * math.sqrt(variance), step) if variance > 0.0 else step
        return jacobian

    def aic(self, residuals: np.ndarray, fitted: int) -> float:
        """−2 ln(likelihood) + 2 · fitted parameters, but for a constant of the data.

        A σ that is estimated counts as a parameter, with its likeliest value.
        """
        total = 2.0 * (fitted + len(self.estimated))
        for name, rows in self.data.groups.items():
            square, n = float(np.sum(residuals[rows] ** 2)), rows.stop - rows.start
            if name in self.estimated:
                square = n * math.log(square * self.sigma[rows.start] ** 2 / n)
            total += square
        return total


def _covariance(jacobian: np.ndarray) -> np.ndarray:
    """(J Jᵀ)⁻¹; NaN if J's rank is deficient."""
    scale = np.linalg.norm(jacobian, axis=1)
    normal = (jacobian / scale[:, None]) @ (jacobian / scale[:, None]).T
    if normal.size and not (np.isfinite(normal).all() and np.linalg.cond(normal) < 1e14):
        return np.full(normal.shape, math.nan)
    return np.linalg.inv(normal) / np.outer(scale, scale)
