"""A linear contact, F = k d + c d', with a drag on each body: one form for both linear laws.

With the compression d, the closing speed w = v_club - v_ball and the reduced mass μ, the equations

    m_C v_C' = -(k d + damper w) - drag v_C,  m_B v_B' = k d + damper w - drag v_B,  d' = w

have one real rate -r (0 without drag) and a pair of rates -h ± iR. Every quantity is a row
(a, c, s) of coefficients:

    a e^(-rt) + c e^(-ht) cos Rt + s e^(-ht) sin Rt.

Sums, derivatives and integrals of rows are rows, and every event is a zero of a row: contact ends
when the force falls to zero, the force peaks when its derivative does, the compression when the
closing speed does. `closed_form.ClosedFormContact` evaluates rows in double precision,
`extended.ExtendedContact` in extended precision.
"""

from collections.abc import Iterable
from typing import Any

from .contact import ContactPhase, largest_until

#: The coefficients of a quantity, float or Decimal.
Row = tuple[Any, Any, Any]


class LinearContact(ContactPhase):
    """What rows give, whatever their precision; see `ContactPhase`."""

    #: r, h and R, 1/s.
    _rates: Row
    #: -1 if the pair of rates is real (cosh and sinh instead of cos and sin), else 1.
    _sign = 1
    #: Contact force (N), compression (m), closing speed (m/s).
    _force: Row
    _d: Row
    _w: Row

    def _values(self, rows: Iterable[Row], t: float) -> list[float]:
        """The values of rows at t."""
        raise NotImplementedError

    def _integral(self, row: Row, begin: float, width: float) -> float:
        """The integral of a row over [begin, begin + width]."""
        raise NotImplementedError

    def _find_maxima(self, row: Row) -> list[tuple[float, float]]:
        """The maxima of a row inside the contact: times (s) and values."""
        raise NotImplementedError

    def _slope(self, row: Row) -> Row:
        """The derivative of a row."""
        a, c, s = row
        r, h, second = self._rates
        return -r * a, second * s - h * c, -h * s - self._sign * second * c

    def compression(self, t: float) -> float:
        return self._values((self._d,), t)[0]

    def closing(self, t: float) -> float:
        return self._values((self._w,), t)[0]

    def impulse(self, begin: float, width: float) -> float:
        return self._integral(self._force, begin, width)

    def peak_force(self, t: float) -> tuple[float, float]:
        return self._largest("_force", t)

    def peak_compression(self, t: float) -> float:
        return self._largest("_d", t)[0]

    def _largest(self, name: str, t: float) -> tuple[float, float]:
        """The largest value of a row on [0, t], and its time, s."""
        row, found = getattr(self, name), self.__dict__.setdefault("_maxima", {})
        if name not in found:
            found[name] = self._find_maxima(row)
        return largest_until(t, lambda t: self._values((row,), t)[0], found[name])
