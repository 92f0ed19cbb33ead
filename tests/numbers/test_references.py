"""The sources of expected numbers agree: 80 digits, matrix exponentials, quadrature, DOP853."""

import math

import pytest
from cases import CASES, POWER_LAW, exact, golden, integrated
from conftest import some
from golden import by_quadrature
from quadrature import PowerLawContact, mp


@pytest.mark.parametrize("name", golden()["rows"])
def test_linear_laws_by_matrix_exponentials(name):
    for output, text in golden()["rows"][name].items():
        expected = mp.mpf(text)
        assert abs(exact(name)[output] - expected) <= 1e-24 * abs(expected), output


@pytest.mark.parametrize("name", some(2, POWER_LAW))
def test_the_power_law_by_quadrature(name):
    """The rows in the file are those that the quadrature gives."""
    assert golden()["power law"][name] == by_quadrature(name)


#: Not contacts that last, stiff ones, and one that ends as an input changes.
LEFT_OUT = ("sticks", "separates late", "parts late", "pulled apart", "rates", "30.0", "10000.0")
INTEGRATED = [
    name
    for name, case in CASES.items()
    if not (any(word in name for word in LEFT_OUT) or (case.changes and "gap" in case.given))
]


@pytest.mark.parametrize("name", INTEGRATED)
def test_the_reference_and_dop853_agree(name):
    case = CASES[name]
    values = case.values
    if values["restitution_at_rest"]:
        contact, n = PowerLawContact(**values), values["exponent"]
        stiffening = 0.5 * (n + 1.0) * values["k"] * float(contact.mu)
        values["b"] = 2.0 * float(contact.zeta) * math.sqrt(stiffening)
    # Worst: 2e-10; 3e-9 of largest forces at touch.
    speed = abs(values["club_speed"]) + abs(values["ball_speed"])
    scales = {"club_velocity": speed, "ball_velocity": speed}
    found = integrated(values, case.changes)
    if values["club_force"]:
        del found["club_velocity"]  # in flight it goes on
    for output, value in found.items():
        expected = float(exact(name)[output])
        tolerance = {"max_force": 1e-8, "impulse": 1e-10}.get(output, 1e-9)
        assert abs(value - expected) <= tolerance * scales.get(output, abs(expected)), output
