"""Tables beside the code: digits of their sources, formats, and units that fit their factors."""

import math
from importlib.resources import files

import pytest
from cases import DEFAULTS, KINDS, Case, scales_of
from compare import assert_close
from golf_physics.variables import BY_NAME, MORE_UNITS, UNITS
from scipy import constants

from golf_impact.data.balls import BALLS
from golf_impact.data.document import Printed
from golf_impact.data.files import read_toml
from golf_impact.data.quantities import QUANTITIES, Quantity, format_with_error, undefined_results
from golf_impact.data.runs import REALS
from golf_impact.data.units import SYMBOLS, symbol_of, unit_of

PAGE = read_toml(files("golf_impact.explore") / "page.toml")
MEASURED = read_toml(files("golf_impact.data") / "measured.toml")

# Digits of sources; of balls: transcripts/list.md, of measurements and start values: snapshots


def test_columns_of_the_tour_add_up():
    """TrackMan's printed columns of 2023, and the heads' masses."""
    columns = [*zip(*MEASURED["pga"]["rows"])][1:]
    totals = [1173, -37.7, 1645, 164.2, 69098, 388, 583, 2446, 2.966]
    assert list(map(math.fsum, columns)) == pytest.approx(totals, rel=1e-12)


def test_speeds_of_balls():
    """The source document's and Roh & Lee's 35 m/s, Penner's line, drivers of the tour."""
    ranges = {name: ball.speeds for name, ball in BALLS.items()}
    documents = dict.fromkeys(("document", "document-old"), (30.0, 40.0))
    assert ranges == dict.fromkeys(BALLS, (30.0, 50.0)) | documents | {"tour": (45.0, 55.0)}


# Formats


def test_half_a_printed_digit():
    for text, scale, half in (("621", 1e-6, 5e-7), ("21.50", 1.0, 5e-3), ("91", 0.01, 5e-3)):
        number = Printed(text, scale)
        assert (number.value, number.half_digit) == pytest.approx((float(text) * scale, half))
        assert number.is_near(number.value + 0.9999 * half)
        assert not number.is_near(number.value + 1.0001 * half)
        assert number.is_near(number.value - 1.9999 * half, halves=2.0)


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (827312.3, 5678.9, "827300 ± 5700"),
        (0.86, 0.0123, "0.860 ± 0.012"),
        (9_999_900.0, 2e3, "9999900 ± 2000"),
        (-1e7, 2e3, "(-1.00000 ± 0.00020)e7"),
        (1e7, 3e8, "(0.1 ± 3.0)e8"),
        (-4.56e-5, 1.2e-9, "(-4.56000 ± 0.00012)e-5"),
        (1e-3, 1.2e-9, "0.0010000000 ± 0.0000000012"),
        (-4.56e-5, 1.2e-8, "-0.000045600 ± 0.000000012"),
        (-1e-9, 4.1e-7, "0.00000000 ± 0.00000041"),
        (1.5, 0.0, "1.5"),
        (1.5, None, "1.5 (error not defined)"),
        (1.5, math.inf, "1.5 (error not defined)"),
    ],
)
def test_a_value_and_its_error(value, error, text):
    assert format_with_error(value, error) == text


def test_an_error_that_is_rounding():
    """That of a momentum which no parameter changes isn't printed."""
    about = QUANTITIES["momentum"]
    assert about.format_value(8.4, 8.3e-13) == "8.4000"
    assert about.format_value(8.4, 8.3e-6) == "8.4000000 ± 0.0000083"


def test_results_without_a_value():
    assert [*undefined_results(touched=True, separated=False)] == [
        "smash_factor", "coefficient_of_restitution", "energy_efficiency", "contact_time",
        "contact_displacement",
    ]  # fmt: skip


# Units

#: Of figures and the page alone: the SI unit and the size in it.
OTHERS = {"": ("1", 1.0), "rpm": ("rad/s", math.pi / 30.0), "D": ("1", 1.0)}

#: Of results that are no outputs, and momenta in N·s: the output with their unit.
ALIKE = {
    **dict.fromkeys(("momentum_initial", "momentum", "momentum_gain_ball"), "impulse"),
    "kinetic_energy_initial": "kinetic_energy",
    "contact_displacement_over_diameter": "smash_factor",
}

TABLES = {**QUANTITIES, **{name: Quantity(*row) for name, row in PAGE["units"].items()}}


def size_of(unit):
    unit = unit.strip()
    return OTHERS[unit] if unit in OTHERS else SYMBOLS[symbol_of(unit)]


def test_units_fit_their_factors():
    for name, quantity in TABLES.items():
        si, size = size_of(quantity.unit)
        unit = BY_NAME[ALIKE.get(name, name)].unit
        assert (si, quantity.factor * size) == (unit, pytest.approx(1.0)), name
    for name, control in PAGE["controls"].items():
        assert size_of(control["unit"])[0] == (unit_of(name) or "1"), name


def test_sizes_of_units():
    """SciPy's, after NIST; those of prefixes by their powers of ten."""
    sizes = {
        "in": constants.inch, "ft": constants.foot, "oz": constants.oz, "lb": constants.lb,
        "lbf": constants.lbf, "mph": constants.mph, "km/h": constants.kmh, "kmh": constants.kmh,
        "kph": constants.kmh, "ft/s": constants.foot, "fps": constants.foot,
        "deg": constants.degree, "°": constants.degree, "rpm": 2.0 * constants.pi / 60.0,
        "lbf/in": constants.lbf / constants.inch, "%": 0.01, "daN": 10.0, "kN/mm": 1e6,
        "N/mm": 1e3, "MN/m": 1e6, "kN/m": 1e3, "kN": 1e3, "MN": 1e6, "mN": 1e-3,
        "kgf": constants.kgf,
        "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "g": 1e-3, "ms": 1e-3, "us": 1e-6, "ns": 1e-9,
    }  # fmt: skip
    found = {symbol: size for symbol, (_, size) in SYMBOLS.items() if size != 1.0}
    assert found == pytest.approx(sizes, rel=1e-12)


#: Exponents of kg, m and s by unit.
BASE = {"": {}} | {name: unit.base for name, unit in (UNITS | MORE_UNITS).items()}


def test_the_unit_of_an_acceleration():
    """Those of other outputs: in results in other base units."""
    for body in ("club", "ball"):
        assert BASE[BY_NAME[f"{body}_acceleration"].unit] == {"m": 1, "s": -2}


PULLED = {"k": 8e3, "b": 1540.0, "club_speed": 276.0, "club_force": -1.1e5}
ANY = (*KINDS.values(), {"law": 2, "club_force": 300.0}, *({"law": n, **PULLED} for n in (1, 2)))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("values", ANY)
def test_results_do_not_depend_on_the_base_units(way_of, values, sign):
    def run(steps, **units):
        def size(name):
            return math.prod(units[unit] ** n for unit, n in BASE[BY_NAME[name].unit].items())

        given = {name: size(name) * value for name, value in (DEFAULTS | values).items()}
        path = way_of("in process").path(given, [(2e-4 * size("contact_time"), {})] * steps)
        return {name: path[-1][name] / size(name) for name in REALS}

    for steps in (1, 2, 10):
        found = run(steps, kg=10.0 ** (3 * sign), m=10.0 ** (-2 * sign), s=10.0**sign)
        exact = run(steps, kg=1.0, m=1.0, s=1.0)
        scales = scales_of(Case("", values), exact | {"touched": True}, 2e-4 * steps)
        assert_close(found, exact, scales, values=values, steps=steps)
