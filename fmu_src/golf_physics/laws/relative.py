"""Law 2: a spring and a damper between the bodies (Kelvin–Voigt).

The contact force F = k d + b d', with the compression d and the closing speed d', acts on both
bodies alike, so momentum is conserved. Contact ends when it has fallen to zero: the bodies can push
but not pull (Schwager & Pöschel, Granular Matter 9, 465–469, 2007). With an exponent the spring
stiffens, and a contact is a `PowerLawContact`.

Measured balls have COR = e₀ - slope · v (v: approach speed at first touch), which no fixed damping
gives: COR = exp(-2ζs(ζ)) depends on the damping ratio ζ alone, whatever the exponent, with s =
arccos ζ/√(1-ζ²), or arccosh ζ/√(ζ²-1) above critical damping. So ζ is chosen at touch.
"""

from math import sqrt
from types import MappingProxyType

from ..refusals import refusal
from ..restitution import LEAST, damping_ratio
from ..values import Inputs, Motion, Parameters, Refusal
from .contact import ContactPhase
from .law import Law, LinearLaw
from .linear import linear_contact
from .power_law import PowerLawContact


class RelativeLaw(LinearLaw):
    """Law 2; see `Law`."""

    own_parameters = MappingProxyType({"exponent": 1.0, "restitution_at_rest": 0.0})

    def refusal_of_touch(self, p: Parameters, inputs: Inputs) -> Refusal | None:
        """A coefficient of restitution that falls with speed must stay in 0…1."""
        closing = inputs.club_speed - p.ball_speed
        coefficient = p.restitution_at_rest - p.restitution_slope * closing
        if not p.restitution_at_rest or LEAST <= coefficient <= 1.0:
            return self.refusal_of_push(p, inputs, closing)
        return refusal(
            "TOUCH", "club_speed", inputs.club_speed, at_rest=p.restitution_at_rest,
            slope=p.restitution_slope, closing=closing, coefficient=coefficient, least=LEAST,
        )  # fmt: skip

    def damping(self, p: Parameters, k: float, closing: float) -> float:
        # Outputs may be read before a step is refused for a COR out of range.
        coefficient = p.restitution_at_rest - p.restitution_slope * closing
        zeta = damping_ratio(max(coefficient, LEAST))
        mu = p.m_club * (p.m_ball / (p.m_club + p.m_ball))
        return 2.0 * zeta * mu * sqrt(0.5 * (p.exponent + 1.0) * (k / mu))

    def contact(self, p: Parameters, inputs: Inputs, start: Motion) -> ContactPhase:
        k, b, _, club_force = inputs
        if p.exponent == 1.0:
            return linear_contact(k, b, 0.0, p.m_club, p.m_ball, start, club_force)
        if not club_force:
            return PowerLawContact(p, k, b, start)
        # In the scaled time it is a power of x, without a closed form.
        return Law.contact(self, p, inputs, start)

    def damper(self, b: float) -> float:
        return b

    def force(self, p: Parameters, k: float, b: float, compression: float, closing: float) -> float:
        n = p.exponent
        if n == 1.0:
            return super().force(p, k, b, compression, closing)
        power = (abs(compression) / p.reference_compression) ** (0.5 * (n - 1.0))
        return power * (k * power * compression + b * closing)
