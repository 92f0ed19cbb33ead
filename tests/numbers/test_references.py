"""The sources of expected numbers agree: modes, matrix exponentials, two quadratures, DOP853."""

import pytest
from cases import CASES, POWER_LAW, exact, golden, integrated
from conftest import some

from golf_impact.data.quantities import START
from golf_impact.data.runs import reduced_mass
from golf_impact.evidence.reference import Reference, mp


def agree(found, texts, tolerance):
    for output, text in texts.items():
        expected = mp.mpf(text)
        assert abs(found[output] - expected) <= tolerance * abs(expected), output


@pytest.mark.parametrize("name", golden()["rows"])
def test_linear_laws_by_matrix_exponentials(name):
    agree(exact(name), golden()["rows"][name], 1e-24)


@pytest.mark.parametrize("name", some(2, POWER_LAW))
def test_power_laws_by_another_quadrature(name):
    """Afterwards and, of the first ones, on the way: the 25 digits of the instants count there."""
    impact, (ends, *path) = Reference(CASES[name].values), golden()["power law"][name]
    agree(impact.outputs(impact.parting * 2), ends, 1e-24)
    for row in path[-1:] if name in POWER_LAW[:4] else []:
        agree(impact.outputs(impact.touch + mp.mpf(row["contact_time"])), row, 1e-22)


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
        values["b"] = float(Reference(values).v["b"])
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


@pytest.mark.parametrize("n", [1.5, 12.0])
def test_an_elastic_power_law_by_the_gamma_function(n):
    """From μ v²/2 = k d_r^(1-n) d^(n+1)/(n+1) at the largest compression d, where half is over."""
    v = {name: mp.mpf(x) for name, x in (START | {"law": 2, "b": 0.0, "exponent": n}).items()}
    share, mu = 1 / (v["exponent"] + 1), reduced_mass(v)
    d_r, speed = v["reference_compression"], v["club_speed"]
    deepest = d_r * (mu * speed**2 / (2 * share * v["k"] * d_r**2)) ** share
    time = 2 * deepest / speed * mp.sqrt(mp.pi) * mp.gamma(1 + share) / mp.gamma(share + 0.5)
    expected = {"contact_time": time, "time_of_max_force": time / 2, "max_compression": deepest}
    agree(Reference(v).outputs(1), expected | {"coefficient_of_restitution": mp.one}, 1e-28)
