"""A linear contact, F = k d + damper · d', with a drag on each body: one form for both linear laws.

With the compression d, the closing speed w = v_club - v_ball and the reduced mass μ, the equations

    m_C v_C' = -(k d + damper w) - drag v_C,  m_B v_B' = k d + damper w - drag v_B,  d' = w

have one real rate -r (0 without drag) and a pair of rates -h ± iR. Every quantity is a row
(a, c, s) of coefficients:

    a e^(-rt) + c e^(-ht) cos Rt + s e^(-ht) sin Rt.

Sums, derivatives and integrals of rows are rows, and every event is a zero of a row, or of its
derivative. `closed_form.ClosedFormContact` evaluates rows in double precision,
`extended.ExtendedContact` in extended precision.
"""

from typing import Any

from .contact import ContactPhase

#: The coefficients of a quantity, float or Decimal.
Row = tuple[Any, Any, Any]


class LinearContact(ContactPhase):
    """A contact phase whose quantities are rows, whatever their precision."""

    #: r, h and R, 1/s.
    _rates: Row
    #: -1 if the pair of rates is real (cosh and sinh instead of cos and sin), else 1.
    _sign = 1

    def _row(self, name: str) -> Row:
        raise NotImplementedError

    def _slope(self, row: Row) -> Row:
        """The derivative of a row."""
        a, c, s = row
        r, h, second = self._rates
        return -r * a, second * s - h * c, -h * s - self._sign * second * c
