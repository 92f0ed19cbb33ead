"""Random impacts far beyond golf, extreme ones, and ways to step through them. SI units."""

import math
import random
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

from golf_impact.evidence.reference import Segment
from golf_impact.evidence.scales import reduced_mass

#: The document's impact.
BASELINE = {"k": 1e6, "b": 9.0, "club_speed": 35.0, "ball_speed": 0.0, "gap": 0.0}
BASELINE |= {"m_club": 0.210, "m_ball": 0.04593}

#: Changes of it that stretch one thing each; the damping ratio ζ (zeta) replaces b.
EXTREMES = {
    "baseline": {},
    "elastic": {"b": 0.0},
    "soft": {"k": 1e2},
    "stiff": {"k": 1e12},
    "slow": {"club_speed": 1e-6},
    "fast": {"club_speed": 1e3},
    "ball moving away": {"ball_speed": 20.0},
    "ball coming": {"ball_speed": -20.0},
    "after a gap": {"gap": 0.01},
    "nearly undamped": {"zeta": 1e-6},
    "half of critical": {"zeta": 0.5},
    "just below critical": {"zeta": 0.999999999999995},
    "critical": {"zeta": 1.0},
    "just above critical": {"zeta": 1.000000000000005},
    "overdamped": {"zeta": 2.9},
    "heavily overdamped": {"zeta": 1e4},
    "light ball": {"m_club": 2.0, "m_ball": 2e-6, "zeta": 0.1},
    "heavy ball": {"m_ball": 2.1e5, "zeta": 0.1},
    "equal masses": {"m_ball": 0.21, "zeta": 0.1},
}


@dataclass(frozen=True)
class ImpactCase:
    """A run: its values at the start, and the times between changes of k, b and club_force."""

    values: dict[str, float]  #: inputs and parameters by name
    segments: tuple[Segment, ...]  #: the first one's k and b are those of `values`
    start_time: float = 0.0  #: the host's time at the start, s

    @property
    def closing(self) -> float:
        """Approach speed, m/s."""
        return self.values["club_speed"] - self.values["ball_speed"]

    @property
    def approach(self) -> float:
        """From the start to first touch, s."""
        return self.values["gap"] / self.closing


def critical_damping(values: Mapping[str, float]) -> float:
    """The b of ζ = b/(2√(kμ)) = 1, N.s/m."""
    return 2.0 * math.sqrt(values["k"] * reduced_mass(values))


def half_contact(zeta: float) -> float:
    """Law 2's contact time in units of 2/ω, ω = √(k/μ), at this damping ratio.

    Schwager & Pöschel, Granular Matter 9, 465-469 (2007).
    """
    if zeta < 1.0:
        return math.acos(zeta) / math.sqrt((1.0 - zeta) * (1.0 + zeta))
    if zeta > 1.0:
        return math.acosh(zeta) / math.sqrt((zeta - 1.0) * (zeta + 1.0))
    return 1.0


def contact_time_of_law_2(values: Mapping[str, float]) -> float:
    """Contact time of law 2, s; also the time scale of law 1."""
    zeta = values["b"] / critical_damping(values)
    return 2.0 * half_contact(zeta) / math.sqrt(values["k"] / reduced_mass(values))


def extreme_impacts() -> Iterator[tuple[str, ImpactCase]]:
    """All `EXTREMES` under both laws, by name, for one and a half contact times of law 2."""
    for law in (1, 2):
        for name, changes in EXTREMES.items():
            values = BASELINE | {"law": law} | changes
            if zeta := values.pop("zeta", 0.0):
                values["b"] = zeta * critical_damping(values)
            approach = values["gap"] / (values["club_speed"] - values["ball_speed"])
            end = approach + 1.5 * contact_time_of_law_2(values)
            yield f"{name}, law {law}", ImpactCase(values, segments_of(values, end))


def random_impact(seed: int, number: int) -> ImpactCase:
    """A random impact; the same for the same seed and number, on any machine.

    Stiffness from 1e2 to 1e12 N/m, damping ratio 0 to 1e4, mass ratio 1e-6 to 1e6, up to three
    changes of k and b in contact; b within its range.
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
        changes.append((touch + share * contact, later, _allowed(b, values | {"k": later})))
    end = touch + 4.0 * contact
    if rng.random() < 0.2:  # long after separation
        end += _decades(rng, -3, 0)
    return ImpactCase(values, segments_of(values, end, changes), start_time)


def pushed(impact: ImpactCase, rng: random.Random) -> ImpactCase:
    """The impact with forces on the head, at most twice an undamped contact's largest force."""
    scale = impact.closing * 0.5 * critical_damping(impact.values)
    segments = tuple(
        replace(segment, club_force=scale * rng.choice((-1.0, 0.0, 1.0)) * _decades(rng, -4, 0.3))
        for segment in impact.segments
    )
    values = impact.values | {"club_force": segments[0].club_force}
    return replace(impact, values=values, segments=segments)


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


def cut(segments: Iterable[Segment], instants: Iterable[float]) -> list[Segment]:
    """Steps that end at these instants (s from the start), too; their sums are exact."""
    steps, begin, instants = [], 0.0, sorted(instants)
    for segment in segments:
        length = segment.length
        inside = {_rounded(t - begin, length) for t in instants if 0.0 < t - begin < length}
        edges = pairwise(sorted(inside | {0.0, length}))
        steps += [replace(segment, length=end - start) for start, end in edges]
        begin += length
    return steps


def _rounded(time: float, length: float) -> float:
    """The nearest multiple of a power of two, 2^-45 of a length or smaller: sums are exact, s."""
    unit = 2.0 ** (math.floor(math.log2(length)) - 46)
    return round(time / unit) * unit


def random_steps(impact: ImpactCase, rng: random.Random) -> list[Segment]:
    """Some 24 steps of 1 ns to 1 s in any order in each segment; the last takes what is left."""
    instants, begin = [], 0.0
    for segment in impact.segments:
        longest = math.log10(min(1.0, segment.length))
        lowest = [longest - rng.choice((1.0, 3.0, 9.0)) for _ in range(24)]
        sizes = (_decades(rng, max(-9.0, low), max(-9.0, longest)) for low in lowest)
        instants += [t for t in accumulate(sizes, initial=begin) if t < begin + segment.length]
        begin += segment.length
    return cut(impact.segments, instants)


def step_patterns(
    impact: ImpactCase, contact_time: float, rng: random.Random, equal: int = 64
) -> dict[str, list[Segment]]:
    """Steps by name: one or so many equal ones in each segment, random ones, and four special ones.

    These end 1 to 100 ns before and after touch and separation.
    """
    events = (impact.approach, impact.approach + contact_time)
    beside = [event + side * 1e-9 * _decades(rng, 0, 2) for event in events for side in (-1.0, 1.0)]
    return {
        "one step": list(impact.segments),
        "equal": [
            replace(s, length=s.length / equal) for s in impact.segments for _ in range(equal)
        ],
        "random": random_steps(impact, rng),
        "beside events": cut(impact.segments, beside),
    }
