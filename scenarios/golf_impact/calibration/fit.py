"""The parameters of a contact law by weighted least squares, through lmfit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import lmfit
import numpy as np
from scipy.special import chdtrc, stdtrit

from golf_impact.calibration.measurements import Measurements
from golf_impact.calibration.model import FAR, FEW, ContactLaw, Problem
from golf_impact.calibration.series import RESTITUTION, TARGETS, UNITS, compute_scalars, inputs
from golf_impact.errors import UserError
from golf_impact.intervals import step_of

#: Parameters are rounded to this fraction of their standard error; the rise of χ² at the end of a
#: one-sided 95 % interval; a lag-1 autocorrelation of residuals, times √rows, that isn't chance.
_ROUNDING, _ONE_SIDED, _CORRELATED = 1e-3, 1.645**2, 4.0

#: By how many rows touch is moved.
_ROWS = tuple(2.0**n for n in range(3, -5, -1))


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
        result: lmfit's `MinimizerResult`, not rounded; touch is in µs since a curve's origin, drift
            in N/ms.
        values: the FMU's inputs and parameters of this impact, SI units.
        parameters, covariance, correlations: of the fitted ones; 0 for one at its limit.
        curves: of each curve `touch`, the instant by its clock (s), and, as far as its sensor has
            them, `offset` (N) and `drift` (N/s).
        predicted: scalar targets as the physics gives them.
        residuals, sigma: (model − measured)/σ of the measured values, and their σ, by part.
        rms: residuals of each series, root mean square in its unit.
        estimated: the series whose σ follows from the residuals.
        row_correlations: lag-1 autocorrelations of residuals in contact, where they aren't chance.
        probability: of a larger χ² if law and σ are right; None if χ² has no meaning.
        deviance, aic: −2 ln(likelihood), but for a constant, and Akaike's criterion.
        coverage: half the width of a 95 % interval in standard errors: Student's t or normal.
        is_exact: whether residuals are rounding, of which a comparison of laws would be one.

    Raises:
        UserError: the measurements don't determine the law's parameters, or no contact that ends
            comes near them.
    """

    def __init__(
        self,
        data: Measurements,
        law: ContactLaw,
        apart: bool = False,
        fixed: Mapping[str, float] | None = None,
        profile: bool = False,
    ) -> None:
        self.law, self.title = law, law.title + " with COR line" * bool(data.cor_speeds)
        problem = Problem(data, law, apart, fixed or {})
        self.estimated = [name for name, one in data.series.items() if one.sigma is None]
        with np.errstate(all="ignore"):
            result = _minimum(problem)
            for _ in range(3 if self.estimated else 0):
                self._estimate_sigma(problem, result)
                if len(problem.parts) == 1:
                    break  # the minimum doesn't depend on the only σ
                result = problem.solve(result.params)
            self.sigma = {**problem.sigma}
            self._enlarge_sigma(problem, result)
            minimizer = problem.minimizer(result.params, near=0.75)
            result = minimizer.least_squares()
            if ends := _at_limits(result):
                params = result.params.copy()
                for name, (limit, _) in ends.items():
                    params[name].set(value=limit, vary=False)
                minimizer = problem.minimizer(params, near=0.75)
                result = minimizer.least_squares()
        self.result = _determined(problem, result)
        free = [*result.var_names, *ends]
        of_law = [name for name in problem.names if name in free]
        # With the same σ as the result.
        profiles = _profiles(minimizer, result, of_law) if profile else {}
        params = result.params.copy()
        for name, size in zip(result.var_names, np.linalg.norm(result.jac, axis=0)):
            if name in problem.names:
                digits = math.ceil(math.log10(size / _ROUNDING))
                params[name].value = round(params[name].value, digits)
        problem.sigma = self.sigma
        residuals = problem.residuals(params)
        self.residuals = problem.split(residuals)
        self.chi_squared = float(residuals @ residuals)
        self.degrees_of_freedom = freedom = len(residuals) - len(free)
        tested = freedom > 0 and not self.estimated
        self.probability = chance_of(self.chi_squared, freedom) if tested else None
        logarithms = sum(float(np.log(sigma).sum()) for sigma in self.sigma.values())
        self.deviance = self.chi_squared + 2.0 * logarithms
        self.aic = self.deviance + 2.0 * len(free)
        self.coverage = float(stdtrit(max(1, freedom) if self.estimated else 1e9, 0.975))

        def estimate(name: str, unit: float = 1.0, zero: float = 0.0) -> Estimate:
            value, error = zero + unit * params[name].value, unit * result.params[name].stderr
            half = self.coverage * error
            return Estimate(value, error, profiles.get(name, (value - half, value + half)))

        self.parameters = {
            name: Estimate(ends[name][0], None, ends[name][1], ends[name][0])
            if name in ends
            else estimate(name)
            for name in of_law
        }
        self.curves = {
            curve: {
                of: estimate(name, UNITS[of], one.origin if of == "touch" else 0.0)
                for of, name in zip(UNITS, one.own[1:])
                if name in params
            }
            for curve, one in data.curves.items()
        }
        # The row of one at its limit is 0.
        at = [result.var_names.index(name) if name in result.var_names else -1 for name in of_law]
        self.covariance = np.pad(result.covar, (0, 1))[np.ix_(at, at)]
        errors = np.array([one.standard_error or math.inf for one in self.parameters.values()])
        self.correlations = self.covariance / np.outer(errors, errors)
        self.values = inputs(problem.values(params), data.impact)
        names = [name for name in TARGETS if data.sized or name in RESTITUTION]
        self.predicted = compute_scalars(names, self.values)
        self.rms = {
            name: math.sqrt(np.mean((self.residuals[name] * self.sigma[name]) ** 2))
            for name in data.series
        }
        exact = [self.rms[name] < 1e-6 * one.signal.max() for name, one in data.series.items()]
        exact.append(np.abs(self.residuals.get("targets", 0.0)).max() < 0.01)
        self.is_exact = all(exact)

    def _estimate_sigma(self, problem: Problem, result: Any) -> None:
        """σ of the series without: residuals over rows less the parameters that they determine."""
        covariance = _determined(problem, result).covar
        leverages = problem.split(np.sum(result.jac @ covariance * result.jac, axis=1))
        for name, residuals in problem.split(result.residual).items():
            if name not in self.estimated:
                continue
            one, sigma, used = problem.parts[name], problem.sigma[name], leverages[name]
            if getattr(one, "step", 0.0) > math.sqrt(np.mean(residuals**2)) * sigma[0]:
                # Outside contact all values may round to one: no noise is left.
                residuals, used = residuals[one.contact], used[one.contact]
            freedom = max(len(residuals) - float(used.sum()), 1.0)
            # Data computed without noise leave residuals of rounding only.
            least = 1e-9 * float(np.abs(one.y).max()) / sigma[0]
            problem.sigma[name] = sigma * max(math.sqrt(np.sum(residuals**2) / freedom), least)

    def _enlarge_sigma(self, problem: Problem, result: Any) -> None:
        """Estimated σ so that independent rows determine as much as correlated ones (AR(1)) do."""
        self.row_correlations = {}
        for name, rows in problem.split(result.residual).items():
            if name in problem.data.curves:
                inside = rows[problem.parts[name].contact]
                r = float(inside[1:] @ inside[:-1]) / max(float(inside @ inside), 1e-300)
                # That of independent residuals is normal, 1/√rows.
                if r * math.sqrt(len(inside)) > _CORRELATED:
                    self.row_correlations[name] = r
                    if name in self.estimated:
                        problem.sigma[name] = problem.sigma[name] * enlargement(r)

    def numbers(self) -> dict[str, Any]:
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


def enlargement(r: float) -> float:
    """Of standard errors by a lag-1 autocorrelation."""
    return math.sqrt((1.0 + r) / (1.0 - r))


def chance_of(square: float, freedom: int) -> float:
    """Probability of a larger χ² with these degrees of freedom."""
    return float(chdtrc(freedom, max(square, 0.0)))


def _minimum(problem: Problem, tolerance: float = 0.0) -> Any:
    """lmfit's result of the best minimum; of several that are as good, the least damped one."""
    thin, starts = problem.data.thinned(FEW), problem.starts()
    if thin is not problem.data:
        thinner = Problem(thin, problem.law, problem.apart, problem.fixed)
        starts = [_shifted(problem, _minimum(thinner, 1e-5).params)]
    elif problem.data.curves:
        starts = sorted(starts, key=problem.cost)[:3]
        best = min((problem.solve(one, 1e-2) for one in starts), key=lambda one: one.chisqr)
        for _ in range(2):
            best = problem.solve(_shifted(problem, best.params), 1e-6)
        starts = [_shifted(problem, best.params)]
    results = [problem.solve(params, tolerance) for params in starts]
    least = min(result.chisqr for result in results)
    if least >= FAR:
        raise UserError(f"{problem.law.title}: no contact that ends comes near these measurements")
    equal = (one for one in results if one.chisqr - least <= 1e-6 * (1.0 + least))
    return min(equal, key=lambda one: [round(one.params[n].value, 3) for n in problem.names[1:]])


def _shifted(problem: Problem, params: lmfit.Parameters) -> lmfit.Parameters:
    """These parameters, or better ones with touches some rows away.

    Law 2's force jumps or rises steeply at touch: χ² has a minimum between any two rows.
    """
    curves = {curve.own[1]: curve for curve in problem.data.curves.values()}
    held = params.copy()
    for touch in curves:
        held[touch].vary = False
    others = [one.name for one in held.values() if one.vary]
    q, r = np.linalg.qr(problem.jacobian(held))

    def moved(touch: str, shift: float) -> tuple[float, float, lmfit.Parameters]:
        found = params.copy()
        found[touch].value += shift
        # The others follow, as they would in a fit.
        changes = np.linalg.lstsq(r, q.T @ problem.residuals(found))[0]
        for name, change in zip(others, changes):
            found[name].value -= change
        return problem.cost(found), shift, found

    for touch, curve in curves.items():
        best = moved(touch, 0.0)[0], 0.0, params
        for rows, sign in product(_ROWS, (1.0, -1.0)):
            further = best[1] + sign * rows * curve.spacing / UNITS["touch"]
            best = min(best, moved(touch, further), key=lambda one: one[0])
        params = best[2]
    return params


def _determined(problem: Problem, result: Any) -> Any:
    """The result, unless its parameters have no covariance; then a UserError."""
    if result.covar is None or not np.all(result.covar.diagonal() > 0.0):
        names = ", ".join(name for name in problem.names if name in result.var_names)
        raise UserError(f"{problem.law.title}: these measurements don't determine {names}")
    return result


def _at_limits(result: Any) -> dict[str, tuple[float, tuple[float, float]]]:
    """Limits and one-sided intervals of the parameters that are at a limit.

    At a limit is one that is closer to it than the step of a difference.
    """
    found: dict[str, tuple[float, tuple[float, float]]] = {}
    if result.covar is None:
        return found
    step = -result.covar @ (result.jac.T @ result.residual)
    for n, name in enumerate(result.var_names):
        one = result.params[name]
        for limit, inward in ((one.min, 1.0), (one.max, -1.0)):
            if math.isfinite(limit) and abs(one.value - limit) <= step_of(name, limit):
                # χ² is a parabola whose minimum lies beyond the limit.
                beyond = min(inward * step[n], 0.0)
                far = beyond + math.sqrt(beyond**2 + _ONE_SIDED * result.covar[n, n])
                low, high = sorted((limit, float(limit + inward * far)))
                found[name] = limit, (low, high)
    return found


def _profiles(minimizer: Any, result: Any, names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """95 % intervals where χ² rises as much, the other parameters being fitted again."""
    found = lmfit.conf_interval(
        minimizer,
        result,
        p_names=[name for name in names if name in result.var_names],
        sigmas=[0.95],
        prob_func=lambda best, other: 1.0 - chance_of(other.chisqr - best.chisqr, 1),
    )
    return {name: (rows[0][1], rows[-1][1]) for name, rows in found.items()}
