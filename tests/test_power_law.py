"""The contact law with an exponent: against quadrature with 30 digits, and integration.

This law's tolerance is 1e-10 on the scales of the tolerance table. Closed forms and series do much
better, so the tolerances here are tighter; the worst case measured stands beside each.
"""

import math
from itertools import pairwise
from operator import mul
from typing import NamedTuple

import mpmath
import pytest
from golf_physics.laws.power_law import PowerLawContact
from golf_physics.values import Motion, Parameters
from numpy.polynomial.legendre import leggauss
from scipy.integrate import solve_ivp

#: That of exponent 1, which this law keeps too: rounding, and series of 18 terms.
TOLERANCE = 1e-13

#: Where the integration to compare with limits the accuracy: its relative tolerance is 3e-14.
INTEGRATION_TOLERANCE = 1e-12

M_CLUB, M_BALL = 0.210, 0.04593
MU = M_CLUB * M_BALL / (M_CLUB + M_BALL)
D_R = 5e-3

_mp = mpmath.mp.clone()
_mp.dps = 30
mpf = _mp.mpf


def contact(k, b, n, x_club, compression, v_club, v_ball, closing):
    parameters = Parameters(M_CLUB, M_BALL, 0.04, 0.0, 0.0, 2, n, D_R, 0.0, 0.0)
    start = Motion(x_club, x_club - compression, v_club, v_ball, compression, closing)
    return PowerLawContact(parameters, k, b, start)


def state_of(phase, t):
    state, scale = phase.dense_output()
    return state(scale * t)


class Start(NamedTuple):
    """One phase: the arguments of the contact law."""

    k: float
    b: float
    n: float
    compression: float = 0.0
    v_club: float = 35.0
    v_ball: float = 0.0

    def phase(self, **changed):
        k, b, n, compression, v_club, v_ball = start = self._replace(**changed)
        return contact(k, b, n, 0.0, compression, v_club, v_ball, start.closing)

    @property
    def closing(self):
        return self.v_club - self.v_ball

    def force(self, d, w):
        """The law itself, N."""
        relative = d / D_R
        return self.k * D_R * relative**self.n + self.b * relative ** (0.5 * (self.n - 1.0)) * w


def error(value, exact, scale=None):
    """The error of `value`, relative to `scale` (or to `exact`)."""
    return abs(float(value - exact)) / abs(float(exact if scale is None else scale))


def damping(k, n, zeta):
    return 2.0 * zeta * math.sqrt(0.5 * (n + 1.0) * k * MU)


# Quadrature with 30 digits, from touch


class Touch:
    """The same contact from first touch in 30 digits: y'' + 2ζy' + y = 0 from y = 0, y' = 1.

    y is (d/length)^m; y = 1 at d = length. Events are found by bisection, not by formulas.
    """

    def __init__(self, start):
        k, b, n, u = (mpf(value) for value in (start.k, start.b, start.n, start.closing))
        mu = mpf(M_CLUB) * mpf(M_BALL) / (mpf(M_CLUB) + mpf(M_BALL))
        self.k, self.n, self.u = k, n, u
        self.m, self.power = (n + 1) / 2, (n - 1) / (n + 1)
        omega = _mp.sqrt(self.m * k / mu)
        self.zeta = b / (2 * mu * omega)
        self.length = mpf(D_R) * (self.m * u / (mpf(D_R) * omega)) ** (1 / self.m)
        self.omega = self.m * u / self.length
        self.root = _mp.sqrt(_mp.mpc(self.zeta**2 - 1))

    def motion(self, sigma):
        """y and y'."""
        decay = _mp.exp(-self.zeta * sigma)
        sine = _mp.sinc(1j * self.root * sigma).real * sigma
        cosine = _mp.cosh(self.root * sigma).real
        return decay * sine, decay * (cosine - self.zeta * sine)

    def force(self, sigma):
        y, rate = self.motion(sigma)
        scale = self.k * mpf(D_R) * (self.length / mpf(D_R)) ** self.n
        return scale * y**self.power * (y + 2 * self.zeta * rate)

    def time(self, sigma):
        """∫ y^(-P) dσ / ω from touch; σ = v^m removes the singularity there."""
        m = self.m
        cuts = [min(sigma, 1 / max(1, self.zeta))]
        while cuts[-1] < sigma:
            cuts.append(min(2 * cuts[-1], sigma))
        total = _mp.quad(
            lambda v: m * (self.motion(v**m)[0] / v**m) ** -self.power, [0, cuts[0] ** (1 / m)]
        )
        for begin, end in pairwise(cuts):
            total += _mp.quad(
                lambda s: self.motion(s)[0] ** -self.power, [begin, (begin + end) / 2, end]
            )
        return total / self.omega

    def falls_through_zero(self, function, low, high):
        for _ in range(110):
            middle = _mp.sqrt(low * high)
            low, high = (middle, high) if function(middle) > 0 else (low, middle)
        return high

    @property
    def end(self):
        zeta = self.zeta
        high = 3 * _mp.log(3 + 2 * zeta) / max(zeta, 1)  # beyond 2 arccosh(ζ) / √(ζ² - 1)

        def drive(sigma):
            y, rate = self.motion(sigma)
            return y + 2 * zeta * rate

        low = _mp.mpf(1) / (1 + zeta)
        return self.falls_through_zero(drive, low / 4, min(high, _mp.pi * mpf("1.01")))

    @property
    def peak(self):
        def slope(sigma):
            y, rate = self.motion(sigma)
            drive = y + 2 * self.zeta * rate
            return self.power * rate * drive + y * (rate - 2 * self.zeta * drive)

        return self.falls_through_zero(slope, mpf("1e-30"), self.end)


def _from_touch():
    k = 8e5
    cases = [
        (n, zeta)
        for n in (1.0 + 1e-9, 1.5, 10.0)
        for zeta in (1e-6, 0.1, 0.5, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.5, 30.0, 1e4)
    ]
    cases += [(1.05, 0.8), (2.0, 0.7), (3.0, 0.3), (6.0, 0.82), (20.0, 0.2)]
    later = (1e-6, 0.5, 1.5, 30.0)  # and all of the least and the largest n
    return [
        pytest.param(
            Start(k, damping(k, n, zeta), n),
            id=f"n={n:.10g},zeta={zeta:.10g}",
            marks=[pytest.mark.ci] * (zeta in later or n in (1.0 + 1e-9, 10.0)),
        )
        for n, zeta in cases
    ]


@pytest.mark.parametrize("start", _from_touch())
def test_against_quadrature(start):
    exact = Touch(start)
    phase = start.phase()
    end, peak = exact.end, exact.peak
    time = exact.time(end)
    u = start.closing
    # Worst: 9e-16 (largest force; n = 10, ζ beside 1).
    assert error(phase.duration, time) < TOLERANCE
    y_end, rate_end = exact.motion(end)
    assert error(phase.value("w", phase.duration), u * rate_end, u) < TOLERANCE
    d_end = exact.length * abs(y_end) ** (1 / exact.m)
    assert error(state_of(phase, phase.duration)[5], d_end) < TOLERANCE
    force, when = phase.largest("force", phase.duration)
    largest = phase.largest("d", phase.duration)[0]
    assert error(force, exact.force(peak)) < TOLERANCE
    assert error(when, exact.time(peak), time) < TOLERANCE
    for fraction in (mpf("1e-4"), mpf("0.25"), mpf("0.8"), mpf("0.995")):
        sigma = end * fraction
        y, rate = exact.motion(sigma)
        t = float(exact.time(sigma))
        # Worst: 6e-15 (force; n = 20).
        f, _, _, _, _, d = state_of(phase, t)
        assert error(f, exact.force(sigma), force) < TOLERANCE
        assert error(d, exact.length * y ** (1 / exact.m), largest) < TOLERANCE
        assert error(phase.value("w", t), u * rate, u) < TOLERANCE
        assert error(phase.impulse(0.0, t), MU * u * (1 - rate), MU * u) < TOLERANCE


# Integration of the equations of motion as they stand


def integrated(start, t):
    """d, d' and the impulse at t by Runge–Kutta of order 8, from a compression above 0."""

    def rates(_, y):
        force = start.force(max(y[0], 0.0), y[1])
        return [y[1], -force / MU, force]

    first = [start.compression, start.closing, 0.0]
    atol = [1e-16, 1e-13, 1e-15]
    return solve_ivp(rates, (0.0, t), first, method="DOP853", rtol=3e-14, atol=atol).y[:, -1]


def _in_mid_contact():
    cases = {
        "as-before": Start(8e5, 20.0, 1.5, 3e-3, 30.0, 8.0),
        "opening": Start(8e5, 20.0, 1.615544, 5e-3, 26.0, 38.0),
        "opening-undamped": Start(8e5, 0.0, 2.5, 2e-3, 20.0, 48.0),
        "barely-touching": Start(8e5, 20.0, 1.5, 1e-5, 34.9, 0.1),
        "softened": Start(8e4, 20.0, 1.5, 5e-3, 28.0, 20.0),
        "stiffened": Start(8e7, 20.0, 3.0, 5e-3, 28.0, 20.0),
        "near-critical": Start(8e5, damping(8e5, 1.5, 1.0), 1.5, 3e-3, 30.0, 8.0),
        "overdamped": Start(8e5, damping(8e5, 1.5, 7.0), 1.5, 3e-3, 30.0, 8.0),
        "at-rest": Start(8e5, damping(8e5, 4.0, 0.6), 4.0, 6e-3, 30.0, 30.0),
        "nearly-apart": Start(8e5, damping(8e5, 1.5, 0.9), 1.5, 5e-3, 24.0, 35.0),
    }
    return [pytest.param(start, id=name) for name, start in cases.items()]


@pytest.mark.parametrize("start", _in_mid_contact())
def test_against_integration(start):
    phase = start.phase()
    time = phase.duration
    assert time > 0.0
    force, when = phase.largest("force", time)
    speed = start.v_club + start.v_ball
    largest = phase.largest("d", time)[0]
    # Spring and damper may nearly cancel.
    scale = max(force, start.force(start.compression, 0.0))
    forces = []
    for fraction in (0.05, 0.5, 0.9, 1.0):
        t = fraction * time
        d, w, impulse = integrated(start, t)
        f, _, _, v_club, v_ball, compression = state_of(phase, t)
        forces.append(f)
        # Worst: 4e-14 (speed; barely touching).
        assert error(compression, d, largest) < INTEGRATION_TOLERANCE
        assert error(phase.value("w", t), w, speed) < INTEGRATION_TOLERANCE
        assert error(v_club - v_ball, w, speed) < INTEGRATION_TOLERANCE
        assert error(f, start.force(max(d, 0.0), w), scale) < INTEGRATION_TOLERANCE
        assert error(phase.impulse(0.0, t), impulse, MU * speed) < INTEGRATION_TOLERANCE
        momentum = M_CLUB * start.v_club + M_BALL * start.v_ball
        assert error(M_CLUB * v_club + M_BALL * v_ball, momentum) < 1e-15
    assert force >= max(forces)
    # A stationary maximum, or the force falls from the start.
    step = 1e-4 * time
    if when > step:
        assert error(state_of(phase, when)[0], force) < TOLERANCE
        assert max(state_of(phase, when - step)[0], state_of(phase, when + step)[0]) < force
    else:
        assert when == 0.0
        assert error(force, start.force(start.compression, start.closing)) < TOLERANCE
        assert state_of(phase, step)[0] < force


def test_the_checks_can_fail():
    start = Start(8e5, 20.0, 1.5)
    assert error(start.phase(n=1.5 + 3e-12).duration, start.phase().duration) > TOLERANCE
    exact = Touch(start._replace(k=8e5 * (1.0 + 1e-12)))
    force, _ = start.phase().largest("force", 1.0)
    assert error(force, exact.force(exact.peak)) > TOLERANCE


def test_no_contact_is_a_phase_without_duration():
    # Suddenly damped so much that the force would be a pull.
    phase = Start(8e5, 1e4, 1.5, 1e-3, 20.0, 40.0).phase()
    assert phase.duration == 0.0
    assert state_of(phase, 0.0)[:1] == [0.0]
    assert state_of(phase, 0.0)[3:] == [20.0, 40.0, 1e-3]
    assert phase.impulse(0.0, 0.0) == 0.0
    assert phase.largest("d", 0.0)[0] == 1e-3


# Properties for any values


@pytest.mark.parametrize("n", [1.0 + 1e-9, 1.5, 10.0])
@pytest.mark.parametrize("zeta", [0.0, 0.1, 1.0, 30.0])
def test_impulse_is_exact_relative_to_its_width(n, zeta):
    start = Start(8e5, damping(8e5, n, zeta), n)
    phase = start.phase()
    time = phase.duration
    force, _ = phase.largest("force", time)
    nodes, weights = leggauss(8)
    for width in (1e-12 * time, 1e-6 * time, 1e-3 * time):
        for begin in (0.05 * time, 0.5 * time, 0.9 * time):
            # Against Gauss's quadrature of the force, which is smooth there: worst 6e-16.
            mean = phase.impulse(begin, width) / width
            half = 0.5 * width
            forces = [state_of(phase, begin + half + half * node)[0] for node in nodes]
            assert error(mean, 0.5 * sum(map(mul, weights, forces)), force) < TOLERANCE
        # From touch on, the pieces add up to the whole: worst 1.3e-15.
        pieces = sum(phase.impulse(width * i, width) for i in range(10))
        assert error(phase.impulse(0.0, 10.0 * width), pieces) < TOLERANCE
    whole = MU * (start.closing - phase.value("w", time))
    assert error(phase.impulse(0.0, time), whole) < TOLERANCE
    for count in (4, 10, 25, 60):
        steps = [time * i / count for i in range(count + 1)]
        pieces = sum(phase.impulse(a, b - a) for a, b in pairwise(steps))
        # Worst: 3e-15 (n = 10, ζ = 1), where the formulas for short and long intervals meet.
        assert error(pieces, whole) < TOLERANCE


def test_the_ends_are_exact():
    phase = Start(8e5, 20.0, 1.5, v_club=35.1, v_ball=0.1).phase()
    assert state_of(phase, 0.0) == [0.0, 0.0, 0.0, 35.1, 0.1, 0.0]
    assert phase.impulse(0.0, 0.0) == 0.0
    _, *ball, closing = phase.end()
    end = state_of(phase, phase.duration)
    assert ball == end[2:]
    assert closing == phase.value("w", phase.duration)
    assert end[0] == 0.0
    just_before = state_of(phase, math.nextafter(phase.duration, 0.0))
    for value, exact, scale in zip(just_before, end, (5e3, 0.02, 0.02, 35.0, 35.0, 7e-3)):
        assert error(value, exact, scale) < TOLERANCE
    start = Start(8e5, 20.0, 1.5, 1e-3, 35.1, 0.1)
    force, *others = state_of(start.phase(), 0.0)
    assert error(force, start.force(1e-3, 35.0)) < 1e-14
    assert others == [0.0, -1e-3, 35.1, 0.1, 1e-3]
    # Elastic: no compression remains, and it vanishes in proportion to the remaining time.
    elastic = Start(8e5, 0.0, 10.0).phase()
    assert state_of(elastic, elastic.duration)[5] == 0.0
    left = 1e-9 * elastic.duration
    assert error(state_of(elastic, elastic.duration - left)[5], 35.0 * left) < 1e-6
