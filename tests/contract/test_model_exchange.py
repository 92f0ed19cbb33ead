"""Model Exchange: the native FMUs of both versions, solved by hosts, beside co-simulation.

The host is an FMU by fmpy, integrated by SciPy.
"""

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
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model
from golf_physics.variables import (
    BY_NAME,
    CO_SIMULATION_ONLY,
    DERIVATIVES,
    INDICATORS,
    STATES,
)
from scipy.integrate import solve_ivp
from ways import REALS

from golf_impact.data.runs import FLAGS
from golf_impact.evidence.reference import mp

RESULTS = (*CRITERIA, "energy_efficiency")
SCALES = {
    "force": 5e3, "compression": 5e-3, "club_position": 1e-2, "ball_position": 1e-2,
    "contact_displacement": 1e-2, "club_velocity": 35.0, "ball_velocity": 35.0, "impulse": 2.0,
    "momentum": 7.0, "kinetic_energy": 130.0, "club_acceleration": 3e4, "ball_acceleration": 1e5,
    "touch_indicator": 1.0, "separation_indicator": 5e3, "touch_time": 1e-3, "contact_time": 1e-3,
} | dict.fromkeys((CRITERIA[0], CRITERIA[1], "energy_efficiency"), 1.0)  # fmt: skip
INPUTS = ("k", "b", "club_speed", "club_force")
UNKNOWNS = [name for name in REALS if name not in CO_SIMULATION_ONLY]
UNKNOWNS += [*DERIVATIVES[2:], *INDICATORS]


def vector(name, fmi3=None, size=4):
    """A method that returns so many numbers of the FMU by a function, in FMI 3.0 by another one."""

    def read(self):
        array = (ctypes.c_double * size)()
        getattr(self.instance, fmi3 if fmi3 and self.fmi == 3 else name)(array, size)
        return list(array)

    return read


class Model:
    """An extracted FMU: fmpy's `instance`, and the `messages` it has logged."""

    states = vector("getContinuousStates")
    nominals = vector("getNominalsOfContinuousStates")
    derivatives = vector("getDerivatives", "getContinuousStateDerivatives")
    indicators = vector("getEventIndicators", size=len(INDICATORS))

    def __init__(self, folder, fmi):
        kind = FMU2Model if fmi == 2 else FMU3Model
        self.instance = fmus.make_instance(folder, "solved", kind, loggingOn=True)
        self.messages, self.fmi = self.instance.messages, fmi

    def begin(self, start, **values):
        """From instantiation to continuous-time mode, with the events of the start."""
        fmus.begin(self.instance, start, **values)
        assert not self.event()
        self.instance.enterContinuousTimeMode()
        return self

    def place(self, time, *states):
        """Set time (s) and continuous states."""
        self.instance.setTime(time)
        self.instance.setContinuousStates((ctypes.c_double * 4)(*states), 4)
        return self

    def event(self):
        """Handle the events of this instant; returns whether the simulation must stop."""
        self.instance.enterEventMode()
        update = "newDiscreteStates" if self.fmi == 2 else "updateDiscreteStates"
        again, stop, nominals, jumped, *_ = getattr(self.instance, update)()
        assert (again, nominals, jumped) == (False, False, True)
        return stop

    def set(self, **values):
        """Set inputs by name."""
        fmus.put(self.instance, **values)

    def read(self, *names):
        """Real outputs by name."""
        return dict(zip(names, fmus.get(self.instance, *names), strict=True))

    def flags(self):
        """touched, in_contact, separated."""
        return [bool(flag) for flag in self.instance.getBoolean(self.instance.flags)]

    def changes(self, unknowns, known, seed=1.0):
        """The directional derivatives of variables by one."""
        r = self.instance.references
        found = self.instance.getDirectionalDerivative(
            [r[name] for name in unknowns], [r[known]], [seed]
        )
        return dict(zip(unknowns, found, strict=True))

    def solve(self, stop, rtol=1e-12, start=0.0, method="DOP853", atol=None):
        """Integrate to a time (s) from event to event, as a host does: the times of the events, s.

        By default `atol` is `rtol` times 1 mm and 1 m/s. AssertionError: the FMU ends it.
        """

        def slopes(t, y):
            return self.place(t, *y).derivatives()

        def indicator(number):
            def event(t, y):
                slopes(t, y)
                return self.indicators()[number]

            event.terminal, event.direction = True, -1
            return event

        t, found, events = start, [], [indicator(0), indicator(1)]
        atol = atol or [1e-3 * rtol, 1e-3 * rtol, rtol, rtol]
        while t < stop:
            run = solve_ivp(
                slopes, (t, stop), self.states(), method, events=events, rtol=rtol, atol=atol
            )
            t = run.t[-1]
            slopes(t, run.y[:, -1])
            if run.status == 1:
                found.append(t)
                assert len(found) < 5, found
                assert not self.event(), self.messages
        return found


def is_error(call, *arguments):
    """Whether a call returns Error."""
    try:
        call(*arguments)
    except FMICallException as error:
        return error.status == 3
    return False


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


@pytest.mark.parametrize("name", SOLVED)
def test_by_scipy(make, stepped, name):
    """All outputs, with inputs that jump at events; those that need the history are NaN."""
    given, changes, start = SOLVED[name]
    exact, model, point = stepped(given, END, changes, start), make(start, **given), 0.0
    for time, inputs in (*changes, (END, {})):
        model.solve(start + time, start=start + point)
        model.set(**inputs)
        assert not model.event()
        point = time
    found, dragged = model.read(*REALS), given.get("law", 1) == 1 and given.get("b", 9.0)
    missing = {*CO_SIMULATION_ONLY, *["impulse"] * bool(dragged)}
    assert {name for name in REALS if math.isnan(found[name])} == missing
    # Measured: 5e-11.
    assert_close(found, {n: exact[n] for n in REALS if n not in missing}, SCALES, 1e-9)
    assert model.flags() == [exact[flag] for flag in FLAGS]


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
    assert_close(found, {name: exact[name] for name in RESULTS}, SCALES, within)


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
        results = {"smash_factor": v_b / u, "coefficient_of_restitution": (v_b - v_c) / u}
        results["energy_efficiency"] = (m_c * v_c**2 + m_b * v_b**2) / (m_c * u**2)
        results["contact_displacement"] = x_b
        if not contact:
            results = {name: mp.mpf(name == "energy_efficiency") for name in results}
        root = abs(force) ** (1 / n)
        return {
            "force": force, "compression": d if contact else mp.mpf(0), "club_velocity": v_c,
            "ball_velocity": v_b, "club_position": x_c, "ball_position": x_b,
            "impulse": m_b * v_b if touched else mp.mpf(0), "momentum": m_c * v_c + m_b * v_b,
            "kinetic_energy": (m_c * v_c**2 + m_b * v_b**2) / 2,
            "club_acceleration": (pushed - force - drag * v_c) / m_c,
            "ball_acceleration": (force - drag * v_b) / m_b,
            "touch_indicator": mp.mpf(-1) if touched else max(x_b - x_c, v_b - club_speed),
            "separation_indicator": root if contact else mp.mpf(-1 if touched else 1), **results,
        }  # fmt: skip

    return at


#: After separation those of that instant.
FROZEN = (
    "smash_factor", "coefficient_of_restitution", "energy_efficiency", "contact_displacement",
)  # fmt: skip

#: A change of each known variable that counts.
SIZES = dict(zip((*INPUTS, *STATES), (1e6, 10.0, 35.0, 1e3, 1e-2, 1e-2, 35.0, 35.0), strict=True))


@pytest.mark.parametrize("name", ["law 1", "law 2", "n = 1.6", "COR line", "COR line, n = 1.5"])
def test_equations_and_directional_derivatives(make, name):
    """Beside the equations in 40 digits, and their central differences."""
    given = CASES[name].given | {"ball_speed": 0.0}
    model = make(gap=1e-3, **given)
    for phase in phases(model):
        if phase in ("touch", "end"):
            continue
        point = [mp.mpf(x) for x in (*model.read(*INPUTS).values(), *PHASES[phase][1])]
        at, dragged = equations(given, phase), name == "law 1" and phase != "approach"
        values = {u: float(x) for u, x in at(*point).items() if u != "impulse" or not dragged}
        kept = [u for u in values if phase != "separated" or u not in FROZEN]
        assert_close(model.read(*kept), {u: values[u] for u in kept}, SCALES, 1e-14)
        assert model.derivatives() == [*model.read(*DERIVATIVES).values()]
        assert model.indicators() == [*model.read(*INDICATORS).values()]
        for n, (known, size) in enumerate(SIZES.items()):
            h = mp.mpf(size) * mp.mpf("1e-12")
            ends = [[*point[:n], point[n] + sign * h, *point[n + 1 :]] for sign in (1, -1)]
            above, below = (at(*end) for end in ends)
            found = model.changes(UNKNOWNS, known)
            assert math.isnan(found["impulse"]) is dragged
            exact = {u: float((above[u] - below[u]) / (2 * h)) for u in values}
            scales = {u: SCALES[u] / size for u in exact}
            assert_close(found, exact, scales, 1e-9, phase=phase, known=known)
    assert model.nominals() == [BY_NAME[name].nominal for name in STATES]


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


def test_where_a_contact_ends(make):
    """A force, however small; none at touch, where they close at half the approach speed."""
    for compression, closing, in_contact in (
        (1e-4, -30.0, True), (0.0, -30.0, False), (-1e-9, 17.5, True), (-1e-9, 14.0, False)
    ):  # fmt: skip
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
    for n in range(40):
        way.step(end + n * 2e-6 - way.time)
        model.place(way.time, *way.read(STATES).values())
        if not n:
            model.event()
        names = ("compression", "momentum", "kinetic_energy")
        assert_close(model.read(*names), way.read(names), {"compression": 1e-3}, 1e-13)
        left.append(way["compression"])
    assert left == sorted(left, reverse=True)
    assert left[0] > 1e-4 > left[-1] == 0.0
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
