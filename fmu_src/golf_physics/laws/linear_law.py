"""A law whose force is linear in compression and closing speed, and so has a closed form."""

from .closed_form import ClosedFormContact
from .contact import ContactPhase, InitialState, Parameters
from .extended import ExtendedContact
from .law import Law


def linear_contact(
    k: float, damper: float, drag: float, m_club: float, m_ball: float, start: InitialState
) -> ContactPhase:
    """The contact phase from `start` on, in double precision where that suffices."""
    if not (damper and drag):
        contact = ClosedFormContact(k, damper, drag, m_club, m_ball, start)
        if contact.duration:
            return contact
    return ExtendedContact(k, damper, drag, m_club, m_ball, start)


class LinearLaw(Law):
    """F = k d + damper · d', and a drag on each body; see `Law`."""

    def damper(self, b: float) -> float:
        """The coefficient of the closing speed, N.s/m."""
        return 0.0

    def force(self, p: Parameters, k: float, b: float, compression: float, closing: float) -> float:
        return k * compression + self.damper(b) * closing

    def contact(self, p: Parameters, k: float, b: float, start: InitialState) -> ContactPhase:
        return linear_contact(k, self.damper(b), self.drag(b), p.m_club, p.m_ball, start)
