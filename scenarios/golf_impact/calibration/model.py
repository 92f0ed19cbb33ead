"""What a contact law gives for measurements: residuals and their derivatives, for lmfit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from golf_impact.api import run_impact, run_trajectory
from golf_impact.arrays.impacts import closed_contact
from golf_impact.calibration.curves import reduced_mass
from golf_impact.calibration.intervals import RANGES, ends_of
from golf_impact.calibration.measurements import IMPACT, TARGETS, Measurements, number
from golf_impact.errors import UserError, missing_package
from golf_impact.quantities import LAWS_IN_WORDS

try:
    import lmfit
    from scipy.interpolate import CubicSpline
except ModuleNotFoundError:
    raise missing_package("calibrate", "lmfit", "calibrate") from None

#: The parameters of COR = first − second · approach speed; they replace b.
LINE = ("restitution_at_rest", "restitution_slope")

#: Parameters of a curve in lmfit's fit, with their units in SI units: the instant of touch since
#: the curve's origin, offset and drift of its baseline. Their scales are alike.
UNITS = {"touch": 1e-6, "offset": 1.0, "drift": 1e3}

#: The residual where no contact ends, σ.
FAR = 1e9

#: Damping ratios and exponents of the starts.
_ZETAS, _EXPONENTS = (1e-3, 0.02, 0.1, 0.3, 0.8, 3.0, 30.0), (1.05, 1.5, 2.2, 4.0)

#: Rows in contact above which the force is a cubic spline between so many instants, denser towards
#: touch; instants where the contact isn't in closed form, so that each of them takes longer.
_INSTANTS, _SCALAR_INSTANTS = 1000, 300


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


def of_curve(name: str, curve: str) -> str:
    """The name of a parameter that belongs to one of several curves: touch_2 of curve_2."""
    return name + curve.removeprefix("curve")


class Problem:
    """A law and the measurements that it has to meet.

    Values have the FMU's names (SI units). A curve has besides those of `UNITS`, and perhaps a
    stiffness of its own: `touch_2`, `k_2` are those of the second one.

    Attributes:
        names: of the law's and the impact's parameters, fixed ones too, in order.
        sigma: standard deviations of the measured values, (n,).
    """

    def __init__(
        self, data: Measurements, law: ContactLaw, apart: bool, fixed: Mapping[str, float]
    ) -> None:
        self.data, self.law, self.fixed, self.apart = data, law, fixed, apart
        self.sigma = data.sigma.copy()
        fitted = [*LINE] if data.cor_speeds else ["b"]
        fitted += ["k", "exponent"] if data.sized else []
        self.names = [name for name in RANGES if name in fitted]
        self.names += [of_curve("k", name) for name in [*data.curves][1:] if apart]
        self.names += [name for name in IMPACT if name in data.priors]
        self.of_law: dict[str, Any] = {"law": law.law}
        if data.sized:
            self.of_law["reference_compression"] = law.reference_compression
        #: The curve that a parameter belongs to, and its name there.
        self.own = {
            of_curve(name, curve): (curve, name)
            for curve in data.curves
            for name in ("k", *UNITS)
            if (curve, name) != ("curve", "k")
        }

    def values(self, params: lmfit.Parameters) -> dict[str, Any]:
        return {**self.of_law, **params.valuesdict()}

    def impact(
        self, values: Mapping[str, Any], conditions: Mapping[str, float] | None = None
    ) -> dict[str, Any]:
        """Inputs and parameters of the FMU, at these conditions or those of scalars."""
        of_impact = {name: values[name] for name in IMPACT if name in values}
        of_law = {n: v for n, v in values.items() if n in self.of_law or n in RANGES}
        return {**of_law, **(conditions or self.data.impact), **of_impact}

    def scalars(self, names: Sequence[str], values: Mapping[str, Any]) -> dict[str, float]:
        """Scalars of these names, by the physics of the FMU to the last bit."""
        found = run_impact([TARGETS[name] for name in names], **self.impact(values))
        if any(map(math.isnan, found.values())):
            raise UserError("the bodies don't separate")
        return dict(zip(names, found.values()))

    def curve(self, name: str, values: Mapping[str, Any]) -> np.ndarray:
        """Force and baseline of a curve, N."""
        curve = self.data.curves[name]
        touch, offset, drift = (
            unit * values.get(of_curve(of, name), 0.0) for of, unit in UNITS.items()
        )
        since = curve.x - curve.origin
        impact = self.impact(values, curve.impact)
        impact["k"] = values.get(of_curve("k", name), values["k"])
        return _forces(since - touch, impact) + offset + drift * since

    def model(self, values: Mapping[str, Any]) -> np.ndarray:
        """All that is measured, (n,).

        UserError: the physics rejects a value, or the bodies don't separate.
        """
        data, parts = self.data, []
        if data.targets:
            parts.append(np.array([*self.scalars([*data.targets], values).values()]))
        parts += [self.curve(name, values) for name in data.curves]
        if data.cor_speeds:
            # Law 2 takes its damping from this line.
            rest, slope = (values[name] for name in LINE)
            parts.append(rest - slope * data.cor_speeds.x)
            if parts[-1].min() <= 0.0:
                raise UserError("COR isn't above 0 at these speeds")
        parts.append(np.array([values[name] for name in data.priors]))
        return np.concatenate(parts)

    def residuals(self, params: lmfit.Parameters) -> np.ndarray:
        """(model − measured)/σ; large where there is no contact that ends."""
        try:
            residuals = (self.model(self.values(params)) - self.data.values) / self.sigma
        except UserError:
            # Far from any ball values may leave the FMU's range; the search has to turn back.
            residuals = np.full(len(self.sigma), FAR)
        return residuals if np.all(np.abs(residuals) < FAR) else np.full(len(self.sigma), FAR)

    def jacobian(self, params: lmfit.Parameters, near: float = 0.0) -> np.ndarray:
        """Derivatives (n, p) of the residuals over the varied parameters, by differences.

        Rows within so many spacings of touch have none over its instant: the force jumps or rises
        steeply there.
        """
        values = self.values(params)
        names = [one.name for one in params.values() if one.vary]
        slopes = np.zeros((len(names), len(self.sigma)))
        try:
            for slope, name in zip(slopes, names):
                curve, of = self.own.get(name, ("", name))
                ends = ends_of(of, values[name])
                rows = self.data.groups[curve] if curve else slice(None)
                low, high = (
                    self.curve(curve, moved) if curve else self.model(moved)
                    for moved in ({**values, name: end} for end in ends)
                )
                slope[rows] = (high - low) / (ends[1] - ends[0])
                if of == "touch":
                    one = self.data.curves[curve]
                    since = one.x - one.origin - UNITS[of] * values[name]
                    # A difference over the jump itself is none of the force.
                    close = max(near * one.spacing, UNITS[of] * (ends[1] - ends[0]))
                    slope[rows][np.abs(since) <= close] = 0.0
        except UserError:
            slopes[:] = 0.0
        return slopes.T / self.sigma[:, None]

    def starts(self) -> list[lmfit.Parameters]:
        """A grid of ζ and n; k from an undamped contact as long as the curve's, or 0.5 ms."""
        data, law = self.data, self.law
        duration, impact, early = 5e-4, data.impact, [0.0]
        for curve in [*data.curves.values()][:1]:
            duration, impact = 1.2 * float(np.ptp(curve.x[curve.contact])), curve.impact
            early = [0.0, 0.1]
        reduced, omega = reduced_mass(data.impact), math.pi / duration
        zetas = (0.1,) if data.series else _ZETAS
        exponents = (law.exponent,) if law.exponent else _EXPONENTS
        starts = []
        for zeta, n, share in product(zetas, exponents, early):
            # With the compression L = m v/ω: √(m k/μ) = ω (d_r/L)^(m − 1).
            m = 0.5 * (n + 1.0)
            ratio = law.reference_compression * omega / (m * impact["club_speed"])
            k = self.fixed.get("k", reduced * omega**2 / m * ratio ** (n - 1.0))
            # The damping ratio is b/√(2 (n + 1) k μ).
            b = zeta * math.sqrt(2.0 * (n + 1.0) * k * reduced)
            guess = {name: prior.value for name, prior in data.priors.items()}
            guess |= {"b": b, "exponent": n, **dict(zip(LINE, (0.8, 0.002)))}
            params = lmfit.Parameters()
            for name in self.names:
                free = name not in self.fixed and not (name == "exponent" and law.exponent)
                value = self.fixed.get(name, guess.get(name, k))
                params.add(name, value, free, *RANGES.get(name, (-math.inf, math.inf)))
            for name, curve in data.curves.items():
                own = (-share * duration, *curve.baseline)
                for (of, unit), value in zip(UNITS.items(), own):
                    params.add(of_curve(of, name), value / unit)
            starts.append(params)
        return starts


def _forces(times: np.ndarray, impact: Mapping[str, Any]) -> np.ndarray:
    """Contact force at times since first touch, N."""
    force, contact = np.zeros(times.shape), closed_contact(impact)
    if contact:
        most, end = _INSTANTS, contact.contact_time
    else:
        most, end = _SCALAR_INSTANTS, run_impact(["contact_time"], **impact)["contact_time"]
    if not end > 0.0:
        raise UserError("the bodies don't separate")
    inside = (times > 0.0) & (times < end)
    rows = instants = times[inside]
    if len(rows) > most:
        instants = end * np.linspace(1e-3, 1.0 - 1e-9, most) ** 2
    if contact:
        sampled = contact.forces(instants)
    else:
        sampled = run_trajectory(0, ["force"], times=instants, **impact)["force"]
    if rows is not instants:
        sampled = CubicSpline(np.sqrt(instants), sampled)(np.sqrt(rows))
    force[inside] = sampled
    return force
