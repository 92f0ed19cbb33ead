"""The table of the component's variables, from which all interfaces and documents are made."""

from functools import partial
from typing import Any, NamedTuple

from .laws import LAWS as _LAWS

_LARGEST = 1.7976931348623157e308
_ABOVE_ZERO = 5e-324


class Unit(NamedTuple):
    """A unit in SI base units, and its display units."""

    base: dict[str, int]
    display: dict[str, float]


class Variable(NamedTuple):
    """One variable: its attributes in FMI and its allowed values."""

    name: str
    causality: str
    type: str
    unit: str
    start: float | int | None
    low: float  #: least allowed value; of an output, the minimum in the model description
    high: float
    allowed: str  #: in words
    nominal: float | None
    display: str | None
    description: str


UNITS: dict[str, Unit] = {
    "m": Unit({"m": 1}, {"mm": 1e3}),
    "kg": Unit({"kg": 1}, {"g": 1e3}),
    "s": Unit({"s": 1}, {"ms": 1e3, "us": 1e6}),
    "m/s": Unit({"m": 1, "s": -1}, {"mph": 3600.0 / 1609.344, "km/h": 3.6}),
    "s/m": Unit({"m": -1, "s": 1}, {}),
    "N": Unit({"kg": 1, "m": 1, "s": -2}, {"kN": 1e-3}),
    "N/m": Unit({"kg": 1, "s": -2}, {"kN/m": 1e-3, "N/mm": 1e-3}),
    "N.s/m": Unit({"kg": 1, "s": -1}, {}),
    "N.s": Unit({"kg": 1, "m": 1, "s": -1}, {}),
    "kg.m/s": Unit({"kg": 1, "m": 1, "s": -1}, {}),
    "J": Unit({"kg": 1, "m": 2, "s": -2}, {}),
    "1": Unit({}, {"%": 100.0}),
}

#: Name and description of each contact law, by the value of the parameter `law`.
LAWS: dict[int, tuple[str, str]] = {n: (law.name, law.description) for n, law in _LAWS.items()}


def _real(
    causality: str, name: str, unit: str, start: float | None, allowed: str, nominal: float,
    display: str | None, description: str,
) -> Variable:  # fmt: skip
    low, high = -_LARGEST, _LARGEST
    if allowed.startswith("> 0"):
        low = _ABOVE_ZERO
    elif allowed.startswith(">= "):
        low = float(allowed[3:])
    elif ".." in allowed:
        low, high = map(float, allowed.split(".."))
    return Variable(
        name, causality, "Real", unit, start, low, high, allowed, nominal, display, description
    )


_input, _parameter = partial(_real, "input"), partial(_real, "parameter")


def _output(name: str, unit: str, *others: Any) -> Variable:
    return _real("output", name, unit, None, *others)


def _flag(name: str, text: str) -> Variable:
    return Variable(name, "output", "Boolean", "", None, 0, 1, "", None, None, text)


#: A variable's value reference is its place here.
VARIABLES: tuple[Variable, ...] = (
    _input("k", "N/m", 1e6, "> 0", 1e6, "N/mm", "Contact stiffness of the ball (at reference_compression if exponent is not 1)"),
    _input("b", "N.s/m", 9.0, ">= 0", 10.0, None, "Damping of the contact (at reference_compression if exponent is not 1)"),
    _input("club_speed", "m/s", 35.0, "finite", 35.0, "mph", "Club head speed before the impact; used until first touch, then ignored"),
    _parameter("m_club", "kg", 0.210, "> 0", 0.2, "g", "Mass of the club head"),
    _parameter("m_ball", "kg", 0.04593, "> 0", 0.05, "g", "Mass of the ball"),
    _parameter("ball_diameter", "m", 0.04267, "> 0", 0.04, "mm", "Diameter of the ball"),
    _parameter("ball_speed", "m/s", 0.0, "finite", 35.0, "mph", "Velocity of the ball before the impact"),
    _parameter("gap", "m", 0.0, ">= 0", 0.1, "mm", "Distance between club face and ball at the start"),
    Variable("law", "parameter", "Enumeration", "", 1, min(LAWS), max(LAWS), " or ".join(f"{n} ({name})" for n, (name, _) in LAWS.items()), None, None, "Contact law"),
    _parameter("exponent", "1", 1.0, ">= 1", 1.0, None, "Exponent n of the relative power law, up to 12; must be 1 with law 1"),
    _parameter("reference_compression", "m", 0.005, "> 0", 0.005, "mm", "Compression for which k and b are given if exponent is not 1"),
    _parameter("restitution_at_rest", "1", 0.0, "0..1", 1.0, None, "If above 0, damping follows from COR = restitution_at_rest - restitution_slope * approach speed, and b is not used (law 2)"),
    _parameter("restitution_slope", "s/m", 0.0, ">= 0", 0.003, None, "Slope of the coefficient of restitution over approach speed, -dCOR/dv; see restitution_at_rest"),
    _output("force", "N", ">= 0", 5e3, "kN", "Contact force on the ball"),
    _output("club_position", "m", "finite", 0.01, "mm", "Position of the club face; the ball starts at 0"),
    _output("ball_position", "m", "finite", 0.01, "mm", "Position of the ball's near side"),
    _output("club_velocity", "m/s", "finite", 35.0, "mph", "Velocity of the club head"),
    _output("ball_velocity", "m/s", "finite", 50.0, "mph", "Velocity of the ball"),
    _output("compression", "m", ">= 0", 0.005, "mm", "Compression of the ball: club_position - ball_position, or 0 if they are apart"),
    _output("mean_force", "N", ">= 0", 5e3, "kN", "Mean contact force over the last communication step: impulse / step size"),
    _flag("touched", "The club has touched the ball"),
    _flag("in_contact", "Club and ball are in contact"),
    _flag("separated", "The contact has ended"),
    _output("touch_time", "s", "finite", 1e-3, "ms", "Time of first touch (before it, the start time); separation is at touch_time + contact_time"),
    _output("smash_factor", "1", "finite", 1.0, None, "Ball velocity / club speed at first touch"),
    _output("coefficient_of_restitution", "1", "finite", 1.0, None, "(ball velocity - club velocity) / approach speed at first touch"),
    _output("energy_efficiency", "1", ">= 0", 1.0, "%", "Kinetic energy now / at first touch"),
    _output("contact_time", "s", ">= 0", 5e-4, "us", "Time in contact so far"),
    _output("max_force", "N", ">= 0", 5e3, "kN", "Largest contact force so far, exact"),
    _output("time_of_max_force", "s", ">= 0", 5e-4, "us", "Time of the largest contact force so far, since first touch"),
    _output("max_compression", "m", ">= 0", 0.005, "mm", "Largest compression so far, exact"),
    _output("contact_displacement", "m", "finite", 0.01, "mm", "Displacement of the ball in contact so far"),
    _output("impulse", "N.s", ">= 0", 2.0, None, "Impulse of the contact force so far"),
    _output("momentum", "kg.m/s", "finite", 5.0, None, "Momentum of club and ball together"),
    _output("kinetic_energy", "J", ">= 0", 100.0, None, "Kinetic energy of club and ball together"),
)  # fmt: skip

#: Further variables of FMI 3.0: time, and those of Model Exchange. Their value references continue
#: those of the table.
MORE_VARIABLES: tuple[Variable, ...] = (
    _real("independent", "time", "s", None, "finite", 1e-3, "ms", "Time"),
    _real("local", "club_acceleration", "m/s2", None, "finite", 3e4, None, "Acceleration of the club head"),
    _real("local", "ball_acceleration", "m/s2", None, "finite", 1e5, None, "Acceleration of the ball"),
    _real("local", "touch_indicator", "", None, "finite", 1.0, None, "Event indicator of first touch: above 0 before it, then -1"),
    _real("local", "separation_indicator", "", None, "finite", 1.0, None, "Event indicator of separation: above 0 before it, then -1"),
)  # fmt: skip

MORE_UNITS: dict[str, Unit] = {"m/s2": Unit({"m": 1, "s": -2}, {})}

#: Value references of all of them by name.
ALL_REFERENCES: dict[str, int] = {
    variable.name: n for n, variable in enumerate(VARIABLES + MORE_VARIABLES)
}

#: Model Exchange: the continuous states, their derivatives in the same order, the event indicators.
STATES = ("club_position", "ball_position", "club_velocity", "ball_velocity")
DERIVATIVES = ("club_velocity", "ball_velocity", "club_acceleration", "ball_acceleration")
INDICATORS = ("touch_indicator", "separation_indicator")

#: Outputs that depend on the history of the contact, not only on its states: NaN in Model Exchange.
CO_SIMULATION_ONLY = ("mean_force", "max_force", "time_of_max_force", "max_compression")
