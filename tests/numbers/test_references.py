"""The sources of expected numbers agree: modes, matrix exponentials, two quadratures, DOP853."""

import pytest
from cases import CASES, POWER_LAW, exact, golden, integrated
from conftest import some
from golden import damping, rows

from golf_impact.evidence.reference import mp


def agree(found, texts, tolerance):
    for output, text in texts.items():
        expected = mp.mpf(text)
        assert abs(found[output] - expected) <= tolerance * abs(expected), output


@pytest.mark.parametrize("name", golden()["rows"])
def test_linear_laws_by_matrix_exponentials(name):
    agree(exact(name), golden()["rows"][name], 1e-24)


@pytest.mark.parametrize("name", some(2, POWER_LAW))
def test_power_laws_by_another_quadrature(name):
    """Afterwards and on the way."""
    for row, expected in zip(rows(CASES[name].values), golden()["power law"][name], strict=True):
        agree(row, expected, 3e-24)


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
        values["b"] = float(damping(values))
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
