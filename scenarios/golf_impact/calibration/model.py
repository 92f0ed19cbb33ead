"""A contact law evaluated through the FMU at measured instants and speeds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from golf_impact.calibration.measurements import RESTITUTION, TARGETS, Measurements
from golf_impact.calibration.pulse import centre_and_width
from golf_impact.errors import UserError
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.fmu.uncertainty import RANGES

#: The parameters of COR = first − second · approach speed.
LINE = ("restitution_at_rest", "restitution_slope")


@dataclass(frozen=True)
class ContactLaw:
    """A law, and whether its exponent is free."""

    law: int  #: 1 (absolute) or 2 (relative)
    exponent: float | None  #: n, or None if it is free
    reference_compression: float = 0.005  #: d_r, at which k and b hold, m

    @classmethod
    def of(cls, law: int, exponent: float | str, reference_compression: float) -> ContactLaw:
        """From options: the exponent is a number or "free".

        Raises:
            UserError: there is no such law.
        """
        if not 0.0 < reference_compression < math.inf:
            raise UserError(
                f"--reference-compression {reference_compression!r} is refused: it must be a "
                "finite number of metres above 0"
            )
        n, refused = None, f"--exponent {exponent} is refused"
        if str(exponent).strip().lower() != "free":
            try:
                n = float(exponent)
            except ValueError:
                raise UserError(f"{refused}: it must be a number or the word free") from None
            least, largest = RANGES["exponent"][:2]
            if not least <= n <= largest:
                raise UserError(f"{refused}: it must be between {least:g} and {largest:g}, or free")
        if law == 1 and n != 1.0:
            raise UserError(
                f"{refused} with --law 1 (absolute), which is linear: leave it out, or take --law 2"
            )
        return cls(law, n, reference_compression)

    @property
    def title(self) -> str:
        if self.exponent is None:
            return "power law, n free"
        if self.exponent == 1.0:
            return "Kelvin–Voigt" if self.law == 2 else "absolute"
        return f"{'Tsuji' if self.exponent == 1.5 else 'power law'}, n = {self.exponent:g}"

    @property
    def options(self) -> str:
        """As options of the command line."""
        n = "free" if self.exponent is None else f"{self.exponent:g}"
        return "--law 1" if self.law == 1 else f"--exponent {n}"


class Model:
    """One law and the measurements that it has to meet.

    The coordinates of a fit suit least squares better than k and b. With v the club speed,
    m = (n + 1)/2 and ω = √(m k/μ) at the reference compression, the length L with
    ω (L/d_r)^(m − 1) = m v/L is the compression that the speed would reach without damping, up to a
    factor of order 1; ζ = b/(2 μ ω). Then speeds depend on ζ alone, times are proportional to L and
    forces to 1/L, whatever d_r is. They are

    - length: ln(L/1 m),
    - damping: ζ up to 1 and 1 + ln ζ beyond, or the two parameters of a COR line,
    - exponent: n, if free,
    - touch: the instant of touch by the curve's clock, as (instant − centroid)/width of the
      measured force pulse, if there is a curve.
    """

    def __init__(self, fmu: ImpactFmu, data: Measurements, law: ContactLaw) -> None:
        self.fmu, self.data, self.law = fmu, data, law
        self.line = data.cor_speeds is not None
        #: Coordinates, and the FMU's parameters that they stand for.
        self.coordinates = (
            *(["length"] if data.sized else []),
            *(LINE if self.line else ["damping"]),
            *(["exponent"] if law.exponent is None and data.sized else []),
            *(["touch"] if data.curve is not None else []),
        )
        #: The FMU's names of what is fitted. A COR line replaces b.
        self.free = (
            *(["k"] if data.sized else []),
            *([] if self.line else ["b"]),
            *(["exponent"] if "exponent" in self.coordinates else []),
            *(LINE if self.line else []),
        )
        titles = [law.title] * data.sized + ["COR line"] * self.line
        self.title = " with ".join(titles) or law.title
        #: Reduced mass times club speed, kg·m/s.
        self.momentum = data.conditions.reduced_mass * data.conditions.club_speed
        #: Centroid and standard width of the force pulse, s.
        self.pulse = (0.0, 1.0)
        if data.curve is not None:
            self.pulse = centre_and_width(data.curve.x, data.curve.y)
        #: What the law predicts of the scalars; times and forces need a stiffness.
        self.predictable = tuple(n for n in TARGETS if data.sized or n in RESTITUTION)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Of the coordinates, for least_squares."""
        ranges = RANGES | {"damping": RANGES["b"]}
        unbounded = (-math.inf, math.inf, 0.0)
        low, high, _ = zip(*(ranges.get(name, unbounded) for name in self.coordinates))
        return np.array(low), np.array(high)

    def values(self, x: np.ndarray) -> dict[str, float]:
        """Inputs and parameters of the FMU at these coordinates, by name (SI units)."""
        at = dict(zip(self.coordinates, map(float, x)))
        conditions, d = self.data.conditions, self.law.reference_compression
        mu, v = conditions.reduced_mass, conditions.club_speed
        values: dict[str, float] = {"law": self.law.law}
        if "length" in at:
            length = math.exp(at["length"])
            n = at.get("exponent", self.law.exponent or 1.0)
            m = 0.5 * (n + 1.0)
            omega = m * (v / length) * (d / length) ** (m - 1.0)
            values |= {"k": mu * omega * omega / m, "exponent": n, "reference_compression": d}
            if "damping" in at:
                zeta = at["damping"] if at["damping"] <= 1.0 else math.exp(at["damping"] - 1.0)
                values["b"] = 2.0 * zeta * mu * omega
        return values | {name: at[name] for name in LINE if name in at} | vars(conditions)

    def touch(self, x: np.ndarray) -> float:
        """The instant of touch by the curve's clock at these coordinates, s; 0 without a curve."""
        if "touch" not in self.coordinates:
            return 0.0
        centre, width = self.pulse
        return centre + width * float(x[self.coordinates.index("touch")])

    def predict(self, values: Mapping[str, float], touch: float) -> np.ndarray | None:
        """All measured values as the FMU gives them; None if the bodies never separate.

        Args:
            values: inputs and parameters of the FMU.
            touch: the instant of touch by the curve's clock, s.
        """
        data, cor = self.data, "coefficient_of_restitution"
        try:
            scalars = self.scalars(values)
            if scalars is None:
                return None
            parts: list[Any] = [[scalars[name] for name in data.targets]]
            if data.curve is not None:
                parts.append(self.forces(values, data.curve.x - touch, scalars["contact_time"]))
            if data.cor_speeds is not None:
                cases = ({**values, "club_speed": v} for v in data.cor_speeds.x.tolist())
                parts.append([self.fmu.impact((cor,), **case)[cor] for case in cases])
        except (UserError, OverflowError):
            # Far from any ball values may leave the FMU's range; the search has to turn back.
            return None
        return np.concatenate(parts)

    def scalars(self, values: Mapping[str, float]) -> dict[str, float] | None:
        """What each scalar target would be, by its name; None if the bodies never separate."""
        outputs = {name: TARGETS[name][0] for name in self.predictable}
        given = self.fmu.impact(tuple(outputs.values()), **values)
        if not self.fmu.flag("separated"):
            return None
        return {name: given[output] for name, output in outputs.items()}

    def forces(
        self, values: Mapping[str, float], instants: np.ndarray, contact_time: float
    ) -> np.ndarray:
        """Contact force (N) at ascending instants since touch (s), in one run of the FMU."""
        force = np.zeros(len(instants))
        inside = (instants > 0.0) & (instants < contact_time)
        if inside.any():
            self.fmu.start(**values)
            times = np.concatenate([[0.0], instants[inside]])
            force[inside] = self.fmu.sampled(times, ("force",))["force"][1:]
        return force
