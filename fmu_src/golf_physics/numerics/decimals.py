"""exp, cos and sin of decimals: `decimal` has no cosine, and its exp is several times as slow."""

from collections.abc import Callable
from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal, localcontext
from functools import cache
from math import perm
from typing import Any

#: π to 130 digits.
PI = Decimal(
    "3.1415926535897932384626433832795028841971693993751058209749445923078164062862089986280348253"
    "421170679821480865132823066470938446"
)

#: An argument is halved, an angle taken a third of, so often before its series. Undoing that costs
#: some 4 digits.
_HALVINGS, _THIRDS = 12, 4

#: Below this e^x is 0: its exponent would soon leave the range, which is 10⁹ times smaller where
#: Python has 32 bits, as in WebAssembly.
_VANISHED = Decimal(MIN_EMIN)


@cache
def arithmetic(digits: int) -> tuple[Callable[..., Any], ...]:
    """Of decimals with so many digits, at most 120: a context manager under which they have them;
    e^x and cosine and sine of an angle (rad), to be called under it.
    """
    context = Context(prec=digits, Emax=MAX_EMAX, Emin=MIN_EMIN)
    with localcontext(context):
        ln_ten, two_pi = Decimal(10).ln(), 2 * PI
        zero, one, three, minus_four = Decimal(0), Decimal(1), Decimal(3), Decimal(-4)
        halved, third = one / 2**_HALVINGS, one / (4 * 3**_THIRDS)
        first, *exp_series = _series(ln_ten / 2 * halved, 1, digits)
        lead, *sin_series = _series(PI * third, 2, digits)

    def exp(x: Decimal) -> Decimal:
        if x < _VANISHED:
            return zero
        tens = (x / ln_ten).to_integral_value()
        small = tens.fma(-ln_ten, x) * halved
        total = first
        for coefficient in exp_series:
            total = total.fma(small, coefficient)
        for _ in range(_HALVINGS):
            total *= total
        return total.scaleb(int(tens))

    def cos_sin(angle: Decimal) -> tuple[Decimal, Decimal]:
        turns = (angle / two_pi).to_integral_value()
        small = turns.fma(-two_pi, angle) * third
        # Of the sine's series with signs that alternate.
        square = -small * small
        sine = lead
        for coefficient in sin_series:
            sine = sine.fma(square, coefficient)
        sine *= small
        for _ in range(_THIRDS):
            sine *= minus_four.fma(sine * sine, three)
        # Of a quarter of the angle, so the cosine is above 0.7.
        cosine = (one - sine * sine).sqrt()
        for _ in range(2):
            cosine, sine = one - 2 * sine * sine, 2 * sine * cosine
        return cosine, sine

    return lambda: localcontext(context), exp, cos_sin


def _series(largest: Decimal, stride: int, digits: int) -> list[Decimal]:
    """Coefficients of e^x (stride 1) or of sinh x / x in x² (stride 2), the last one first.

    As many as an argument up to `largest` needs.
    """
    terms, n = [Decimal(1)], stride - 1
    while abs(terms[-1]) * largest ** (n + stride) > Decimal(10) ** (-digits - 1):
        n += stride
        terms.append(terms[-1] / perm(n, stride))
    return terms[::-1]
