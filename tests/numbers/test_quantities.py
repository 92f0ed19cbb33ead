"""Tables beside the code: digits of their sources, and units that fit their factors.

Sizes of units, formats, speeds of balls: transcripts/python.md.
"""

import math
from importlib.resources import files

import pytest
from cases import BASE, DEFAULTS, KINDS, Case, scales_of
from compare import assert_close
from golf_physics.variables import BY_NAME

from golf_impact.data.files import read_toml
from golf_impact.data.quantities import QUANTITIES, Quantity
from golf_impact.data.runs import REALS
from golf_impact.data.units import SYMBOLS, symbol_of, unit_of

PAGE = read_toml(files("golf_impact.explore") / "page.toml")
MEASURED = read_toml(files("golf_impact.data") / "measured.toml")


def test_columns_of_the_tour_add_up():
    """TrackMan's printed columns of 2023, and the heads' masses."""
    columns = [*zip(*MEASURED["pga"]["rows"])][1:]
    totals = [1173, -37.7, 1645, 164.2, 69098, 388, 583, 2446, 2.966]
    assert list(map(math.fsum, columns)) == pytest.approx(totals, rel=1e-12)


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
