"""The impacts that tests, benchmark and stress share, and the ways to step through them. SI units.

Named cases that stretch one thing each, and random ones, far beyond golf; `special_points` has
those at the borders of closed forms.
"""

import math
import random
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from pathlib import Path

from golf_impact.closed_forms import half_contact, reduced_mass
from golf_impact.peers.problem import Case
from golf_impact.reference import Segment, Steps
from golf_impact.toml import read_toml


@dataclass(frozen=True)
class ImpactCase:
    """Inputs and parameters of a run, and its segments."""

    number: int  #: of the impact in its run; with the seed it determines the impact
    values: dict[str, float]  #: inputs and parameters by name
    start_time: float  #: the host's time at the start, s
    segments: tuple[Segment, ...]  #: the first one's k and b are those of `values`
    kind: str = "random"  #: part of the seed of its steps

    @property
    def closing(self) -> float:
        """Approach speed, m/s."""
        return self.values["club_speed"] - self.values["ball_speed"]

    @property
    def approach(self) -> float:
        """From the start to first touch, s, if there is one."""
        return self.values["gap"] / self.closing


def damping_ratio(values: Mapping[str, float]) -> float:
    """ζ = b/(2√(kμ))."""
    return values["b"] / critical_damping(values["k"], values["m_club"], values["m_ball"])


def critical_damping(k: float, m_club: float, m_ball: float) -> float:
    """The b of ζ = 1, N.s/m."""
    return 2.0 * math.sqrt(k * reduced_mass(m_club, m_ball))


def contact_time_of_law2(zeta: float, values: Mapping[str, float]) -> float:
    """Contact time of law 2, s; also the time scale of law 1."""
    omega = math.sqrt(values["k"] / reduced_mass(values["m_club"], values["m_ball"]))
    return 2.0 * half_contact(zeta) / omega


#: The document's impact, from which the named cases differ.
BASELINE = {name: value for name, value in vars(Case()).items() if name != "law"} | {"gap": 0.0}

#: Changes of it that stretch one thing each, by name.
NAMED = read_toml(Path(__file__).with_suffix(".toml"))


def named_cases(randoms: int = 0) -> Iterator[tuple[str, ImpactCase]]:
    """The named cases under both laws and as many random ones near golf, by name."""
    rows = [(name, law, NAMED[name]) for law in (1, 2) for name in NAMED]
    rng = random.Random(20)
    for n in range(randoms):
        changes = {
            "m_club": 10.0 ** rng.uniform(-3, 1),
            "m_ball": 10.0 ** rng.uniform(-3, 1),
            "k": 10.0 ** rng.uniform(3, 10),
            "zeta": 10.0 ** rng.uniform(-3, 0.2),
            "club_speed": rng.uniform(10.0, 80.0),
            "ball_speed": rng.choice((0.0, rng.uniform(-30.0, 5.0))),
            "gap": rng.choice((0.0, 0.0, 1e-4)),
        }
        rows.append((f"random {n}", 1 + n % 2, changes))
    for number, (name, law, changes) in enumerate(rows):
        values = BASELINE | {"law": law} | changes
        if zeta := values.pop("zeta", 0.0):
            values["b"] = zeta * critical_damping(values["k"], values["m_club"], values["m_ball"])
        yield f"{name}, law {law}", unchanged(number, values)


def unchanged(number: int, values: dict[str, float]) -> ImpactCase:
    """An impact whose k and b stay, for one and a half of law 2's contact times after touch."""
    approach = values["gap"] / (values["club_speed"] - values["ball_speed"])
    length = approach + 1.5 * contact_time_of_law2(damping_ratio(values), values)
    return ImpactCase(number, values, 0.0, segments_of(values, length))


def random_impact(seed: int, number: int) -> ImpactCase:
    """A random impact; the same for the same seed and number, on any machine."""
    rng = random.Random(f"{seed}/{number}")
    k = _decades(rng, 2, 12)
    mass, ratio = _decades(rng, -3, 1), _decades(rng, -6, 6)
    m_club, m_ball = mass * math.sqrt(ratio), mass / math.sqrt(ratio)
    zeta = _damping(rng)
    closing = _decades(rng, -6, 3)
    ball_speed = rng.choice((0.0, 0.0, 1.0, -1.0)) * _decades(rng, -6, 3)
    club_speed = max(-1e3, min(1e3, ball_speed + closing))
    if rng.random() < 0.02:  # no impact at all
        club_speed = ball_speed - closing
    closing = club_speed - ball_speed
    gap = 0.0
    if closing > 0.0 and rng.random() < 0.5:
        gap = min(_decades(rng, -6, -1), 100.0 * closing)
    values = {"law": rng.choice((1, 2)), "m_club": m_club, "m_ball": m_ball, "k": k}
    values |= {"b": zeta * critical_damping(k, m_club, m_ball)}
    values |= {"club_speed": club_speed, "ball_speed": ball_speed, "gap": gap}
    start_time = rng.choice((0.0, 1.0)) * _decades(rng, -3, 6)
    contact = contact_time_of_law2(zeta, values)
    touch = gap / closing if gap else 0.0
    changes = []
    for cut in sorted(rng.uniform(0.02, 1.1) for _ in range(rng.choice((0, 0, 0, 0, 1, 2, 3)))):
        b = values["b"] * rng.choice((0.0, 1.0, 1.0)) * _decades(rng, -2, 2)
        changes.append((touch + cut * contact, k * _decades(rng, -2, 2), b))
    end = touch + 4.0 * contact
    if rng.random() < 0.2:  # long after separation
        end += _decades(rng, -3, 0)
    return ImpactCase(number, values, start_time, segments_of(values, end, changes))


def pushed_impact(seed: int, number: int) -> ImpactCase:
    """A random impact with a force on the head, at most twice an undamped contact's largest."""
    impact, rng = random_impact(seed, number), random.Random(f"{seed}/{number}/force")
    v = impact.values
    scale = impact.closing * math.sqrt(v["k"] * reduced_mass(v["m_club"], v["m_ball"]))
    segments = tuple(
        replace(segment, club_force=scale * rng.choice((-1.0, 0.0, 1.0)) * _decades(rng, -4, 0.3))
        for segment in impact.segments
    )
    values = v | {"club_force": segments[0].club_force}
    return replace(impact, values=values, segments=segments, kind="pushed")


def _decades(rng: random.Random, low: float, high: float) -> float:
    return 10.0 ** rng.uniform(low, high)


def _damping(rng: random.Random) -> float:
    """ζ: none, near critical from either side, or anything."""
    kind = rng.randrange(6)
    if kind == 0:
        return 0.0
    if kind == 1:
        return 1.0 + rng.choice((-0.5, 0.5)) * _decades(rng, -14, -2)
    return _decades(rng, -4, 4) if kind < 4 else _decades(rng, -2, 1)


def segments_of(
    values: Mapping[str, float], end: float, changes: Iterable[tuple[float, float, float]] = ()
) -> tuple[Segment, ...]:
    """From the start to the end (s): k and b are those of `values`, then those of changes.

    A change is an instant (s) and the k and b from then on. It has no effect at the start, or if
    another one follows at the same instant.
    """
    begins = [(0.0, values["k"], values["b"]), *changes, (end, 0.0, 0.0)]
    made: list[Segment] = []
    for (begin, k, b), (until, *_) in pairwise(begins):
        if until > begin:
            if not made:
                k, b = values["k"], values["b"]
            made.append(Segment(_rounded(until - begin, until - begin), k, b))
    return tuple(made)


def _rounded(time: float, length: float) -> float:
    """The nearest multiple of a power of two, 2^-45 of a length or smaller: sums are exact, s."""
    unit = 2.0 ** (math.floor(math.log2(length)) - 46)
    return round(time / unit) * unit


def _cut(segment: Segment, cuts: Iterable[float]) -> list[Segment]:
    """The steps of a segment between these times in it, s; times outside of it don't count."""
    length = segment.length
    inside = {_rounded(time, length) for time in cuts if 0.0 < time < length}
    edges = pairwise(sorted(inside | {0.0, length}))
    return [replace(segment, length=end - begin) for begin, end in edges]


def random_steps(impact: ImpactCase, seed: int) -> list[Segment]:
    """Some 24 steps of 1 ns to 1 s in any order; the last one of a segment takes what is left."""
    rng = random.Random(f"{seed}/{impact.number}/steps/{impact.kind}")
    steps = []
    for segment in impact.segments:
        longest = math.log10(min(1.0, segment.length))
        lowest = (longest - rng.choice((1.0, 3.0, 9.0)) for _ in range(24))
        sizes = (_decades(rng, max(-9.0, low), max(-9.0, longest)) for low in lowest)
        steps += _cut(segment, accumulate(sizes))
    return steps


def straddling_steps(impact: ImpactCase, contact_time: float, seed: int) -> list[Segment]:
    """Points 1 to 100 ns before and after touch and separation."""
    rng = random.Random(f"{seed}/{impact.number}/straddle/{impact.kind}")
    steps, begin = [], 0.0
    for segment in impact.segments:
        cuts = [
            event - begin + side * 1e-9 * _decades(rng, 0, 2)
            for event in (impact.approach, impact.approach + contact_time)
            for side in (-1.0, 1.0)
        ]
        steps += _cut(segment, cuts)
        begin += segment.length
    return steps


def partitions(impact: ImpactCase, contact_time: float, seed: int) -> dict[str, Steps]:
    """All of these by name."""
    return {
        "one step": impact.segments,
        "equal": [replace(s, length=s.length / 64.0) for s in impact.segments for _ in range(64)],
        "random": random_steps(impact, seed),
        "straddling": straddling_steps(impact, contact_time, seed),
    }
