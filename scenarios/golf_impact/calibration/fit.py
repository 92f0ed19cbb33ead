"""The parameters of a contact law by weighted least squares, through lmfit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from golf_impact.calibration.intervals import RANGES, step_of
from golf_impact.calibration.measurements import RESTITUTION, TARGETS, Measurements
from golf_impact.calibration.model import FAR, LINE, UNITS, ContactLaw, Problem, of_curve
from golf_impact.errors import UserError, missing_package

try:
    import lmfit
    from scipy.special import chdtrc, stdtrit
except ModuleNotFoundError:
    raise missing_package("calibrate", "lmfit", "calibrate") from None

#: Parameters are rounded to this fraction of their standard error; the rise of χ² at the end of a
#: one-sided 95 % interval; a lag-1 autocorrelation of residuals, times √rows, that isn't chance.
_ROUNDING, _ONE_SIDED, _CORRELATED = 1e-3, 1.645**2, 4.0

#: Rows of a curve with which a search begins; by how many touch is moved.
_FEW, _ROWS = 600, tuple(2.0**n for n in range(3, -5, -1))


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
        residuals, sigma: (model − measured)/σ of all measured values, and their σ, (n,).
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
        _check_number(law, data, fixed or {})
        self.law = law
        problem = Problem(data, law, apart, fixed or {})
        self.estimated = [name for name, one in data.series.items() if one.sigma is None]
        alone = len(data.series) == 1 and not data.targets and not data.priors
        with np.errstate(all="ignore"):
            result = _minimum(problem)
            for _ in range(3 if self.estimated else 0):
                self._estimate_sigma(problem, result)
                if alone:
                    break  # the minimum doesn't depend on the only σ
                result = _minimizer(problem, result.params).least_squares()
            self.sigma = problem.sigma.copy()
            self._enlarge_sigma(problem, result)
            params, ends = _held(problem, result.params)
            minimizer = _minimizer(problem, params, near=0.75)
            self.result = result = minimizer.least_squares()
        free = [*result.var_names, *ends]
        if result.covar is None or not np.all(result.covar.diagonal() > 0.0):
            raise UserError(f"{law.title}: these measurements don't determine {', '.join(free)}")
        of_law = [name for name in problem.names if name in free]
        # With the same σ as the result.
        profiles = _profiles(minimizer, result, of_law) if profile else {}
        params = result.params.copy()
        for name, size in zip(result.var_names, np.linalg.norm(result.jac, axis=0)):
            if name in problem.names:
                digits = math.ceil(math.log10(size / _ROUNDING))
                params[name].value = round(params[name].value, digits)
        problem.sigma = self.sigma
        self.residuals = problem.residuals(params)
        self.chi_squared = square = float(self.residuals @ self.residuals)
        self.degrees_of_freedom = freedom = len(self.residuals) - len(free)
        tested = freedom > 0 and not self.estimated
        self.probability = chance_of(square, freedom) if tested else None
        self.deviance = square + 2.0 * float(np.sum(np.log(self.sigma)))
        self.aic = self.deviance + 2.0 * len(free)
        self.coverage = float(stdtrit(max(1, freedom) if self.estimated else 1e9, 0.975))

        def estimate(name: str, unit: float = 1.0, zero: float = 0.0) -> Estimate:
            value, error = zero + unit * params[name].value, unit * result.params[name].stderr
            half = self.coverage * error
            return Estimate(value, error, (value - half, value + half))

        self.parameters = {
            name: Estimate(params[name].value, None, ends[name], params[name].value)
            if name in ends
            else estimate(name)
            for name in of_law
        }
        for name, interval in profiles.items():
            self.parameters[name] = self.parameters[name]._replace(interval=interval)
        self.curves = {
            name: {
                of: estimate(of_curve(of, name), unit, curve.origin if of == "touch" else 0.0)
                for of, unit in [*UNITS.items()][: 1 + len(curve.baseline)]
            }
            for name, curve in data.curves.items()
        }
        # The row of one at its limit is 0.
        at = [result.var_names.index(name) if name in result.var_names else -1 for name in of_law]
        self.covariance = np.pad(result.covar, (0, 1))[np.ix_(at, at)]
        errors = np.array([one.standard_error or math.inf for one in self.parameters.values()])
        self.correlations = self.covariance / np.outer(errors, errors)
        values = problem.values(params)
        self.values = problem.impact(values)
        names = [name for name in TARGETS if data.sized or name in RESTITUTION]
        self.predicted = problem.scalars(names, values)
        self.title = law.title + " with COR line" * bool(data.cor_speeds)
        self.rms = {
            name: math.sqrt(np.mean((self.residuals[rows] * self.sigma[rows]) ** 2))
            for name, rows in data.groups.items()
            if name in data.series
        }
        exact = [self.rms[name] < 1e-6 * one.force.max() for name, one in data.series.items()]
        exact.append(np.abs(self.residuals[data.groups["targets"]]).max(initial=0.0) < 0.01)
        self.is_exact = all(exact)

    def _estimate_sigma(self, problem: Problem, result: Any) -> None:
        """σ of the series without: residuals over rows less the parameters that they determine."""
        leverage = np.sum(np.linalg.qr(result.jac / _lengths(result.jac))[0] ** 2, axis=1)
        for name in self.estimated:
            rows, one = problem.data.groups[name], problem.data.series[name]
            residuals, used = result.residual[rows], leverage[rows]
            if one.step > math.sqrt(np.mean(residuals**2)) * problem.sigma[rows.start]:
                # Outside contact all values may round to one: no noise is left.
                residuals, used = residuals[one.contact], used[one.contact]
            freedom = max(len(residuals) - float(used.sum()), 1.0)
            # Data computed without noise leave residuals of rounding only.
            least = 1e-9 * float(np.abs(one.y).max()) / problem.sigma[rows.start]
            problem.sigma[rows] *= max(math.sqrt(np.sum(residuals**2) / freedom), least)

    def _enlarge_sigma(self, problem: Problem, result: Any) -> None:
        """Estimated σ so that independent rows determine as much as correlated ones (AR(1)) do."""
        self.row_correlations = {}
        for name, curve in problem.data.curves.items():
            rows = problem.data.groups[name]
            inside = result.residual[rows][curve.contact]
            r = float(inside[1:] @ inside[:-1]) / max(float(inside @ inside), 1e-300)
            # That of independent residuals is normal, 1/√rows.
            if r * math.sqrt(len(inside)) > _CORRELATED:
                self.row_correlations[name] = r
                if name in self.estimated:
                    problem.sigma[rows] *= math.sqrt((1.0 + r) / (1.0 - r))

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


def _check_number(law: ContactLaw, data: Measurements, fixed: Mapping[str, float]) -> None:
    """Raise UserError if these measurements can't determine the law's free parameters."""
    line, speeds = bool(data.cor_speeds), sum(name in RESTITUTION for name in data.targets)
    names = {*LINE} if line else {"b"}
    names |= {"k", "exponent"} if data.sized else set()
    for name in (*fixed, *data.priors):
        if name in RANGES and name not in names:
            raise UserError(f"{name} is refused: {', '.join(sorted(names))} are fitted here")
    if names <= {*fixed} | ({"exponent"} if law.exponent else set()) and not data.curves:
        raise UserError("nothing is left to be fitted: fix fewer parameters")
    if law.law == 1 and line:
        raise UserError("cor_speeds are refused with law = 1: its damping has no COR line")
    have = len(data.targets) - speeds + (line or speeds > 0)
    have += sum(name in RANGES for name in data.priors)
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


def _minimizer(
    problem: Problem, params: lmfit.Parameters, tolerance: float = 0.0, near: float = 0.0
) -> _Minimizer:
    if not tolerance:
        # Of χ²; with many rows it is about their number, and 1e-3 a thirtieth of a σ.
        rows = len(problem.sigma)
        tolerance = 1e-10 if rows <= _FEW else max(1e-10, 1e-3 / rows)
    found = _Minimizer(
        problem.residuals,
        params,
        scale_covar=False,
        jac=lambda params: problem.jacobian(params, near),
        method="dogbox",  # of SciPy's methods the one that ends exactly at a limit
        x_scale="jac",
        **dict.fromkeys(("xtol", "ftol", "gtol"), tolerance),
    )
    # SciPy's limit; lmfit's own would end without a covariance.
    found.kws["max_nfev"] = 100
    return found


def _minimum(problem: Problem, tolerance: float = 0.0) -> Any:
    """lmfit's result of the best minimum; of several that are as good, the least damped one."""

    def solve(params: lmfit.Parameters, tolerance: float) -> Any:
        return _minimizer(problem, params, tolerance).least_squares()

    thin, starts = problem.data.thinned(_FEW), problem.starts()
    if thin is not problem.data:
        thinner = Problem(thin, problem.law, problem.apart, problem.fixed)
        starts = [_shifted(problem, _minimum(thinner, 1e-5).params)]
    elif problem.data.curves:
        starts = sorted(starts, key=lambda params: _cost(problem, params))[:3]
        best = min((solve(one, 1e-2) for one in starts), key=lambda one: one.chisqr)
        for _ in range(2):
            best = solve(_shifted(problem, best.params), 1e-6)
        starts = [_shifted(problem, best.params)]
    results = [solve(params, tolerance) for params in starts]
    least = min(result.chisqr for result in results)
    if least >= FAR:
        raise UserError(f"{problem.law.title}: no contact that ends comes near these measurements")
    equal = (one for one in results if one.chisqr - least <= 1e-6 * (1.0 + least))
    return min(equal, key=lambda one: [round(one.params[n].value, 3) for n in problem.names[1:]])


def _cost(problem: Problem, params: lmfit.Parameters) -> float:
    return float(np.sum(problem.residuals(params) ** 2))


def _shifted(problem: Problem, params: lmfit.Parameters) -> lmfit.Parameters:
    """These parameters, or better ones with touches some rows away.

    Law 2's force jumps or rises steeply at touch: χ² has a minimum between any two rows.
    """
    touches = {of_curve("touch", name): one for name, one in problem.data.curves.items()}
    others = [one.name for one in params.values() if one.vary and one.name not in touches]
    held = params.copy()
    for touch in touches:
        held[touch].vary = False
    q, r = np.linalg.qr(problem.jacobian(held))

    def moved(touch: str, shift: float) -> lmfit.Parameters:
        found = params.copy()
        found[touch].value += shift
        # The others follow, as they would in a fit.
        changes = np.linalg.lstsq(r, q.T @ problem.residuals(found))[0]
        for name, change in zip(others, changes):
            found[name].value -= change
        return found

    for touch, curve in touches.items():
        best, least, shift = params, _cost(problem, moved(touch, 0.0)), 0.0
        for rows, sign in product(_ROWS, (1.0, -1.0)):
            further = shift + sign * rows * curve.spacing / UNITS["touch"]
            found = moved(touch, further)
            if (cost := _cost(problem, found)) < least:
                best, least, shift = found, cost, further
        params = best
    return params


def _lengths(jacobian: np.ndarray) -> np.ndarray:
    """Norms of the columns, 1 for one that is 0."""
    lengths = np.linalg.norm(jacobian, axis=0)
    return np.where(lengths > 0.0, lengths, 1.0)


def _held(
    problem: Problem, params: lmfit.Parameters
) -> tuple[lmfit.Parameters, dict[str, tuple[float, float]]]:
    """Parameters with those fixed that are at a limit, and the one-sided intervals of these.

    At a limit is one that is closer to it than the step of a difference.
    """
    jacobian, ends = problem.jacobian(params), {}
    lengths, params = _lengths(jacobian), params.copy()
    covariance = np.linalg.pinv(np.linalg.qr(jacobian / lengths)[1]) / lengths[:, None]
    covariance = covariance @ covariance.T
    step = -covariance @ (jacobian.T @ problem.residuals(params))
    for n, one in enumerate([one for one in params.values() if one.vary]):
        for limit, inward in ((one.min, 1.0), (one.max, -1.0)):
            if math.isfinite(limit) and abs(one.value - limit) <= step_of(one.name, limit):
                # χ² is a parabola whose minimum lies beyond the limit.
                beyond = min(inward * step[n], 0.0)
                far = beyond + math.sqrt(beyond**2 + _ONE_SIDED * covariance[n, n])
                ends[one.name] = tuple(sorted((limit, float(limit + inward * far))))
                one.set(value=limit, vary=False)
    return params, ends


def _profiles(
    minimizer: _Minimizer, result: Any, names: Sequence[str]
) -> dict[str, tuple[float, float]]:
    """95 % intervals where χ² rises as much, the other parameters being fitted again."""
    found = lmfit.conf_interval(
        minimizer,
        result,
        p_names=[name for name in names if name in result.var_names],
        sigmas=[0.95],
        prob_func=lambda best, other: 1.0 - chance_of(other.chisqr - best.chisqr, 1),
    )
    return {name: (rows[0][1], rows[-1][1]) for name, rows in found.items()}


def chance_of(square: float, freedom: int) -> float:
    """Probability of a larger χ² with these degrees of freedom."""
    return float(chdtrc(freedom, max(square, 0.0)))
