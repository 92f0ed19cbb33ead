"""The impacts that tests share, by name, and what is expected of them.

Two sources that share nothing with the FMU: `exact`, of linear contacts the reference, of others
the rows of `data/golden.json`, and `integrated`, by SciPy's DOP853.
"""

import json
from functools import cache
from pathlib import Path
from typing import NamedTuple

from golf_physics.variables import MORE_UNITS, SETTABLE, UNITS
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from golf_impact.data.runs import reduced_mass
from golf_impact.evidence.random_impacts import critical_damping
from golf_impact.evidence.reference import Reference, mp
from golf_impact.evidence.scales import Scales

DEFAULTS = {row.name: row.start for row in SETTABLE.values()}

#: Exponents of kg, m and s by unit.
BASE = {"": {}} | {name: unit.base for name, unit in (UNITS | MORE_UNITS).items()}


class Case(NamedTuple):
    """An impact: why it is here, what differs from the defaults, and inputs that change later."""

    why: str
    given: dict
    changes: tuple = ()  #: (s since the start, inputs set then)
    end: float = 0.0  #: s since the start, if it isn't beyond separation and all changes
    start: float = 0.0  #: the host's time, s

    @property
    def values(self):
        """All inputs and parameters at the start."""
        return DEFAULTS | self.given

    @property
    def is_linear(self):
        return self.given.get("exponent", 1.0) == 1.0 and "restitution_at_rest" not in self.given


CRITICAL = {"law": 2, "m_club": 0.3, "m_ball": 0.06, "k": 8e5}

CASES = {
    "law 1": Case("the document's defaults", {}),
    "law 2": Case("the other law", {"law": 2}),
    "undamped": Case("a corner of the document's table", {"k": 0.5e6, "b": 0.0}),
    "undamped, law 2": Case("the same result by the other law", {"law": 2, "k": 0.5e6, "b": 0.0}),
    "stiff and damped": Case("the opposite corner", {"k": 2e6, "b": 12.0}),
    "stiff and damped, law 2": Case("the opposite corner", {"law": 2, "k": 2e6, "b": 12.0}),
    "ball comes": Case("the club turns back", {"ball_speed": -20.0, "m_club": 0.05}),
    "ball meets a club at rest": Case("no smash factor", {"club_speed": 0.0, "ball_speed": -1.0}),
    "after a gap": Case("touch isn't the start", {"gap": 0.004, "ball_speed": 2.0}),
    "half of critical": Case("the largest force is at touch from here", {**CRITICAL, "b": 200.0}),
    "critical": Case("two rates coincide", {**CRITICAL, "b": 400.0}),
    "just above critical": Case("beside it", {**CRITICAL, "b": 400.0004}),
    "overdamped": Case("no oscillation; ζ = 10", {**CRITICAL, "b": 4000.0}),
    "damped, light ball": Case("ζ = 1.9", {"law": 2, "b": 800.0, "m_ball": 0.046}),
    "drag 150": Case("beside ζ = 0.4, where light balls may stick", {"b": 150.0}),
    "drag 1000": Case("ζ = 2.6; bodies part below 2.91", {"b": 1000.0}),
    "sticks": Case("they never part", {"b": 5000.0}),
    "sticks for long": Case("nothing is left of the compression", {"b": 5000.0}, end=1e3),
    "sticks for ever": Case("nor of anything else", {"b": 5000.0}, end=1e25),
    "sticks, then parts": Case(
        "drag separates them long after its fast mode has decayed",
        {"m_club": 0.0031622776601683794, "m_ball": 316.2277660168379, "b": 11246.770270096215,
         "club_speed": 36.0, "ball_speed": 1.0},
    ),
    "equal masses": Case("both drags are one", {"m_club": 0.1, "m_ball": 0.1, "b": 400.0}),
    "very light ball": Case("1e-6 of the club", {"law": 2, "m_club": 2.0, "m_ball": 2e-6}),
    "marble": Case(
        "small, stiff, fast",
        {"law": 2, "m_club": 0.233852, "m_ball": 0.00194858, "k": 2.46302e9, "b": 10.3834,
         "club_speed": 64.1308},
    ),
    "grains": Case(
        "bodies of a few grams, much drag",
        {"m_club": 0.00262502, "m_ball": 0.00350169, "k": 661718.0, "b": 20.8423,
         "club_speed": 19.5105},
    ),
    "against each other": Case(
        "both move",
        {"m_club": 0.699182, "m_ball": 9.65858, "k": 351.581, "b": 8.49658, "club_speed": 69.5512,
         "ball_speed": -2.43864},
    ),
    "changes": Case(
        "k and b change in contact, speed before it", {"gap": 0.003},
        ((5e-5, {"club_speed": 42.0}), (2e-4, {"k": 1.5e6, "b": 30.0}), (4e-4, {"k": 8e5})),
    ),
    "starts late": Case("touch_time is the host's", {"gap": 0.003, "law": 2}, start=-2.75),
    "changes, law 2": Case(
        "the damper's force jumps", {"law": 2}, ((2e-4, {"b": 60.0}), (3e-4, {"k": 2e6, "b": 0.0}))
    ),
    "COR, n = 1.5": Case(
        "COR 0.743, 4021.0718 N at 5 mm",
        {"law": 2, "exponent": 1.5, "k": 804214.36, "restitution_at_rest": 0.743},
    ),
    "COR, n = 1.6": Case(
        "the exponent of a published ball",
        {"law": 2, "exponent": 1.615544, "k": 770080.2, "restitution_at_rest": 0.743},
    ),
    "n = 1.6": Case(
        "damping given", {"law": 2, "exponent": 1.6, "k": 8e5, "b": 30.0, "ball_speed": -3.0}
    ),
    "n = 3": Case(
        "stiffens much; another length",
        {"law": 2, "exponent": 3.0, "reference_compression": 0.008, "gap": 0.001},
    ),
    "n = 12": Case("the largest exponent", {"law": 2, "exponent": 12.0}),
    "COR line": Case(
        "damping chosen at touch",
        {"law": 2, "restitution_at_rest": 0.86, "restitution_slope": 0.0029},
    ),
    "COR line, n = 1.5": Case(
        "and an exponent",
        {"law": 2, "exponent": 1.5, "restitution_at_rest": 0.86, "restitution_slope": 0.0029},
    ),
    "pulled apart": Case(
        "suddenly so much damping that contact ends", {"law": 2}, ((4e-4, {"b": 1e4}),), 1e-3
    ),
    "pulled apart, pushed": Case(
        "and the force goes on", {"law": 2, "club_force": 500.0}, ((4e-4, {"b": 1e4}),), 1e-3
    ),
    "pulled apart, returns": Case(
        "compression is 0 from when the bodies approach again", {"law": 2},
        ((4e-4, {"b": 1e4}), (4.5e-4, {"club_force": 1e5}), (6e-4, {"club_force": -1e5})), 9e-4
    ),
    "fast common motion": Case(
        "law 1's real mode cancels the pair",
        {"b": 60.0, "ball_speed": -1000.0, "club_speed": -965.0},
    ),
    "separates late": Case(
        "until d has decayed to 1e-14 m", {"k": 1033217.582605348, "b": 1147.0}, end=0.04
    ),
    "hardly any drag": Case("its damping ratio would underflow in a divisor", {"b": 1e-300}),
    "least drag": Case("a subnormal number", {"b": 5e-324}),
    # The share of a fast common motion decays before the oscillation, which leaves 1.5 N.
    "parts late": Case(
        "a pull against the drag",
        {"m_club": 0.2, "m_ball": 0.1, "b": 10.0, "ball_speed": 34.999, "club_force": -40.0},
        ((8e-4, {"club_force": 3.0}),), 0.1008,
    ),
    "no force": Case(
        "-0 N is none", {"law": 2, "club_force": -0.0}, ((1e-4, {"k": 1.2e6}),), 1.1e-3
    ),
    "force before touch": Case(
        "ignored; touch comes after 286 µs", {"law": 2, "gap": 0.01, "club_force": -5e4},
        ((1e-4, {"club_force": 800.0}),), 1.2e-3,
    ),
    "force returns": Case(
        "in flight, to its value in contact", {"law": 2, "club_force": 500.0},
        ((1e-3, {"club_force": 0.0}), (2e-3, {"club_force": 500.0})), 4e-3,
    ),
    "force ends": Case(
        "in flight", {"law": 2, "club_force": 500.0}, ((1e-3, {"club_force": 0.0}),), 2e-3
    ),
}  # fmt: skip

#: Modes are separate under law 2 up to a level of half the amplitude, under law 1 without a force.
CASES |= {
    f"law {law}, {force:g} N": Case(
        "a force on the head", {"law": law, "b": 30.0, "club_force": force}, end=1.2e-3
    )
    for law in (1, 2)
    for force in (1e-300, 1.0, 9e3, 1.3e4, -1.2e4, -1.8e4)
}

#: Beside the damping up to which modes are separate.
CASES |= {
    f"law {law}, {side} ζ = {zeta}, ball {m_ball} kg": Case(
        "where modes aren't separate any more",
        {"law": law, "m_ball": m_ball,
         "b": critical_damping(DEFAULTS | {"m_ball": m_ball}) * zeta * (1.0 + sign * 2.0**-49)},
    )
    for law, zeta in ((1, 0.7), (2, 0.999))
    for m_ball in (0.105, 4.0)
    for side, sign in (("below", -1.0), ("above", 1.0))
}  # fmt: skip

#: ζ² and m_club m_ball/M² where the characteristic polynomial of law 1 has one triple root; by
#: rounding the cases lie on either side.
_TRIPLE = (4 / 3 - (16 / 9 - 32 / 27) ** 0.5) / (16 / 27)
_PRODUCT = 2.0 * _TRIPLE / 27.0
_SHARE = 0.5 * (1.0 - (1.0 - 4.0 * _PRODUCT) ** 0.5)
CASES |= {
    f"three rates meet, b × {factor!r}": Case(
        "a triple root",
        {"m_club": 0.3 * (1.0 - _SHARE), "m_ball": 0.3 * _SHARE, "ball_speed": -3.0,
         "b": 2.0 * (_TRIPLE * 1e6 * 0.3 * _PRODUCT) ** 0.5 * factor},
        end=2e-4,
    )
    for factor in (1.0, 1.0 + 1e-9, 1.0 - 1e-6)
}  # fmt: skip

#: The power law around critical damping, and far from it; nearly linear, and up to exponent 12.
_DAMPED = [(1.5, zeta) for zeta in (1e-6, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 30.0, 1e4)]
_DAMPED += [(1.05, 0.8), (2.0, 0.7), (3.0, 0.3), (6.0, 0.82), (12.0, 0.2)]
_DAMPED += [(n, zeta) for n in (1.0 + 1e-9, 10.0) for zeta in (1e-6, 1.0, 30.0)]
CASES |= {
    f"n = {n!r}, ζ = {zeta!r}": Case(
        "a power law's damping",
        {"law": 2, "k": 8e5, "exponent": n,
         "b": zeta * (0.5 * (n + 1.0)) ** 0.5 * critical_damping(DEFAULTS | {"k": 8e5})},
    )
    for n, zeta in _DAMPED
}  # fmt: skip

POWER_LAW = [name for name, case in CASES.items() if not case.is_linear]

#: Of the horizon, where the outputs on the way are compared.
SHARES = (0.08, 0.29, 0.4, 0.63, 1.0)

#: One of each kind of contact, by what differs from the defaults.
KINDS = {
    name: CASES[name].given
    for name in ("law 1", "law 2", "after a gap", "damped, light ball", "n = 1.6", "COR line")
} | {"never separates": {"b": 2000.0}}


def golden():
    """The rows of `data/golden.json`, written by tests/tools/golden.py."""
    return json.loads((Path(__file__).parent / "data" / "golden.json").read_text())


@cache
def _power_law(name):
    """Of a case of the power law its outputs after separation, and on the way."""
    rows = golden()["power law"][name]
    return [{output: mp.mpf(text) for output, text in row.items()} for row in rows]


def restitution(zeta):
    """Law 2's coefficient of restitution at a damping ratio; both factors are imaginary above 1."""
    half = 1 if zeta == 1 else mp.re(mp.acos(zeta) / mp.sqrt(1 - mp.mpf(zeta) ** 2))
    return mp.exp(-2 * zeta * half)


def approach_of(case):
    """s, at the speed at the start."""
    return case.values["gap"] / (case.values["club_speed"] - case.values["ball_speed"])


@cache
def horizon(name):
    """s from the start to the end of a case: beyond separation and all changes."""
    case = CASES[name]
    if case.end:
        return case.end
    if not case.is_linear:
        return approach_of(case) + 1.3 * float(_power_law(name)[0]["contact_time"])
    impact = Reference(case.values)
    undamped = (reduced_mass(case.values) / case.values["k"]) ** 0.5
    return approach_of(case) + 1.3 * min(float(impact.parting - impact.touch), 30.0 * undamped)


def instants(end):
    """Where outputs of a linear case are compared, and shortly before it, s."""
    return {end * share: end * (share - 0.002) for share in SHARES}


def exact_path_of(case, end):
    """All outputs of a linear case at some instants (s), the last of them its end.

    Mean forces are those of steps from shortly before, or from a change in between.
    """
    impact, path = Reference(case.values | {"start_time": case.start}, case.changes), {}
    for time, begin in instants(end).items():
        begin = max(begin, *(instant for instant, _ in case.changes if instant < time), 0.0)
        path[time] = now = impact.outputs(time)
        gained = now["impulse"] - impact.outputs(begin)["impulse"]
        now["mean_force"] = gained / (mp.mpf(time) - begin)
    return path


@cache
def exact_path(name):
    """Outputs of a case at some instants, s: all; of a power law those that it has."""
    if CASES[name].is_linear:
        return exact_path_of(CASES[name], horizon(name))
    end, *path = _power_law(name)
    approach = approach_of(CASES[name])
    return {approach + float(row["contact_time"]): row for row in path} | {horizon(name): end}


def exact(name):
    """Outputs of a case at its horizon; of a power law those that are fixed at separation."""
    return exact_path(name)[horizon(name)]


def scales_of(case, last, span):
    """Scales of errors of a case whose outputs after `span` s are these."""
    values, approach = case.values | {"start_time": case.start}, last["touch_time"] - case.start
    return Scales(values, last, float(approach), span, case.changes)


def integrated(values, changes=(), force=None, push=None, touch=0.0):
    """Outputs at separation by DOP853, of bodies that touch at `touch`, s; a gap is ignored.

    `force(compression, closing, values)`, N, is that of another law; `push(t, x, v)`, N, that on
    the club head, instead of its input.
    """
    v = DEFAULTS | values
    drags, n = v["law"] == 1, v["exponent"]

    def contact_force(d, closing, v):
        relative = abs(d) / v["reference_compression"]
        damping = 0.0 if drags else v["b"] * relative ** (0.5 * (n - 1.0)) * closing
        return v["k"] * relative ** (n - 1.0) * d + damping

    force = force or contact_force

    def slopes(t, y, v):
        f, drag = force(y[0] - y[1], y[2] - y[3], v), v["b"] if drags else 0.0
        pushed = push(t, y[0], y[2]) if push else v["club_force"]
        club = (pushed - f - drag * y[2]) / v["m_club"]
        return [y[2], y[3], club, (f - drag * y[3]) / v["m_ball"], f]

    def ends(t, y, v):
        # Not at touch, where the force of law 2 is that of the damper, if any.
        if t - touch <= 1e-9 * limit:
            return 1.0
        return y[0] - y[1] if drags else force(y[0] - y[1], y[2] - y[3], v)

    ends.terminal, ends.direction = True, -1
    limit = 1e3 * ((reduced_mass(v) / v["k"]) ** 0.5 + v["b"] / v["k"])
    state, begun = [0.0, 0.0, v["club_speed"], v["ball_speed"], 0.0], touch
    max_force = 0.0
    for time, later in (*changes, (touch + limit, {})):
        options = {"rtol": 1e-13, "atol": 1e-16, "args": (v,), "events": ends}
        path = solve_ivp(slopes, (begun, time), state, "DOP853", dense_output=True, **options)

        def pull(t, motion=path.sol, v=v):
            x_club, x_ball, v_club, v_ball, _ = motion(t)
            return -force(x_club - x_ball, v_club - v_ball, v)

        peak = minimize_scalar(pull, bounds=(begun, path.t[-1]), options={"xatol": 1e-12})
        max_force = max(max_force, -peak.fun, -pull(begun), -pull(path.t[-1]))
        begun, state, v = path.t[-1], path.y[:, -1], v | later
        if path.status == 1:
            break
    return {
        "contact_time": begun - touch, "contact_displacement": state[1], "club_velocity": state[2],
        "ball_velocity": state[3], "impulse": state[4], "max_force": max_force,
    }  # fmt: skip
