"""Law 2 fitted to measurements: the residual, its minimum and what determines it, by lmfit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import lmfit
import numpy as np
from scipy.special import chdtri

from golf_impact.data.errors import UserError
from golf_impact.data.runs import reduced_mass
from golf_impact.studies.calibrate.measurements import IMPACT, UNITS, Measurements
from golf_impact.studies.intervals import RANGES, ends_of, step_of

#: The parameters of COR = first − second · approach speed; they replace b.
LINE = ("restitution_at_rest", "restitution_slope")

#: The compression at which k and b hold, m.
REFERENCE_COMPRESSION = 0.005

#: Names of law 2 by its exponent; None if it is free.
_TITLES = {None: "power law, n free", 1.0: "Kelvin–Voigt", 1.5: "Tsuji, n = 1.5"}

#: The residual where no contact ends, σ; rows of a curve with which a search begins.
_FAR, _FEW = 1e9, 600

#: Damping ratios and exponents of the starts; by how many rows touch is moved.
_ZETAS, _EXPONENTS = (1e-3, 0.02, 0.1, 0.3, 0.8, 3.0, 30.0), (1.05, 1.5, 2.2, 4.0)
_ROWS = tuple(2.0**n for n in range(3, -5, -1))

#: The rise of χ² at the end of a one-sided 95 % interval; a lag-1 autocorrelation of residuals,
#: times √rows, that isn't chance; rows in contact up to which intervals follow from the rise of χ².
_ONE_SIDED, _CORRELATED, _SPARSE = 1.645**2, 4.0, 40

#: The least singular value of the Jacobian, its columns of length 1, that isn't rounding.
_DEPENDENT = 1e-7

_GIVE = (
    "give --curve FILE.csv, --cor-speeds FILE.csv or more of them, e.g. --measured cor=0.743 "
    "--measured contact_time=600us"
)


class Estimate(NamedTuple):
    """A fitted value in SI units, with its 95 % interval."""

    value: float
    standard_error: float | None  #: None if it is at its limit
    interval: tuple[float, float]  #: one-sided if it is at its limit
    limit: float | None = None  #: the end of its range, if it is there


class Problem:
    """The residual of all measurements, for lmfit, and its derivatives.

    Parameters have the FMU's names (SI units); a curve has besides those of `UNITS`, with its
    suffix: `touch_2`. A fixed one doesn't vary, the exponent too unless it is free.

    Attributes:
        names: of the law's and the impact's parameters, fixed ones too, in order.
        sigma: standard deviations of the measured values, by the name of the part.

    Raises:
        UserError: a parameter isn't one of these measurements, or none is left.
    """

    def __init__(self, data: Measurements, fixed: Mapping[str, float]) -> None:
        self.data, self.fixed, self.parts = data, fixed, data.parts
        n = fixed.get("exponent")
        self.title = _TITLES.get(n) or f"power law, n = {n:g}"
        self.title += " with COR line" * bool(data.cor_speeds)
        self.sigma = {name: part.guess for name, part in self.parts.items()}
        self.rows = sum(map(len, self.sigma.values()))
        known = {*data.scalars.measured} - {*data.scalars.targets}
        # COR over speed alone doesn't depend on the stiffness.
        self.sized = not data.cor_speeds or data.sized or "k" in {*fixed, *known}
        fitted = {*(LINE if data.cor_speeds else ["b"]), *(["k", "exponent"] if self.sized else [])}
        if other := ({*fixed} - {"exponent"} | known & {*RANGES}) - fitted:
            raise UserError(f"{min(other)} is refused: {', '.join(sorted(fitted))} are fitted here")
        if fitted <= {*fixed} and not data.curves:
            raise UserError("nothing is left to be fitted: fix fewer parameters")
        if not self.parts:
            raise UserError(f"nothing is measured; {_GIVE}")
        self.names = [name for name in (*RANGES, *IMPACT) if name in fitted | known]

    def split(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """Views of rows by the name of the part that they are of."""
        ends = np.cumsum([len(sigma) for sigma in self.sigma.values()])[:-1]
        return dict(zip(self.parts, np.split(rows, ends)))

    def _model(self, values: Mapping[str, Any]) -> np.ndarray:
        return np.concatenate(
            [(part.model(values) - part.y) / self.sigma[n] for n, part in self.parts.items()]
        )

    def residual(self, params: lmfit.Parameters) -> np.ndarray:
        """(model − measured)/σ of all parts, (n,); large where there is no contact that ends."""
        # Far from any ball values may leave the FMU's range; the search has to turn back.
        with suppress(UserError):
            rows = self._model(params.valuesdict())
            if np.all(np.abs(rows) < _FAR):
                return rows
        return np.full(self.rows, _FAR)

    def cost(self, params: lmfit.Parameters) -> float:
        return float(np.sum(self.residual(params) ** 2))

    def jacobian(self, params: lmfit.Parameters, near: float = 0.0) -> np.ndarray:
        """Derivatives (n, p) of the residual over the varied parameters, by differences.

        Rows within so many spacings of touch have none over its instant: the force jumps or rises
        steeply there.
        """
        values = params.valuesdict()
        varied = [one.name for one in params.values() if one.vary]
        slopes = np.zeros((len(varied), self.rows))
        with suppress(UserError):
            for name, rows in zip(varied, slopes):
                low, high = ends_of(name.rstrip("_0123456789"), values[name])
                rows += self._model({**values, name: high}) - self._model({**values, name: low})
                rows /= high - low
        for name, curve in self.data.curves.items():
            touch = "touch" + curve.suffix
            # A difference over the jump itself is none of the force.
            close = max(
                near * curve.spacing, UNITS["touch"] * 2.0 * step_of("touch", values[touch])
            )
            beside = np.abs(curve.since_touch(values)) <= close
            self.split(slopes[varied.index(touch)])[name][beside] = 0.0
        return slopes.T

    def solve(self, params: lmfit.Parameters, tolerance: float = 1e-10, near: float = 0.0) -> Any:
        """lmfit's result of the minimum beside these parameters."""
        found = lmfit.Minimizer(
            self.residual,
            params,
            scale_covar=False,
            jac=lambda params: self.jacobian(params, near),
            method="dogbox",  # of SciPy's methods the one that ends exactly at a limit
            x_scale="jac",
            **dict.fromkeys(("xtol", "ftol", "gtol"), tolerance),
        )
        # SciPy's limit; lmfit's own would end without a covariance.
        found.kws["max_nfev"] = 100
        return found.least_squares()

    def starts(self) -> list[lmfit.Parameters]:
        """A grid of ζ, ascending, and n; k from an undamped contact of 0.5 ms or the curve's."""
        data, duration = self.data, 5e-4
        if curve := data.curves.get("curve"):
            duration = 1.2 * float(np.ptp(curve.x[curve.contact]))
        reduced, omega = reduced_mass(data.impact), math.pi / duration
        exponents = [self.fixed["exponent"]] if "exponent" in self.fixed else _EXPONENTS
        known = {name: one.value for name, one in data.scalars.measured.items()}
        starts = []
        for zeta, n in product((0.1,) if data.series else _ZETAS, exponents):
            # With the compression L = m v/ω: √(m k/μ) = ω (d_r/L)^(m − 1).
            m = 0.5 * (n + 1.0)
            ratio = REFERENCE_COMPRESSION * omega / (m * data.impact["club_speed"])
            k = self.fixed.get("k", reduced * omega**2 / m * ratio ** (n - 1.0))
            # The damping ratio is b/√(2 (n + 1) k μ).
            b = zeta * math.sqrt(2.0 * (n + 1.0) * k * reduced)
            line = dict(zip(LINE, (0.8, 0.002)))
            guess = {"k": k, "b": b, "exponent": n, **line, **known, **self.fixed}
            params = lmfit.Parameters()
            for name in self.names:
                params.add(name, guess[name], name not in self.fixed, *RANGES.get(name, ()))
            for curve in data.curves.values():
                for (of, unit), value in zip(UNITS.items(), (0.0, *curve.baseline)):
                    params.add(of + curve.suffix, value / unit)
            starts.append(params)
        return starts

    def minimum(self) -> Any:
        """lmfit's result of the best minimum; of several that are as good, the least damped one.

        UserError: no contact comes near the measurements, or they don't determine the parameters.
        """
        starts = self.starts()
        if curves := self.data.curves:
            few = {name: one.thinned(_FEW) for name, one in curves.items()}
            thin = Problem(replace(self.data, curves=few), self.fixed)
            starts = sorted(starts, key=thin.cost)[:3]
            best = min((thin.solve(one, 1e-2) for one in starts), key=lambda one: one.chisqr)
            for _ in range(2):
                thin.estimate_sigma(best)
                best = thin.solve(thin.shifted(best.params), 1e-6)
            starts = [self.shifted(best.params)]
        # Of equal minima, but for rounding, the first is the least damped one.
        best = min(map(self.solve, starts), key=lambda one: round(one.chisqr, 6))
        if best.chisqr >= _FAR:
            raise UserError(f"{self.title}: no contact that ends comes near these measurements")
        lengths = np.linalg.norm(best.jac, axis=0)
        directions = best.jac / np.where(lengths, lengths, 1.0)
        if np.linalg.matrix_rank(directions, _DEPENDENT) < best.nvarys:
            names = ", ".join(name for name in self.names if name in best.var_names)
            once = "ball speed, club speed after and COR count once"
            raise UserError(
                f"{self.title}: these measurements don't determine {names} ({once}); {_GIVE}"
            )
        return best

    def shifted(self, params: lmfit.Parameters) -> lmfit.Parameters:
        """These parameters, or better ones with touches some rows away.

        Law 2's force jumps or rises steeply at touch: χ² has a minimum between any two rows.
        """
        varied = [one.name for one in params.values() if one.vary]
        others = [name for name in varied if not name.startswith("touch")]
        inverse = np.linalg.pinv(self.jacobian(params)[:, [varied.index(name) for name in others]])
        least = self.cost(params)
        for curve in self.data.curves.values():
            for rows, sign in product(_ROWS, (1.0, -1.0)):
                moved = params.copy()
                moved["touch" + curve.suffix].value += sign * rows * curve.spacing / UNITS["touch"]
                # The others follow, as they would in a fit.
                for name, change in zip(others, inverse @ self.residual(moved)):
                    moved[name].value -= change
                if (cost := self.cost(moved)) < least:
                    params, least = moved, cost
        return params

    def estimate_sigma(self, result: Any) -> None:
        """σ of the series without: residuals over rows less the parameters that they determine."""
        leverages = self.split(np.sum(np.linalg.qr(result.jac)[0] ** 2, axis=1))
        residuals = self.split(result.residual)
        for name in self.data.estimated:
            part, sigma = self.parts[name], self.sigma[name]
            rows, used = residuals[name], leverages[name]
            if part.step > math.sqrt(np.mean(rows**2)) * sigma[0]:
                # Outside contact all values may round to one: no noise is left.
                rows, used = rows[part.contact], used[part.contact]
            freedom = max(len(rows) - float(used.sum()), 1.0)
            # Data computed without noise leave residuals of rounding only.
            least = 1e-9 * float(np.abs(part.y).max()) / sigma[0]
            self.sigma[name] = sigma * max(math.sqrt(rows @ rows / freedom), least)

    def enlarge_sigma(self, result: Any) -> dict[str, float]:
        """Enlarge estimated σ so that rows determine as much as correlated ones (AR(1)) do.

        Returns the lag-1 autocorrelations of residuals in contact, where they aren't chance.
        """
        correlations = {}
        for name, curve in self.data.curves.items():
            inside = self.split(result.residual)[name][curve.contact]
            r = float(inside[1:] @ inside[:-1]) / max(float(inside @ inside), 1e-300)
            # That of independent residuals is normal, 1/√rows.
            if r * math.sqrt(len(inside)) > _CORRELATED:
                correlations[name] = r
                if name in self.data.estimated:
                    self.sigma[name] = self.sigma[name] * enlargement(r)
        return correlations

    def profiles(self, result: Any, coverage: float) -> dict[str, tuple[float, float]]:
        """95 % intervals where χ² rises by coverage², the other parameters being fitted again.

        Only if a curve has few rows: touch may lie between other two rows than in the best fit;
        linear intervals, which don't consider that, are too narrow. (lmfit's conf_interval stops
        where χ² falls for once.)
        """
        if not any(len(one.contact) <= _SPARSE for one in self.data.curves.values()):
            return {}

        def rises(one: lmfit.Parameter, value: float) -> bool:
            params = result.params.copy()
            params[one.name].set(value=value, vary=False)  # lmfit keeps it within its range
            found = self.solve(self.shifted(params), 1e-6)
            return bool(found.chisqr - result.chisqr > coverage**2)

        def end(one: lmfit.Parameter, step: float) -> float:
            near, far = 0.0, 1.0
            while far < 10.0 and not rises(one, one.value + far * step):
                near, far = far, 1.5 * far
            for _ in range(5):
                middle = 0.5 * (near + far)
                is_beyond = rises(one, one.value + middle * step)
                near, far = (near, middle) if is_beyond else (middle, far)
            return float(np.clip(one.value + far * step, one.min, one.max))

        free = [result.params[name] for name in self.names if name in result.var_names]
        return {
            one.name: (end(one, -coverage * one.stderr), end(one, coverage * one.stderr))
            for one in free
        }

    def curves_differ(self, result: Any) -> bool:
        """Whether χ² would fall by more than noise, linearly, if each curve had its own k."""
        if len(self.data.curves) < 2 or "k" not in result.var_names:
            return False
        slopes = self.split(result.jac[:, result.var_names.index("k")])
        own = [
            np.concatenate([rows * (part == curve) for part, rows in slopes.items()])
            for curve in [*self.data.curves][1:]
        ]
        (least,) = np.linalg.lstsq(np.column_stack([result.jac, *own]), result.residual)[1]
        return bool(result.chisqr - least > chdtri(len(own), 0.05))


def at_limits(result: Any) -> dict[str, Estimate]:
    """The parameters that are closer to a limit than the step of a difference."""
    found = {}
    steps = -result.covar @ (result.jac.T @ result.residual)
    for name, step, variance in zip(result.var_names, steps, result.covar.diagonal()):
        one = result.params[name]
        near_low = one.value - one.min < one.max - one.value
        limit, inward = (one.min, 1.0) if near_low else (one.max, -1.0)
        if abs(one.value - limit) <= step_of(name, one.value):
            # χ² is a parabola whose minimum lies beyond the limit.
            beyond = min(inward * step, 0.0)
            far = beyond + math.sqrt(beyond**2 + _ONE_SIDED * variance)
            low, high = sorted((limit, float(limit + inward * far)))
            found[name] = Estimate(limit, None, (low, high), limit)
    return found


def enlargement(r: float) -> float:
    """Of standard errors by a lag-1 autocorrelation."""
    return math.sqrt((1.0 + r) / (1.0 - r))
