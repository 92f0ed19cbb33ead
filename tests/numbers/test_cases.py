"""The sources of expected numbers agree with each other and with the golden rows."""

import math

import pytest
from cases import CASES, exact, integrated
from golden import golden, mp
from quadrature import PowerLawContact

INTEGRATED = [
    name
    for name, case in CASES.items()
    if name != "sticks" and not (case.changes and "gap" in case.given)
]


@pytest.mark.parametrize("name", golden())
def test_golden_rows(name):
    for output, value in golden()[name].items():
        expected = mp.mpf(value)
        assert abs(exact(name)[output] - expected) <= 1e-24 * abs(expected), output


@pytest.mark.parametrize("name", INTEGRATED)
def test_the_two_sources_agree(name):
    values = CASES[name].values
    if values["restitution_at_rest"]:
        contact, n = PowerLawContact(**values), values["exponent"]
        stiffening = 0.5 * (n + 1.0) * values["k"] * float(contact.mu)
        values["b"] = 2.0 * float(contact.zeta) * math.sqrt(stiffening)
    # Worst: 2e-10 of times and positions, 2e-11 of the others.
    speed = abs(values["club_speed"]) + abs(values["ball_speed"])
    scales = {"club_velocity": speed, "ball_velocity": speed}
    for output, value in integrated(values, CASES[name].changes).items():
        expected = float(exact(name)[output])
        tolerance = 1e-9 if output.startswith("contact") else 1e-10
        assert abs(value - expected) <= tolerance * scales.get(output, abs(expected)), output
