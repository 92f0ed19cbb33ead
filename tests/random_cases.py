"""Random cases by their numbers, the same on any machine. SI units."""

import math
import random

import numpy as np
from cases import CASES, Case

from golf_impact.evidence.random_impacts import (
    contact_time_of_law_2,
    critical_damping,
    random_impact,
)


def far(number):
    """Far beyond golf, as `golf-impact stress` has them; some with changes of the speed before
    touch, or of the force alone.
    """
    impact = random_impact(24, number, pushed=number % 2 == 0)
    changes, before = impact.changes, impact.approach / 2.0
    if number % 4 == 0:
        changes = tuple((time, {"club_force": x["club_force"]}) for time, x in changes)
    if before:
        speed = impact.values["ball_speed"] + impact.closing * (1.0 + 0.3 * (number % 3))
        changes = ((before, {"club_speed": speed}), *changes)
    return Case("far", impact.values, changes, impact.end, impact.start_time)


_REFUSED = [{"k": -1.0}, {"m_ball": 0.0}, {"exponent": 13.0}, {"gap": 1e99}, {"ball_diameter": 0.0}]


def whole(number, pushed=0.03):
    """As `accepted`, but one of ten is refused."""
    rng, values = random.Random(f"refused {number}"), accepted(number, pushed)
    return values | (rng.choice(_REFUSED) if rng.random() < 0.1 else {})


def accepted(number, pushed):
    """Values of an impact in golf or far beyond it, some of them with a force on the head."""
    rng = random.Random(f"whole {number}")
    m_club = rng.choice((rng.uniform(0.05, 0.5), 10.0 ** rng.uniform(-3, 1)))
    m_ball = rng.choice((rng.uniform(0.02, 0.1), 10.0 ** rng.uniform(-3, 1)))
    values = {
        "law": rng.choice([1, 2, 2]), "m_club": m_club, "m_ball": m_ball,
        "k": 10.0 ** rng.uniform(3, 9) if rng.random() < 0.3 else rng.uniform(2e5, 3e6),
        "club_speed": rng.uniform(1.0, 80.0), "gap": rng.choice([0.0, rng.uniform(0.0, 0.01)]),
        "ball_speed": rng.choice([0.0, rng.uniform(-20.0, 4.0)]),
    }  # fmt: skip
    ratio = rng.choice(
        [
            0.0,
            rng.uniform(0.0, 0.9),
            10.0 ** rng.uniform(-4, 1),
            10.0 ** rng.uniform(1, 3.9),
            beside(rng, 1.0),
        ]
    )
    if values["law"] == 2 and rng.random() < 0.5:
        values["exponent"] = rng.choice([1.0 + 1e-9, 1.5, rng.uniform(1.0, 3.0), 5.0, 12.0])
        values["reference_compression"] = 10.0 ** rng.uniform(-3, -1)
    n = values.get("exponent", 1.0)
    values["b"] = ratio * math.sqrt(0.5 * (n + 1.0)) * critical_damping(values)
    if values["law"] == 2 and rng.random() < 0.3:
        values["restitution_at_rest"] = rng.uniform(0.1, 1.0)
        values["restitution_slope"] = rng.uniform(0.0, 0.01)
    if rng.random() < pushed and ratio < 10.0:
        values["club_force"] = rng.uniform(-2000.0, 2000.0)
    return values


#: Damping ratios up to which modes are separate, by law; and, under law 2, the one at which
#: the largest force moves to the start.
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


def special(number):
    """At and near the damping up to which the modes of a linear contact are separate: rates
    coincide, equal masses, a fast common motion, changes of k and b just at an event.
    """
    rng = random.Random(f"special {number}")
    law = rng.choice((1, 2))
    m_club = rng.choice((0.25, 10.0 ** rng.uniform(-3, 1)))
    ratio = rng.choice((1.0, 0.25, 2.0 ** rng.randint(-12, 12), rng.uniform(0.08, 0.2)))
    m_ball = max(1e-6, m_club * rng.choice((ratio, 10.0 ** rng.uniform(-4, 4))))
    k = rng.choice((2.0**20, 1e6, 10.0 ** rng.uniform(2, 12)))
    # Those of coinciding rates twice as often.
    more = [2.0, *(2 * coinciding_rates(m_club, m_ball))] if law == 1 else [1.0]
    zeta = rng.choice([*_BORDERS[law], *more])
    values = {"law": law, "m_club": m_club, "m_ball": m_ball, "k": k}
    b = values["b"] = beside(rng, zeta * critical_damping(values))
    # Speeds of few bits: their difference is exact, and so is the instant of touch.
    mantissa, power = math.frexp(10.0 ** rng.uniform(-6, 3))
    closing = rng.choice((32.0, 35.0, math.ldexp(round(4096 * mantissa), power - 12)))
    ball_speed = rng.choice((0.0, 0.0, 1.0, -1.0)) * closing * 2.0 ** rng.randint(-4, 9)
    gap = rng.choice((0.0, closing * 2.0 ** rng.randint(-14, -6)))
    values |= {"club_speed": ball_speed + closing, "ball_speed": ball_speed, "gap": gap}
    contact = contact_time_of_law_2(values)
    # K and b change at touch, at the peak, in the rebound or at separation, also back.
    others = [(k, b), (k, 0.0), (k, beside(rng, b)), (k * 4.0, b), (k * 4.1, 2.0 * b)]
    others += [(k * 10.0 ** rng.uniform(-3, 3), b * 10.0 ** rng.uniform(-3, 2))]
    # Just at separation the last bit decides whether they still have an effect.
    places = [0.0, 0.5, 0.75, *(1.0 + sign * 10.0 ** rng.uniform(-12, -2) for sign in (-1, 1))]
    places += [0.5 + n * 2.0**-10 for n in range(4)]
    touch, cuts = gap / closing, sorted(rng.sample(places, rng.choice((0, 0, 1, 2, 5))))
    changes = [(touch + cut * contact, dict(zip("kb", rng.choice(others)))) for cut in cuts]
    changes = tuple((time, inputs) for time, inputs in changes if time)
    return Case("special", values, changes, touch + 3.0 * contact)


def beside(rng, value):
    """This value, some units in its last place beside it, or up to a thousandth of it."""
    kind = rng.randrange(3)
    if kind == 1:
        for _ in range(rng.randint(1, 4)):
            value = math.nextafter(value, rng.choice((0.0, math.inf)))
    elif kind == 2:
        value *= 1.0 + rng.choice((1.0, -1.0)) * 10.0 ** rng.uniform(-15, -3)
    return value


def history(way, number):
    """All outputs of a way at some instants of an impact, and what it refuses, as text.

    A first step finds touch, the largest force and separation. Instants are there, or some units in
    the last place beside, in between, and long after. Before some steps inputs change, also so that
    the bodies just part, or a state is restored.
    """
    rng, case = random.Random(f"history {number}"), _case_of_history(number)
    values, found = case.values, []
    accepted, now = way.begin(case.given, case.start).step(case.end or 1.0), way.read()
    if not accepted:
        return repr((now, way.messages))
    touch, span = now["touch_time"] - case.start, now["contact_time"] or case.end or 1.0
    critical, peak = critical_damping(values), now["max_force"] or 1.0
    may_be_pushed = values["b"] < 2.0 * critical  # otherwise the integration is slow

    def changed(kind):
        if kind == 0 and may_be_pushed:
            power = rng.uniform(-4, rng.choice((0, 1, 8)))
            return {"club_force": rng.choice((0.0, 1.0, -1.0)) * peak * 10.0**power}
        if kind == 1:
            return {"club_speed": values["club_speed"] * rng.uniform(0.5, 2.0)}
        if kind == 2:
            return {name: values[name] for name in ("k", "b")}
        if kind == 3:
            relative = now["compression"] / values["reference_compression"]
            stiffness = values["k"] * relative ** (0.5 * (values["exponent"] - 1.0))
            opening = now["ball_velocity"] - now["club_velocity"]
            none_left = stiffness * now["compression"] / opening if opening > 0.0 else 0.0
            return {"b": min(beside(rng, none_left), 3.0 * critical)}
        factors = 1.0, beside(rng, 1.0), 4.0, 10.0 ** rng.uniform(-3, 3)
        dampings = 0.0, rng.random(), beside(rng, 1.0), 10.0 ** rng.uniform(-3, 1)
        k, b = values["k"] * rng.choice(factors), critical * rng.choice(dampings)
        return {"k": k, "b": rng.choice((b, values["b"]))}

    events = touch, touch + now["time_of_max_force"], touch + span
    points = [beside(rng, rng.choice(events)) for _ in range(rng.randint(0, 3))]
    points += [touch + span * rng.uniform(0.0, 1.1) for _ in range(rng.randint(1, 4))]
    points += [point + span * 10.0 ** rng.uniform(-15, -2) for point in points[::2]]
    points += [touch + span * 10.0 ** rng.uniform(0, 4)]
    way.begin(values | (changed(0) if number % 5 in (0, 4) else {}), case.start)
    time = 0.0
    for point in sorted(points):
        if rng.random() < 0.1:
            saved = way.save(as_bytes=rng.random() < 0.5)
            found.append(way.step(span * rng.random()))
            way.restore(saved)
        size = point - time
        for _ in range(rng.choice((1, 1, 1, 2)) if size > 0.0 else 0):
            way.set(**(changed(rng.choice((0, 1, 1, 2, 3, 4, 4))) if rng.random() < 0.5 else {}))
            accepted, now = way.step(size), way.read()
            found += [accepted, now]
            time += size
    return repr((found, way.messages))


def _case_of_history(number):
    """One of `CASES`, at borders, far beyond golf, of any kind, or a power law's."""
    kind = number % 5
    if kind == 0:
        return [*CASES.values()][number // 5 % len(CASES)]
    if kind == 1:
        return special(number)
    if kind == 2:
        return far(number)
    rng, values = random.Random(f"start {number}"), whole(number, pushed=0.3)
    if kind == 4:
        values |= {"law": 2, "exponent": rng.choice((1.0 + 1e-9, 1.5, rng.uniform(1.0, 12.0)))}
        values["b"] *= rng.choice((0.0, 1.0, 1.0))
    return Case("whole", values, start=rng.choice((0.0, 0.0, -4.5, 3.7)))
