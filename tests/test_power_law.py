"""The contact law with an exponent: against references of 25 digits, quadrature and integration.

The bar for this law is 1e-10 on the scales of the tolerance table. Closed forms and series do much
better, so the tolerances here are tighter; the worst case measured stands beside each.
"""

import json
import math
import random
from itertools import pairwise
from operator import mul
from pathlib import Path
from typing import NamedTuple

import mpmath
import pytest
from golf_physics.laws import contact as contacts
from golf_physics.laws import relative
from golf_physics.laws.power_law import PowerLawContact
from numpy.polynomial.legendre import leggauss
from scipy.integrate import solve_ivp
from test_two_ways import contact_of

#: The bar of exponent 1, which this law keeps too: rounding, and series of 18 terms.
BAR = 1e-13

#: Where the integration to compare with is what limits: it has a relative tolerance of 3e-14.
INTEGRATION_BAR = 1e-12

M_CLUB, M_BALL = 0.210, 0.04593
MU = M_CLUB * M_BALL / (M_CLUB + M_BALL)
D_R = 5e-3

_mp = mpmath.mp.clone()
_mp.dps = 30
mpf = _mp.mpf


def power_law(
    k, b, m_club, m_ball, x_club, compression, v_club, v_ball, closing=None, *,
    exponent, reference_compression,
):  # fmt: skip
    closing = v_club - v_ball if closing is None else closing
    start = contacts.InitialState(x_club, compression, v_club, v_ball, closing)
    return PowerLawContact(k, b, m_club, m_ball, start, exponent, reference_compression)


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
        start = self._replace(**changed)
        return power_law(
            start.k,
            start.b,
            M_CLUB,
            M_BALL,
            0.0,
            start.compression,
            start.v_club,
            start.v_ball,
            exponent=start.n,
            reference_compression=D_R,
        )

    @property
    def closing(self):
        return self.v_club - self.v_ball

    def force(self, d, w):
        """The law itself, N."""
        relative = d / D_R
        return self.k * D_R * relative**self.n + self.b * relative ** (0.5 * (self.n - 1.0)) * w


def off(value, exact, scale=None):
    """How far `value` is from `exact`, relative to `scale` (or to `exact`)."""
    return abs(float(value - exact)) / abs(float(exact if scale is None else scale))


def damping(k, n, zeta):
    return 2.0 * zeta * math.sqrt(0.5 * (n + 1.0) * k * MU)


# The printed references


def _reference_cases():
    table = json.loads((Path(__file__).parent / "data" / "power_law.json").read_text())
    return [pytest.param(case, id=f"power-law-{n}") for n, case in enumerate(table["cases"])]


@pytest.mark.parametrize("case", _reference_cases())
def test_reference(case):
    given = {name: float(value) for name, value in case["inputs"].items()}
    expected = {name: float(value) for name, value in case["results"].items()}
    n, u = given["n"], given["u_club_mps"]
    b = expected["c"] * D_R ** (0.5 * (n - 1.0))
    phase = power_law(
        given["spring_force_at_5mm_N"] / D_R,
        b,
        given["m_club_kg"],
        given["m_ball_kg"],
        0.0,
        0.0,
        u,
        0.0,
        exponent=n,
        reference_compression=D_R,
    )
    time = phase.duration
    force, x_club, x_ball, v_club, v_ball, d = state_of(phase, time)
    # The references' quadratures are good to 1e-15. Worst here: 5e-16 (compression at the end), and
    # 1.2e-15 where it is a difference of positions.
    bar = 1e-14
    assert off(time, expected["T"]) < bar
    assert force == 0.0
    assert off(v_club, expected["v_club"]) < bar
    assert off(v_ball, expected["v_ball"]) < bar
    assert off((v_ball - v_club) / u, expected["e"]) < bar
    assert off(d, expected["dsep"]) < bar
    assert off(x_club - x_ball, expected["dsep"]) < bar
    largest, when = phase.peak_force(time)
    assert off(largest, expected["F"]) < bar
    assert off(when, expected["tF"]) < bar
    assert off(phase.peak_compression(time), expected["dmax"]) < bar
    assert off(state_of(phase, expected["t_dmax"])[5], expected["dmax"]) < bar
    assert off(phase.closing(expected["t_dmax"]), 0.0, u) < bar


# Quadrature with 30 digits, from touch


class Touch:
    """The same contact from first touch in 30 digits: y'' + 2ζy' + y = 0 from y = 0, y' = 1.

    y is (d/length)^m and length what y = 1 means. Events are found by bisection, not by formulas.
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
        """∫ y^(-P) dσ / ω from touch; σ = v^m takes the singularity there away."""
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
    assert off(phase.duration, time) < BAR
    y_end, rate_end = exact.motion(end)
    assert off(phase.closing(phase.duration), u * rate_end, u) < BAR
    d_end = exact.length * abs(y_end) ** (1 / exact.m)
    assert off(state_of(phase, phase.duration)[5], d_end) < BAR
    force, when = phase.peak_force(phase.duration)
    largest = phase.peak_compression(phase.duration)
    assert off(force, exact.force(peak)) < BAR
    assert off(when, exact.time(peak), time) < BAR
    for fraction in (mpf("1e-4"), mpf("0.25"), mpf("0.8"), mpf("0.995")):
        sigma = end * fraction
        y, rate = exact.motion(sigma)
        t = float(exact.time(sigma))
        # Worst: 6e-15 (force; n = 20).
        f, _, _, _, _, d = state_of(phase, t)
        assert off(f, exact.force(sigma), force) < BAR
        assert off(d, exact.length * y ** (1 / exact.m), largest) < BAR
        assert off(phase.closing(t), u * rate, u) < BAR
        assert off(phase.impulse(0.0, t), MU * u * (1 - rate), MU * u) < BAR


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
    force, when = phase.peak_force(time)
    speed = start.v_club + start.v_ball
    largest = phase.peak_compression(time)
    # Spring and damper may nearly cancel.
    scale = max(force, start.force(start.compression, 0.0))
    forces = []
    for fraction in (0.05, 0.5, 0.9, 1.0):
        t = fraction * time
        d, w, impulse = integrated(start, t)
        f, _, _, v_club, v_ball, compression = state_of(phase, t)
        forces.append(f)
        # Worst: 4e-14 (speed; barely touching).
        bar = INTEGRATION_BAR
        assert off(compression, d, largest) < bar
        assert off(phase.closing(t), w, speed) < bar
        assert off(v_club - v_ball, w, speed) < bar
        assert off(f, start.force(max(d, 0.0), w), scale) < bar
        assert off(phase.impulse(0.0, t), impulse, MU * speed) < bar
        momentum = M_CLUB * start.v_club + M_BALL * start.v_ball
        assert off(M_CLUB * v_club + M_BALL * v_ball, momentum) < 1e-15
    assert force >= max(forces)
    # A stationary maximum, or the force falls from the start.
    step = 1e-4 * time
    if when > step:
        assert off(state_of(phase, when)[0], force) < BAR
        assert max(state_of(phase, when - step)[0], state_of(phase, when + step)[0]) < force
    else:
        assert when == 0.0
        assert off(force, start.force(start.compression, start.closing)) < BAR
        assert state_of(phase, step)[0] < force


@pytest.mark.parametrize(("n", "smoothing"), [(1.5, 4), (2.0, 2), (3.0, 1), (1.25, 8)])
def test_touch_against_integration_over_compression(n, smoothing):
    # The law's infinite slope at d = 0 disappears with d = z^smoothing as the variable.
    start = Start(8e5, damping(8e5, n, 0.3), n)
    phase = start.phase()
    top = (0.7 * phase.peak_compression(phase.duration)) ** (1.0 / smoothing)

    def rates(z, y):
        d = z**smoothing
        stretch = smoothing * z ** (smoothing - 1)
        return [stretch / y[1], -start.force(d, y[1]) / (MU * y[1]) * stretch]

    t, w = solve_ivp(
        rates, (0.0, top), [0.0, start.closing], method="DOP853", rtol=3e-14, atol=1e-18
    ).y[:, -1]
    # Worst: 1.3e-14 (n = 1.5).
    assert off(state_of(phase, t)[5], top**smoothing) < BAR
    assert off(phase.closing(t), w) < BAR


def test_the_checks_can_fail():
    start = Start(8e5, 20.0, 1.5)
    assert off(start.phase(n=1.5 + 3e-12).duration, start.phase().duration) > BAR
    exact = Touch(start._replace(k=8e5 * (1.0 + 1e-12)))
    force, _ = start.phase().peak_force(1.0)
    assert off(force, exact.force(exact.peak)) > BAR


# A change of k or b in mid-contact


@pytest.mark.parametrize("zeta", [0.0, 0.1, 0.9, 1.0, 5.0, 200.0])
@pytest.mark.parametrize("n", [1.0 + 1e-9, 1.5, 4.0])
def test_a_new_phase_continues_the_old_one(n, zeta):
    start = Start(8e5, damping(8e5, n, zeta), n)
    whole = start.phase()
    force, _ = whole.peak_force(whole.duration)
    for fraction in (1e-9, 1e-3, 0.4, 0.9):
        t = fraction * whole.duration
        f, x_club, x_ball, v_club, v_ball, d = state_of(whole, t)
        rest = power_law(
            start.k,
            start.b,
            M_CLUB,
            M_BALL,
            x_club,
            d,
            v_club,
            v_ball,
            whole.closing(t),
            exponent=n,
            reference_compression=D_R,
        )
        assert x_ball == x_club - d
        # Where spring and damper nearly cancel, what is left of the force, and of the time, is as
        # good as their rounding.
        # Worst: 5e-15, and 4e-13 of 1.6e-11 allowed (ζ = 200).
        bar = BAR + 1e-15 * start.force(d, 0.0) / f
        assert off(t + rest.duration, whole.duration) < bar
        for share in (0.01, 0.5, 1.0):
            later = share * rest.duration
            got, expected = state_of(rest, later), state_of(whole, min(t + later, whole.duration))
            length = 35.0 * whole.duration
            scales = (force, length, length, 35.0, 35.0, length)
            for value, reference, scale in zip(got, expected, scales):
                assert off(value, reference, scale) < bar


def test_many_changes():
    # k and b change at 40 instants; each phase against the integration, and all of them against
    # the conservation of momentum.
    rng = random.Random(4)
    start = Start(8e5, 20.0, 1.7)
    phase = start.phase()
    for _ in range(40):
        t = 0.03 * phase.duration
        _, _, _, v_club, v_ball, d = state_of(phase, t)
        k, b = 8e5 * rng.uniform(0.5, 2.0), rng.uniform(0.0, 60.0)
        start = Start(k, b, 1.7, d, v_club, v_ball)
        if start.force(d, v_club - v_ball) <= 0.0:
            break
        phase = start.phase()
        d, w, _ = integrated(start, phase.duration)
        # Worst: 5e-14 (speed).
        assert off(state_of(phase, phase.duration)[5], d, 7e-3) < INTEGRATION_BAR
        assert off(phase.closing(phase.duration), w, 35.0) < INTEGRATION_BAR
    # Worst: 2e-16.
    momentum = M_CLUB * start.v_club + M_BALL * start.v_ball
    assert off(momentum, M_CLUB * 35.0) < 1e-14


def test_no_contact_is_a_phase_without_duration():
    # Damped so much all at once that the force would pull.
    phase = Start(8e5, 1e4, 1.5, 1e-3, 20.0, 40.0).phase()
    assert phase.duration == 0.0
    assert state_of(phase, 0.0)[:1] == [0.0]
    assert state_of(phase, 0.0)[3:] == [20.0, 40.0, 1e-3]
    assert phase.impulse(0.0, 0.0) == 0.0
    assert phase.peak_compression(0.0) == 1e-3


# What must hold whatever the numbers


@pytest.mark.parametrize("zeta", [0.0, 0.1, 0.4, 2.0])
def test_kelvin_voigt_in_the_limit(zeta):
    # The difference from n = 1 is proportional to n - 1: a tenth of it, a tenth of the difference.
    k, b = 8e5, damping(8e5, 1.0, zeta)
    limit = contact_of(
        relative, k, b, M_CLUB, M_BALL, contacts.InitialState(0.0, 0.0, 35.0, 0.0, 35.0)
    )

    def values(phase):
        time = phase.duration
        _, _, x_ball, v_club, v_ball, d = state_of(phase, time)
        middle = state_of(phase, 2e-4) if time > 2e-4 else state_of(phase, 0.5 * limit.duration)
        force = phase.peak_force(time)[0] if zeta < 0.5 else 0.0
        return [time, x_ball, v_club, v_ball, d, phase.peak_compression(time), force, *middle]

    expected = values(limit)
    near = values(Start(k, b, 1.0 + 1e-6).phase())
    nearer = values(Start(k, b, 1.0 + 1e-7).phase())
    for exact, first, second in zip(expected, near, nearer):
        assert abs(second - exact) < 1e-6 * abs(exact) + 1e-15
        if abs(first - exact) > 1e-8 * abs(exact) + 1e-15:
            # Of quadratic terms and rounding: worst 7e-6.
            assert off((second - exact) / (first - exact), 0.1) < 1e-3


@pytest.mark.parametrize("zeta", [0.0, 0.1, 0.7, 1.0, 50.0])
@pytest.mark.parametrize("n", [1.0 + 1e-9, 1.2, 1.615544, 10.0])
def test_restitution_does_not_depend_on_speed(n, zeta):
    k = 8e5
    q = math.sqrt(abs(1.0 - zeta) * (1.0 + zeta))
    s = 1.0 if zeta == 1.0 else (math.atan2(q, zeta) if zeta < 1.0 else math.asinh(q)) / q
    for speed in (1e-6, 1e-2, 35.0, 1e4):
        phase = Start(k, damping(k, n, zeta), n, v_club=speed).phase()
        # A closed form: worst 1.1e-16.
        restitution = -phase.closing(phase.duration) / speed
        assert off(restitution, math.exp(-2.0 * zeta * s), 1.0) < 1e-14


@pytest.mark.parametrize("zeta", [0.0, 1e-9, 0.1, 0.6, 1.0, 3.0, 1e3])
@pytest.mark.parametrize("n", [1.0 + 1e-9, 1.5, 10.0])
def test_everything_is_monotone_and_bounded(n, zeta):
    start = Start(8e5, damping(8e5, n, zeta), n)
    phase = start.phase()
    time = phase.duration
    force, t_force = phase.peak_force(time)
    largest = phase.peak_compression(time)
    times = [time * i / 400 for i in range(401)]
    states = [state_of(phase, t) for t in times]
    closing = [phase.closing(t) for t in times]
    slack = 1e-14 * 35.0  # rounding, where the speed hardly changes
    assert all(b <= a + slack for a, b in pairwise(closing))
    assert all(0.0 <= f <= force * (1.0 + BAR) for f, *_ in states)
    assert all(0.0 <= d <= largest * (1.0 + BAR) for *_, d in states)
    rising = [f for t, (f, *_) in zip(times, states) if t <= t_force]
    falling = [f for t, (f, *_) in zip(times, states) if t >= t_force]
    assert rising == sorted(rising)
    assert all(b <= a + BAR * force for a, b in pairwise(falling))
    for t, (f, *_, d) in zip(times, states):
        assert phase.peak_force(t) == ((force, t_force) if t >= t_force else (f, t))
        assert phase.peak_compression(t) >= d * (1.0 - BAR)


@pytest.mark.parametrize(
    "start",
    [
        Start(8e5, 0.0, 1.5),
        Start(8e5, 20.0, 1.5),
        Start(8e5, 500.0, 2.2),
        Start(8e5, 20.0, 1.8, 4e-3, 20.0, 40.0),
        Start(8e5, 3000.0, 1.5, 1e-3, 30.0, 1.0),
    ],
)
def test_energy_balance(start):
    phase = start.phase()

    def energy(d, w):
        n = start.n
        return 0.5 * MU * w * w + start.k * D_R**2 / (n + 1.0) * (d / D_R) ** (n + 1.0)

    def loss(t):
        f, *_, d = state_of(phase, t)
        return (f - start.k * D_R * (d / D_R) ** start.n) * phase.closing(t)

    first = energy(start.compression, start.closing)
    nodes, weights = leggauss(200)
    for t in (0.3 * phase.duration, phase.duration):
        # t v^10, because the loss has an infinite slope where d = 0.
        v = 0.5 * (nodes + 1.0)
        lost = sum(5.0 * t * w * x**9 * loss(t * x**10) for w, x in zip(weights, v))
        left = energy(state_of(phase, t)[5], phase.closing(t))
        # What the quadrature is good for: worst 8e-15.
        assert off(left + lost, first) < 1e-12


@pytest.mark.parametrize("n", [1.0 + 1e-9, 1.5, 10.0])
@pytest.mark.parametrize("zeta", [0.0, 0.1, 1.0, 30.0])
def test_impulse_is_exact_relative_to_its_width(n, zeta):
    start = Start(8e5, damping(8e5, n, zeta), n)
    phase = start.phase()
    time = phase.duration
    force, _ = phase.peak_force(time)
    nodes, weights = leggauss(8)
    for width in (1e-12 * time, 1e-6 * time, 1e-3 * time):
        for begin in (0.05 * time, 0.5 * time, 0.9 * time):
            # Against Gauss's quadrature of the force, which is smooth there: worst 6e-16.
            mean = phase.impulse(begin, width) / width
            half = 0.5 * width
            forces = [state_of(phase, begin + half + half * node)[0] for node in nodes]
            assert off(mean, 0.5 * sum(map(mul, weights, forces)), force) < BAR
        # From touch on, the pieces add up to the whole: worst 1.3e-15.
        pieces = sum(phase.impulse(width * i, width) for i in range(10))
        assert off(phase.impulse(0.0, 10.0 * width), pieces) < BAR
    whole = MU * (start.closing - phase.closing(time))
    assert off(phase.impulse(0.0, time), whole) < BAR
    for count in (4, 10, 25, 60):
        steps = [time * i / count for i in range(count + 1)]
        pieces = sum(phase.impulse(a, b - a) for a, b in pairwise(steps))
        # Worst: 3e-15 (n = 10, ζ = 1), where the formulas for short and long intervals meet.
        assert off(pieces, whole) < BAR


def test_the_ends_are_exact():
    phase = Start(8e5, 20.0, 1.5, v_club=35.1, v_ball=0.1).phase()
    assert state_of(phase, 0.0) == [0.0, 0.0, 0.0, 35.1, 0.1, 0.0]
    assert phase.impulse(0.0, 0.0) == 0.0
    *ball, closing = phase.end()
    end = state_of(phase, phase.duration)
    assert ball == [end[2], *end[3:]]
    assert closing == phase.closing(phase.duration)
    assert end[0] == 0.0
    just_before = state_of(phase, math.nextafter(phase.duration, 0.0))
    for value, exact, scale in zip(just_before, end, (5e3, 0.02, 0.02, 35.0, 35.0, 7e-3)):
        assert off(value, exact, scale) < BAR
    start = Start(8e5, 20.0, 1.5, 1e-3, 35.1, 0.1)
    force, *others = state_of(start.phase(), 0.0)
    assert off(force, start.force(1e-3, 35.0)) < 1e-14
    assert others == [0.0, -1e-3, 35.1, 0.1, 1e-3]
    # Elastic: nothing is left of the compression, and it vanishes with the time that remains.
    elastic = Start(8e5, 0.0, 10.0).phase()
    assert state_of(elastic, elastic.duration)[5] == 0.0
    left = 1e-9 * elastic.duration
    assert off(state_of(elastic, elastic.duration - left)[5], 35.0 * left) < 1e-6


def test_extreme_numbers_stay_finite():
    rng = random.Random(7)

    def between(low, high):
        return 10.0 ** rng.uniform(low, high)

    for _ in range(2000):
        n = rng.choice([1.0 + 2.0**-52, 1.0 + between(-15, 0), rng.uniform(1.0, 12.0)])
        k, d_r, w = between(-20, 40), between(-8, 3), rng.choice([5e-324, between(-200, 20)])
        b = rng.choice([0.0, between(-30, 30)])
        m_club, m_ball = between(-10, 10), between(-10, 10)
        omega = math.sqrt(0.5 * (n + 1.0) * k * (1.0 / m_club + 1.0 / m_ball))
        scale = d_r * (w / (d_r * omega)) ** (2.0 / (n + 1.0))
        d = rng.choice([0.0, scale * between(-300, 0), scale * between(-3, 1)])
        v_club = w if d == 0.0 else w * rng.choice([1.0, -1.0, 0.0, -1e-6])
        phase = power_law(
            k, b, m_club, m_ball, 0.0, d, v_club, 0.0, exponent=n, reference_compression=d_r
        )
        time = phase.duration
        assert 0.0 <= time < math.inf
        force, when = phase.peak_force(time)
        assert 0.0 <= when <= time * (1.0 + BAR)
        for fraction in (0.0, 1e-300, 1e-9, 0.1, 0.9, 1.0 - 1e-12, 1.0):
            state = state_of(phase, fraction * time)
            assert all(map(math.isfinite, state))
            assert 0.0 <= state[0] <= force * (1.0 + 1e-9) + 1e-300
