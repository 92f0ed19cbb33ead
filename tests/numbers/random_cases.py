"""Random impacts at the borders of closed forms, and close to them. SI units.

`golf_impact.random_impacts` never falls there: dampings at which rates coincide or the FMU changes
to extended precision, equal masses, a fast common motion, changes of k and b just at an event.
"""

import math
import random

import numpy as np

from golf_impact.random_impacts import (
    ImpactCase,
    contact_time_of_law_2,
    critical_damping,
    segments_of,
)

#: Borders between double and extended precision, by law; and, under law 2, the damping at which the
#: largest force moves to the start.
_BORDERS = {1: (0.7,), 2: (0.999, 0.5)}


def coinciding_rates(m_club, m_ball):
    """The damping ratios at which two of law 1's rates coincide.

    The zeros of the discriminant of s³ + 2ζs² + (1 + 4ζ²u)s + 4ζu, u = m_club m_ball / M², a cubic
    in ζ².
    """
    u = m_club * m_ball / (m_club + m_ball) ** 2
    one, z = np.poly1d([4.0 * u, 1.0]), np.poly1d([1.0, 0.0])  # 1 + 4 z u, z
    cubic = 144.0 * u * z * one - 128.0 * u * z**2 + 4.0 * z * one**2 - 4.0 * one**3
    cubic = cubic - 432.0 * u**2 * z
    roots = [root.real for root in cubic.roots if abs(root.imag) < 1e-6 * abs(root)]
    return sorted(math.sqrt(root) for root in roots if root > 0.0)


def special_impact(seed, number):
    """A random impact; the same for the same seed and number, on any machine."""
    rng = random.Random(f"special {seed}/{number}")
    law = rng.choice((1, 2))
    m_club = rng.choice((0.25, 10.0 ** rng.uniform(-3, 1)))
    ratio = rng.choice((1.0, 0.25, 2.0 ** rng.randint(-12, 12), rng.uniform(0.08, 0.2)))
    m_ball = m_club * rng.choice((ratio, 10.0 ** rng.uniform(-4, 4)))
    k = rng.choice((2.0**20, 1e6, 10.0 ** rng.uniform(2, 12)))
    more = [2.0, *(2 * coinciding_rates(m_club, m_ball))] if law == 1 else [1.0]
    zeta = rng.choice([*_BORDERS[law], *more])
    values = {"law": law, "m_club": m_club, "m_ball": m_ball, "k": k}
    b = values["b"] = beside(rng, zeta * critical_damping(values))
    # Speeds of few bits: their difference is exact, and so is the instant of touch.
    mantissa, power = math.frexp(10.0 ** rng.uniform(-6, 3))
    closing = rng.choice((32.0, 35.0, math.ldexp(round(4096 * mantissa), power - 12)))
    ball_speed = rng.choice((0.0, 0.0, 1.0, -1.0)) * closing * 2.0 ** rng.randint(-4, 40)
    gap = rng.choice((0.0, closing * 2.0 ** rng.randint(-14, -6)))
    values |= {"club_speed": ball_speed + closing, "ball_speed": ball_speed, "gap": gap}
    contact = contact_time_of_law_2(values)
    # K and b change at touch, at the peak, in the rebound or at separation, also back.
    others = [(k, b), (k, 0.0), (k, beside(rng, b)), (k * 4.0, b), (k * 4.0, 2.0 * b)]
    others += [(k * 10.0 ** rng.uniform(-6, 6), b * 10.0 ** rng.uniform(-3, 3))]
    places = [0.0, 0.5, 0.75, 1.0 - 10.0 ** rng.uniform(-12, -2), 1.0]
    places += [0.5 + n * 2.0**-10 for n in range(4)]
    touch, cuts = gap / closing, sorted(rng.sample(places, rng.choice((0, 0, 1, 2, 5))))
    changes = [(touch + cut * contact, *rng.choice(others)) for cut in cuts]
    return ImpactCase(values, segments_of(values, touch + contact + 2.0 * contact, changes))


def beside(rng, value):
    """This value, some units in its last place beside it, or up to a thousandth of it."""
    kind = rng.randrange(3)
    if kind == 1:
        for _ in range(rng.randint(1, 4)):
            value = math.nextafter(value, rng.choice((0.0, math.inf)))
    elif kind == 2:
        value *= 1.0 + rng.choice((1.0, -1.0)) * 10.0 ** rng.uniform(-15, -3)
    return value
