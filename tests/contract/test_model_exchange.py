"""Model Exchange: the native FMUs of both versions, solved by hosts, beside co-simulation."""

import ctypes
import math

import fmpy
import fmus
import numpy as np
import pytest
from cases import CASES, DEFAULTS, KINDS
from compare import assert_close
from conftest import CRITERIA
from fmpy.fmi1 import FMICallException
from golf_physics.variables import (
    BY_NAME,
    CO_SIMULATION_ONLY,
    DERIVATIVES,
    INDICATORS,
    STATES,
    VARIABLES,
)
from quadrature import mp
from scipy.integrate import solve_ivp
from solver import Model, is_error
from ways import REALS

from golf_impact.data.runs import FLAGS

RESULTS = (*CRITERIA, "energy_efficiency")
SIZES_OF_RESULTS = dict(zip(RESULTS, (1.0, 1.0, 35.0, 35.0, 1.0), strict=True))
INPUTS = ("k", "b", "club_speed", "club_force")
UNKNOWNS = [name for name in REALS if name not in CO_SIMULATION_ONLY]
UNKNOWNS += [*DERIVATIVES[2:], *INDICATORS]


@pytest.fixture(scope="module", params=[2, 3], ids=["FMI 2.0", "FMI 3.0"])
def fmi(request):
    return request.param


@pytest.fixture
def folder(way_of, fmi):
    """The extracted FMU."""
    return way_of(f"native, FMI {fmi}.0").slave.unzipDirectory


@pytest.fixture
def make(folder, fmi):
    """A function that makes an instance that has begun."""
    models = []

    def make(start=0.0, **values):
        models.append(Model(folder, fmi))
        return models[-1].begin(start, **values)

    yield make
    for model in models:
        model.instance.freeInstance()


@pytest.fixture
def stepped(way_of):
    """A function that returns all outputs of a case by co-simulation, which is exact."""
    way = way_of("native, FMI 2.0")

    def stepped(values, end, changes=(), start=0.0):
        way.begin(values, start)
        point = 0.0
        for time, inputs in (*changes, (end, {})):
            assert way.step(time - point), way.messages
            way.set(**inputs)
            point = time
        return way.read()

    return stepped


# The same impact

#: Values, inputs that change later (s, by name), and the start time, s.
SOLVED = {name: (given, (), 7.0) for name, given in KINDS.items()}
SOLVED |= {
    name: (CASES[name].given, CASES[name].changes, CASES[name].start)
    for name in (
        "changes", "changes, law 2", "starts late", "COR line, n = 1.5", "law 1, 9000 N",
        "law 2, 9000 N", "law 2, -12000 N", "force before touch", "force returns", "pulled apart",
    )
}  # fmt: skip
SOLVED |= {
    f"COR line, ball at {speed:g} m/s": (
        KINDS["COR line"] | {"ball_speed": speed, "gap": 0.002}, (), 0.0
    )
    for speed in (-12.0, 12.0)
}  # fmt: skip
END = 4e-3


def assert_solved(found, exact, given, tolerance):
    """Outputs as in co-simulation; those that need the history are NaN."""
    dragged = given.get("law", 1) == 1 and given.get("b", 9.0)
    scales = {"force": 5e3, "compression": 0.005, "momentum": 7.0, "kinetic_energy": 130.0}
    scales |= dict.fromkeys(("club_position", "ball_position", "contact_displacement"), 0.1)
    scales |= {"touch_time": 1e-3, "contact_time": 1e-3} | SIZES_OF_RESULTS
    missing = {*CO_SIMULATION_ONLY, *["impulse"] * bool(dragged)}
    assert {name for name in REALS if math.isnan(found[name])} == missing
    kept = {name: exact[name] for name in found if name not in missing}
    assert_close(found, kept, scales, tolerance)


@pytest.mark.parametrize(("tolerance", "within"), [(1e-12, 1e-9), (1e-8, 1e-6)])
@pytest.mark.parametrize("name", SOLVED)
def test_by_scipy(make, stepped, name, tolerance, within):
    """With inputs that jump at events; measured: 2e-11 and 3e-8."""
    given, changes, start = SOLVED[name]
    exact, model, point = stepped(given, END, changes, start), make(start, **given), 0.0
    events = []
    for time, inputs in (*changes, (END, {})):
        events += model.solve(start + time, tolerance, start + point)
        model.set(**inputs)
        assert not model.event()
        point = time
    assert_solved(model.read(*REALS), exact, given, within)
    assert model.flags() == [exact[flag] for flag in FLAGS]
    separation = exact["touch_time"] + exact["contact_time"]
    expected = [exact["touch_time"]] * (exact["touch_time"] > start)
    # One that an input causes is no root.
    caused = any(abs(start + time - separation) < 1e-15 for time, _ in changes)
    expected += [separation] * (exact["separated"] and not caused)
    assert events == pytest.approx(expected, rel=0.0, abs=1e-4 * within + 2e-15 * abs(start))


_EULER = {"solver": "Euler", "output_interval": 5e-7, "step_size": 5e-7}


@pytest.mark.parametrize(
    ("name", "solver", "within"),
    [(name, {}, 1e-6) for name in SOLVED] + [(name, _EULER, 1e-2) for name in ("law 1", "law 2")],
)
def test_by_fmpy(folder, stepped, name, solver, within):
    """By CVODE at the proposed tolerance (measured: 8e-7), and by Euler's method (4e-3)."""
    about = fmpy.read_model_description(folder)
    assert float(about.defaultExperiment.tolerance) == 1e-8
    given, changes, start = SOLVED[name]
    exact, now = stepped(given, END, changes, start), DEFAULTS | given
    # An event has a row before it and one after.
    rows = [(start, *map(now.get, INPUTS))]
    for time, values in changes:
        now |= values
        rows += [(start + time, *rows[-1][1:]), (start + time, *map(now.get, INPUTS))]
    options = {"output_interval": 1e-4} | solver
    found = fmpy.simulate_fmu(
        folder,
        fmi_type="ModelExchange",
        start_time=start,
        stop_time=start + END,
        start_values=given,
        input=np.array(rows, dtype=[(name, float) for name in ("time", *INPUTS)]),
        output=[*REALS, *FLAGS],
        **options,
    )[-1]
    assert [bool(found[flag]) for flag in FLAGS] == [exact[flag] for flag in FLAGS]
    assert_close(found, {name: exact[name] for name in RESULTS}, SIZES_OF_RESULTS, within)


@pytest.mark.parametrize("law", [1, 2])
def test_k_and_b_are_functions_of_time(make, law):
    """As inputs that a solver sets at every evaluation; beside an integration of the equations."""

    def inputs(t):
        return {"k": 1e6 * (1.0 + 800.0 * t), "b": 20.0 + 3e4 * t, "club_force": 2e6 * t}

    def slopes(t, y):
        k, b, pushed = inputs(t).values()
        drag, damper = (b, 0.0) if law == 1 else (0.0, b)
        f = k * (y[0] - y[1]) + damper * (y[2] - y[3])
        return [y[2], y[3], (pushed - f - drag * y[2]) / 0.21, (f - drag * y[3]) / 0.04593]

    def force(t, y):
        # Of law 1 it is 0 at touch, too.
        return slopes(t, y)[3] * 0.04593 + (inputs(t)["b"] * y[3] + (t < 1e-5)) * (law == 1)

    force.terminal = True
    run = solve_ivp(
        slopes, (0.0, 2e-3), [0, 0, 35, 0], "DOP853", events=force, rtol=1e-13, atol=1e-14
    )
    _, _, v_club, v_ball = run.y[:, -1]
    model = make(law=law)
    model.solve(2e-3, inputs=inputs)
    found = model.read("ball_velocity", "contact_time", "coefficient_of_restitution")
    expected = [v_ball, run.t[-1], (v_ball - v_club) / 35.0]
    assert list(found.values()) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
@pytest.mark.parametrize("method", ["DOP853", "RK45"])
@pytest.mark.parametrize(
    "values",
    [{}, {"b": 900.0}, {"law": 2, "b": 0.0, "exponent": 12.0}, {"law": 2, "exponent": 1.6}],
    ids=str,
)
def test_no_separation_is_overlooked(make, stepped, values, method, rtol):
    """By a solver with steps of its own choice, which looks for changes of sign at their ends."""
    expected = stepped(values, 1.0)["contact_time"]
    atol = [0.02 * rtol, 0.02 * rtol, 35.0 * rtol, 35.0 * rtol]
    events = make(**values).solve(5.0 * expected, rtol, method=method, atol=atol)
    assert events == pytest.approx([expected], rel=1e3 * rtol)


# Equations


@pytest.mark.parametrize("name", ["law 1", "law 2", "n = 1.6", "COR line"])
def test_the_equations_are_those_of_the_phases(way_of, make, fmi, name):
    """At any state of the exact solution, the equations give its force and accelerations."""
    way, model = way_of(f"native, FMI {fmi}.0").begin(KINDS[name]), make(**KINDS[name])
    names = ("force", "compression", *DERIVATIVES, *INDICATORS)
    scales = dict(zip(names, (7e3, 5e-3, 35.0, 35.0, 1.5e5, 1.5e5, 1.0, 7e3)))
    for n in range(20):
        assert way.step(2e-5)
        model.place((n + 1) * 2e-5, *way.read(STATES).values())
        assert_close(model.read(*names), way.read(names), scales, 1e-12)
        assert model.derivatives() == [*model.read(*DERIVATIVES).values()]
        assert model.indicators() == [*model.read(*INDICATORS).values()]
    assert model.nominals() == [BY_NAME[name].nominal for name in STATES]


#: Phase: time, states and inputs at it; one after the other, an event each.
PHASES = {
    "approach": (1e-4, (-1e-3, 0.0, 35.0, 0.0), {}),
    "touch": (2e-4, (1e-12, 0.0, 35.0, 0.0), {}),
    "contact": (5e-4, (4e-3, 1e-3, 30.0, 20.0), {"club_force": 700.0, "k": 1.2e6}),
    "end": (7e-4, (0.011, 0.011 - 1e-9, 22.0, 55.0), {}),
    "separated": (8e-4, (0.0201, 0.02, 22.0, 55.0), {"club_force": -300.0}),
}


def phases(model):
    """The model at each of its phases; the contact begins and ends between them."""
    for name, (time, states, inputs) in PHASES.items():
        model.set(**inputs)
        model.place(time, *states)
        if name in ("touch", "end"):
            if name == "end":
                model.place(time, states[0], states[0] + 1e-6, *states[2:])
            assert not model.event()
        yield name


def equations(values, phase):
    """The outputs at one instant as functions of inputs and states, with mpmath."""
    v = {name: mp.mpf(value) for name, value in (DEFAULTS | values).items()}
    u, m_c, m_b, n = mp.mpf(35), v["m_club"], v["m_ball"], v["exponent"]
    touched, contact = phase != "approach", phase in ("touch", "contact")
    mu, law = m_c * m_b / (m_c + m_b), values.get("law", 1)

    def at(k, b, club_speed, club_force, x_c, x_b, v_c, v_b):
        v_c = v_c if touched else club_speed
        d, closing = x_c - x_b, v_c - v_b
        if v["restitution_at_rest"]:
            log = mp.log(v["restitution_at_rest"] - v["restitution_slope"] * u)
            zeta = mp.findroot(lambda z: 2 * z * mp.acos(z) / mp.sqrt(1 - z * z) + log, 0.04)
            b = 2 * zeta * mp.sqrt(k * mu * (n + 1) / 2)
        r = abs(d) / v["reference_compression"]
        force = k * d * r ** (n - 1) + (b * r ** ((n - 1) / 2) * closing if law == 2 else 0)
        force = force if contact else mp.mpf(0)
        drag, pushed = (b if law == 1 and contact else 0), (club_force if touched else 0)
        gone = {"smash_factor": v_b / u, "coefficient_of_restitution": (v_b - v_c) / u}
        gone["energy_efficiency"] = (m_c * v_c**2 + m_b * v_b**2) / (m_c * u**2)
        gone["contact_displacement"] = x_b
        root = abs(force) ** (1 / n)
        return {
            "force": force, "compression": d if contact else mp.mpf(0), "club_velocity": v_c,
            "ball_velocity": v_b, "club_position": x_c, "ball_position": x_b,
            "impulse": m_b * v_b if touched else mp.mpf(0), "momentum": m_c * v_c + m_b * v_b,
            "kinetic_energy": (m_c * v_c**2 + m_b * v_b**2) / 2,
            "club_acceleration": (pushed - force - drag * v_c) / m_c,
            "ball_acceleration": (force - drag * v_b) / m_b,
            "touch_indicator": mp.mpf(-1) if touched else max(x_b - x_c, v_b - club_speed),
            "separation_indicator": root if contact else mp.mpf(0),
        } | {name: value if contact else mp.mpf(0) for name, value in gone.items()}  # fmt: skip

    return at


#: A change of each known variable that counts.
SIZES = dict(zip((*INPUTS, *STATES), (1e6, 10.0, 35.0, 1e3, 1e-2, 1e-2, 35.0, 35.0), strict=True))
SCALES = {
    "force": 5e3, "compression": 5e-3, "club_position": 1e-2, "ball_position": 1e-2,
    "contact_displacement": 1e-2, "club_velocity": 35.0, "ball_velocity": 35.0, "impulse": 2.0,
    "momentum": 7.0, "kinetic_energy": 130.0, "club_acceleration": 3e4, "ball_acceleration": 1e5,
    "touch_indicator": 1.0, "separation_indicator": 5e3,
}  # fmt: skip


@pytest.mark.parametrize("name", ["law 1", "law 2", "n = 1.6", "COR line", "COR line, n = 1.5"])
def test_directional_derivatives(make, name):
    """Beside central differences of 40 digits."""
    given = CASES[name].given | {"ball_speed": 0.0}
    model = make(gap=1e-3, **given)
    for phase in phases(model):
        _, states, _ = PHASES[phase]
        inputs = model.read(*INPUTS)
        if phase in ("touch", "end"):
            continue
        point = [mp.mpf(value) for value in (*inputs.values(), *states)]
        at = equations(given, phase)
        for n, (known, size) in enumerate(SIZES.items()):
            h = mp.mpf(size) * mp.mpf("1e-12")
            ends = [[*point[:n], point[n] + sign * h, *point[n + 1 :]] for sign in (1, -1)]
            above, below = (at(*end) for end in ends)
            found = model.changes(UNKNOWNS, known)
            for unknown, value in above.items():
                if unknown == "impulse" and given.get("law", 1) == 1 and phase != "approach":
                    assert math.isnan(found[unknown])
                    continue
                expected = float((value - below[unknown]) / (2 * h))
                error = abs(found[unknown] - expected) * size / SCALES.get(unknown, 1.0)
                assert error < 1e-9, (phase, unknown, known, found[unknown], expected)


def test_derivatives_there_are_and_dependencies(make, folder, fmi):
    """Each dependency that is listed counts in some phase, and no other; others are refused."""
    about = fmpy.read_model_description(folder)
    structure = (*about.outputs, *about.derivatives, *about.eventIndicators)
    listed = {(u.variable.name, known.name) for u in structure for known in u.dependencies}
    if fmi == 2:
        # The indicators aren't in the structure, and time is no variable.
        listed |= {(name, known) for name in INDICATORS for known in BY_NAME[name].dependencies}
    found = set()
    knowns = [*INPUTS, *STATES, *["time"] * (fmi == 3)]
    for name in ("law 1", "law 2", "n = 1.6", "COR line"):
        model = make(gap=1e-3, **KINDS[name] | {"ball_speed": 0.0})
        # Bodies that touch and don't close: the velocities count.
        model.place(1e-5, 1e-3, 0.0, 35.0, 40.0)
        states = [model.changes(UNKNOWNS, known) for known in knowns]
        for _ in phases(model):
            states += [model.changes(UNKNOWNS, known) for known in knowns]
        for n, changes in enumerate(states):
            known = knowns[n % len(knowns)]
            found |= {(u, known) for u, change in changes.items() if change and change == change}
    # That of the compression on time is a jump: it ends where the bodies have parted.
    assert listed - found == ({("compression", "time")} if fmi == 3 else set())
    assert found <= listed
    assert all(map(math.isnan, model.changes(CO_SIMULATION_ONLY, "k").values()))
    # Club speed follows from the impulse in a swing: it must not be an algebraic loop.
    assert not found & {("impulse", name) for name in INPUTS}
    for unknowns, known in ((["force"], "m_club"), (["k"], "k"), (["touched"], "k")):
        assert is_error(model.changes, unknowns, known)
        assert "a directional derivative" in model.messages[-1]


# Events


def test_an_event_at_its_root_has_happened(make):
    """A rounding error before it, too; a host that goes on there doesn't find it again."""
    for number in range(30):
        speed, gap = 20.0 + number, 0.005
        for short in (0.0, 1.7e-18, 1.7e-17, 1e-12):
            model = make(club_speed=speed, gap=gap).place(gap / speed, -short, 0.0, speed, 0.0)
            model.event()
            assert model.flags()[0] == (short < 1e-15)
    for values in ({}, {"law": 2}, {"law": 2, "exponent": 1.6}):
        for number in range(10):
            model = make(club_speed=20.0 + 1.37 * number, gap=0.003, **values)
            assert len(model.solve(2e-3, 1e-9)) == 2
            assert model.flags() == [True, False, True]


def test_a_club_that_sets_off_from_the_ball(make):
    """Gap 0 and no closing: nothing happens until the club's speed comes, even without an event."""
    model = make(7.0, club_speed=0.0)
    assert model.indicators()[0] > 0.0
    assert model.read("touch_time") == {"touch_time": 7.0}
    model.set(club_speed=10.0)
    model.place(8.0, 1e-9, 0.0, 0.0, 0.0)
    assert model.indicators()[0] < 0.0
    assert not model.event()
    assert model.states() == [1e-9, 0.0, 10.0, 0.0]  # the velocity is the input's
    assert model.flags() == [True, True, False]
    assert model.read("touch_time") == {"touch_time": 8.0}


@pytest.mark.parametrize(
    ("compression", "closing", "in_contact"),
    # A force, however small; none at touch, where the bodies close at half the approach speed.
    [(1e-4, -30.0, True), (0.0, -30.0, False), (-1e-9, 17.5, True), (-1e-9, 14.0, False)],
)
def test_where_a_contact_ends(make, compression, closing, in_contact):
    model = make(law=2, b=0.0).place(5e-4, 0.01 + compression, 0.01, 20.0, 20.0 - closing)
    assert (model.indicators()[1] > 0.0) == in_contact
    model.event()
    assert model.flags()[1] == in_contact


def test_a_force_after_separation(make, way_of):
    """Momentum and energy run on; the compression falls, and stays 0 where the positions cross."""
    way = way_of("native, FMI 2.0").begin(values := {"law": 2, "b": 60.0, "club_force": 700.0})
    way.step(1.0)
    end, model, left = way["contact_time"] * (1.0 + 2.0**-51), make(**values), []
    way.begin(values)
    for time in (end, *(end + n * 2e-6 for n in range(1, 40))):
        way.step(time - way.time)
        model.place(time, *way.read(STATES).values())
        if time == end:
            model.event()
        names = ("compression", "momentum", "kinetic_energy")
        assert_close(model.read(*names), way.read(names), {"compression": 1e-3}, 1e-13)
        left.append(model.read("compression")["compression"])
    assert left[0] > 1e-4
    assert left == sorted(left, reverse=True)
    assert left[-1] == 0.0
    assert model.derivatives()[2:] == [700.0 / 0.21, 0.0]
    model.place(0.05, 3.0, 2.0, 10.0, 55.0)
    assert model.read("compression") == {"compression": 0.0}


def test_the_impulse_under_a_drag_is_unknown(make):
    """b may have changed between events; without drag it is the ball's momentum."""
    for law, b, known in ((1, 9.0, False), (1, 0.0, True), (2, 9.0, True)):
        model = make(law=law, b=b).place(1e-4, 0.0035, 0.001, 30.0, 10.0)
        assert (model.read("impulse")["impulse"] == 0.04593 * 10.0) is known
        model.set(b=3.0)
        model.derivatives()
        model.set(b=0.0)
        assert math.isnan(model.read("impulse")["impulse"]) is (law == 1)


# States


def test_a_state_in_event_and_continuous_time_mode(make):
    """Saved in any phase it goes on exactly as before, in this instance or another one."""
    first, second, saved, paths = make(gap=1e-3), make(law=2), [], []

    def seen(model):
        return repr((model.read(*REALS), model.flags(), model.states(), model.derivatives()))

    for _ in phases(first):
        saved.append((fmus.packed(first.instance), seen(first)))
    for data, expected in saved:
        for model in (second, first):
            fmus.restore_packed(model.instance, data)
            assert seen(model) == expected
            model.set(k=2e6)
            model.place(9e-4, 0.01, 0.005, 20.0, 30.0)
            assert not model.event()
            paths.append(seen(model))
    assert paths[::2] == paths[1::2]
    assert len({*paths}) == len(saved)


def test_the_two_interfaces_are_kept_apart(make, way_of, fmi):
    """States of one are refused by the other; so are functions."""
    way, model = way_of(f"native, FMI {fmi}.0").begin(), make()
    assert way.step(1e-4)
    before = repr((model.states(), way.read()))
    for to, messages, data in (
        (way.slave, way.messages, fmus.packed(model.instance)),
        (model.instance, model.messages, fmus.packed(way.slave)),
    ):
        assert is_error(fmus.restore_packed, to, data)
        assert "a state that this component didn't make is refused" in messages[-1]
    assert repr((model.states(), way.read())) == before
    functions = way.slave.dll
    time = getattr(functions, f"fmi{fmi}SetTime")
    assert time(ctypes.c_void_p(way.slave.component), ctypes.c_double(0.0)) == 3
    assert "a function of Model Exchange is refused" in way.messages[-1]
    if fmi == 2:
        step = functions.fmi2DoStep
        size = ctypes.c_double(1e-4)
        assert step(ctypes.c_void_p(model.instance.component), size, size, 0) == 3
        assert "this instance is for Model Exchange" in model.messages[-1]


# Bad input


def test_bad_input_stops_a_solver(make):
    """The derivatives are Error, the next event ends the run; corrected, it goes on."""
    model = make()
    model.set(k=-1.0)
    assert "k = -1 N/m is refused" in model.messages[-1]
    assert is_error(model.derivatives)
    assert model.event()
    assert "the simulation must stop: k = -1 N" in model.messages[-1]
    model.set(k=1e6)
    assert model.derivatives()[0] == 35.0
    assert not model.event()


def test_a_touch_that_is_refused_ends_the_run(make, folder):
    line = {"law": 2, "restitution_at_rest": 0.5, "restitution_slope": 0.1, "gap": 0.001}
    model = make(**line)
    with pytest.raises(AssertionError, match="club_speed = 35"):
        model.solve(1e-3, 1e-8)
    assert "the simulation must stop: club_speed = 35" in model.messages[-1]
    rows = fmpy.simulate_fmu(folder, fmi_type="ModelExchange", start_values=line, stop_time=1e-3)
    assert rows["time"][-1] == pytest.approx(0.001 / 35.0, rel=1e-3)


@pytest.mark.parametrize("bad", [{"exponent": 2.0}, {"k": math.inf}])
@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_bad_start_values_end_the_initialization(folder, bad, kind):
    with pytest.raises(FMICallException, match="ExitInitializationMode"):
        fmpy.simulate_fmu(folder, fmi_type=kind, start_values=bad)


def test_no_state_of_a_solver_is_fatal(make):
    model = make(law=2, exponent=12.0)
    model.place(0.0, 1e60, 0.0, 35.0, 0.0)
    assert model.derivatives()[2:] == [-math.inf, math.inf]
    for value in (math.nan, math.inf, 1e308, -1e308):
        model.place(value, value, -value, -value, value)
        model.derivatives()
        model.indicators()
        model.changes(UNKNOWNS, "k")
        model.event()
        model.read(*(row.name for row in VARIABLES if row.type == "Real"))
