"""The parameters of a contact law by weighted least squares, through lmfit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import lmfit
import numpy as np
from scipy.special import chdtrc, stdtrit

from golf_impact.data.errors import UserError
from golf_impact.studies.calibrate.measurements import Measurements, number
from golf_impact.studies.calibrate.series import (
    IMPACT,
    RESTITUTION,
    TARGETS,
    UNITS,
    compute_scalars,
    inputs,
    reduced_mass,
)
from golf_impact.studies.intervals import RANGES, ends_of, step_of

#: The parameters of COR = first − second · approach speed; they replace b.
LINE = ("restitution_at_rest", "restitution_slope")

#: The residual where no contact ends, σ; rows of a curve with which a search begins.
_FAR, _FEW = 1e9, 600

#: Damping ratios and exponents of the starts.
_ZETAS, _EXPONENTS = (1e-3, 0.02, 0.1, 0.3, 0.8, 3.0, 30.0), (1.05, 1.5, 2.2, 4.0)

#: The rise of χ² at the end of a one-sided 95 % interval; a lag-1 autocorrelation of residuals,
#: times √rows, that isn't chance; rows in contact up to which intervals follow from the rise of χ².
_ONE_SIDED, _CORRELATED, _SPARSE = 1.645**2, 4.0, 40

#: By how many rows touch is moved.
_ROWS = tuple(2.0**n for n in range(3, -5, -1))


class ContactLaw(NamedTuple):
    """A law, and which of its parameters are given."""

    law: int  #: 1 (absolute) or 2 (relative)
    exponent: float | None  #: n, or None if it is free
    reference_compression: float = 0.005  #: d_r, at which k and b hold, m

    @classmethod
    def of(cls, exponent: float | str) -> ContactLaw:
        """From an option: the exponent is a number or "free"."""
        return cls(2, None if exponent == "free" else number(exponent, "exponent"))

    @property
    def title(self) -> str:
        if self.exponent is None:
            return "power law, n free"
        if self.exponent == 1.0:
            return "Kelvin–Voigt"
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


class Problem:
    """Residuals of a law and their derivatives.

    Values have the FMU's names (SI units). A curve has besides those of `UNITS`, and perhaps a
    stiffness of its own: `touch_2`, `k_2` are those of the second one.

    Attributes:
        names: of the law's and the impact's parameters, fixed ones too, in order.
        owner: the curve that a parameter belongs to, by its name.
        sigma: standard deviations of the measured values, by the name of the part.
        rows: the number of measured values.

    Raises:
        UserError: the measurements can't determine the law's free parameters.
    """

    def __init__(
        self, data: Measurements, law: ContactLaw, apart: bool, fixed: Mapping[str, float]
    ) -> None:
        self.data, self.law, self.fixed, self.apart = data, law, fixed, apart
        self.parts = data.parts
        self.sigma = {name: part.guess.copy() for name, part in self.parts.items()}
        self.rows = sum(map(len, self.sigma.values()))
        fitted = {*(LINE if data.cor_speeds else ["b"]), *(["k", "exponent"] * data.sized)}
        self._check_number(fitted)
        own = {curve: one.own for curve, one in data.curves.items()}
        self.owner = {name: curve for curve in own for name in own[curve] if name != "k"}
        self.names = [name for name in RANGES if name in fitted]
        self.names += [stiffness for stiffness, *_ in own.values() if apart and stiffness != "k"]
        self.names += [name for name in IMPACT if name in data.priors.measured]

    def _check_number(self, fitted: set[str]) -> None:
        """Raise UserError if these measurements can't determine the law's free parameters."""
        data, law, fixed, line = self.data, self.law, self.fixed, bool(self.data.cor_speeds)
        priors = [name for name in data.priors.measured if name in RANGES]
        for name in (*fixed, *priors):
            if name not in fitted:
                raise UserError(f"{name} is refused: {', '.join(sorted(fitted))} are fitted here")
        if fitted <= {*fixed} | ({"exponent"} if law.exponent else set()) and not data.curves:
            raise UserError("nothing is left to be fitted: fix fewer parameters")
        sizes = [name for name in data.targets.measured if name not in RESTITUTION]
        have = len(sizes) + (line or len(data.targets.measured) > len(sizes)) + len(priors)
        need = 2 + (law.exponent is None) - sum(name in fixed for name in ("k", "b"))
        if have < need and not (data.curves or (line and need == 2 and not data.sized)):
            raise UserError(
                f"{law.title} can't be fitted: too few targets, {have} where {need} are needed "
                "(ball speed, club speed after and COR count once); give --curve FILE.csv, "
                "--cor-speeds FILE.csv or more of them, e.g. --measured cor=0.743 --measured "
                "contact_time=600us"
            )

    def values(self, params: lmfit.Parameters) -> dict[str, Any]:
        law = {"law": self.law.law}
        sizes = {"reference_compression": self.law.reference_compression} if self.data.sized else {}
        return law | sizes | params.valuesdict()

    def split(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """Views of rows by the name of the part that they are of."""
        ends = np.cumsum([len(sigma) for sigma in self.sigma.values()])[:-1]
        return dict(zip(self.parts, np.split(rows, ends)))

    def residuals(self, params: lmfit.Parameters) -> np.ndarray:
        """(model − measured)/σ of all parts, (n,); large where there is no contact that ends."""
        values, far = self.values(params), np.full(self.rows, _FAR)
        try:
            rows = np.concatenate(
                [(part.model(values) - part.y) / self.sigma[n] for n, part in self.parts.items()]
            )
        except UserError:
            # Far from any ball values may leave the FMU's range; the search has to turn back.
            return far
        return rows if np.all(np.abs(rows) < _FAR) else far

    def cost(self, params: lmfit.Parameters) -> float:
        return float(np.sum(self.residuals(params) ** 2))

    def jacobian(self, params: lmfit.Parameters, near: float = 0.0) -> np.ndarray:
        """Derivatives (n, p) of the residuals over the varied parameters, by differences.

        Rows within so many spacings of touch have none over its instant: the force jumps or rises
        steeply there.
        """
        values, names = self.values(params), [one.name for one in params.values() if one.vary]
        slopes = np.zeros((len(names), self.rows))
        try:
            for name, column in zip(names, slopes):
                owner = self.owner.get(name)
                of = name.partition("_")[0] if owner else name
                ends = ends_of(of, values[name])
                for key, rows in self.split(column).items():
                    if owner not in (None, key):
                        continue
                    part = self.parts[key]
                    low, high = (part.model({**values, name: end}) for end in ends)
                    rows[:] = (high - low) / (ends[1] - ends[0]) / self.sigma[key]
                    if of == "touch":
                        # A difference over the jump itself is none of the force.
                        close = max(near * part.spacing, UNITS[of] * (ends[1] - ends[0]))
                        rows[np.abs(part.since_touch(values)) <= close] = 0.0
        except UserError:
            slopes[:] = 0.0
        return slopes.T

    def minimizer(
        self, params: lmfit.Parameters, tolerance: float = 0.0, near: float = 0.0
    ) -> lmfit.Minimizer:
        # Of χ²; with many rows it is about their number, and 1e-3 a thirtieth of a σ.
        many = self.rows > _FEW
        tolerance = tolerance or max(1e-10, 1e-3 / self.rows if many else 0.0)
        found = lmfit.Minimizer(
            self.residuals,
            params,
            scale_covar=False,
            jac=lambda params: self.jacobian(params, near),
            method="dogbox",  # of SciPy's methods the one that ends exactly at a limit
            x_scale="jac",
            **dict.fromkeys(("xtol", "ftol", "gtol"), tolerance),
        )
        # SciPy's limit; lmfit's own would end without a covariance.
        found.kws["max_nfev"] = 100
        return found

    def solve(self, params: lmfit.Parameters, tolerance: float = 0.0) -> Any:
        return self.minimizer(params, tolerance).least_squares()

    def starts(self) -> list[lmfit.Parameters]:
        """A grid of ζ and n; k from an undamped contact as long as the curve's, or 0.5 ms."""
        data, law = self.data, self.law
        duration, speed, early = 5e-4, data.impact["club_speed"], [0.0]
        for curve in [*data.curves.values()][:1]:
            duration, early = 1.2 * float(np.ptp(curve.x[curve.contact])), [0.0, 0.1]
            speed = curve.impact["club_speed"]
        reduced, omega = reduced_mass(data.impact), math.pi / duration
        zetas = (0.1,) if data.series else _ZETAS
        exponents = (law.exponent,) if law.exponent else _EXPONENTS
        known = {name: prior.value for name, prior in data.priors.measured.items()}
        starts = []
        for zeta, n, share in product(zetas, exponents, early):
            # With the compression L = m v/ω: √(m k/μ) = ω (d_r/L)^(m − 1).
            m = 0.5 * (n + 1.0)
            ratio = law.reference_compression * omega / (m * speed)
            k = self.fixed.get("k", reduced * omega**2 / m * ratio ** (n - 1.0))
            # The damping ratio is b/√(2 (n + 1) k μ).
            b = zeta * math.sqrt(2.0 * (n + 1.0) * k * reduced)
            guess = {**known, "b": b, "exponent": n, **dict(zip(LINE, (0.8, 0.002))), **self.fixed}
            params = lmfit.Parameters()
            for name in self.names:
                free = name not in self.fixed and not (name == "exponent" and law.exponent)
                params.add(name, guess.get(name, k), free, *RANGES.get(name, ()))
            for curve in data.curves.values():
                own = (-share * duration, *curve.baseline)
                for name, unit, value in zip(curve.own[1:], UNITS.values(), own):
                    params.add(name, value / unit)
            starts.append(params)
        return starts


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
                for name, one in ends.items():
                    result.params[name].set(value=one.value, vary=False)
                minimizer = problem.minimizer(result.params, near=0.75)
                result = minimizer.least_squares()
        self.result = _determined(problem, result)
        free = [*result.var_names, *ends]
        of_law = [name for name in problem.names if name in free]
        params = result.params
        freedom = len(result.residual) - len(free)
        self.coverage = float(stdtrit(max(1, freedom) if self.estimated else 1e9, 0.975))
        profiles: dict[str, tuple[float, float]] = {}
        if any(len(one.contact) <= _SPARSE for one in data.curves.values()):
            # With the same σ as the result.
            profiles = _profiles(problem, result, of_law, self.coverage)
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

        def estimate(name: str, unit: float = 1.0, zero: float = 0.0) -> Estimate:
            value, error = zero + unit * params[name].value, unit * result.params[name].stderr
            half = self.coverage * error
            return Estimate(value, error, profiles.get(name, (value - half, value + half)))

        self.parameters = {name: ends.get(name) or estimate(name) for name in of_law}
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
        self.is_exact = all([*exact, np.abs(self.residuals.get("targets", 0.0)).max() < 0.01])

    def _estimate_sigma(self, problem: Problem, result: Any) -> None:
        """σ of the series without: residuals over rows less the parameters that they determine."""
        covariance = _determined(problem, result).covar
        leverages = problem.split(np.sum(result.jac @ covariance * result.jac, axis=1))
        residuals = problem.split(result.residual)
        for name in self.estimated:
            one, sigma = problem.parts[name], problem.sigma[name]
            rows, used = residuals[name], leverages[name]
            if one.step > math.sqrt(np.mean(rows**2)) * sigma[0]:
                # Outside contact all values may round to one: no noise is left.
                rows, used = rows[one.contact], used[one.contact]
            freedom = max(len(rows) - float(used.sum()), 1.0)
            # Data computed without noise leave residuals of rounding only.
            least = 1e-9 * float(np.abs(one.y).max()) / sigma[0]
            problem.sigma[name] = sigma * max(math.sqrt(rows @ rows / freedom), least)

    def _enlarge_sigma(self, problem: Problem, result: Any) -> None:
        """Estimated σ so that independent rows determine as much as correlated ones (AR(1)) do."""
        self.row_correlations = {}
        residuals = problem.split(result.residual)
        for name, curve in problem.data.curves.items():
            inside = residuals[name][curve.contact]
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
    thin, starts = problem.data.thinned(_FEW), problem.starts()
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
    if least >= _FAR:
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


def _at_limits(result: Any) -> dict[str, Estimate]:
    """The parameters that are closer to a limit than the step of a difference."""
    found: dict[str, Estimate] = {}
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
                found[name] = Estimate(limit, None, (low, high), limit)
    return found


def _profiles(
    problem: Problem, result: Any, names: Sequence[str], coverage: float
) -> dict[str, tuple[float, float]]:
    """95 % intervals where χ² rises by coverage², the other parameters being fitted again.

    With few rows touch may lie between other two rows than in the best fit: linear intervals,
    which don't consider that, are too narrow.
    """

    def rises(name: str, errors: float) -> float:
        held = result.params.copy()
        one = held[name]
        value = one.value + errors * one.stderr
        one.set(value=min(max(value, one.min), one.max), vary=False)
        found = problem.solve(_shifted(problem, held), 1e-6)
        return float(found.chisqr) - float(result.chisqr) - coverage**2

    intervals = {}
    for name in (name for name in names if name in result.var_names):
        ends = []
        for side in (-1.0, 1.0):
            near, far = 0.0, coverage
            while far < 10.0 * coverage and rises(name, side * far) < 0.0:
                near, far = far, 1.5 * far
            for _ in range(5):
                middle = 0.5 * (near + far)
                near, far = (middle, far) if rises(name, side * middle) < 0.0 else (near, middle)
            one = result.params[name]
            ends.append(min(max(one.value + side * far * one.stderr, one.min), one.max))
        intervals[name] = ends[0], ends[1]
    return intervals
