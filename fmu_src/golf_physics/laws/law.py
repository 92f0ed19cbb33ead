"""A contact law: what is needed is its force and its drag."""

from .contact import ContactPhase, InitialState, Inputs, Parameters
from .integrated import IntegratedContact


class Law:
    """A contact law: m_C v_C' = -F - c v_C, m_B v_B' = F - c v_B with force F and drag c.

    Contact ends when force or compression falls to 0. A law that overrides nothing but `force` and
    `drag` is integrated numerically; `contact` may be overridden with a closed form.
    """

    #: As the FMU's enumeration shows it.
    name: str
    description: str

    def refusal(self, p: Parameters, inputs: Inputs) -> str | None:
        """Why the law rejects these values, or None.

        By default it has no power law and no given coefficient of restitution.
        """
        if p.exponent != 1.0:
            return (
                f"exponent = {p.exponent!r} is refused with law = {p.law} ({self.name}): set "
                "exponent = 1, or law = 2 (relative)"
            )
        if p.restitution_at_rest > 0.0:
            return (
                f"restitution_at_rest = {p.restitution_at_rest!r} is refused with law = {p.law} "
                f"({self.name}): set it to 0, or law = 2 (relative)"
            )
        return None

    def refusal_of_touch(self, p: Parameters, club_speed: float) -> str | None:
        """Why it rejects a touch at this club speed (m/s), or None."""
        return None

    def damping(self, p: Parameters, k: float, closing: float) -> float:
        """The damping b (N.s/m) for the parameters' coefficient of restitution.

        `closing` is the approach speed at first touch, m/s. Called only if `refusal` accepts
        restitution_at_rest > 0.
        """
        raise AssertionError("such parameters are refused")

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

        Raises:
            ArithmeticError: it leaves the range of a double, or the force can't be integrated.
        """

        def force(compression: float, closing: float) -> float:
            return self.force(p, k, b, compression, closing)

        return IntegratedContact(force, self.drag(b), p.m_club, p.m_ball, start)
