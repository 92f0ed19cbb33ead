"""The parameters of a contact law by weighted least squares through the FMU. Needs SciPy."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from golf_impact.calibration.measurements import RESTITUTION, TARGETS, Measurements, number
from golf_impact.errors import UserError
from golf_impact.facts.quantities import LAWS_IN_WORDS
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.fmu.uncertainty import RANGES, gradient

#: The parameters of COR = first − second · approach speed; they replace b.
LINE = ("restitution_at_rest", "restitution_slope")

#: Damping ratios and exponents of the starts.
_ZETAS, _EXPONENTS = [1e-3, 0.02, 0.1, 0.3, 0.8, 3.0, 30.0], [1.05, 1.5, 2.2, 4.0]

#: The unit of the coordinate of touch, s; the largest residual, also where no contact ends, in σ;
#: parameters are rounded to this fraction of their standard error.
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
    """A fitted value in SI units; the standard error is None if it is at its limit."""

    value: float
    standard_error: float | None


@dataclass
class Fit:
    """The best parameters of one law; arrays over all measured values have the shape (n,)."""

    law: ContactLaw
    values: dict[str, float]  #: the FMU's inputs and parameters of this impact, SI units
    parameters: dict[str, Estimate]  #: those of them that were fitted
    covariance: np.ndarray  #: of the parameters, (p, p); 0 for one at its limit
    touch: Estimate | None  #: the instant by the curve's clock, s
    predicted: dict[str, float]  #: scalar targets as the FMU gives them
    residuals: np.ndarray  #: (model − measured)/σ
    sigma: np.ndarray  #: standard deviations of the measured values
    estimated: tuple[str, ...]  #: groups of measurements whose σ follows from the residuals

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
    def aic(self) -> float:
        """Akaike's criterion, −2 ln(likelihood) + 2 · fitted parameters, but for a constant."""
        fitted = len(self.residuals) - self.degrees_of_freedom
        return self.chi_squared + 2.0 * float(np.sum(np.log(self.sigma))) + 2.0 * fitted

    @property
    def coverage(self) -> float:
        """Half the width of a 95 % interval in standard errors: Student's t or normal."""
        from scipy.special import stdtrit

        return float(stdtrit(max(1, self.degrees_of_freedom) if self.estimated else 1e9, 0.975))

    def as_json(self) -> dict[str, Any]:
        """The part of calibrate.json that every fit has."""
        names = ("predicted", "chi_squared", "degrees_of_freedom", "probability", "aic")
        return {
            "title": self.title,
            "law": self.law.law,
            "exponent": self.values.get("exponent"),
            "parameters": {name: one._asdict() for name, one in self.parameters.items()},
            "covariance": self.covariance.tolist(),
            **{name: getattr(self, name) for name in names},
        }


def fit(fmu: ImpactFmu, data: Measurements, law: ContactLaw) -> Fit:
    """The parameters of a law that meet these measurements best, rounded.

    Weighted least squares (SciPy's dogbox method) from several starts. A σ that isn't given is
    estimated from the residuals, for each series separately.

    Raises:
        UserError: the measurements don't determine the law's parameters, or no contact that ends
            comes near them.
    """
    _check_number(law, data)
    problem = _Problem(fmu, data, law)
    with np.errstate(all="ignore"):
        result = problem.minimum()
        for _ in range(3 if problem.estimated else 0):
            problem.estimate_sigma(result)
            result = problem.solve(result.x)
        values, free = problem.values(result.x), problem.free
        at = np.flatnonzero(result.active_mask == 0)
        jacobian = problem.jacobian(values, [free[n] for n in at])
        for n, slope in zip(at[: len(at) - bool(data.curve)], jacobian):
            unit = _ROUNDING / max(float(np.linalg.norm(slope)), 1e-300)
            values[free[n]] = round(values[free[n]], -math.floor(math.log10(unit)))
        residuals = problem.residuals(values)
        # Scaled, so that rounding doesn't matter; 0 for parameters at a limit.
        scale = np.linalg.norm(jacobian, axis=1, keepdims=True)
        normal = (jacobian / scale) @ (jacobian / scale).T
        covariance = np.zeros((len(free), len(free)))
        covariance[np.ix_(at, at)] = np.linalg.pinv(normal) / (scale * scale.T)
    errors = [math.sqrt(variance) or None for variance in covariance.diagonal()]
    parameters = {n: Estimate(values[n], error) for n, error in zip(free, errors)}
    touch, p = parameters.pop("touch", None), len(parameters)
    values.pop("touch", None)
    return Fit(
        law=law,
        values=values,
        parameters=parameters,
        covariance=covariance[:p, :p],
        touch=touch,
        predicted=problem.scalars(values),
        residuals=residuals,
        sigma=problem.sigma,
        estimated=problem.estimated,
    )


def _check_number(law: ContactLaw, data: Measurements) -> None:
    """Raise UserError if these measurements can't determine the law's free parameters."""
    line, speeds = bool(data.cor_speeds), sum(name in RESTITUTION for name in data.targets)
    have, need = len(data.targets) - speeds + (line or speeds > 0), 2 + (law.exponent is None)
    if law.law == 1 and line:
        raise UserError("--cor-speeds is refused with --law 1: its damping has no COR line")
    if have < need and not (data.curve or (line and need == 2 and not data.sized)):
        raise UserError(
            f"{law.title} can't be fitted: too few targets, {have} where {need} are needed (ball "
            "speed, club speed after and COR count once); give --curve FILE.csv, --cor-speeds "
            "FILE.csv or more of them, e.g. --cor 0.743 --contact-time 600e-6"
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
        exponent = ["exponent"] if law.exponent is None else []
        damping = LINE if data.cor_speeds else ("b",)
        fitted = (*damping, *exponent, "k") if data.sized else damping
        #: The names of what is fitted: the FMU's, and touch.
        self.free = [name for name in RANGES if name in fitted] + ["touch"] * bool(data.curve)
        ranges = {**RANGES, **dict.fromkeys(("k", "touch"), (-math.inf, math.inf))}
        self.bounds = np.array([ranges[name] for name in self.free]).T
        self.estimated = tuple(name for name, one in data.series.items() if one.sigma is None)
        sigma = [np.array([target.sigma for target in data.targets.values()])]
        for one in data.series.values():
            guess = np.full(len(one.y), 0.01 * one.y.max())
            sigma.append(guess if one.sigma is None else one.sigma)
        self.sigma = np.concatenate(sigma)

    # The model

    def values(self, x: np.ndarray) -> dict[str, float]:
        """Inputs and parameters of the FMU at these coordinates, by name, and touch (SI units)."""
        values: dict[str, float] = {"law": self.law.law, **dict(zip(self.free, x.tolist()))}
        if self.data.sized:
            k, n = float(np.exp(values["k"])), values.get("exponent", self.law.exponent or 1.0)
            if "b" in values:
                values["b"] *= math.sqrt(2.0 * (n + 1.0) * k * self.data.conditions.reduced_mass)
            d = self.law.reference_compression
            values |= {"k": k, "exponent": n, "reference_compression": d}
        if self.data.curve:
            values["touch"] = self.data.curve.x[0] + _CLOCK * values["touch"]
        return values | vars(self.data.conditions)

    def scalars(self, values: Mapping[str, float]) -> dict[str, float]:
        """Scalar targets by name; NaN if the bodies never separate. Times and forces need a k."""
        outputs = {n: TARGETS[n] for n in TARGETS if self.data.sized or n in RESTITUTION}
        given = self.fmu.impact(list(outputs.values()), **values)
        return {name: given[output] for name, output in outputs.items()}

    def residuals(self, values: Mapping[str, float]) -> np.ndarray:
        """(model − measured)/σ; large where there is no contact that ends."""
        data, far = self.data, np.full(len(self.sigma), _FAR)
        impact = {name: value for name, value in values.items() if name != "touch"}
        try:
            scalars = self.scalars(impact)
            if math.isnan(scalars["cor"]):
                return far
            parts: list[Any] = [[scalars[name] for name in data.targets]]
            if data.curve:
                instants = data.curve.x - values["touch"]
                inside = (instants > 0.0) & (instants < scalars["contact_time"])
                self.fmu.start(**impact)
                times = np.concatenate([[0.0], instants[inside]])
                parts.append(np.zeros(len(instants)))
                parts[-1][inside] = self.fmu.sample(times, ("force",))["force"][1:]
            if data.cor_speeds:
                cases = ({**impact, "club_speed": v} for v in data.cor_speeds.x.tolist())
                parts.append([self.scalars(case)["cor"] for case in cases])
        except UserError:
            # Far from any ball values may leave the FMU's range; the search has to turn back.
            return far
        residuals = (np.concatenate(parts) - data.values) / self.sigma
        return residuals if np.all(np.abs(residuals) < _FAR) else far

    def jacobian(self, values: Mapping[str, float], names: Sequence[str]) -> np.ndarray:
        """Derivatives of the residuals: a row for each of these parameters, (p, n)."""
        inner = gradient(self.residuals, values, [name for name in names if name != "touch"])
        if not self.data.curve:
            return inner
        # The force jumps or rises steeply at touch: a difference over a row, 0 for the rows there.
        instants = self.data.curve.x - values["touch"]
        half = 0.5 * float(np.median(np.diff(instants)))
        ends = (self.residuals({**values, "touch": values["touch"] + s}) for s in (-half, half))
        slope = np.subtract(*ends) / (-2.0 * half)
        slope[self.data.groups["curve"]][np.abs(instants) <= 1.5 * half] = 0.0
        return np.vstack([inner.reshape(-1, len(slope)), slope])

    # Least squares

    def solve(self, start: np.ndarray, tolerance: float = 1e-10) -> Any:
        """SciPy's result from one start."""
        from scipy.optimize import least_squares

        return least_squares(
            lambda x: self.residuals(self.values(x)),
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
        """A grid of ζ and n; k from an undamped contact as long as the curve's, or 0.5 ms."""
        impact, curve, d = self.data.conditions, self.data.curve, self.law.reference_compression
        duration, touches = 5e-4, [0.0]
        if curve:
            contact = curve.x[curve.contact]
            duration = 1.2 * float(np.ptp(contact))
            touches = [(contact[0] - s * duration - curve.x[0]) / _CLOCK for s in (0.0, 0.1)]
        starts, zetas = [], [0.1] if self.data.series else _ZETAS
        exponents = _EXPONENTS if "exponent" in self.free else [self.law.exponent or 1.0]
        for zeta, n, touch in itertools.product(zetas, exponents, touches):
            # With ω = π/duration and the compression L = m v/ω: √(m k/μ) = ω (d_r/L)^(m − 1).
            m, omega = 0.5 * (n + 1.0), math.pi / duration
            power = (n - 1.0) * math.log(d * omega / (m * impact.club_speed))
            k = math.log(impact.reduced_mass * omega**2 / m) + power
            at = {"k": k, "b": zeta, "exponent": n, LINE[0]: 0.8, LINE[1]: 0.002, "touch": touch}
            starts.append(np.array([at[name] for name in self.free]))
        return starts

    def minimum(self) -> Any:
        """SciPy's result of the best minimum; of several that are as good, the least damped one."""
        starts, curve = self.starts(), self.data.curve
        if curve:
            best = min((self.solve(x, 1e-2) for x in starts), key=attrgetter("cost"))
            # Law 2's force jumps or rises steeply at touch, so that χ² has a minimum between any
            # two rows: the best of the neighbouring ones.
            row = np.eye(len(best.x))[-1] * np.median(np.diff(curve.x)) / _CLOCK
            for rows in (4, 2, 1):
                near = [self.solve(best.x + shift * row, 1e-6) for shift in (rows, 0, -rows)]
                best = min(near, key=attrgetter("cost"))
            starts = [best.x]
        results = [self.solve(x) for x in starts]
        least = min(result.cost for result in results)
        if least >= _FAR:
            raise UserError(f"{self.law.title}: no contact that ends comes near these measurements")
        equal = (one for one in results if one.cost - least <= 5e-7 * (1.0 + least))
        return min(equal, key=lambda one: tuple(np.round(one.x[1:], 6)))

    def estimate_sigma(self, result: Any) -> None:
        """σ of the series without: residuals over rows less the parameters that they determine."""
        leverage = np.sum(np.linalg.qr(result.jac)[0] ** 2, axis=1)
        for name in self.estimated:
            rows = self.data.groups[name]
            freedom = max(rows.stop - rows.start - float(leverage[rows].sum()), 1.0)
            # Data computed without noise leave residuals of rounding only.
            least = 1e-9 * float(np.abs(self.data.values[rows]).max()) / self.sigma[rows.start]
            self.sigma[rows] *= max(math.sqrt(np.sum(result.fun[rows] ** 2) / freedom), least)
