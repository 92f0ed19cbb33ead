"""What the source document prints, and the parameters that its numbers come from.

Source: "Doing Physics with Python: a one-dimensional model for the collision between a golf club
and golf ball" (golfSpring.py). Its numbers are those of an explicit Euler scheme with a step of
0.5 µs, stopped a few samples late; so they lie some tenths of a per cent from the exact
solution of its own equations.
"""

from dataclasses import dataclass

#: The parameters that reproduce the printed numbers; they are the FMU's defaults.
USED = {"m_club": 0.210, "m_ball": 0.04593, "ball_diameter": 0.04267}

#: The parameters as Table 1 prints them.
TABLE_1 = {"m_club": 0.200, "m_ball": 0.046, "ball_diameter": 0.044}

#: The step of the document's scheme, s.
TIME_STEP = 0.5e-6

#: The document's program goes on for 2 or 3 samples after the bodies part, until they are this far
#: apart, m; 35 to 48 µm print the same numbers.
END_GAP = 36e-6

#: How far the exact answer may lie from a printed number, relative, beside half a printed digit:
#: the document's numerical error. The largest are 0.53 % in COR at k = 2e6 (0.0051, where half a
#: digit is 0.005) and 0.48 % in the ball speed printed there.
NUMERICAL_ERROR = 0.005


@dataclass(frozen=True)
class Printed:
    """A number as it is printed: `text` in units of `scale` SI units."""

    text: str
    scale: float = 1.0

    @property
    def value(self) -> float:
        """The number in SI units."""
        return float(self.text) * self.scale

    @property
    def _decimals(self) -> int:
        return len(self.text.partition(".")[2])

    @property
    def half_digit(self) -> float:
        """Half a unit of the last printed digit, in SI units."""
        return 0.5 * 10.0**-self._decimals * self.scale

    def shown(self, value: float) -> str:
        """Another value with one digit more than the printed one."""
        return f"{value / self.scale:.{self._decimals + 1}f}"


#: What is printed of one case, and of each case in a table of several.
_CASE = (
    *("club_velocity", "ball_velocity", "momentum_initial", "momentum_final"),
    *("kinetic_energy_initial", "kinetic_energy_final", "smash_factor"),
    *("coefficient_of_restitution", "contact_time", "contact_displacement_over_diameter"),
    *("max_force", "impulse", "momentum_gain_ball", "energy_efficiency"),
)
_ROW = (
    *("club_velocity", "ball_velocity", "max_force", "smash_factor", "coefficient_of_restitution"),
    *("contact_time", "contact_displacement_over_diameter", "energy_efficiency"),
)

#: SI units of those that are printed in others: µs and %.
_SCALES = {"contact_time": 1e-6, "energy_efficiency": 0.01}


def _printed(names: tuple[str, ...], texts: str) -> dict[str, Printed]:
    pairs = zip(names, texts.split(), strict=True)
    return {name: Printed(text, _SCALES.get(name, 1.0)) for name, text in pairs}


BASELINE = _printed(
    _CASE, "21.50 54.84 7.35 7.03 128.62 117.61 1.57 0.95 621 0.41 6799 2.68 2.52 91"
)

ELASTIC = _printed(
    _CASE, "22.41 57.55 7.35 7.35 128.62 128.81 1.64 1.00 611 0.41 6808 2.64 2.64 100"
)

#: The softer ball of the elastic case: two numbers only.
ELASTIC_SOFT = {"ball_velocity": Printed("58"), "contact_time": Printed("864", 1e-6)}

CLUB_SPEED = {
    35.0: _printed(_ROW, "21.5 54.8 6799 1.57 0.95 621 0.41 91"),
    50.0: _printed(_ROW, "30.7 78.4 9713 1.57 0.95 620 0.59 91"),
}

COMPRESSION = {
    0.5e6: _printed(_ROW, "21.1 53.7 4802 1.53 0.93 883 0.58 88"),
    1.0e6: _printed(_ROW, "21.5 54.9 6799 1.57 0.95 621 0.41 91"),
    2.0e6: _printed(_ROW, "21.8 55.8 9627 1.59 0.97 438 0.29 94"),
}

OLD_BALL = {
    (1.0e6, 9.0): _printed(_ROW, "21.50 54.84 6799 1.57 0.95 621 0.41 91"),
    (0.5e6, 12.0): _printed(_ROW, "20.71 52.44 4799 1.50 0.91 890 0.58 84"),
}

#: Roh & Lee, "Analysis of golf ball spin mechanism at impact by FEM", 14th International Congress
#: on Sound and Vibration, as the document quotes them (SI units).
ROH_LEE = {
    "m_club": 0.210,
    "m_ball": 0.04593,
    "radius": 0.021335,
    "club_speed": 35.0,
    "club_velocity": 24.0,
    "ball_velocity": 50.0,
    "contact_time": 600e-6,
    "max_force": 6600.0,
    "time_of_max_force": 280e-6,
}

#: What the document works out from them on the back of an envelope.
ENVELOPE = {
    "average force": Printed("3828"),
    "contact distance": Printed("0.015"),
    "contact distance / R": Printed("0.7"),
    "smash factor": Printed("1.43"),
    "coefficient of restitution": Printed("0.74"),
    "initial momentum": Printed("7.35"),
    "final momentum": Printed("7.34"),
    "initial kinetic energy": Printed("128.6"),
    "final kinetic energy": Printed("117.9"),
    "energy lost": Printed("8.3", 0.01),
}
