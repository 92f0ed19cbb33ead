"""The parameters of a contact law by weighted least squares. Needs SciPy."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from golf_impact.arrays.impacts import DEFAULTS
from golf_impact.calibration.measurements import RESTITUTION, TARGETS, Measurements, number
from golf_impact.calibration.model import LINE, Model
from golf_impact.errors import UserError
from golf_impact.quantities import LAWS_IN_WORDS
from golf_impact.report.uncertainty import RANGES

#: Damping ratios and exponents of the starts.
_ZETAS, _EXPONENTS = [1e-3, 0.02, 0.1, 0.3, 0.8, 3.0, 30.0], [1.05, 1.5, 2.2, 4.0]

#: The unit of the coordinate of touch, s; the largest residual, also where no contact ends, in σ;
#: parameters are rounded to this fraction of their standard error.
_CLOCK, _FAR, _ROUNDING = 1e-4, 1e9, 1e-3

#: Rows of a curve with which a search begins.
_FEW = 600


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
            raise UserError(f"law = {law} is refused: {LAWS_IN_WORDS}", "law", law, LAWS_IN_WORDS)
        n = None if exponent == "free" else number(exponent, "exponent")
        if law == 1 and n != 1.0:
            why = "law = 1 (absolute) is linear: leave the exponent out, or take law 2"
            raise UserError(f"exponent = {exponent} is refused: {why}", "exponent", exponent, why)
        return cls(law, n, number(reference_compression, "reference_compression"))

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


class Fit:
    """The parameters of a law that meet measurements best, rounded.

    They are found by weighted least squares from several starts. A σ that isn't given is estimated
    from the residuals, for each series separately.

    Attributes:
        values: the FMU's inputs and parameters of this impact, SI units.
        parameters: those of them that were fitted.
        covariance: of the parameters, (p, p); 0 for one at its limit.
        touches: instants by the curves' clocks, s.
        rms: residuals of each series, root mean square in its unit.
        is_exact: whether residuals are rounding, of which a comparison of laws would be one.
        predicted: scalar targets as the physics gives them.
        residuals: (model − measured)/σ of all measured values, (n,).
        sigma: standard deviations of the measured values, (n,).
        estimated: the groups of measurements whose σ follows from the residuals.
        degrees_of_freedom: measured values less fitted parameters, the instant of touch among them.
        probability: of a larger χ² if law and σ are right; None if χ² has no meaning.
        aic: Akaike's criterion, −2 ln(likelihood) + 2 · fitted parameters, but for a constant.
        coverage: half the width of a 95 % interval in standard errors: Student's t or normal.

    Raises:
        UserError: the measurements don't determine the law's parameters, or no contact that ends
            comes near them.
    """

    def __init__(
        self,
        data: Measurements,
        law: ContactLaw,
        apart: bool = False,
        tick: Callable[[], object] = lambda: None,
    ) -> None:
        from scipy.special import chdtrc, stdtrit

        _check_number(law, data)
        problem = _Problem(data, law, apart, tick)
        self.law, self.sigma, self.estimated = law, problem.sigma, problem.estimated
        with np.errstate(all="ignore"):
            result = problem.minimum()
            for _ in range(3 if self.estimated else 0):
                problem.estimate_sigma(result)
                if len(data.groups) == 1:
                    break  # the minimum doesn't depend on the only σ
                result = problem.solve(result.x)
            values = problem.values(result.x)
            jacobian = problem.parameter_slopes(values)
            jacobian[:, result.active_mask != 0] = 0.0  # fixed, at a limit
            lengths = np.linalg.norm(jacobian, axis=0)
            for name, length in zip(problem.free, lengths.tolist()):
                if name not in problem.touches and length > 0.0:
                    values[name] = round(values[name], math.ceil(math.log10(length / _ROUNDING)))
            values = {n: v if n == "law" else float(v) for n, v in values.items()}
            self.residuals = problem.residuals(values)
            # Scaled, so that rounding doesn't matter.
            scale = np.where(lengths > 0.0, lengths, 1.0)
            root = np.linalg.pinv(np.linalg.qr(jacobian / scale)[1]) / scale[:, None]
            covariance = root @ root.T
            for name, curve in data.curves.items():
                rows = data.groups[name]
                by_offset = covariance @ (jacobian[rows].T @ (1.0 / self.sigma[rows]))
                covariance = covariance + curve.offset_error**2 * np.outer(by_offset, by_offset)
        errors = [math.sqrt(variance) or None for variance in covariance.diagonal()]
        self.parameters = {n: Estimate(values[n], error) for n, error in zip(problem.free, errors)}
        self.touches = {
            group: self.parameters.pop(name) for group, name in zip(data.curves, problem.touches)
        }
        ball = {name: value for name, value in values.items() if name in DEFAULTS}
        self.values = {**ball, **data.impact}
        self.covariance = covariance[: len(self.parameters), : len(self.parameters)]
        names = [name for name in TARGETS if data.sized or name in RESTITUTION]
        self.predicted = dict(zip(names, problem.model.scalars(names, self.values, False)))
        self.title = law.title + " with COR line" * bool(data.cor_speeds)
        of_series = {name: self.residuals[data.groups[name]] for name in data.series}
        self.rms = {
            name: math.sqrt(np.mean((residuals * self.sigma[data.groups[name]]) ** 2))
            for name, residuals in of_series.items()
        }
        within = [self.rms[name] < 1e-6 * np.abs(one.y).max() for name, one in data.series.items()]
        scalars = self.residuals[: len(data.targets)]
        self.is_exact = all(within) and bool(np.all(np.abs(scalars) < 0.01))
        self.chi_squared = square = float(self.residuals @ self.residuals)
        self.degrees_of_freedom = freedom = len(self.residuals) - len(problem.free)
        tested = freedom > 0 and not self.estimated
        self.probability = float(chdtrc(freedom, square)) if tested else None
        self.aic = square + 2.0 * float(np.sum(np.log(self.sigma))) + 2.0 * len(problem.free)
        self.coverage = float(stdtrit(max(1, freedom) if self.estimated else 1e9, 0.975))

    def as_json(self) -> dict[str, Any]:
        """The part of calibrate.json that every fit has."""
        names = ("predicted", "chi_squared", "degrees_of_freedom", "probability", "aic", "rms")
        return {
            "title": self.title,
            "law": self.law.law,
            "exponent": self.values.get("exponent"),
            "parameters": {name: one._asdict() for name, one in self.parameters.items()},
            "covariance": self.covariance.tolist(),
            **{name: getattr(self, name) for name in names},
        }


def _check_number(law: ContactLaw, data: Measurements) -> None:
    """Raise UserError if these measurements can't determine the law's free parameters."""
    line, speeds = bool(data.cor_speeds), sum(name in RESTITUTION for name in data.targets)
    have, need = len(data.targets) - speeds + (line or speeds > 0), 2 + (law.exponent is None)
    if law.law == 1 and line:
        raise UserError("cor_speeds are refused with law = 1: its damping has no COR line")
    if have < need and not (data.curves or (line and need == 2 and not data.sized)):
        raise UserError(
            f"{law.title} can't be fitted: too few targets, {have} where {need} are needed (ball "
            "speed, club speed after and COR count once); give --curve FILE.csv, --cor-speeds "
            "FILE.csv or more of them, e.g. --cor 0.743 --contact-time 600e-6"
        )


class _Problem:
    """One law and the measurements that it has to meet.

    The coordinates of a fit are its free parameters as they suit least squares: of k the logarithm
    (dependences on k and n are nearly linear in it), of b the damping ratio ζ = b/√(2 (n + 1) k μ)
    (speeds depend on it alone), of touch the time since the first row of its curve in `_CLOCK`.
    """

    def __init__(
        self, data: Measurements, law: ContactLaw, apart: bool, tick: Callable[[], object]
    ) -> None:
        self.model, self.data, self.law, self.apart, self.tick = Model(data), data, law, apart, tick
        fitted = {*LINE} if data.cor_speeds else {"b"}
        if data.sized:
            fitted |= {"k"} if law.exponent else {"k", "exponent"}
        #: Instants of touch, and their curves.
        self.touches = {f"touch{n.removeprefix('curve')}": c for n, c in data.curves.items()}
        stiffnesses = [name.replace("touch", "k") for name in self.touches][1:] if apart else []
        #: The names of what is fitted: the FMU's, stiffnesses of other curves, and touches.
        self.free = [*(name for name in RANGES if name in fitted), *stiffnesses, *self.touches]
        ends = dict.fromkeys(("k", *stiffnesses, *self.touches), (-math.inf, math.inf))
        self.bounds = np.array([(RANGES | ends)[name] for name in self.free]).T
        self.of_law: dict[str, Any] = {"law": law.law}
        if data.sized:
            self.of_law["exponent"] = law.exponent
            self.of_law["reference_compression"] = law.reference_compression
        self.estimated = tuple(name for name, one in data.series.items() if one.sigma is None)
        sigma = [np.array([target.sigma for target in data.targets.values()])]
        for one in data.series.values():
            guess = np.full(len(one.y), 0.01 * one.y.max())
            sigma.append(guess if one.sigma is None else one.sigma)
        self.sigma = np.concatenate(sigma)

    def values(self, x: np.ndarray) -> dict[str, Any]:
        """Parameters at these coordinates by name, and the law's others (SI units)."""
        values = self.named(x)
        if self.data.sized:
            k, n = np.exp(values["k"]), values.get("exponent", self.law.exponent or 1.0)
            if "b" in values:
                values["b"] *= np.sqrt(2.0 * (n + 1.0) * k * self.data.reduced_mass)
            values |= {"k": k, "exponent": n}
            values |= {name: np.exp(values[name]) for name in self.free if name.startswith("k ")}
        for name, curve in self.touches.items():
            values[name] = curve.x[0] + _CLOCK * values[name]
        return {**self.of_law, **values}

    def named(self, x: np.ndarray) -> dict[str, Any]:
        """Coordinates by name, complex ones only where they have a step."""
        return {n: v if v.imag else v.real for n, v in zip(self.free, x.tolist())}

    def residuals(self, values: Mapping[str, Any]) -> np.ndarray:
        """(model − measured)/σ; large where there is no contact that ends."""
        try:
            residuals = (self.model(values) - self.data.values) / self.sigma
        except UserError:
            # Far from any ball values may leave the FMU's range; the search has to turn back.
            return np.full(len(self.sigma), _FAR)
        return residuals if np.all(np.abs(residuals) < _FAR) else np.full(len(self.sigma), _FAR)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Derivatives (n, p) of the residuals by the coordinates."""
        try:
            return self.model.slopes(self.values, x, self.bounds) / self.sigma[:, None]
        except UserError:
            return np.zeros((len(self.sigma), len(x)))

    def parameter_slopes(self, values: Mapping[str, Any]) -> np.ndarray:
        """Derivatives (n, p) of the residuals by the parameters (SI units)."""
        given = np.array([values[name] for name in self.free])
        slopes = self.model.slopes(lambda p: {**values, **self.named(p)}, given, self.bounds)
        slopes /= self.sigma[:, None]
        for (name, curve), group in zip(self.touches.items(), self.data.curves):
            # The force jumps or rises steeply at touch: rows there don't determine its instant.
            near = np.abs(curve.x - values[name]) <= 0.75 * curve.spacing
            slopes[self.data.groups[group], self.free.index(name)][near] = 0.0
        return slopes

    def solve(self, start: np.ndarray, tolerance: float | None = None) -> Any:
        """SciPy's result from one start."""
        from scipy.optimize import least_squares

        if tolerance is None:
            # Of χ²; with many rows it is about their number, and 1e-3 a thirtieth of a σ.
            rows = len(self.sigma)
            tolerance = 1e-10 if rows <= _FEW else max(1e-10, 1e-3 / rows)

        self.tick()
        return least_squares(
            lambda x: self.residuals(self.values(x)),
            np.clip(start, *self.bounds),
            jac=self.jacobian,
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
        duration, impact, shares = 5e-4, self.data.impact, [0.0]
        d = self.law.reference_compression
        for curve in [*self.data.curves.values()][:1]:
            duration, impact = 1.2 * float(np.ptp(curve.x[curve.contact])), curve.impact
            shares = [0.0, 0.1]
        starts, zetas = [], [0.1] if self.data.series else _ZETAS
        exponents = _EXPONENTS if "exponent" in self.free else [self.law.exponent or 1.0]
        for zeta, n, share in itertools.product(zetas, exponents, shares):
            # With ω = π/duration and the compression L = m v/ω: √(m k/μ) = ω (d_r/L)^(m − 1).
            m, omega = 0.5 * (n + 1.0), math.pi / duration
            power = (n - 1.0) * math.log(d * omega / (m * impact["club_speed"]))
            k = math.log(self.data.reduced_mass * omega**2 / m) + power
            at = dict.fromkeys(self.free, k)
            at |= dict(zip(("b", "exponent", *LINE), (zeta, n, 0.8, 0.002)))
            for name, curve in self.touches.items():
                first = curve.x[curve.contact[0]] - curve.x[0]
                at[name] = (first - share * duration) / _CLOCK
            starts.append(np.array([at[name] for name in self.free]))
        return starts

    def minimum(self, tolerance: float | None = None) -> Any:
        """SciPy's result of the best minimum; of several that are as good, the least damped one."""
        starts = self.starts()
        if thin := self.thinned():
            x = thin.minimum(1e-5).x
            for name, curve in self.touches.items():
                x[self.free.index(name)] += (thin.touches[name].x[0] - curve.x[0]) / _CLOCK
            starts = [self.shifted(x)]
        elif self.touches:
            starts = sorted(starts, key=self.cost)[:3]
            best = min((self.solve(x, 1e-2) for x in starts), key=attrgetter("cost"))
            for _ in range(2):
                best = self.solve(self.shifted(best.x), 1e-6)
            starts = [self.shifted(best.x)]
        results = [self.solve(x, tolerance) for x in starts]
        least = min(result.cost for result in results)
        if least >= _FAR:
            raise UserError(f"{self.law.title}: no contact that ends comes near these measurements")
        equal = (one for one in results if one.cost - least <= 5e-7 * (1.0 + least))
        return min(equal, key=lambda one: tuple(np.round(one.x[1:], 6)))

    def thinned(self) -> _Problem | None:
        """The same of free heads, with every eighth row of long curves around contact, or fewer."""
        data, free_head = self.data, {"club_force": 0.0}
        curves = [
            replace(one.around_contact(_FEW), impact={**one.impact, **free_head})
            for one in data.curves.values()
        ]
        thin = Measurements(data.targets, curves, data.cor_speeds, {**data.impact, **free_head})
        if thin.impact == data.impact and all(
            len(one.x) == len(other.x) and one.impact == other.impact
            for one, other in zip(curves, data.curves.values())
        ):
            return None
        return _Problem(thin, self.law, self.apart, self.tick)

    def cost(self, x: np.ndarray) -> float:
        return float(np.sum(self.residuals(self.values(x)) ** 2))

    def shifted(self, x: np.ndarray) -> np.ndarray:
        """These coordinates, or better ones with touches some rows away.

        Law 2's force jumps or rises steeply at touch: χ² has a minimum between any two rows.
        """
        jacobian, least = self.jacobian(x), self.cost(x)
        normal = jacobian.T @ jacobian
        for name, curve in self.touches.items():
            # The others follow, as they would in a fit.
            one = np.arange(len(x)) == self.free.index(name)
            along = one.astype(float)
            along[~one] = -np.linalg.lstsq(normal[~one][:, ~one], normal[~one][:, one])[0].ravel()
            for rows, sign in itertools.product((8, 4, 2, 1), (1, -1)):
                shift = sign * rows * curve.spacing / _CLOCK * along
                moved = np.clip(x + shift, *self.bounds)
                if (found := self.cost(moved)) < least:
                    x, least = moved, found
        return x

    def estimate_sigma(self, result: Any) -> None:
        """σ of the series without: residuals over rows less the parameters that they determine."""
        leverage = np.sum(np.linalg.qr(result.jac)[0] ** 2, axis=1)
        for name in self.estimated:
            rows = self.data.groups[name]
            freedom = max(rows.stop - rows.start - float(leverage[rows].sum()), 1.0)
            # Data computed without noise leave residuals of rounding only.
            least = 1e-9 * float(np.abs(self.data.values[rows]).max()) / self.sigma[rows.start]
            self.sigma[rows] *= max(math.sqrt(np.sum(result.fun[rows] ** 2) / freedom), least)
