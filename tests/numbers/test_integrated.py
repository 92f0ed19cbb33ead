"""The default phase: contacts from force and drag alone, and those of an exponent under a force."""

from math import inf, sqrt

import pytest
from golf_physics.laws import LAWS
from golf_physics.laws.law import Law
from golf_physics.values import Inputs, Motion, Parameters

M_CLUB, M_BALL = 0.21, 0.04593
MU = M_CLUB * M_BALL / (M_CLUB + M_BALL)


def parameters(law=2, exponent=1.0, m_ball=M_BALL):
    return Parameters(M_CLUB, m_ball, 0.04267, 0.0, 0.0, law, exponent, 0.005, 0.0, 0.0)


def touch(speed):
    return Motion(0.0, 0.0, speed, 0.0, 0.0, speed)


def pushed(exponent, b, speed, club_force):
    inputs = Inputs(1e6, b, speed, club_force)
    return Law.contact(LAWS[2], parameters(exponent=exponent), inputs, touch(speed))


def finished(phase):
    while phase.extend():
        pass
    return phase


@pytest.mark.parametrize(
    ("k", "zeta", "m_ball", "club_force"),
    [
        (1e6, 0.1, M_BALL, 0.0),
        (1e-3, 0.1, M_BALL, 0.0),
        (7.8e12, 3.7, M_BALL, 0.0),  # stiff
        (1e6, 3.35, M_BALL, 0.0),  # without an end
        (1e6, 3.35, M_CLUB, 0.0),
        (1e6, 0.3, M_BALL, 3000.0),  # to a steady speed
    ],
)
def test_law_1_against_its_closed_form(k, zeta, m_ball, club_force):
    """Also for ends that don't exist. Measured: 2e-15."""
    law, p = LAWS[1], parameters(1, m_ball=m_ball)
    omega = sqrt(k * (1.0 / M_CLUB + 1.0 / m_ball))
    inputs = Inputs(k, 2.0 * zeta * k / omega, 35.0, club_force)
    exact = law.contact(p, inputs, touch(35.0))
    found = finished(Law.contact(law, p, inputs, touch(35.0)))
    assert found.duration == pytest.approx(exact.duration, rel=1e-13)
    until = min(exact.duration, 20.0 / omega)
    for name in ("force", "d"):
        largest = exact.largest(name, until)[0]
        assert found.largest(name, until)[0] == pytest.approx(largest, rel=1e-13)
        for n in range(11):
            t = 0.1 * n * until
            assert found.value(name, t) == pytest.approx(exact.value(name, t), abs=1e-13 * largest)
    assert found.impulse(0.0, until) == pytest.approx(exact.impulse(0.0, until), rel=1e-13)


@pytest.mark.parametrize("t", [1.0, 1e6])
def test_a_contact_that_a_push_keeps_together_comes_to_rest(t):
    """From then on force and compression are constant, and both bodies accelerate alike."""
    phase = pushed(1.5, 60.0, 1.0, 300.0)
    total = M_CLUB + M_BALL
    force, x_club, x_ball, v_club, v_ball, d = phase.state(t)
    at_rest = M_BALL * 300.0 / total
    compression = 0.005 * (at_rest / (1e6 * 0.005)) ** (1.0 / 1.5)
    assert force == pytest.approx(at_rest, rel=1e-12)
    assert d == pytest.approx(compression, rel=1e-11)
    assert phase.duration == inf
    assert v_club == v_ball == pytest.approx((M_CLUB * 1.0 + 300.0 * t) / total, rel=1e-12)
    assert x_club - x_ball == pytest.approx(d, abs=1e-15 * x_club)
    assert phase.impulse(0.0, t) == pytest.approx(M_BALL * v_ball, rel=1e-12)
    assert len(phase._panels) < 200


@pytest.mark.parametrize(
    ("exponent", "speed", "club_force"),
    [(1.5, 35.0, 1e4), (1.5, 35.0, 1e8), (1.5, 0.01, 300.0), (12.0, 35.0, 1e6), (1.01, 35.0, 1e3)],
)
def test_without_damping_the_bodies_part_as_fast_as_they_met(exponent, speed, club_force):
    """Also where the dip of the compression below 0 is far shorter than a panel."""
    phase = pushed(exponent, 0.0, speed, club_force)
    end = phase.end()
    assert end.closing == pytest.approx(-speed, rel=1e-9)
    assert phase.largest("d", phase.duration)[1] == pytest.approx(0.5 * phase.duration, rel=1e-10)


@pytest.mark.parametrize(
    ("exponent", "speed", "club_force"),
    [(1.5, 35.0, 1e60), (1.5, 35.0, 1e10), (1.44, 35.0, 5e48), (1.5, 1e-50, 300.0)],
)
def test_a_dip_within_rounding_errors_is_refused(exponent, speed, club_force):
    with pytest.raises(ArithmeticError, match="rounding errors decide whether the bodies separate"):
        finished(pushed(exponent, 0.0, speed, club_force))


def test_a_pull_out_of_proportion_ends_the_contact():
    phase = finished(pushed(1.5, 0.0, 35.0, -1e60))
    assert phase.duration == pytest.approx(2.0 * 35.0 * M_CLUB / 1e60, rel=1e-9)
    assert phase.largest("d", phase.duration)[0] == pytest.approx(35.0**2 * M_CLUB / 2e60, rel=1e-9)


def test_a_contact_with_neither_end_nor_rest_is_refused_in_a_sentence():
    phase = pushed(1.5, 1.0, 1e-3, 300.0)
    assert phase.state(1e-4)[0] > 0.0
    with pytest.raises(ArithmeticError, match="neither ended nor come to rest after 600 panels"):
        phase.state(1e3)
    assert phase.state(1e-4)[0] > 0.0


def test_a_phase_is_a_value():
    """What it returns doesn't depend on what was read before."""

    def read(phase, names):
        reads = {
            "end": phase.end,
            "force": lambda: phase.largest("force", 3e-4),
            "d": lambda: phase.largest("d", 5e-4),
            "impulse": lambda: phase.impulse(1e-4, 3e-4),
            "state": lambda: phase.state(4e-4),
            "velocities": phase.end_velocities,
        }
        return {name: reads[name]() for name in names}

    names = ["end", "force", "d", "impulse", "state", "velocities"]
    first = read(pushed(1.5, 9.0, 35.0, 300.0), names)
    assert read(pushed(1.5, 9.0, 35.0, 300.0), names[::-1]) == first
    for name in names:
        assert read(pushed(1.5, 9.0, 35.0, 300.0), [name])[name] == first[name]
    assert first["force"][0] > 7000.0


def test_the_start_is_exact():
    """There the series have rounding errors, of which a power makes large ones."""
    phase = pushed(1.02, 46.0, 35.0, 18.0)
    assert phase.state(0.0) == [0.0, 0.0, 0.0, 35.0, 0.0, 0.0]
