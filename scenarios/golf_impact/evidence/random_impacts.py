"""Random impacts far beyond golf, and ways to step through them. SI units."""

import math
import random
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import NamedTuple

from golf_impact.data.runs import reduced_mass


class Step(NamedTuple):
    """A communication step, s, and the inputs set before it."""

    length: float
    k: float
    b: float
    club_force: float


@dataclass(frozen=True)
class ImpactCase:
    """A run from 0 to its end, s."""

    values: Mapping[str, float]  #: inputs and parameters by name, at the start
    end: float
    changes: tuple[tuple[float, Mapping[str, float]], ...] = ()  #: instants and inputs from then on
    start_time: float = 0.0  #: the host's time at the start, s

    @property
    def closing(self) -> float:
        """Approach speed, m/s."""
        return self.values["club_speed"] - self.values["ball_speed"]

    @property
    def approach(self) -> float:
        """From the start to first touch, s."""
        return self.values["gap"] / self.closing

    def steps(self, instants: Iterable[float] = ()) -> list[Step]:
        """Steps that end at these instants (rounded as the end), at changes and at the end."""
        later, ends = dict(self.changes), {_rounded(time, self.end) for time in instants}
        edges = sorted({0.0, *(end for end in ends if 0.0 < end < self.end), *later, self.end})
        now, steps = {"club_force": 0.0, **self.values}, []
        for begin, end in pairwise(edges):
            now |= later.get(begin, {})
            steps.append(Step(end - begin, now["k"], now["b"], now["club_force"]))
        return steps

    def patterns(self, contact_time: float, rng: random.Random) -> dict[str, list[Step]]:
        """By name: one step; 2 to 100 equal ones; some 24 random ones of 1 ns to 1 s after each
        change; and steps that end 1 to 100 ns before and after touch and separation.
        """
        number = round(_decades(rng, 0.3, 2.0))
        chosen: list[float] = []
        for begin in (0.0, *(time for time, _ in self.changes)):
            longest = max(-9.0, math.log10(min(1.0, self.end - begin)))
            chosen += accumulate((_decades(rng, -9, longest) for _ in range(24)), initial=begin)
        events = (self.approach, self.approach + contact_time)
        return {
            "one step": self.steps(),
            "equal steps": self.steps(self.end * n / number for n in range(1, number)),
            "random steps": self.steps(chosen),
            "steps beside events": self.steps(
                at + sign * _decades(rng, -9, -7) for at in events for sign in (-1.0, 1.0)
            ),
        }


def _rounded(time: float, end: float) -> float:
    """To a multiple of a power of two, 2^-46 of the end: sums of steps are exact."""
    unit = 2.0 ** (math.floor(math.log2(end)) - 46)
    return round(time / unit) * unit


def critical_damping(values: Mapping[str, float]) -> float:
    """The b of ζ = b/(2√(kμ)) = 1, N.s/m."""
    return 2.0 * math.sqrt(values["k"] * reduced_mass(values))


def contact_time_of_law_2(values: Mapping[str, float]) -> float:
    """Contact time of law 2, s; also the time scale of law 1.

    Schwager & Pöschel, Granular Matter 9, 465-469 (2007).
    """
    zeta = values["b"] / critical_damping(values)
    frequency = math.sqrt(abs((1.0 - zeta) * (1.0 + zeta)))
    half = math.acos(zeta) if zeta < 1.0 else math.acosh(zeta)
    own_time = 2.0 * half / frequency if frequency else 2.0
    return own_time / math.sqrt(values["k"] / reduced_mass(values))


def random_impact(seed: int, number: int, pushed: bool = False) -> ImpactCase:
    """A random impact; the same for the same seed and number, on any machine.

    Stiffness from 1e2 to 1e12 N/m, damping ratio 0 to 1e4, mass ratio 1e-6 to 1e6, up to three
    changes of k and b in contact; b within its range. If `pushed`, there are forces on the head, at
    most twice an undamped contact's largest force.
    """
    rng = random.Random(f"{seed}/{number}")
    k, mass, ratio = _decades(rng, 2, 12), _decades(rng, -3, 1), math.sqrt(_decades(rng, -6, 6))
    values = {"k": k, "m_club": mass * ratio, "m_ball": mass / ratio}
    values["b"] = _allowed(_damping_ratio(rng) * critical_damping(values), values)
    closing = _decades(rng, -6, 3)
    ball_speed = rng.choice((0.0, 0.0, 1.0, -1.0)) * _decades(rng, -6, 3)
    club_speed = max(-1e3, min(1e3, ball_speed + closing))
    closing, gap = club_speed - ball_speed, 0.0
    if rng.random() < 0.5:
        gap = min(_decades(rng, -6, -1), 100.0 * closing)
    values |= {"law": rng.choice((1, 2)), "gap": gap}
    values |= {"club_speed": club_speed, "ball_speed": ball_speed}
    start_time = rng.choice((0.0, 1.0)) * _decades(rng, -3, 6)
    contact, touch = contact_time_of_law_2(values), gap / closing
    changes = []
    for share in sorted(rng.uniform(0.02, 1.1) for _ in range(rng.choice((0, 0, 0, 0, 1, 2, 3)))):
        b = values["b"] * rng.choice((0.0, 1.0, 1.0)) * _decades(rng, -2, 2)
        later = k * _decades(rng, -2, 2)
        inputs = {"k": later, "b": _allowed(b, values | {"k": later})}
        changes.append((touch + share * contact, inputs))
    end = touch + 4.0 * contact
    if rng.random() < 0.2:  # long after separation
        end += _decades(rng, -3, 0)
    if pushed:
        rng, scale = random.Random(f"{seed}/{number}/force"), closing * critical_damping(values) / 2
        for inputs in (values, *(later for _, later in changes)):
            inputs["club_force"] = scale * rng.choice((-1.0, 0.0, 1.0)) * _decades(rng, -4, 0.3)
    on_grid = tuple((_rounded(time, end), inputs) for time, inputs in changes)
    return ImpactCase(values, _rounded(end, end), on_grid, start_time)


def _decades(rng: random.Random, low: float, high: float) -> float:
    return math.pow(10.0, rng.uniform(low, high))


def _allowed(b: float, values: Mapping[str, float]) -> float:
    """The b, N.s/m, or the largest that is allowed beside this k and these masses."""
    return min(b, 1e9, 9.999e3 * critical_damping(values))


def _damping_ratio(rng: random.Random) -> float:
    """None, near critical from either side, or anything."""
    kind = rng.randrange(6)
    if kind == 0:
        return 0.0
    if kind == 1:
        return 1.0 + rng.choice((-0.5, 0.5)) * _decades(rng, -14, -2)
    return _decades(rng, -4, 4) if kind < 4 else _decades(rng, -2, 1)
