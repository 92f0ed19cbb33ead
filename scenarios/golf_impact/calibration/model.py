"""A contact law and the measurements that it has to meet, as lmfit minimizes their residuals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import product
from typing import Any, NamedTuple

import lmfit
import numpy as np

from golf_impact.calibration.measurements import Measurements, number
from golf_impact.calibration.series import IMPACT, RESTITUTION, UNITS, reduced_mass
from golf_impact.errors import UserError
from golf_impact.intervals import RANGES, ends_of
from golf_impact.quantities import LAWS_IN_WORDS

#: The parameters of COR = first − second · approach speed; they replace b.
LINE = ("restitution_at_rest", "restitution_slope")

#: The residual where no contact ends, σ.
FAR = 1e9

#: Rows of a curve with which a search begins.
FEW = 600

#: Damping ratios and exponents of the starts.
_ZETAS, _EXPONENTS = (1e-3, 0.02, 0.1, 0.3, 0.8, 3.0, 30.0), (1.05, 1.5, 2.2, 4.0)


class ContactLaw(NamedTuple):
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


class _Minimizer(lmfit.Minimizer):
    """lmfit's, whose `conf_interval` uses the same method as the fit."""

    def leastsq(self, *arguments: Any, **options: Any) -> Any:
        return self.least_squares()


class Problem:
    """Residuals of a law and their derivatives.

    Values have the FMU's names (SI units). A curve has besides those of `UNITS`, and perhaps a
    stiffness of its own: `touch_2`, `k_2` are those of the second one.

    Attributes:
        names: of the law's and the impact's parameters, fixed ones too, in order.
        sigma: standard deviations of the measured values, by the name of the part.

    Raises:
        UserError: the measurements can't determine the law's free parameters.
    """

    def __init__(
        self, data: Measurements, law: ContactLaw, apart: bool, fixed: Mapping[str, float]
    ) -> None:
        self.data, self.law, self.fixed, self.apart = data, law, fixed, apart
        self.parts = data.parts
        self.sigma = {name: part.guess.copy() for name, part in self.parts.items()}
        fitted = {*LINE} if data.cor_speeds else {"b"}
        fitted |= {"k", "exponent"} if data.sized else set()
        self._check_number(fitted)
        self.names = [name for name in RANGES if name in fitted]
        #: The curve that a parameter belongs to.
        self.owner: dict[str, str] = {}
        for curve, one in data.curves.items():
            self.owner |= dict.fromkeys(one.own, curve)
            self.names += [one.own[0]] if apart and one.suffix else []
        self.owner.pop("k", None)
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
        if law.law == 1 and line:
            raise UserError("cor_speeds are refused with law = 1: its damping has no COR line")
        sizes = [name for name in data.targets.measured if name not in RESTITUTION]
        have = len(sizes) + (line or len(data.targets.measured) > len(sizes)) + len(priors)
        need = 2 + (law.exponent is None) - sum(name in fixed for name in ("k", "b"))
        if have < need and not (data.curves or (line and need == 2 and not data.sized)):
            raise UserError(
                f"{law.title} can't be fitted: too few targets, {have} where {need} are needed "
                "(ball speed, club speed after and COR count once); give --curve FILE.csv, "
                "--cor-speeds FILE.csv or more of them, e.g. --cor 0.743 --contact-time 600e-6"
            )

    def values(self, params: lmfit.Parameters) -> dict[str, Any]:
        law = {"law": self.law.law, "reference_compression": self.law.reference_compression}
        if not self.data.sized:
            del law["reference_compression"]
        return law | params.valuesdict()

    def split(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """Rows by the name of the part that they are of."""
        ends = np.cumsum([len(sigma) for sigma in self.sigma.values()])[:-1]
        return dict(zip(self.parts, np.split(rows, ends)))

    def residuals(self, params: lmfit.Parameters) -> np.ndarray:
        """(model − measured)/σ of all parts, (n,); large where there is no contact that ends."""
        values = self.values(params)
        try:
            rows = np.concatenate(
                [(part.model(values) - part.y) / self.sigma[n] for n, part in self.parts.items()]
            )
        except UserError:
            # Far from any ball values may leave the FMU's range; the search has to turn back.
            rows = np.array([math.inf])
        if np.all(np.abs(rows) < FAR):
            return rows
        return np.full(sum(map(len, self.sigma.values())), FAR)

    def cost(self, params: lmfit.Parameters) -> float:
        return float(np.sum(self.residuals(params) ** 2))

    def jacobian(self, params: lmfit.Parameters, near: float = 0.0) -> np.ndarray:
        """Derivatives (n, p) of the residuals over the varied parameters, by differences.

        Rows within so many spacings of touch have none over its instant: the force jumps or rises
        steeply there.
        """
        values, columns, rows = self.values(params), [], sum(map(len, self.sigma.values()))
        names = [one.name for one in params.values() if one.vary]
        try:
            for name in names:
                owner = self.owner.get(name)
                of = name.partition("_")[0] if owner else name
                ends = ends_of(of, values[name])
                column = []
                for key, part in self.parts.items():
                    slope = np.zeros(len(part.y))
                    if owner in (None, key):
                        low, high = (part.model({**values, name: end}) for end in ends)
                        slope = (high - low) / (ends[1] - ends[0])
                    if of == "touch" and owner == key:
                        # A difference over the jump itself is none of the force.
                        close = max(near * part.spacing, UNITS[of] * (ends[1] - ends[0]))
                        slope[np.abs(part.since_touch(values)) <= close] = 0.0
                    column.append(slope / self.sigma[key])
                columns.append(np.concatenate(column))
        except UserError:
            columns = [np.zeros(rows)] * len(names)
        return np.reshape(columns, (len(names), rows)).T

    def minimizer(
        self, params: lmfit.Parameters, tolerance: float = 0.0, near: float = 0.0
    ) -> _Minimizer:
        # Of χ²; with many rows it is about their number, and 1e-3 a thirtieth of a σ.
        rows = sum(map(len, self.sigma.values()))
        if not tolerance:
            tolerance = 1e-10 if rows <= FEW else max(1e-10, 1e-3 / rows)
        found = _Minimizer(
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
            duration, speed = (
                1.2 * float(np.ptp(curve.x[curve.contact])),
                curve.impact["club_speed"],
            )
            early = [0.0, 0.1]
        reduced, omega = reduced_mass(data.impact), math.pi / duration
        zetas = (0.1,) if data.series else _ZETAS
        exponents = (law.exponent,) if law.exponent else _EXPONENTS
        starts = []
        for zeta, n, share in product(zetas, exponents, early):
            # With the compression L = m v/ω: √(m k/μ) = ω (d_r/L)^(m − 1).
            m = 0.5 * (n + 1.0)
            ratio = law.reference_compression * omega / (m * speed)
            k = self.fixed.get("k", reduced * omega**2 / m * ratio ** (n - 1.0))
            # The damping ratio is b/√(2 (n + 1) k μ).
            b = zeta * math.sqrt(2.0 * (n + 1.0) * k * reduced)
            guess = {name: prior.value for name, prior in data.priors.measured.items()}
            guess |= {"b": b, "exponent": n, **dict(zip(LINE, (0.8, 0.002))), **self.fixed}
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
