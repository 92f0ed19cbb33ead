"""What a contact law predicts for a target, through the FMU, in coordinates that suit a fit."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from golf_impact.calibration.targets import TARGETS, Conditions
from golf_impact.errors import UserError
from golf_impact.fmu.impact_fmu import ImpactFmu

#: The least and the largest exponent that the FMU takes.
LIMITS = (1.0, 12.0)


@dataclass(frozen=True)
class ContactLaw:
    """A law and which of its parameters are free; k and b always are."""

    law: int  #: 1 (absolute) or 2 (relative)
    exponent: float | None  #: n, or None if it is free too
    reference_compression: float = 0.005  #: d_r, at which k and b hold, m

    @property
    def title(self) -> str:
        if self.exponent is None:
            return "power law, n free"
        if self.exponent == 1.0:
            return "Kelvin–Voigt" if self.law == 2 else "absolute"
        return f"{'Tsuji' if self.exponent == 1.5 else 'power law'}, n = {self.exponent:g}"

    @property
    def free(self) -> tuple[str, ...]:
        """The FMU's names of the free parameters."""
        return ("k", "b") if self.exponent is not None else ("k", "b", "exponent")


def asked_for(law: int, exponent: str, reference_compression: float) -> ContactLaw:
    """The law of the command line; the exponent is a number as text, or "free".

    Raises:
        UserError: there is no such law.
    """
    if not 0.0 < reference_compression < math.inf:
        raise UserError(
            f"--reference-compression {reference_compression!r} is refused: it must be a finite "
            "number of metres above 0"
        )
    n, refused = None, f"--exponent {exponent} is refused"
    if exponent.strip().lower() != "free":
        try:
            n = float(exponent)
        except ValueError:
            raise UserError(f"{refused}: it must be a number or the word free") from None
        least, largest = LIMITS
        if not least <= n <= largest:
            raise UserError(f"{refused}: it must be between {least:g} and {largest:g}, or free")
    if law == 1 and n != 1.0:
        raise UserError(
            f"{refused} with --law 1 (absolute), which is linear: leave it out, or take --law 2"
        )
    return ContactLaw(law, n, reference_compression)


@dataclass(frozen=True)
class Coordinates:
    """A contact by its size, damping and shape.

    With v the club speed, m = (n + 1)/2 and ω = √(m k/μ) at the reference compression,
    ζ = b/(2 μ ω), and L is the compression that the speed would reach without damping, up to a
    factor of order 1: ω (L/d_r)^(m - 1) = m v/L. Then speeds depend on ζ alone, times are
    proportional to L and forces to 1/L, whatever d_r is.
    """

    length: float  #: L, m
    damping: float  #: z = ζ up to 1, and 1 + ln ζ beyond: smooth, and b = 0 is within reach
    exponent: float  #: n

    @classmethod
    def of(cls, length: float, zeta: float, exponent: float) -> "Coordinates":
        return cls(length, zeta if zeta <= 1.0 else 1.0 + math.log(zeta), exponent)

    @property
    def zeta(self) -> float:
        return self.damping if self.damping <= 1.0 else math.exp(self.damping - 1.0)


class Predictor:
    """One law in one impact."""

    def __init__(self, fmu: ImpactFmu, conditions: Conditions, law: ContactLaw) -> None:
        self.conditions = conditions
        self.law = law
        self._fmu = fmu
        self._outputs = {name: output for name, (output, *_) in TARGETS.items()}

    def values(self, at: Coordinates) -> dict[str, Any]:
        """All inputs and parameters of the FMU that the result needs, by name (SI units)."""
        mu, v = self.conditions.reduced_mass, self.conditions.club_speed
        n, d = at.exponent, self.law.reference_compression
        m = 0.5 * (n + 1.0)
        omega = m * (v / at.length) * (d / at.length) ** (m - 1.0)
        return {
            "k": mu * omega * omega / m,
            "b": 2.0 * at.zeta * mu * omega,
            "law": self.law.law,
            "exponent": n,
            "reference_compression": d,
            **vars(self.conditions),
        }

    def predict(self, at: Coordinates) -> dict[str, float] | None:
        """What each target would be, by its name; None if the bodies never part."""
        try:
            outputs = self._fmu.impact(tuple(self._outputs.values()), **self.values(at))
        except (UserError, OverflowError):
            # Far from any ball, values may leave what the FMU takes; a fit only has to turn back.
            return None
        if not self._fmu.read_flag("separated"):
            return None
        return {name: outputs[output] for name, output in self._outputs.items()}

    def path(self, at: Coordinates) -> dict[str, np.ndarray]:
        """`time` since touch (s) and contact `force` (N)."""
        return self._fmu.trajectory(names=("force",), **self.values(at))

    def sensitivities(self, at: Coordinates) -> list[list[float]]:
        """d(k, b, n)/d(ln L, z, n), by rows."""
        n, values = at.exponent, self.values(at)
        k, b, mu = values["k"], values["b"], self.conditions.reduced_mass
        size = -(n + 1.0)
        shape = 1.0 / (n + 1.0) + math.log(self.law.reference_compression / at.length)
        critical = 2.0 * mu * math.sqrt(0.5 * (n + 1.0) * k / mu)
        steep = 1.0 if at.damping <= 1.0 else at.zeta
        return [
            [k * size, 0.0, k * shape],
            [0.5 * b * size, critical * steep, 0.5 * b * (shape + 1.0 / (n + 1.0))],
            [0.0, 0.0, 1.0],
        ]
