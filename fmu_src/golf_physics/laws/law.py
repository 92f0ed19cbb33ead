"""A contact law: what is needed is its force and its drag."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from .closed_form import linear_contact
from .contact import ContactPhase, InitialState, Inputs
from .integrated import IntegratedContact

if TYPE_CHECKING:
    from ..parameters import Parameters


class Law:
    """A contact law: m_C v_C' = -F - c v_C, m_B v_B' = F - c v_B with force F and drag c.

    Contact ends when force or compression falls to 0. A law that overrides nothing but `force` and
    `drag` is integrated numerically; `contact` may be overridden with a closed form. The parameters
    p are those of the table of variables, k is in N/m, b in N.s/m.
    """

    #: As the FMU's enumeration shows it.
    name: str
    description: str

    def refusal(self, p: Parameters, inputs: Inputs) -> str | None:
        """Why the law rejects these values, or None; by default all that only law 2 has."""
        if p.exponent != 1.0:
            given, remedy = f"exponent = {p.exponent!r}", "set exponent = 1"
        elif p.restitution_at_rest > 0.0:
            given, remedy = f"restitution_at_rest = {p.restitution_at_rest!r}", "set it to 0"
        else:
            return None
        return (
            f"{given} is refused with law = {p.law} ({self.name}): {remedy}, or law = 2 (relative)"
        )

    def refusal_of_touch(self, p: Parameters, club_speed: float) -> str | None:
        """Why it rejects a touch at this club speed (m/s), or None."""
        return None

    def damping(self, p: Parameters, k: float, b: float, closing: float) -> float:
        """The damping that acts, N.s/m, in a contact with this approach speed, m/s."""
        return b

    def force(self, p: Parameters, k: float, b: float, compression: float, closing: float) -> float:
        """Contact force, N, from the compression, m, and its rate of change, m/s.

        It must continue smoothly below zero force and zero compression, where solvers evaluate it
        while they locate the end of contact.
        """
        raise NotImplementedError

    def drag(self, b: float) -> float:
        """The coefficient c of the drag on each body, N.s/m."""
        return 0.0

    def contact(self, p: Parameters, k: float, b: float, start: InitialState) -> ContactPhase:
        """The phase that begins at `start`: first touch while closing, or a force above 0.

        Raises ArithmeticError if it leaves the range of a double or can't be integrated.
        """
        force = partial(self.force, p, k, b)
        return IntegratedContact(force, self.drag(b), p.m_club, p.m_ball, start)


class LinearLaw(Law):
    """F = k d + damper · d', or a drag on each body: in closed form; both in extended precision."""

    def damper(self, b: float) -> float:
        """The coefficient of the closing speed, N.s/m."""
        return 0.0

    def force(self, p: Parameters, k: float, b: float, compression: float, closing: float) -> float:
        return k * compression + self.damper(b) * closing

    def contact(self, p: Parameters, k: float, b: float, start: InitialState) -> ContactPhase:
        return linear_contact((k, self.damper(b), self.drag(b), p.m_club, p.m_ball), start)
