"""The table of the component's variables, from which all interfaces and documents are made."""

from functools import partial
from typing import Any, NamedTuple

from .laws import LAWS as _LAWS

#: Of doubles: the largest, and the least above 0.
LARGEST, _ABOVE_ZERO = 1.7976931348623157e308, 5e-324


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
    nominal: float | None
    display: str | None
    description: str
    reference: int  #: FMI's value reference

    @property
    def allowed(self) -> str:
        """The allowed values in words."""
        if self.type == "Boolean":
            return ""
        if self.type == "Enumeration":
            return " or ".join(f"{number} ({name})" for number, (name, _) in LAWS.items())
        if self.high < LARGEST:
            return f"{self.low:g}..{self.high:g}"
        words = {-LARGEST: "finite", _ABOVE_ZERO: "> 0"}
        return words.get(self.low, f">= {self.low:g}")


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

Bounds = tuple[float, float]

#: Bounds of most variables: any finite number, those above 0, those not below 0.
_FINITE, _POSITIVE, _FROM_ZERO = (-LARGEST, LARGEST), (_ABOVE_ZERO, LARGEST), (0.0, LARGEST)


def _real(
    causality: str, reference: int, name: str, unit: str, start: float | None, bounds: Bounds,
    nominal: float, display: str | None, text: str,
) -> Variable:  # fmt: skip
    low, high = bounds
    return Variable(
        name, causality, "Real", unit, start, low, high, nominal, display, text, reference
    )


_input, _parameter = partial(_real, "input"), partial(_real, "parameter")


def _output(reference: int, name: str, unit: str, *others: Any) -> Variable:
    return _real("output", reference, name, unit, None, *others)


def _flag(reference: int, name: str, text: str) -> Variable:
    return Variable(name, "output", "Boolean", "", None, 0, 1, None, None, text, reference)


def _law(reference: int, name: str, text: str) -> Variable:
    low, high = min(LAWS), max(LAWS)
    return Variable(name, "parameter", "Enumeration", "", 1, low, high, None, None, text, reference)


#: Value references are fixed: hosts keep them in their files.
VARIABLES: tuple[Variable, ...] = (
    _input(0, "k", "N/m", 1e6, _POSITIVE, 1e6, "N/mm", "Contact stiffness of the ball (at reference_compression if exponent is not 1)"),
    _input(1, "b", "N.s/m", 9.0, _FROM_ZERO, 10.0, None, "Damping of the contact (at reference_compression if exponent is not 1)"),
    _input(2, "club_speed", "m/s", 35.0, _FINITE, 35.0, "mph", "Club head speed before the impact; used until first touch, then ignored"),
    _parameter(3, "m_club", "kg", 0.210, _POSITIVE, 0.2, "g", "Mass of the club head"),
    _parameter(4, "m_ball", "kg", 0.04593, _POSITIVE, 0.05, "g", "Mass of the ball"),
    _parameter(5, "ball_diameter", "m", 0.04267, _POSITIVE, 0.04, "mm", "Diameter of the ball"),
    _parameter(6, "ball_speed", "m/s", 0.0, _FINITE, 35.0, "mph", "Velocity of the ball before the impact"),
    _parameter(7, "gap", "m", 0.0, _FROM_ZERO, 0.1, "mm", "Distance between club face and ball at the start"),
    _law(8, "law", "Contact law"),
    _parameter(9, "exponent", "1", 1.0, (1.0, 12.0), 1.0, None, "Exponent n of the relative power law; must be 1 with law 1"),
    _parameter(10, "reference_compression", "m", 0.005, _POSITIVE, 0.005, "mm", "Compression for which k and b are given if exponent is not 1"),
    _parameter(11, "restitution_at_rest", "1", 0.0, (0.0, 1.0), 1.0, None, "If above 0, damping follows from COR = restitution_at_rest - restitution_slope * approach speed, and b is not used (law 2)"),
    _parameter(12, "restitution_slope", "s/m", 0.0, _FROM_ZERO, 0.003, None, "Slope of the coefficient of restitution over approach speed, -dCOR/dv; see restitution_at_rest"),
    _output(13, "force", "N", _FROM_ZERO, 5e3, "kN", "Contact force on the ball"),
    _output(14, "club_position", "m", _FINITE, 0.01, "mm", "Position of the club face; the ball starts at 0"),
    _output(15, "ball_position", "m", _FINITE, 0.01, "mm", "Position of the ball's near side"),
    _output(16, "club_velocity", "m/s", _FINITE, 35.0, "mph", "Velocity of the club head"),
    _output(17, "ball_velocity", "m/s", _FINITE, 50.0, "mph", "Velocity of the ball"),
    _output(18, "compression", "m", _FROM_ZERO, 0.005, "mm", "Compression of the ball: club_position - ball_position, or 0 if they are apart"),
    _output(19, "mean_force", "N", _FROM_ZERO, 5e3, "kN", "Mean contact force over the last communication step: impulse / step size"),
    _flag(20, "touched", "The club has touched the ball"),
    _flag(21, "in_contact", "Club and ball are in contact"),
    _flag(22, "separated", "The contact has ended"),
    _output(23, "touch_time", "s", _FINITE, 1e-3, "ms", "Time of first touch (before it, the start time); separation is at touch_time + contact_time"),
    _output(24, "smash_factor", "1", _FINITE, 1.0, None, "Ball velocity / club speed at first touch"),
    _output(25, "coefficient_of_restitution", "1", _FINITE, 1.0, None, "(ball velocity - club velocity) / approach speed at first touch"),
    _output(26, "energy_efficiency", "1", _FROM_ZERO, 1.0, "%", "Kinetic energy now / at first touch"),
    _output(27, "contact_time", "s", _FROM_ZERO, 5e-4, "us", "Time in contact so far"),
    _output(28, "max_force", "N", _FROM_ZERO, 5e3, "kN", "Largest contact force so far, exact"),
    _output(29, "time_of_max_force", "s", _FROM_ZERO, 5e-4, "us", "Time of the largest contact force so far, since first touch"),
    _output(30, "max_compression", "m", _FROM_ZERO, 0.005, "mm", "Largest compression so far, exact"),
    _output(31, "contact_displacement", "m", _FINITE, 0.01, "mm", "Displacement of the ball in contact so far"),
    _output(32, "impulse", "N.s", _FROM_ZERO, 2.0, None, "Impulse of the contact force so far"),
    _output(33, "momentum", "kg.m/s", _FINITE, 5.0, None, "Momentum of club and ball together"),
    _output(34, "kinetic_energy", "J", _FROM_ZERO, 100.0, None, "Kinetic energy of club and ball together"),
)  # fmt: skip

#: Further variables of FMI 3.0: time, and those of Model Exchange.
MORE_VARIABLES: tuple[Variable, ...] = (
    _real("independent", 35, "time", "s", None, _FINITE, 1e-3, "ms", "Time"),
    _real("local", 36, "club_acceleration", "m/s2", None, _FINITE, 3e4, None, "Acceleration of the club head"),
    _real("local", 37, "ball_acceleration", "m/s2", None, _FINITE, 1e5, None, "Acceleration of the ball"),
    _real("local", 38, "touch_indicator", "", None, _FINITE, 1.0, None, "Event indicator of first touch: above 0 before it, then -1"),
    _real("local", 39, "separation_indicator", "", None, _FINITE, 1.0, None, "Event indicator of separation: above 0 before it, then -1"),
)  # fmt: skip

MORE_UNITS: dict[str, Unit] = {"m/s2": Unit({"m": 1, "s": -2}, {})}

#: All of them by name.
BY_NAME: dict[str, Variable] = {row.name: row for row in VARIABLES + MORE_VARIABLES}

#: Inputs and parameters by their references, in the order of `Inputs` and `Parameters`.
SETTABLE: dict[int, Variable] = {row.reference: row for row in VARIABLES if row.start is not None}
INPUTS = sum(row.causality == "input" for row in VARIABLES)

#: The outputs that are the state of the bodies, in its order.
MOTION = (
    "force", "club_position", "ball_position", "club_velocity", "ball_velocity", "compression",
)  # fmt: skip

#: Model Exchange: the continuous states, their derivatives in the same order, the event indicators.
STATES = ("club_position", "ball_position", "club_velocity", "ball_velocity")
DERIVATIVES = ("club_velocity", "ball_velocity", "club_acceleration", "ball_acceleration")
INDICATORS = ("touch_indicator", "separation_indicator")

#: Outputs that depend on the history of the contact, not only on its states: NaN in Model Exchange.
CO_SIMULATION_ONLY = ("mean_force", "max_force", "time_of_max_force", "max_compression")
