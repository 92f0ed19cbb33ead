"""A contact law: what is needed is its force and its drag."""

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType

from ..refusals import MOST_PUSH, MOST_PUSH_OF_POWER_LAW, refusal
from ..values import Inputs, Motion, Parameters, Refusal
from .contact import ContactPhase
from .integrated import IntegratedContact
from .linear import linear_contact


class Law:
    """A contact law: m_C v_C' = P - F - c v_C, m_B v_B' = F - c v_B with force F, drag c, and
    the force P on the club head.

    Contact ends when force or compression falls to 0. A law that overrides nothing but `force` and
    `drag` is integrated numerically; `contact` may be overridden with a closed form. The parameters
    p are those of the table of variables, k is in N/m, b in N.s/m.
    """

    #: Parameters that this law alone uses, with their values where they have no effect: other laws
    #: reject other values.
    own_parameters: Mapping[str, float] = MappingProxyType({})

    def refusal_of_touch(self, p: Parameters, inputs: Inputs) -> Refusal | None:
        """Why it rejects a touch under these inputs, or None."""
        return self.refusal_of_push(p, inputs, inputs.club_speed - p.ball_speed)

    def refusal_of_push(self, p: Parameters, inputs: Inputs, closing: float) -> Refusal | None:
        """Why it rejects the force on the club head after this approach speed, m/s, or None."""
        return None

    def damping(self, p: Parameters, k: float, closing: float) -> float:
        """The damping, N.s/m, for `restitution_at_rest` and this approach speed, m/s."""
        raise NotImplementedError

    def force(self, p: Parameters, k: float, b: float, compression: float, closing: float) -> float:
        """Contact force, N, from the compression, m, and its rate of change, m/s.

        It must continue smoothly below zero force and zero compression, where solvers evaluate it
        while they locate the end of contact.
        """
        raise NotImplementedError

    def drag(self, b: float) -> float:
        """The coefficient c of the drag on each body, N.s/m."""
        return 0.0

    def contact(self, p: Parameters, inputs: Inputs, start: Motion) -> ContactPhase:
        """The phase that begins at `start`: first touch while closing, or a force above 0.

        The inputs are those that act. Raises ArithmeticError if the phase leaves the range of a
        double or can't be integrated.
        """
        k, b, _, club_force = inputs
        force = partial(self.force, p, k, b)
        return IntegratedContact(force, self.drag(b), p.m_club, p.m_ball, start, club_force)


class LinearLaw(Law):
    """F = k d + damper · d', or a drag on each body: in closed form; with both it is integrated."""

    def damper(self, b: float) -> float:
        """The coefficient of the closing speed, N.s/m."""
        return 0.0

    def refusal_of_push(self, p: Parameters, inputs: Inputs, closing: float) -> Refusal | None:
        k, _, _, club_force = inputs
        n, length = p.exponent, p.reference_compression
        share, rate = p.m_ball / (p.m_club + p.m_ball), closing / length
        # Of the compression that the energy leads to, relative to `length`, the power n + 1.
        power = 0.5 * (n + 1.0) * (p.m_club * share / k) * rate * rate
        contact_force = k * length * power ** (n / (n + 1.0))
        most = MOST_PUSH if n == 1.0 else MOST_PUSH_OF_POWER_LAW
        if share * abs(club_force) <= most * contact_force:
            return None
        words = {"most": most, "contact_force": contact_force}
        return refusal("LARGE_PUSH", "club_force", club_force, **words)

    def force(self, p: Parameters, k: float, b: float, compression: float, closing: float) -> float:
        return k * compression + self.damper(b) * closing

    def contact(self, p: Parameters, inputs: Inputs, start: Motion) -> ContactPhase:
        k, b, _, club_force = inputs
        damper, drag = self.damper(b), self.drag(b)
        if damper and drag:
            return super().contact(p, inputs, start)
        return linear_contact(k, damper, drag, p.m_club, p.m_ball, start, club_force)
