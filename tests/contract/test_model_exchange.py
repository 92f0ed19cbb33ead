"""Model Exchange: the native FMUs of both versions, solved by hosts, beside co-simulation.

The host is an FMU by fmpy, integrated by SciPy.
"""

import ctypes
import math
import random
from contextlib import closing, suppress

import fmpy
import fmus
import numpy as np
import pytest
from cases import CASES, DEFAULTS, KINDS
from compare import assert_close
from conftest import CRITERIA, repeated
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model
from golf_physics.variables import (
    BY_NAME,
    CO_SIMULATION_ONLY,
    DERIVATIVES,
    INDICATORS,
    SETTABLE,
    STATES,
)
from scipy.integrate import solve_ivp
from ways import InFmu

from golf_impact.data.runs import FLAGS, REALS

RESULTS = (*CRITERIA, "energy_efficiency")
SCALES = {row.name: row.nominal for row in BY_NAME.values()} | {"separation_indicator": 5e3}
INPUTS = ("k", "b", "club_speed", "club_force")
UNKNOWNS = [name for name in REALS if name not in CO_SIMULATION_ONLY]
UNKNOWNS += [*DERIVATIVES[2:], *INDICATORS]


class Solved(InFmu):
    """An instance for Model Exchange: its `time` and states are the host's."""

    def __init__(self, folder):
        fmi2 = fmpy.read_model_description(folder).fmiVersion == "2.0"
        super().__init__(folder, FMU2Model if fmi2 else FMU3Model)
        slave, self.fmi = self.slave, 2 if fmi2 else 3
        self._update = slave.newDiscreteStates if fmi2 else slave.updateDiscreteStates
        self._slopes = slave.getDerivatives if fmi2 else slave.getContinuousStateDerivatives

    def _begin(self, values, start):
        """To continuous-time mode, with the events of the start."""
        super()._begin(values, start)
        if not self.event():
            self.slave.enterContinuousTimeMode()

    def array(self, function, size=4):
        array = (ctypes.c_double * size)()
        function(array, size)
        return list(array)

    def states(self):
        return self.array(self.slave.getContinuousStates)

    def derivatives(self):
        return self.array(self._slopes)

    def indicators(self):
        return self.array(self.slave.getEventIndicators, len(INDICATORS))

    def place(self, time, *states):
        """Set time (s) and continuous states."""
        self.time = time
        self.slave.setTime(time)
        self.slave.setContinuousStates((ctypes.c_double * 4)(*states), 4)
        return self

    def event(self):
        """Handle the events of this instant; returns whether, and a message why, it must stop."""
        self.slave.enterEventMode()
        before = len(self.messages)
        again, stop, nominals, jumped, announced, _ = self._update()
        assert (again, nominals, jumped, announced) == (False, False, True, False)
        assert stop == (len(self.messages) > before)
        return stop

    def changes(self, unknowns, known):
        """The directional derivatives of variables by one."""
        r = self.slave.references
        found = self.slave.getDirectionalDerivative([r[u] for u in unknowns], [r[known]], [1.0])
        return dict(zip(unknowns, found, strict=True))

    def beside(self, known, change):
        """The unknowns if an input or a state had another value."""
        saved, states = self.save(), self.states()
        if known in INPUTS:
            self.set(**{known: fmus.get(self.slave, known)[0] + change})
        else:
            moved = (x + change * (n == known) for n, x in zip(STATES, states))
            self.place(self.time + change * (known == "time"), *moved)
        found = self.read(UNKNOWNS)
        self.restore(saved)
        return found

    def solve(self, stop, rtol=1e-12, method="DOP853", speed=1.0):
        """Integrate to a time (s) from event to event, as a host does: the times of the events, s.

        `speed`, m/s, is that of the absolute tolerance. AssertionError: the FMU ends it.
        """

        def slopes(t, y):
            return self.place(t, *y).derivatives()

        def indicator(n):
            def event(t, y):
                return self.place(t, *y).indicators()[n]

            event.terminal, event.direction = True, -1
            return event

        found, atol = [], speed * rtol * np.array([1e-3, 1e-3, 1.0, 1.0])
        options = {"events": [*map(indicator, range(2))], "rtol": rtol, "atol": atol}
        while self.time < stop:
            run = solve_ivp(slopes, (self.time, stop), self.states(), method, **options)
            self.place(run.t[-1], *run.y[:, -1])
            if run.status == 1:
                found.append(self.time)
                assert len(found) < 5, found
                assert not self.event(), self.messages
        return found


def is_error(call, *arguments):
    """Whether a call returns Error."""
    with pytest.raises(FMICallException) as caught:
        call(*arguments)
    return caught.value.status == 3


@pytest.fixture(scope="module", params=[2, 3])
def way(request, way_of):
    """An FMU in co-simulation, which is exact."""
    return way_of(f"native, FMI {request.param}.0")


@pytest.fixture(scope="module")
def folder(way):
    return way.slave.unzipDirectory


@pytest.fixture(scope="module")
def model(folder):
    with closing(Solved(folder)) as model:
        yield model


# The same impact

#: Values, inputs that change later (s, by name), and the start time, s.
SOLVED = {name: (given, (), 1e3) for name, given in KINDS.items()}
SOLVED |= {
    name: (CASES[name].given, CASES[name].changes, CASES[name].start)
    for name in (
        "changes", "changes, law 2", "starts late", "COR line, n = 1.5", "law 1, 9000 N",
        "law 2, 9000 N", "law 2, -12000 N", "force before touch", "force returns", "pulled apart",
    )
}  # fmt: skip
END = 4e-3


def stepped(way, name):
    """All outputs at the end, by steps."""
    given, changes, start = SOLVED[name]
    way.begin(given, start)
    for time, inputs in (*changes, (END, {})):
        assert way.step(start + time - way.time), way.messages
        way.set(**inputs)
    return way.read()


@pytest.mark.parametrize("name", SOLVED)
def test_by_scipy(model, way, name):
    """All outputs, with inputs that jump at events; those that need the history are NaN."""
    given, changes, start = SOLVED[name]
    exact = stepped(way, name)
    model.begin(given, start)
    for time, inputs in (*changes, (END, {})):
        model.solve(start + time)
        model.set(**inputs)
        assert not model.event()
    found, dragged = model.read(), given.get("law", 1) == 1 and given.get("b", 9.0)
    missing = {*CO_SIMULATION_ONLY, *["impulse"] * bool(dragged)}
    assert {name for name in REALS if math.isnan(found[name])} == missing
    # Measured: 5e-11.
    assert_close(found, {n: exact[n] for n in REALS if n not in missing}, SCALES, 1e-9)
    assert [found[flag] for flag in FLAGS] == [exact[flag] for flag in FLAGS]


_EULER = {"solver": "Euler", "output_interval": 2e-6, "step_size": 2e-6}


@pytest.mark.parametrize(
    ("name", "solver", "within"),
    [
        *((name, _EULER, 5e-2) for name in ("law 1", "law 2")),
        *((name, {}, 1e-6) for name in ("law 1", "changes, law 2", "COR line, n = 1.5")),
        *(pytest.param(name, {}, 1e-6, marks=pytest.mark.ci) for name in SOLVED),
    ],
)
def test_by_fmpy(folder, way, name, solver, within):
    """By CVODE at the proposed tolerance (measured: 8e-7), and by Euler's method (2e-2)."""
    about = fmpy.read_model_description(folder)
    assert float(about.defaultExperiment.tolerance) == 1e-8
    given, changes, start = SOLVED[name]
    exact, now = stepped(way, name), DEFAULTS | given
    # An event has a row before it and one after.
    rows = [(start, *map(now.get, INPUTS))]
    for time, values in changes:
        now |= values
        rows += [(start + time, *rows[-1][1:]), (start + time, *map(now.get, INPUTS))]
    options = {"output_interval": 1e-4, "start_time": start, "stop_time": start + END} | solver
    found = fmpy.simulate_fmu(
        folder,
        fmi_type="ModelExchange",
        start_values=given,
        input=np.array(rows, dtype=[(name, float) for name in ("time", *INPUTS)]),
        output=[*RESULTS, *FLAGS],
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
def test_no_separation_is_overlooked(model, way, values, method, rtol):
    """By a solver with steps of its own choice, which looks for changes of sign at their ends."""
    way.begin(values).step(1.0)
    expected = way["contact_time"]
    events = model.begin(values).solve(5.0 * expected, rtol, method, 20.0)
    assert events == pytest.approx([expected], rel=1e3 * rtol)


# Equations

#: By name: a contact after a gap.
PHASED = {
    name: CASES[name].given | {"ball_speed": 0.0, "gap": 1e-3} | more
    for name, more in {
        "law 1": {"club_force": -300.0}, "law 2": {"b": 60.0, "club_force": 5e3}, "n = 1.6": {},
        "COR line": {"ball_speed": -12.0}, "COR line, n = 1.5": {},
    }.items()
}  # fmt: skip


def phases(model, way, values):
    """Both at instants of each phase, with the states of co-simulation: the phase's name."""
    way.begin(values).step(1.0)
    touch, lasts = way["touch_time"], way["contact_time"]
    end = (touch + lasts) * (1.0 + 2.0**-51)
    way.begin(values)
    model.begin(values)
    for phase, time in (
        ("approach", 0.5 * touch), ("touch", touch * (1.0 + 2.0**-51)),
        *(("contact", touch + part * lasts) for part in (0.02, 0.5, 0.9)),
        ("end", end), ("separated", end + 1e-6),
        # The compression ends 62 µs later under the force of law 2.
        *(("apart", end + n * 2e-6) for n in range(1, 40)),
    ):  # fmt: skip
        way.step(time - way.time)
        model.place(way.time, *way.read(STATES).values())
        if phase in ("touch", "end"):
            assert not model.event()
        yield phase


def tried(model, way, values):
    """As `phases`; and states that only a solver tries, with no expected outputs."""
    # Bodies that touch and don't close: the velocities count.
    model.begin(values).place(1e-5, 1e-3, 0.0, 35.0, 40.0)
    yield "tried"
    for phase in phases(model, way, values):
        yield phase
        if phase == "contact":
            time, states = model.time, model.states()
            # Beyond the end of the contact, on both sides of its indicator's condition.
            for v_ball in (20.0, 55.0):
                model.place(time, 9e-3, 1e-2, 30.0, v_ball)
                yield "tried"
            model.place(time, *states)


#: A change of each known variable that counts.
SIZES = dict(zip((*INPUTS, *STATES), (1e6, 10.0, 35.0, 1e3, 1e-2, 1e-2, 35.0, 35.0), strict=True))


def test_outputs_and_directional_derivatives(model, way, folder):
    """In each phase outputs are those of co-simulation, and the derivatives their differences.

    Each dependency that is listed counts in some phase, and no other.
    """
    about, found = fmpy.read_model_description(folder), set()
    structure = (*about.outputs, *about.derivatives, *about.eventIndicators)
    listed = {(u.variable.name, known.name) for u in structure for known in u.dependencies}
    if model.fmi == 2:
        # The indicators aren't in the structure, and time is no variable.
        listed |= {(name, known) for name in INDICATORS for known in BY_NAME[name].dependencies}
    sizes = SIZES | ({"time": 1e-4} if model.fmi == 3 else {})
    for name, values in PHASED.items():
        has_touched = False
        for phase in tried(model, way, values):
            has_touched |= phase == "touch"
            unknown = {*CO_SIMULATION_ONLY, *["impulse"] * (name == "law 1" and has_touched)}
            if phase != "tried":
                now, exact = model.read(), way.read()
                assert {n for n in REALS if math.isnan(now[n])} == unknown
                assert_close(now, {n: exact[n] for n in exact if n not in unknown}, SCALES, 1e-12)
            assert model.derivatives() == [*model.read(DERIVATIVES).values()]
            assert model.indicators() == [*model.read(INDICATORS).values()]
            flags = [model["touched"], model["separated"]]
            assert [value == -1.0 for value in model.indicators()] == flags
            for known, size in sizes.items() if phase != "apart" else ():
                changes = model.changes(UNKNOWNS, known)
                assert math.isnan(changes["impulse"]) is ("impulse" in unknown)
                found.update((u, known) for u, change in changes.items() if abs(change) > 0.0)
                # At touch and end force and indicators have a kink.
                if phase not in ("touch", "end"):
                    above, below = (model.beside(known, 1e-6 * by * size) for by in (1.0, -1.0))
                    known_ones = [u for u in UNKNOWNS if u not in unknown]
                    slopes = {u: (above[u] - below[u]) / (2e-6 * size) for u in known_ones}
                    scales = {u: SCALES[u] / size for u in slopes}
                    assert_close(changes, slopes, scales, 1e-8, phase=phase, known=known)
        # After it positions may cross.
        assert model.place(0.05, 3.0, 2.0, 10.0, 55.0)["compression"] == 0.0
    # That of the compression on time is a jump: it ends where the bodies have parted.
    assert listed - found == ({("compression", "time")} if model.fmi == 3 else set())
    assert found <= listed
    # Club speed follows from the impulse in a swing: it must not be an algebraic loop.
    assert not found & {("impulse", name) for name in INPUTS}


def test_what_has_no_directional_derivatives(model):
    assert all(map(math.isnan, model.begin().changes(CO_SIMULATION_ONLY, "k").values()))
    for unknowns, known in ((["force"], "m_club"), (["k"], "k"), (["touched"], "k")):
        assert is_error(model.changes, unknowns, known)
        assert "a directional derivative" in model.messages[-1]
    # At touch the damper of a power law is infinitely steep.
    model.begin({"law": 2, "exponent": 1.5})
    assert model.changes(["force"], "club_position") == {"force": math.inf}
    nominals = model.array(model.slave.getNominalsOfContinuousStates)
    assert nominals == [BY_NAME[name].nominal for name in STATES]


# Events


@pytest.mark.parametrize(("start", "near"), [(0.0, 1e-15), (1e3, 1e-10)])
def test_an_event_at_its_root_has_happened(model, start, near):
    """`near`, m: a rounding error before it, too, so that a host that goes on finds no other."""
    for number in range(30):
        speed, gap = 20.0 + number, 0.005
        for short in (0.0, 1e-3 * near, 0.01 * near, 1e3 * near):
            model.begin({"club_speed": speed, "gap": gap}, start)
            model.place(start + gap / speed, -short, 0.0, speed, 0.0).event()
            assert model["touched"] == (short < near)


def test_a_club_that_sets_off_from_the_ball(model):
    """Gap 0 and no closing: nothing happens until the club's speed comes, even without an event."""
    model.begin({"club_speed": 0.0}, 7.0)
    assert model.indicators()[0] > 0.0
    assert model["touch_time"] == 7.0
    model.set(club_speed=10.0)
    assert model.place(8.0, 1e-9, 0.0, 0.0, 0.0).indicators()[0] < 0.0
    assert not model.event()
    assert model.states() == [1e-9, 0.0, 10.0, 0.0]  # the velocity is the input's
    assert [*model.read([*FLAGS, "touch_time"]).values()] == [8.0, True, True, False]


def test_where_a_contact_ends(model):
    """A force, however small; none at touch, where they close at half the approach speed."""
    for compression, speed, in_contact in (
        (1e-4, -30.0, True), (0.0, -30.0, False), (-1e-9, 17.5, True), (-1e-9, 14.0, False)
    ):  # fmt: skip
        model.begin({"law": 2, "b": 0.0})
        model.place(5e-4, 0.01 + compression, 0.01, 20.0, 20.0 - speed)
        assert (model.indicators()[1] > 0.0) == in_contact
        model.event()
        assert model["in_contact"] == in_contact


def test_the_impulse_under_a_drag_is_unknown(model):
    """b may have changed between events; without drag it is the ball's momentum."""
    for law, b, known in ((1, 9.0, False), (1, 0.0, True), (2, 9.0, True)):
        model.begin({"law": law, "b": b}).place(1e-4, 0.0035, 0.001, 30.0, 10.0)
        assert (model["impulse"] == 0.04593 * 10.0) is known
        model.set(b=3.0)
        model.derivatives()
        model.set(b=0.0)
        assert math.isnan(model["impulse"]) is (law == 1)


# States


def test_a_state_in_event_and_continuous_time_mode(model, way, folder):
    """Saved in any phase it goes on exactly as before, in this instance or another one."""

    def seen(one):
        return repr((one.read(), one.states(), one.derivatives()))

    at = phases(model, way, PHASED["law 1"])
    saved = [(fmus.packed(model.slave), seen(model)) for phase in at if phase != "apart"]
    assert len({expected for _, expected in saved}) == len(saved)
    with closing(Solved(folder)) as other:
        for data, expected in saved:
            paths = set()
            for one in (other.begin({"law": 2}), model):
                fmus.restore_packed(one.slave, data)
                assert seen(one) == expected
                one.set(k=2e6)
                assert not one.place(9e-4, 0.01, 0.005, 20.0, 30.0).event()
                paths.add(seen(one))
            assert len(paths) == 1


def test_the_two_interfaces_are_kept_apart(model, way):
    """States of one are refused by the other; so are functions."""
    model.begin()
    assert way.begin().step(1e-4)
    before = repr((model.states(), way.read()))
    for to, data in (way, fmus.packed(model.slave)), (model, fmus.packed(way.slave)):
        assert is_error(fmus.restore_packed, to.slave, data)
        assert "a state that this component didn't make is refused" in to.messages[-1]
    assert repr((model.states(), way.read())) == before
    functions, size = way.slave.dll, ctypes.c_double(1e-4)
    set_time = getattr(functions, f"fmi{model.fmi}SetTime")
    assert set_time(ctypes.c_void_p(way.slave.component), size) == 3
    assert "a function of Model Exchange is refused" in way.messages[-1]
    if model.fmi == 2:
        assert functions.fmi2DoStep(ctypes.c_void_p(model.slave.component), size, size, 0) == 3
        assert "this instance is for Model Exchange" in model.messages[-1]


# Bad input


def test_bad_input_stops_a_solver(model, folder):
    """The derivatives are Error, the next event ends the run; corrected, it goes on."""
    for bad in {"exponent": 2.0}, {"k": math.inf}:
        with pytest.raises(FMICallException, match="ExitInitializationMode"):
            fmpy.simulate_fmu(folder, fmi_type="ModelExchange", start_values=bad)
    model.begin().set(k=-1.0)
    assert "k = -1 N/m is refused" in model.messages[-1]
    assert is_error(model.derivatives)
    assert model.event()
    assert "the simulation must stop: k = -1 N" in model.messages[-1]
    model.set(k=1e6)
    assert model.derivatives()[0] == 35.0
    assert not model.event()


def test_a_touch_that_is_refused_ends_the_run(model, folder):
    line = {"law": 2, "restitution_at_rest": 0.5, "restitution_slope": 0.1, "gap": 0.001}
    with pytest.raises(AssertionError, match="the simulation must stop: club_speed = 35"):
        model.begin(line).solve(1e-3, 1e-8)
    rows = fmpy.simulate_fmu(folder, fmi_type="ModelExchange", start_values=line, stop_time=1e-3)
    assert rows["time"][-1] == pytest.approx(0.001 / 35.0, rel=1e-3)
    # A solver is exact beside any force.
    pushed = {"law": 2, "exponent": 1.5, "gap": 0.001, "club_force": 1e10}
    assert not model.begin(pushed).place(0.001 / 35.0, 0.0, 0.0, 35.0, 0.0).event()


#: Values and sizes of steps (s) beside the ends of a variable's range.
ODD = (math.nan, math.inf, -math.inf, -0.0, 1e300, -1.7e308, 1.0, 1.5, 35.0, 1e4, 1e-2, 1e-5)
STEPS = (1e-6, 1e-5, 1e-4, 1e-3, 1.0, 1e10, math.nan, -1.0, 1e308)


@pytest.mark.parametrize("times", repeated(25, 250, 10_000))
def test_no_floating_point_exception_is_raised(model, way, times):
    """Whatever the values, in co-simulation and by Euler's method; `make_instance` watches."""
    rng = random.Random(model.fmi)

    def chosen(most, *causalities):
        rows = [row for row in SETTABLE.values() if row.causality in causalities]
        some = rng.sample([row for row in rows if row.type == "Real"], rng.randrange(most))
        return {row.name: rng.choice((row.low, row.high, rng.choice(ODD))) for row in some}

    for _ in range(times):
        values = {"law": rng.choice((1, 2))} | chosen(6, "input", "parameter")
        way.begin(values)
        for size in rng.choices(STEPS, k=10):
            way.step(size, rng.choice((*[None] * 9, rng.choice(ODD))))
            way.set(**chosen(2, "input"))
            way.read()
        # With values that are refused there are no derivatives.
        with suppress(FMICallException):
            model.begin(values)
        for size in rng.choices(STEPS[:5], k=10):
            with suppress(FMICallException):
                model.changes(UNKNOWNS, rng.choice(STATES))
                slopes = (max(-1e30, min(slope, 1e30)) for slope in model.derivatives())
                pairs = [(x, x + size * slope) for x, slope in zip(model.states(), slopes)]
                moved = (then if abs(then) < 1e6 else x for x, then in pairs)
                model.place(model.time + size, *moved).indicators()
                model.event()
            model.set(**chosen(2, "input"))
            model.read()
