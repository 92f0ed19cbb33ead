"""Names, units and formats of quantities: one table for reports, figures and calibration."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from golf_physics.variables import BY_NAME

from golf_impact.data.files import read_toml

#: The allowed values of `law`.
LAWS_IN_WORDS = f"law is {BY_NAME['law'].allowed}"

#: What is printed where no law is chosen.
DEFAULT_LAW = (
    "This is law 1, the source document's, with its k and b unless they are set: a drag on each "
    "body that loses momentum. --set law=2 for the law that keeps it, --ball roh-lee for a real "
    "ball."
)

#: The start values of inputs and parameters by name (SI units).
START = {row.name: float(row.start) for row in BY_NAME.values() if row.start is not None}


class NoValue(float):
    """NaN with a reason: the value of a result that an impact doesn't have.

    It computes as NaN does, is null in JSON and an empty cell in CSV; tables print the reason.
    """

    reason: str  #: in words

    def __new__(cls, reason: str) -> "NoValue":
        self = super().__new__(cls, math.nan)
        self.reason = reason
        return self


#: Outputs that have no value before the bodies separate, and those that have none before touch.
_RESULTS = (
    "smash_factor", "coefficient_of_restitution", "energy_efficiency", "contact_time",
    "contact_displacement",
)  # fmt: skip
_TIMES = ("touch_time", "time_of_max_force")


def undefined_results(touched: bool, separated: bool) -> dict[str, NoValue]:
    """The outputs without a value at the end of a run, by name, each with the reason.

    The FMU's outputs are results so far (a contact time that grows with the simulated time), which
    say nothing about an impact without a contact (`touched`) or a separation (`separated`).
    """
    if separated:
        return {}
    if touched:
        return dict.fromkeys(_RESULTS, NoValue("no separation"))
    return dict.fromkeys(_RESULTS + _TIMES, NoValue("no contact"))


class Quantity(NamedTuple):
    """How a metric is named and printed."""

    name: str  #: in words
    symbol: str = ""  #: after the name, if it has one
    unit: str = ""  #: in which it is printed
    factor: float = 1.0  #: from SI to that unit
    decimals: int = 4  #: printed; enough to see a difference

    @property
    def label(self) -> str:
        """Name, symbol and unit."""
        unit = f"({self.unit})" if self.unit else ""
        return " ".join(filter(None, (self.name, self.symbol, unit)))

    @property
    def plain(self) -> str:
        """Name and unit."""
        return self._replace(symbol="").label

    def format_value(self, value: float, error: float = 0.0) -> str:
        """A value (SI) in the unit of the label, with its error; of one that isn't there, why."""
        if math.isnan(value):
            return value.reason if isinstance(value, NoValue) else "–"
        # Less is rounding: of a momentum that no parameter changes.
        if error > 1e-9 * abs(value):
            return format_with_error(value * self.factor, error * self.factor)
        text = f"{value * self.factor:.{self.decimals}f}"
        return text if float(text) else text.removeprefix("-")


#: By the metric's name, from quantities.toml.
QUANTITIES = {
    name: Quantity(*row) for name, row in read_toml(Path(__file__).with_suffix(".toml")).items()
}


def derived(
    results: Mapping[str, float], values: Mapping[str, float], error: bool = False
) -> dict[str, float]:
    """Outputs of an impact with the quantities beside them; of their standard errors, theirs.

    Args:
        results: outputs by name, or their standard errors.
        values: inputs and parameters (SI units); start values for the others.
        error: whether `results` are standard errors.
    """
    if not results:
        return {}
    given = {**START, **values}
    names = "m_club", "m_ball", "club_speed", "ball_speed", "ball_diameter"
    m_club, m_ball, u_club, u_ball, diameter = (float(given[name]) for name in names)
    before = 0.0 if error else 1.0
    return {
        **results,
        "momentum_initial": before * (m_club * u_club + m_ball * u_ball),
        "kinetic_energy_initial": before * 0.5 * (m_club * u_club**2 + m_ball * u_ball**2),
        "momentum_gain_ball": m_ball * (results["ball_velocity"] - before * u_ball),
        "contact_displacement_over_diameter": results["contact_displacement"] / diameter,
    }


def format_percent(share: float, decimals: int = 2) -> str:
    """A relative deviation in %, with its sign; +0.00 where it vanishes."""
    return f"{round(share * 100.0, decimals) + 0.0:+.{decimals}f}"


def format_shortest(value: float) -> str:
    """The fewest digits that represent this double exactly."""
    return repr(float(value)).removesuffix(".0")


def format_with_error(value: float, error: float | None) -> str:
    """A value and its error, both to two digits of the error: 827300 ± 5700."""
    if error is None or not 0.0 < error < math.inf:
        return f"{value:.6g}" if error == 0.0 else f"{value:.6g} (error not defined)"
    decimals = 1 - math.floor(math.log10(error))
    if abs(value) >= 1e7 or (decimals > 9 and abs(value) < 1e-3):
        power = math.floor(math.log10(max(abs(value), error)))
        factor, places = 10.0**-power, max(0, decimals + power)
        return f"({value * factor:.{places}f} ± {error * factor:.{places}f})e{power}"
    return f"{format_to_error(value, error)} ± {format_to_error(error, error)}"


def format_to_error(value: float, error: float | None) -> str:
    """A value to two digits of its error, without a negative zero; to six if it has none."""
    if error is None or not 0.0 < error < math.inf:
        return f"{value:.6g}"
    decimals = 1 - math.floor(math.log10(error))
    return f"{round(value, decimals) + 0.0:.{max(0, decimals)}f}"


def describe(values: Mapping[str, float]) -> str:
    """Law, stiffness and damping of a case in words: every table names them."""
    given = {**START, **values}
    words = [f"law {given['law']:g}", f"k = {given['k'] / 1e6:.4g} MN/m"]
    if given["exponent"] != 1.0:
        words.append(f"n = {given['exponent']:g}")
    if given["restitution_at_rest"]:
        line = f"{given['restitution_at_rest']:g} − {given['restitution_slope']:g} s/m · v"
        words.append(f"b by COR = {line}")
    else:
        words.append(f"b = {given['b']:.4g} N·s/m")
    return ", ".join(words)


def format_options(values: Mapping[str, float]) -> str:
    """Inputs and parameters (SI) as options of a command line."""
    return " ".join(f"--set {name}={format_shortest(value)}" for name, value in values.items())


def format_unit(unit: str | None) -> str:
    """A unit in usual notation, N·s for FMI's N.s; empty if there is none."""
    return "" if unit in (None, "", "1") else str(unit).replace(".", "·")
