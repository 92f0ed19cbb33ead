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
from golf_impact.facts.quantities import LAWS_IN_WORDS
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.fmu.uncertainty import RANGES, gradient

#: The parameters of COR = first − second · approach speed; they replace b.
LINE = ("restitution_at_rest", "restitution_slope")

#: Damping ratios and exponents of the starts.
_ZETAS, _EXPONENTS = (1e-3, 0.02, 0.1, 0.3, 0.8, 3.0, 30.0), (1.05, 1.5, 2.2, 4.0)

#: Starts are refined on about this many rows of a curve.
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
        if law not in (1, 2):
            raise UserError(f"--law {law} is refused: {LAWS_IN_WORDS}")
        number(reference_compression, "reference_compression")
        n = None if exponent == "free" else number(exponent, "exponent")
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
    def title(self) -> str:
        return self.law.title + " with COR line" * (LINE[0] in self.parameters)

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


def fit(fmu: ImpactFmu, data: Measurements, law: ContactLaw) -> Fit:
    """The parameters of a law that meet these measurements best.

    Weighted least squares (SciPy's dogbox method) from several starts. A σ that isn't given is
    estimated from the residuals, for each series separately.

    Raises:
        UserError: the measurements don't determine the law's parameters, or no contact that ends
            comes near them.
    """
    _check_number(law, data)
    with np.errstate(all="ignore"):
        return _Problem(fmu, data, law).fit()


def _check_number(law: ContactLaw, data: Measurements) -> None:
    """Raise UserError if these measurements can't determine the law's free parameters."""
    line = data.cor_speeds is not None
    if law.law == 1 and line:
        why = "its damping has no COR line (--cor-speeds): take --law 2"
        raise UserError(f"{law.title} can't be fitted: {why}")
    speeds = sum(name in RESTITUTION for name in data.targets)
    sizes = len(data.targets) - speeds
    have, free = sizes + (line or speeds > 0), ("k", "b", "exponent")[: 2 + (law.exponent is None)]
    only_line = line and not sizes and law.exponent is not None
    if data.curve is None and not only_line and have < len(free):
        raise UserError(
            f"{law.title} can't be fitted: too few targets: {', '.join(free)} need {len(free)} "
            f"independent ones, these are {have} (ball speed, club speed after and COR depend on "
            "the damping only: they count once)"
        )


class _Problem:
    """One law and the measurements that it has to meet.

    The coordinates of a fit are its free parameters, in this order and as they suit least squares:

    - k: its logarithm, in which dependences on k and n are nearly linear,
    - b: the damping ratio ζ = b/√(2 (n + 1) k μ), on which alone speeds depend; or the two
      parameters of a COR line,
    - exponent: n, if free,
    - touch: the instant of touch since the first row of the curve, if there is one, in `_CLOCK`.
    """

    def __init__(self, fmu: ImpactFmu, data: Measurements, law: ContactLaw) -> None:
        self.fmu, self.data, self.law = fmu, data, law
        fixed = set() if data.sized else {"k", "exponent"}
        fixed |= {"b"} if data.cor_speeds else set(LINE)
        fixed |= {"exponent"} if law.exponent is not None else set()
        #: The FMU's names of what is fitted.
        self.free = [name for name in RANGES if name not in fixed]
        unbounded = (-math.inf, math.inf)
        ranges = [unbounded if name == "k" else RANGES[name][:2] for name in self.free]
        self.bounds = np.array([*ranges, *[unbounded] * (data.curve is not None)]).T
        self.estimated = tuple(name for name, one in data.series.items() if one.sigma is None)
        sigma = [np.array([target.sigma for target in data.targets.values()])]
        for name, one in data.series.items():
            guess = 0.01 if name == "cor_speeds" else max(noise(one.y), 1e-3 * one.y.max())
            sigma.append(np.full(len(one.y), guess) if one.sigma is None else one.sigma)
        self.sigma = np.concatenate(sigma)

    # The model

    def values(self, x: np.ndarray) -> dict[str, float]:
        """Inputs and parameters of the FMU at these coordinates, by name (SI units)."""
        values: dict[str, float] = {"law": self.law.law, **dict(zip(self.free, x.tolist()))}
        if self.data.sized:
            k, n = float(np.exp(values["k"])), values.get("exponent", self.law.exponent or 1.0)
            if "b" in values:
                values["b"] *= math.sqrt(2.0 * (n + 1.0) * k * self.data.conditions.reduced_mass)
            d = self.law.reference_compression
            values |= {"k": k, "exponent": n, "reference_compression": d}
        return values | vars(self.data.conditions)

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
            if math.isnan(scalars["cor"]):
                return far
            parts: list[Any] = [[scalars[name] for name in data.targets]]
            if data.curve is not None:
                instants = data.curve.x - touch
                inside = (instants > 0.0) & (instants < scalars["contact_time"])
                self.fmu.start(**values)
                times = np.concatenate([[0.0], instants[inside]])
                force = np.zeros(len(instants))
                force[inside] = self.fmu.sample(times, ("force",))["force"][1:]
                parts.append(force)
            if data.cor_speeds is not None:
                cases = ({**values, "club_speed": v} for v in data.cor_speeds.x.tolist())
                parts.append([self.fmu.impact((cor,), **case)[cor] for case in cases])
        except UserError:
            # Far from any ball values may leave the FMU's range; the search has to turn back.
            return far
        residuals = (np.concatenate(parts) - data.values) / self.sigma
        return residuals if np.all(np.abs(residuals) < _FAR) else far

    # Least squares

    def solve(self, start: np.ndarray, tolerance: float = 1e-10) -> Any:
        """SciPy's result from one start."""
        from scipy.optimize import least_squares

        return least_squares(
            lambda x: self.residuals(self.values(x), self.touch(x)),
            np.clip(start, *self.bounds),
            diff_step=1e-6,  # far above the FMU's rounding
            method="dogbox",  # of SciPy's methods the one that ends exactly at a limit
            bounds=self.bounds,
            x_scale="jac",
            xtol=tolerance,
            ftol=tolerance,
            gtol=tolerance,
            max_nfev=100,
        )

    def starts(self) -> list[np.ndarray]:
        """A grid of ζ and n, each with the k and touch of an undamped contact as long."""
        impact, curve, line = self.data.conditions, self.data.curve, self.data.cor_speeds
        momentum = impact.reduced_mass * impact.club_speed
        omega, at, zetas, touches = math.pi / 5e-4, dict[str, float](), _ZETAS, [0.0]
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
            zetas = (-math.log(cor) / math.pi,)
        if line is not None:
            weights, zetas = 1.0 / self.sigma[self.data.groups["cor_speeds"]], (0.1,)
            slope, rest = np.polyfit(line.x, line.y, 1, w=weights)
            at |= {LINE[0]: rest, LINE[1]: -slope}
        starts, d = [], self.law.reference_compression
        exponents = _EXPONENTS if "exponent" in self.free else (self.law.exponent or 1.0,)
        for zeta, n, touch in itertools.product(zetas, exponents, touches):
            m = 0.5 * (n + 1.0)
            # ω (d_r/L)^(n − 1) = √(m k/μ) with the compression L = m v/ω.
            length = m * impact.club_speed / omega
            k = math.log(impact.reduced_mass * omega**2 / m) + (n - 1.0) * math.log(d / length)
            at |= {"k": k, "b": zeta, "exponent": n, "touch": touch}
            names = [*self.free, *["touch"] * (curve is not None)]
            starts.append(np.array([at[name] for name in names]))
        return starts

    def minima(self) -> list[Any]:
        """SciPy's results: the best, and without a curve those as good, the least damped first."""
        curve, starts = self.data.curve, self.starts()
        if curve is not None:
            step = max(1, len(curve.y) // _ROWS)
            sigma = None if curve.sigma is None else curve.sigma[::step]
            few = replace(curve, x=curve.x[::step], y=curve.y[::step], sigma=sigma)
            series = {**self.data.series, "curve": few}
            coarse = _Problem(self.fmu, replace(self.data, series=series), self.law)
            best = min((coarse.solve(x, 1e-3) for x in starts), key=_cost)
            best = self.solve(best.x, 1e-4)
            # Law 2's force jumps or rises steeply at touch, so that χ² has a minimum between any
            # two rows: the best of the neighbouring ones.
            row = np.eye(len(best.x))[-1] * np.median(np.diff(curve.x)) / _CLOCK
            for rows in (4, 2, 1, 1):
                near = [self.solve(best.x + shift * row, 1e-4) for shift in (rows, -rows)]
                best = min(best, *near, key=_cost)
            starts = [best.x]
        results = [self.solve(x) for x in starts]
        best = min(results, key=_cost)
        if best.cost >= _FAR:
            raise UserError(f"{self.law.title}: no contact that ends comes near these measurements")
        equal = [one for one in results if one.cost - best.cost <= 5e-7 * (1.0 + best.cost)]
        minima: list[Any] = []
        for one in sorted(equal, key=lambda one: tuple(np.round(one.x[1:], 6))):
            if not any(np.allclose(one.x, other.x, 0.0, 1e-4) for other in minima):
                minima.append(one)
        return minima

    def fit(self) -> Fit:
        """The best minimum, rounded, with its covariance."""
        data, free = self.data, self.free
        result, *others = self.minima()
        for _ in range(10):
            before = self.sigma.copy()
            self.estimate_sigma(result)
            if len(data.groups) == 1 or np.allclose(before, self.sigma, 0.01):
                break
            result = self.solve(result.x)
        values, touch = self.values(result.x), self.touch(result.x)
        at = [n for n in range(len(free)) if not result.active_mask[n]]
        varied = [free[n] for n in at]
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
        full = np.full((len(free), len(free)), math.nan)
        full[np.ix_(at, at)] = covariance[: len(at), : len(at)]
        errors = [error if error == error else None for error in np.sqrt(np.diag(full)).tolist()]
        model_variance = np.einsum("in,ij,jn->n", jacobian, covariance, jacobian)
        return Fit(
            law=self.law,
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
            others=[self.values(one.x) for one in others],
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


def _cost(result: Any) -> float:
    return float(result.cost)


def _covariance(jacobian: np.ndarray) -> np.ndarray:
    """(J Jᵀ)⁻¹; NaN if J's rank is deficient."""
    scale = np.linalg.norm(jacobian, axis=1)
    normal = (jacobian / scale[:, None]) @ (jacobian / scale[:, None]).T
    if normal.size and not (np.isfinite(normal).all() and np.linalg.cond(normal) < 1e14):
        return np.full(normal.shape, math.nan)
    return np.linalg.inv(normal) / np.outer(scale, scale)
