"""How quantities are called and shown: one table for reports, figures and calibration."""

import math
from collections.abc import Mapping
from typing import NamedTuple

#: What the number `law` may be.
LAWS_IN_WORDS = "law is 1 (absolute) or 2 (relative)"

#: No club head and no ball is so heavy (kg): grams were meant.
_HEAVY = 10.0


class Quantity(NamedTuple):
    """A metric as people read it."""

    name: str  #: in words
    symbol: str = ""  #: behind the name, if it has one
    unit: str = ""  #: in which it is shown
    factor: float = 1.0  #: of that unit in SI
    decimals: int = 4  #: with which it is shown: enough to see a difference

    @property
    def label(self) -> str:
        unit = f"({self.unit})" if self.unit else ""
        return " ".join(filter(None, (self.name, self.symbol, unit)))

    @property
    def plain(self) -> str:
        return self._replace(symbol="").label

    def shown(self, value: float) -> str:
        """A value (SI) in the unit of the label."""
        return f"{value * self.factor:.{self.decimals}f}"


#: By the metric's name: those of the FMU's outputs, and of what is derived from them.
QUANTITIES = {
    "club_velocity": Quantity("club velocity", "v_C", "m/s", decimals=3),
    "ball_velocity": Quantity("ball velocity", "v_B", "m/s", decimals=3),
    "momentum_initial": Quantity("initial momentum", "", "N·s"),
    "momentum_final": Quantity("final momentum", "", "N·s"),
    "kinetic_energy_initial": Quantity("initial kinetic energy", "", "J", decimals=3),
    "kinetic_energy_final": Quantity("final kinetic energy", "", "J", decimals=3),
    "smash_factor": Quantity("smash factor", "S"),
    "coefficient_of_restitution": Quantity("COR"),
    "contact_time": Quantity("contact time", "", "µs", 1e6, 2),
    "contact_displacement_over_diameter": Quantity("contact displacement / D"),
    "max_force": Quantity("max force", "", "N", decimals=1),
    "time_of_max_force": Quantity("time of max force", "", "µs", 1e6, 2),
    "impulse": Quantity("impulse", "J", "N·s"),
    "momentum_gain_ball": Quantity("momentum gained by ball", "P_B", "N·s"),
    "energy_efficiency": Quantity("energy efficiency", "E", "%", 100.0, 2),
}


def label(metric: str) -> str:
    """Name, symbol and unit of a metric; of one that the table lacks, its name in the code."""
    return QUANTITIES[metric].label if metric in QUANTITIES else metric


def shown(metric: str, value: float) -> str:
    """A metric's value (SI) in the unit of its label."""
    return QUANTITIES.get(metric, Quantity(metric)).shown(value)


def shortest(value: float) -> str:
    """The fewest digits that give this very double."""
    return repr(float(value)).removesuffix(".0")


def with_error(value: float, error: float | None) -> str:
    """A value and its error, both to two digits of the error: 827300 ± 5700."""
    if error is None or not 0.0 < error < math.inf:
        return f"{value:.6g}" if error == 0.0 else f"{value:.6g} (error not defined)"
    decimals = 1 - math.floor(math.log10(error))
    if abs(value) >= 1e7 or (decimals > 9 and abs(value) < 1e-3):
        power = math.floor(math.log10(max(abs(value), error)))
        factor, places = 10.0**-power, max(0, decimals + power)
        return f"({value * factor:.{places}f} ± {error * factor:.{places}f})e{power}"
    places = max(0, decimals)
    return f"{round(value, decimals):.{places}f} ± {round(error, decimals):.{places}f}"


def set_options(values: Mapping[str, float]) -> str:
    """Inputs and parameters (SI) as options of a command."""
    return " ".join(f"--set {name}={shortest(value)}" for name, value in values.items())


def doubts_of_mass(masses: Mapping[str, float]) -> list[str]:
    """Masses that may be in grams, in words; they are taken as they stand.

    They come in kg, by what stands before them on the command line.
    """
    return [
        f"{given}{mass:g} is taken in kg: write {given}{mass / 1e3:g} for {mass:g} g."
        for given, mass in masses.items()
        if mass > _HEAVY
    ]


def written(unit: str | None) -> str:
    """A unit as people write it, N·s for the FMI's N.s; empty if there is none."""
    return "" if unit in (None, "", "1") else str(unit).replace(".", "·")


def prefixed(unit: str | None, largest: float) -> tuple[float, str]:
    """Factor and unit that bring values up to this one (SI) to between 1 and 1000.

    Only units that people put a prefix to have one: 1e6 N/m is 1 MN/m.
    """
    if unit not in ("N", "N/m", "m", "s", "J") or not 0.0 < largest < math.inf:
        return 1.0, written(unit)
    thousands = min(max(math.floor(math.log10(largest) / 3.0 + 1e-9), -3), 3)
    return 10.0 ** (-3 * thousands), ("n", "µ", "m", "", "k", "M", "G")[thousands + 3] + unit
