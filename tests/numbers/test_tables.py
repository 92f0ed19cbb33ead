"""Tables beside the code: digits of their sources, and units that fit their factors."""

import math
from importlib.resources import files

import pytest

from golf_build import BY_NAME
from golf_build.system import COMPANIONS
from golf_impact.ball import BALLS
from golf_impact.files import read_toml
from golf_impact.measured import MEASUREMENTS, MPH
from golf_impact.quantities import QUANTITIES, Quantity, undefined_results
from golf_impact.units import SYMBOLS, symbol_of, unit_of

PAGE = read_toml(files("golf_impact.explore") / "page.toml")
MEASURED = read_toml(files("golf_impact") / "measured.toml")

#: Of figures and the page alone.
OTHERS = {"": ("1", 1.0), "rpm": ("rad/s", math.pi / 30.0), "D": ("1", 1.0)}


def test_columns_of_the_tour_add_up():
    """TrackMan's printed columns of 2023, and the heads' masses."""
    columns = [*zip(*MEASURED["pga"]["rows"])][1:]
    totals = [1173, -37.7, 1645, 164.2, 69098, 388, 583, 2446, 2.966]
    assert list(map(math.fsum, columns)) == pytest.approx(totals, rel=1e-12)


def test_measurements_are_those_printed():
    found = [(one.metric, one.club_speed, one.low, one.high) for one in MEASUREMENTS]
    rules, tour = 160.0 * 0.3048, 113.0 * MPH
    assert [(name, pytest.approx(v), *map(pytest.approx, ends)) for name, v, *ends in found] == [
        ("coefficient_of_restitution", rules, 0.78, 0.78),
        ("coefficient_of_restitution", rules, 0.822, 0.830),
        ("smash_factor", tour, 167 / 113, 167 / 113),
        ("smash_factor", 115.0 * MPH, 171 / 115, 171 / 115),
        ("contact_time", tour, 450e-6, 500e-6),
    ]


def test_speeds_of_balls():
    """The source document's and Roh & Lee's 35 m/s, Penner's line, drivers of the tour."""
    ranges = {name: ball.speeds for name, ball in BALLS.items()}
    documents = dict.fromkeys(("document", "document-old"), (30.0, 40.0))
    assert ranges == dict.fromkeys(BALLS, (30.0, 50.0)) | documents | {"tour": (45.0, 55.0)}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("kinematic_viscosity", 1.48e-5), ("air_density", 1.225), ("gravity", 9.80665),
        ("spin_decay", 2e-5), ("spin_ratio_limit", 0.75), ("wind_speed", 0.0),
        # A driver of the tour.
        ("backspin", 2686.0 * math.pi / 30.0), ("launch_angle", math.radians(10.9)),
    ],
)  # fmt: skip
def test_start_values_of_the_flight(name, value):
    rows = {row.name: row for row in COMPANIONS["BallFlight"].tables["rows"]}
    assert rows[name].start == pytest.approx(value, rel=1e-15)


def size_of(unit):
    """The SI unit and the size in it."""
    unit = unit.strip()
    return OTHERS[unit] if unit in OTHERS else SYMBOLS[symbol_of(unit)]


#: Of results that are no outputs: the output with their dimension.
ALIKE = {
    "momentum_initial": "impulse", "momentum_final": "impulse", "momentum_gain_ball": "impulse",
    "momentum": "impulse", "kinetic_energy_initial": "kinetic_energy",
    "kinetic_energy_final": "kinetic_energy",
    "contact_displacement_over_diameter": "smash_factor",
    "compression_over_diameter": "smash_factor",
}  # fmt: skip


@pytest.mark.parametrize("name", QUANTITIES)
def test_units_of_tables(name):
    quantity = QUANTITIES[name]
    si, size = size_of(quantity.unit)
    assert (si, quantity.factor * size) == (BY_NAME[ALIKE.get(name, name)].unit, pytest.approx(1.0))


@pytest.mark.parametrize("quantity", PAGE["quantities"], ids=lambda one: one["name"])
def test_units_of_the_page(quantity):
    si, _ = size_of(quantity["unit"])
    assert si == (unit_of(quantity["name"]) or "1")


@pytest.mark.parametrize("name", PAGE["units"])
def test_units_of_results_on_the_page(name):
    quantity = Quantity(*PAGE["units"][name])
    si, size = size_of(quantity.unit)
    assert (si, quantity.factor * size) == (BY_NAME[name].unit, pytest.approx(1.0))


def test_results_without_a_value():
    assert [*undefined_results(touched=True, separated=False)] == [
        "smash_factor", "coefficient_of_restitution", "energy_efficiency", "contact_time",
        "contact_displacement",
    ]  # fmt: skip
