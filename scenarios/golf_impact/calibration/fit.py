"""The parameters of a contact law by weighted least squares, through lmfit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from golf_impact.calibration.intervals import RANGES, step_of
from golf_impact.calibration.measurements import (
    IMPACT,
    LAW_PARAMETERS,
    RESTITUTION,
    TARGETS,
    Measurements,
    Series,
    number,
    reduced_mass,
)
from golf_impact.calibration.model import LINE, MICRO, PER_MS, Model, of_curve
from golf_impact.errors import UserError, missing_package
from golf_impact.quantities import LAWS_IN_WORDS

try:
    import lmfit
    from scipy.special import chdtrc, stdtrit
except ModuleNotFoundError:
    raise missing_package("calibrate", "lmfit", "calibrate") from None

#: Damping ratios and exponents of the starts.
_ZETAS, _EXPONENTS = (1e-3, 0.02, 0.1, 0.3, 0.8, 3.0, 30.0), (1.05, 1.5, 2.2, 4.0)

#: The largest residual, also where no contact ends, in σ; parameters are rounded to this fraction
#: of their standard error; the rise of χ² at the end of a one-sided 95 % interval.
_FAR, _ROUNDING, _ONE_SIDED = 1e9, 1e-3, 1.645**2

#: A lag-1 autocorrelation of residuals, times √rows, above which it isn't chance.
_CORRELATED = 4.0

#: Rows of a curve with which a search begins; by how many touch is moved.
_FEW, _ROWS = 600, tuple(2.0**n for n in range(3, -5, -1))


@dataclass(frozen=True)
class ContactLaw:
    """A law, and which of its parameters are given."""

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
    """A fitted value in SI units, with its 95 % interval."""

    value: float
    standard_error: float | None  #: None if it is at its limit
    interval: tuple[float, float]  #: one-sided if it is at its limit
    limit: float | None = None  #: the end of its range, if it is there

    def as_json(self) -> dict[str, Any]:
        """Without a limit, if it isn't at one."""
        return {name: v for name, v in self._asdict().items() if name != "limit" or v is not None}


class Fit:
    """The parameters of a law that meet measurements best, rounded.

    They are found by weighted least squares from several starts. A σ that isn't given is estimated
    from the residuals, for each series separately. A parameter that ends at its limit is held there
    while the others are fitted.

    Attributes:
        result: lmfit's `MinimizerResult`, not rounded: `params`, `covar`, `residual`, …; touch is
            in µs since a curve's origin, drift in N/ms.
        values: the FMU's inputs and parameters of this impact, SI units.
        parameters: those of them that were fitted, as `Estimate`.
        covariance: of the parameters, (p, p); 0 for one at its limit.
        curves: of each curve `touch`, the instant by its clock (s), and, as far as its sensor has
            them, `offset` (N) and `drift` (N/s).
        rms: residuals of each series, root mean square in its unit.
        is_exact: whether residuals are rounding, of which a comparison of laws would be one.
        predicted: scalar targets as the physics gives them.
        residuals: (model − measured)/σ of all measured values, (n,).
        sigma: standard deviations of the measured values, (n,).
        estimated: the groups of measurements whose σ follows from the residuals.
        row_correlations: lag-1 autocorrelations of residuals in contact, where they aren't chance;
            standard errors are enlarged for them as those of an AR(1) process, if σ is estimated.
        degrees_of_freedom: measured values less fitted parameters, the instant of touch among them.
        probability: of a larger χ² if law and σ are right; None if χ² has no meaning.
        deviance: −2 ln(likelihood), but for a constant.
        aic: Akaike's criterion, the deviance + 2 · fitted parameters.
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
        fixed: Mapping[str, float] | None = None,
        profile: bool = False,
    ) -> None:
        _check_number(law, data, fixed or {})
        problem = _Problem(data, law, apart, tick, fixed or {})
        self.law, self.sigma, self.estimated = law, problem.sigma, problem.estimated
        with np.errstate(all="ignore"):
            result = problem.minimum()
            for _ in range(3 if self.estimated else 0):
                problem.estimate_sigma(result)
                if len(data.series) == 1 and not data.targets and not data.priors:
                    break  # the minimum doesn't depend on the only σ
                result = problem.solve(result.params)
            self.row_correlations = problem.row_correlations(result)
            problem.sigma = problem.enlarged_sigma(self.row_correlations)
            params, ends = problem.held(result.params)
            self.minimizer = problem.minimizer(params, near=0.75)
            self.result = result = self.minimizer.least_squares()
        free = [*result.var_names, *ends]
        if result.covar is None or not np.all(result.covar.diagonal() > 0.0):
            raise UserError(f"{law.title}: these measurements don't determine {', '.join(free)}")
        params = problem.rounded(result)
        problem.sigma = self.sigma
        self.residuals = problem.residuals(params)
        self.chi_squared = square = float(self.residuals @ self.residuals)
        self.degrees_of_freedom = freedom = len(self.residuals) - len(free)
        tested = freedom > 0 and not self.estimated
        self.probability = chance_of(square, freedom) if tested else None
        self.deviance = square + 2.0 * float(np.sum(np.log(self.sigma)))
        self.aic = self.deviance + 2.0 * len(free)
        self.coverage = float(stdtrit(max(1, freedom) if self.estimated else 1e9, 0.975))
        values = problem.values(params)
        of_law = [name for name in problem.names if name in free]
        profiles = self._profiles(of_law) if profile else {}
        self.parameters = {}
        for name in of_law:
            value, error = values[name], result.params[name].stderr or None
            half = self.coverage * (error or 0.0)
            ends_of = ends.get(name) or profiles.get(name) or (value - half, value + half)
            limit = value if name in ends else None
            self.parameters[name] = Estimate(value, error, ends_of, limit)
        # The row of one at its limit is 0.
        at = [result.var_names.index(name) if name in result.var_names else -1 for name in of_law]
        self.covariance = np.pad(result.covar, (0, 1))[np.ix_(at, at)]
        self.values = problem.impact(values)
        self.curves = {name: self._of_curve(name, data.curves[name]) for name in data.curves}
        names = [name for name in TARGETS if data.sized or name in RESTITUTION]
        self.predicted = problem.model.scalars(names, values)
        self.title = law.title + " with COR line" * bool(data.cor_speeds)
        self.rms = {
            name: math.sqrt(np.mean((self.residuals[rows] * self.sigma[rows]) ** 2))
            for name, rows in data.groups.items()
            if name in data.series
        }
        exact = [self.rms[name] < 1e-6 * one.force.max() for name, one in data.series.items()]
        scalars = self.residuals[data.groups["targets"]]
        self.is_exact = all(exact) and bool(np.all(np.abs(scalars) < 0.01))

    def _of_curve(self, name: str, curve: Series) -> dict[str, Estimate]:
        """Instant of touch by the curve's clock (s), offset (N) at its origin and drift (N/s)."""
        units = {"touch": (MICRO, curve.origin), "offset": (1.0, 0.0), "drift": (PER_MS, 0.0)}
        found = {}
        for of, (unit, zero) in units.items():
            if one := self.result.params.get(of_curve(of, name)):
                value, error = zero + unit * one.value, unit * one.stderr
                half = self.coverage * error
                found[of] = Estimate(value, error, (value - half, value + half))
        return found

    def baseline(self, name: str, curve: Series) -> np.ndarray:
        """Offset and drift of a curve's sensor in its rows, N."""
        own = self.curves[name]
        offset, drift = (own[of].value if of in own else 0.0 for of in ("offset", "drift"))
        return offset + drift * (curve.x - curve.origin)

    def _profiles(self, names: Sequence[str]) -> dict[str, tuple[float, float]]:
        """95 % intervals where χ² rises as much, the other parameters being fitted again."""
        found = lmfit.conf_interval(
            self.minimizer,
            self.result,
            p_names=[name for name in names if name in self.result.var_names],
            sigmas=[0.95],
            prob_func=lambda best, other: 1.0 - chance_of(other.chisqr - best.chisqr, 1),
        )
        return {name: (rows[0][1], rows[-1][1]) for name, rows in found.items()}

    def fit_report(self) -> str:
        """lmfit's report on `result`."""
        return lmfit.fit_report(self.result)

    def as_json(self) -> dict[str, Any]:
        """The part of calibrate.json that every fit has."""
        names = ("predicted", "chi_squared", "degrees_of_freedom", "probability", "aic", "rms")
        return {
            "title": self.title,
            "law": self.law.law,
            "exponent": self.values.get("exponent"),
            "parameters": {name: one.as_json() for name, one in self.parameters.items()},
            "covariance": self.covariance.tolist(),
            "correlations": self.correlations.tolist(),
            **{name: getattr(self, name) for name in names},
        }

    @property
    def correlations(self) -> np.ndarray:
        """Of the parameters, (p, p); 0 for one at its limit."""
        errors = np.sqrt(self.covariance.diagonal())
        errors = np.where(errors > 0.0, errors, np.inf)
        return self.covariance / np.outer(errors, errors)


def _check_number(law: ContactLaw, data: Measurements, fixed: Mapping[str, float]) -> None:
    """Raise UserError if these measurements can't determine the law's free parameters."""
    line, speeds = bool(data.cor_speeds), sum(name in RESTITUTION for name in data.targets)
    names = {*LINE} if line else {"b"}
    names |= {"k", "exponent"} if data.sized else set()
    for name in (*fixed, *data.priors):
        if name in LAW_PARAMETERS and name not in names:
            raise UserError(f"{name} is refused: {', '.join(sorted(names))} are fitted here")
    if names <= {*fixed} | ({"exponent"} if law.exponent else set()) and not data.curves:
        raise UserError("nothing is left to be fitted: fix fewer parameters")
    if law.law == 1 and line:
        raise UserError("cor_speeds are refused with law = 1: its damping has no COR line")
    have = len(data.targets) - speeds + (line or speeds > 0)
    have += sum(name in LAW_PARAMETERS for name in data.priors)
    need = 2 + (law.exponent is None) - sum(name in fixed for name in ("k", "b"))
    if have < need and not (data.curves or (line and need == 2 and not data.sized)):
        raise UserError(
            f"{law.title} can't be fitted: too few targets, {have} where {need} are needed (ball "
            "speed, club speed after and COR count once); give --curve FILE.csv, --cor-speeds "
            "FILE.csv or more of them, e.g. --cor 0.743 --contact-time 600e-6"
        )


class _Minimizer(lmfit.Minimizer):
    """lmfit's, whose `conf_interval` uses the same method as the fit."""

    def leastsq(self, *arguments: Any, **options: Any) -> Any:
        return self.least_squares()


class _Problem:
    """One law and the measurements that it has to meet."""

    def __init__(
        self,
        data: Measurements,
        law: ContactLaw,
        apart: bool,
        tick: Callable[[], object],
        fixed: Mapping[str, float],
    ) -> None:
        self.model, self.data, self.law, self.apart, self.tick = Model(data), data, law, apart, tick
        self.fixed = fixed
        fitted = [*LINE] if data.cor_speeds else ["b"]
        fitted += ["k", "exponent"] if data.sized else []
        #: The names of what a law has, in order, besides stiffnesses of other curves.
        self.names = [name for name in LAW_PARAMETERS if name in fitted]
        self.names += [of_curve("k", name) for name in [*data.curves][1:] if apart]
        self.names += [name for name in IMPACT if name in data.priors]
        self.of_law: dict[str, Any] = {"law": law.law}
        if data.sized:
            self.of_law["reference_compression"] = law.reference_compression
        self.estimated = tuple(name for name, one in data.series.items() if one.sigma is None)
        sigma = [np.array([target.sigma for target in data.targets.values()])]
        for one in data.series.values():
            guess = np.full(len(one.y), 0.01 * one.force.max())
            sigma.append(guess if one.sigma is None else one.sigma)
        sigma.append(np.array([prior.sigma for prior in data.priors.values()]))
        self.sigma = np.concatenate(sigma)

    def values(self, params: lmfit.Parameters) -> dict[str, Any]:
        """Values of the model."""
        return {**self.of_law, **params.valuesdict()}

    def impact(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Inputs and parameters of the FMU."""
        of_law = {n: v for n, v in values.items() if n in (*self.of_law, *LAW_PARAMETERS)}
        return {**of_law, **self.data.impact, **{n: values[n] for n in IMPACT if n in values}}

    def residuals(self, params: lmfit.Parameters) -> np.ndarray:
        """(model − measured)/σ; large where there is no contact that ends."""
        try:
            residuals = (self.model(self.values(params)) - self.data.values) / self.sigma
        except UserError:
            # Far from any ball values may leave the FMU's range; the search has to turn back.
            return np.full(len(self.sigma), _FAR)
        return residuals if np.all(np.abs(residuals) < _FAR) else np.full(len(self.sigma), _FAR)

    def jacobian(self, params: lmfit.Parameters, near: float = 0.0) -> np.ndarray:
        """Derivatives (n, p) of the residuals over the varied parameters."""
        names = [one.name for one in params.values() if one.vary]
        try:
            slopes = self.model.slopes(self.values(params), names, near)
        except UserError:
            return np.zeros((len(self.sigma), len(names)))
        return slopes / self.sigma[:, None]

    def minimizer(
        self, params: lmfit.Parameters, tolerance: float | None = None, near: float = 0.0
    ) -> _Minimizer:
        if tolerance is None:
            # Of χ²; with many rows it is about their number, and 1e-3 a thirtieth of a σ.
            rows = len(self.sigma)
            tolerance = 1e-10 if rows <= _FEW else max(1e-10, 1e-3 / rows)
        found = _Minimizer(
            self.residuals,
            params,
            scale_covar=False,
            jac=lambda params: self.jacobian(params, near),
            method="dogbox",  # of SciPy's methods the one that ends exactly at a limit
            x_scale="jac",
            xtol=tolerance,
            ftol=tolerance,
            gtol=tolerance,
        )
        # SciPy's limit; lmfit's own would end without a covariance.
        found.kws["max_nfev"] = 100
        return found

    def solve(self, params: lmfit.Parameters, tolerance: float | None = None) -> Any:
        """lmfit's result from one start."""
        self.tick()
        return self.minimizer(params, tolerance).least_squares()

    def starts(self) -> list[lmfit.Parameters]:
        """A grid of ζ and n; k from an undamped contact as long as the curve's, or 0.5 ms."""
        data, law = self.data, self.law
        duration, impact, shares = 5e-4, data.impact, [0.0]
        d, reduced = law.reference_compression, reduced_mass(data.impact)
        for curve in [*data.curves.values()][:1]:
            duration, impact = 1.2 * float(np.ptp(curve.x[curve.contact])), curve.impact
            shares = [0.0, 0.1]
        starts, zetas = [], (0.1,) if data.series else _ZETAS
        exponents = (law.exponent,) if law.exponent else _EXPONENTS
        for zeta, n, share in itertools.product(zetas, exponents, shares):
            # With ω = π/duration and the compression L = m v/ω: √(m k/μ) = ω (d_r/L)^(m − 1).
            m, omega = 0.5 * (n + 1.0), math.pi / duration
            power = (n - 1.0) * math.log(d * omega / (m * impact["club_speed"]))
            k = self.fixed.get("k", math.exp(math.log(reduced * omega**2 / m) + power))
            # The damping ratio is b/√(2 (n + 1) k μ).
            b = zeta * math.sqrt(2.0 * (n + 1.0) * k * reduced)
            guess = {name: prior.value for name, prior in data.priors.items()}
            guess |= dict(zip(("b", "exponent", *LINE), (b, n, 0.8, 0.002)))
            params = lmfit.Parameters()
            for name in self.names:
                low, high = RANGES.get(name, (-math.inf, math.inf))
                value = self.fixed.get(name, guess.get(name, k))
                free = name not in self.fixed and not (name == "exponent" and law.exponent)
                params.add(name, value, free, low, high)
            for name, curve in data.curves.items():
                params.add(of_curve("touch", name), -share * duration / MICRO)
                for of, value, unit in zip(("offset", "drift"), curve.baseline, (1.0, PER_MS)):
                    params.add(of_curve(of, name), value / unit)
            starts.append(params)
        return starts

    def minimum(self, tolerance: float | None = None) -> Any:
        """lmfit's result of the best minimum; of several that are as good, the least damped one."""
        starts = self.starts()
        if thin := self.thinned():
            starts = [self.shifted(thin.minimum(1e-5).params)]
        elif self.data.curves:
            starts = sorted(starts, key=self.cost)[:3]
            best = min((self.solve(one, 1e-2) for one in starts), key=lambda one: one.chisqr)
            for _ in range(2):
                best = self.solve(self.shifted(best.params), 1e-6)
            starts = [self.shifted(best.params)]
        results = [self.solve(one, tolerance) for one in starts]
        least = min(result.chisqr for result in results)
        if least >= _FAR:
            raise UserError(f"{self.law.title}: no contact that ends comes near these measurements")
        equal = (one for one in results if one.chisqr - least <= 1e-6 * (1.0 + least))
        return min(equal, key=lambda one: [round(one.params[n].value, 3) for n in self.names[1:]])

    def thinned(self) -> _Problem | None:
        """The same of free heads, with every eighth row of long curves around contact, or fewer."""
        data, free_head = self.data, {"club_force": 0.0}
        curves = [
            replace(one.around_contact(_FEW), impact={**one.impact, **free_head})
            for one in data.curves.values()
        ]
        impact = {**data.impact, **free_head}
        thin = Measurements(data.targets, curves, data.cor_speeds, impact, data.priors)
        if thin.impact == data.impact and all(
            len(one.x) == len(other.x) and one.impact == other.impact
            for one, other in zip(curves, data.curves.values())
        ):
            return None
        return _Problem(thin, self.law, self.apart, self.tick, self.fixed)

    def cost(self, params: lmfit.Parameters) -> float:
        return float(np.sum(self.residuals(params) ** 2))

    def shifted(self, params: lmfit.Parameters) -> lmfit.Parameters:
        """These parameters, or better ones with touches some rows away.

        Law 2's force jumps or rises steeply at touch: χ² has a minimum between any two rows.
        """
        names = [one.name for one in params.values() if one.vary]
        touches = [of_curve("touch", name) for name in self.data.curves]
        others = [n for n, name in enumerate(names) if name not in touches]
        q, r = np.linalg.qr(self.jacobian(params)[:, others])

        def moved(touch: str, shift: float) -> tuple[float, lmfit.Parameters]:
            found = params.copy()
            found[touch].value += shift
            # The others follow, as they would in a fit.
            changes = np.linalg.lstsq(r, q.T @ self.residuals(found))[0]
            for n, change in zip(others, changes):
                found[names[n]].value -= change
            return self.cost(found), found

        for touch, curve in zip(touches, self.data.curves.values()):
            row = curve.spacing / MICRO
            least, best = moved(touch, 0.0)[0], params
            for rows, sign in itertools.product(_ROWS, (1.0, -1.0)):
                shift = best[touch].value - params[touch].value + sign * rows * row
                cost, found = moved(touch, shift)
                if cost < least:
                    least, best = cost, found
            params = best
        return params

    def estimate_sigma(self, result: Any) -> None:
        """σ of the series without: residuals over rows less the parameters that they determine."""
        scale = np.linalg.norm(result.jac, axis=0)
        scale[scale == 0.0] = 1.0
        leverage = np.sum(np.linalg.qr(result.jac / scale)[0] ** 2, axis=1)
        for name in self.estimated:
            rows, one = self.data.groups[name], self.data.series[name]
            residuals, used = result.residual[rows], leverage[rows]
            if one.step > math.sqrt(np.mean(residuals**2)) * self.sigma[rows.start]:
                # Outside contact all values may round to one: no noise is left.
                residuals, used = residuals[one.contact], used[one.contact]
            freedom = max(len(residuals) - float(used.sum()), 1.0)
            # Data computed without noise leave residuals of rounding only.
            least = 1e-9 * float(np.abs(self.data.values[rows]).max()) / self.sigma[rows.start]
            self.sigma[rows] *= max(math.sqrt(np.sum(residuals**2) / freedom), least)

    def row_correlations(self, result: Any) -> dict[str, float]:
        """Lag-1 autocorrelations of residuals in contact, of the curves where it isn't chance.

        That of independent residuals is normal, 1/√rows.
        """
        found = {}
        for name, curve in self.data.curves.items():
            inside = result.residual[self.data.groups[name]][curve.contact]
            correlation = float(inside[1:] @ inside[:-1]) / max(float(inside @ inside), 1e-300)
            if correlation * math.sqrt(len(inside)) > _CORRELATED:
                found[name] = correlation
        return found

    def enlarged_sigma(self, correlations: Mapping[str, float]) -> np.ndarray:
        """σ whose independent rows determine as much as correlated ones (AR(1)) do with theirs."""
        sigma = self.sigma.copy()
        for name in {*correlations}.intersection(self.estimated):
            r = correlations[name]
            sigma[self.data.groups[name]] *= math.sqrt((1.0 + r) / (1.0 - r))
        return sigma

    def held(self, params: lmfit.Parameters) -> tuple[lmfit.Parameters, dict[str, Any]]:
        """Parameters with those fixed that are at a limit, and the one-sided intervals of these."""
        params, ends = params.copy(), {}
        near = self.near_limit(params)
        if near:
            jacobian = self.jacobian(params)
            scale = np.linalg.norm(jacobian, axis=0)
            scale[scale == 0.0] = 1.0
            root = np.linalg.pinv(np.linalg.qr(jacobian / scale)[1]) / scale[:, None]
            covariance = root @ root.T
            step = -covariance @ (jacobian.T @ self.residuals(params))
            names = [one.name for one in params.values() if one.vary]
        for name, limit in near.items():
            n = names.index(name)
            inward = 1.0 if limit == params[name].min else -1.0
            # χ² is a parabola whose minimum lies beyond the limit.
            beyond = min(inward * step[n], 0.0)
            far = beyond + math.sqrt(beyond**2 + _ONE_SIDED * covariance[n, n])
            ends[name] = tuple(sorted((limit, float(limit + inward * far))))
            params[name].set(value=limit, vary=False)
        return params, ends

    def near_limit(self, params: lmfit.Parameters) -> dict[str, float]:
        """Limits of the parameters that are closer to one than the step of a difference."""
        return {
            one.name: limit
            for one in params.values()
            for limit in (one.min, one.max)
            if one.vary
            and math.isfinite(limit)
            and abs(one.value - limit) <= step_of(one.name, limit)
        }

    def rounded(self, result: Any) -> lmfit.Parameters:
        """The law's parameters without digits that the measurements don't determine."""
        lengths = np.linalg.norm(result.jac, axis=0)
        params = result.params.copy()
        for name, length in zip(result.var_names, lengths.tolist()):
            if name in self.names:
                digits = math.ceil(math.log10(length / _ROUNDING))
                params[name].value = round(params[name].value, digits)
        return params


def chance_of(square: float, freedom: int) -> float:
    """Probability of a larger χ² with these degrees of freedom."""
    return float(chdtrc(freedom, max(square, 0.0)))
