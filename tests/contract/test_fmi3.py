"""The FMI 3.0 FMU: the same impact stepped, announced event by event, and solved by a host."""

import math
import random
from contextlib import nullcontext, suppress
from itertools import pairwise

import fmpy
import numpy as np
import pytest
from cases import CASES, DEFAULTS, KINDS
from compare import assert_close
from components import get as get_values
from components import initialized, is_set
from components import put as put_values
from conftest import CRITERIA, EXPECTED, build_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Model, FMU3Slave
from fmus import (
    begin,
    discard,
    get,
    get_all,
    initialize,
    make_instance,
    mutated,
    packed,
    place,
    put,
    restore_packed,
    step_status,
    vector,
)
from golf_physics.component.component import Component
from golf_physics.component.hybrid import HybridComponent
from golf_physics.variables import CO_SIMULATION_ONLY, DERIVATIVES, INDICATORS, STATES, VARIABLES

from golf_build.packaging import guid_in
from golf_impact.fmu import builder_of

OUTPUTS = [v.name for v in VARIABLES if v.causality == "output" and v.type == "Real"]
FLAGS = [v.name for v in VARIABLES if v.type == "Boolean"]


@pytest.fixture(scope="module")
def extracted(fmi3_path, tmp_path_factory):
    return fmpy.extract(str(fmi3_path), str(tmp_path_factory.mktemp("extracted3")))


@pytest.fixture(scope="module")
def description(extracted):
    return fmpy.read_model_description(extracted)


@pytest.fixture
def make(extracted):
    slaves = []

    def make(kind=FMU3Slave):
        name = f"instance {len(slaves)}"
        slaves.append(make_instance(extracted, name, kind, loggingOn=True))
        return slaves[-1]

    yield make
    discard(*slaves)


# The file


@pytest.mark.plain
def test_it_is_reproducible_and_recognized_as_current(fmi3_path, fmu_path, tmp_path):
    again = build_fmu(tmp_path / "again.fmu", fmi=3)
    assert again.read_bytes() == fmi3_path.read_bytes()
    guid = builder_of(fmi=3).guid()
    assert builder_of(fmi=3).guid_of(again) == guid
    assert guid_in(fmu_path) != guid
    assert builder_of().digest() != builder_of(fmi=3).digest()


# Co-simulation


def announced(slave):
    slave.enterEventMode()
    again, stop, nominals, jumped, defined, when = slave.updateDiscreteStates()
    assert (again, stop, nominals, jumped) == (False, False, False, False)
    slave.enterStepMode()
    return when if defined else None


@pytest.mark.parametrize("start", [0.0, -3.0, 1000.0])
def test_events_are_announced_at_the_exact_time(make, start):
    slave = begin(make(), start, gap=0.0035, law=2)
    assert announced(slave) is None  # before the first step its time is unknown
    slave.doStep(start, 1e-6)
    touch = announced(slave)
    # 4e-16 · A/T of the design's tolerances, and a double of the host's time.
    assert touch == pytest.approx(start + 1e-4, rel=3e-16, abs=1e-18)
    slave.doStep(start + 1e-6, touch - (start + 1e-6))
    assert get_all(slave)[1] == [True, True, False]
    separation = announced(slave)
    assert separation == pytest.approx(touch + 6.010445569987614e-4, rel=3e-16, abs=1e-18)
    slave.doStep(touch, separation - touch)
    assert get_all(slave)[1] == [True, False, True]
    assert announced(slave) is None
    assert_close(dict(zip(CRITERIA, get(slave, *CRITERIA))), EXPECTED[2])


def test_an_announcement_includes_inputs_set_since_the_step(make):
    slave = begin(make(), law=2, b=0.0)
    slave.doStep(0.0, 1e-4)
    soft = announced(slave)
    put(slave, k=4e6)
    stiff = announced(slave)
    put(slave, k=1e6)
    assert announced(slave) == soft
    put(slave, k=4e6)
    slave.doStep(1e-4, stiff - 1e-4)
    assert get_all(slave)[1] == [True, False, True]
    assert 1e-4 < stiff < soft


def test_an_early_return_at_touch(way_of):
    """Of the native FMU: pythonfmu3 drops it. Also after a start value had to be corrected."""
    slave = make_instance(
        way_of("native, FMI 3.0").slave.unzipDirectory, eventModeUsed=True, earlyReturnAllowed=True
    )
    initialize(slave, gap=0.0035, exponent=1.5)
    with suppress(FMICallException):
        slave.exitInitializationMode()
    put(slave, exponent=1.0)
    touch = math.nextafter(0.0035 / 35.0, 1.0)
    assert slave.doStep(0.0, 1e-3) == (True, False, True, touch)
    assert get_all(slave)[1] == [True, True, False]
    discard(slave)


def test_events_end_where_the_contact_cannot_be_computed(way_of):
    """Event mode alone: a step beyond a touch that is refused is discarded, and returns at all."""
    slave = make_instance(way_of("native, FMI 3.0").slave.unzipDirectory, eventModeUsed=True)
    begin(slave, law=2, exponent=1.5, gap=0.01, club_force=1e10)
    assert step_status(slave, 0.0, 1e-3) == 2
    discard(slave)


# Model Exchange


#: Inputs jump in the last two: k and b in contact, the club speed on the way to the ball.
SOLVED = {name: (given, ()) for name, given in KINDS.items()}
SOLVED |= {name: (CASES[name].given, CASES[name].changes) for name in ("changes", "changes, law 2")}
SOLVED |= {
    f"COR line, ball at {speed:g} m/s": (KINDS["COR line"] | {"ball_speed": speed, "gap": gap}, ())
    for speed, gap in ((-12.0, 0.002), (12.0, 0.002))
}


@pytest.mark.model_exchange
@pytest.mark.parametrize(("given", "changes"), SOLVED.values(), ids=SOLVED)
def test_solved_by_cvode_it_is_the_same_impact(extracted, fmu, given, changes):
    begin, end, names, now = 7.0, 2e-3, ("club_speed", "k", "b"), DEFAULTS | given
    fmu.begin(now, begin)
    point, inputs = 0.0, [(begin, *map(now.get, names))]
    for time, values in (*changes, (end, {})):
        fmu.step(time - point)
        fmu.set(**values)
        point, now = time, now | values
        # A jump is a row before it and one after it.
        inputs += [(begin + time, *inputs[-1][1:]), (begin + time, *map(now.get, names))]
    rows = fmpy.simulate_fmu(
        extracted,
        fmi_type="ModelExchange",
        start_time=begin,
        stop_time=begin + end,
        output_interval=1e-4,
        relative_tolerance=1e-10,
        record_events=True,
        start_values=given,
        input=np.array(inputs[:-1], dtype=[(name, float) for name in ("time", *names)]),
        output=[*OUTPUTS, *FLAGS],
    )
    exact, last = fmu.read(), rows[-1]
    touch = exact["touch_time"]
    scales = {"force": 5e3, "club_position": 0.01, "ball_position": 0.01, "compression": 0.005}
    dragged = given.get("law", 1) == 1 and given.get("b", 9.0) != 0.0
    for name in OUTPUTS:
        if name in CO_SIMULATION_ONLY or (name == "impulse" and dragged):
            assert math.isnan(last[name]), name
        else:
            # Some 30 times the solver's tolerance is the worst seen.
            scale = max(abs(exact[name]), scales.get(name, 1e-4))
            assert abs(last[name] - exact[name]) < 3e-7 * scale, name
    assert [bool(last[name]) for name in FLAGS] == [exact[name] for name in FLAGS]
    # An event is a row before it and one after it, too; a touch at the start needs none.
    events = [then for then, now in pairwise(rows["time"]) if then == now]
    jumps = [begin + time for time, _ in changes]
    jumps += [touch] * (touch > begin) + [touch + exact["contact_time"]] * bool(last["separated"])
    # The worst, 1.8e-11, is the slow separation of an overdamped contact.
    assert events == pytest.approx(sorted(jumps), rel=0.0, abs=1e-10)


@pytest.mark.model_exchange
@pytest.mark.parametrize("name", ["law 1", "law 2", "n = 1.6", "COR line"])
def test_the_equations_are_those_of_the_phases(make, name):
    """At any state of the exact solution, the equations give its force and accelerations."""
    slave, model = begin(make(), **KINDS[name]), begin(make(FMU3Model), **KINDS[name])
    read = ("force", "club_acceleration", "ball_acceleration", *INDICATORS)
    model.setTime(0.0)
    for n in range(20):
        slave.doStep(n * 2e-5, 2e-5)
        place(model, (n + 1) * 2e-5, *get(slave, *STATES))
        scale = (7e3, 1.5e5, 1.5e5, 1.0, 7e3)
        for value, expected, size in zip(get(model, *read), get(slave, *read), scale, strict=True):
            assert abs(value - expected) < 1e-12 * size
        assert vector(model.getContinuousStateDerivatives) == get(model, *DERIVATIVES)


def test_a_solver_that_stops_just_before_the_root_of_touch():
    """A rounding error before it: handled there, it must not find the same root for ever."""
    for number in range(60):
        speed, gap = 20.0 + number, 0.005
        model = initialized(HybridComponent, pytest.fail, club_speed=speed, gap=gap)
        model.set_time(0.0)
        _, *others = model.states()
        time = gap / speed
        for short in (0.0, 1.7e-18, 1.7e-17):
            again = HybridComponent(pytest.fail)
            again.restore(model.snapshot())
            again.set_time(time)
            again.set_states([-short, *others])
            again.update()
            assert is_set(again, "touched")
        model.set_states([-1e-12, *others])
        model.update()
        assert not is_set(model, "touched")


def phases(make, values):
    """Models before touch, closing and not, in contact, after it, and while the ball recovers."""
    for n, states in enumerate(
        (
            (-1e-3, 0.0, 35.0, 0.0),
            (0.0, 0.0, 35.0, 40.0),
            (4e-3, 1e-3, 30.0, 20.0),
            (0.012, 0.02, 22.0, 55.0),
            (0.02 + 1e-7, 0.02, 22.0, 55.0),
        )
    ):
        model = begin(make(FMU3Model), gap=1e-3, **values)
        end = 8e-4 - 1e-9 if n == 4 else 7e-4
        for time, at in ((1e-4, (1e-12, 0.0, 35.0, 0.0)), (end, states))[: max(0, n - 1)]:
            place(model, time, *at)
            model.enterEventMode()
            model.updateDiscreteStates()
        model.enterContinuousTimeMode()
        yield model, states


@pytest.mark.model_exchange
def test_dependencies(make, description):
    """Those listed are those that there are, in some phase of some kind of contact."""
    structure = (*description.outputs, *description.derivatives, *description.eventIndicators)
    listed = {(u.variable.name, known.name) for u in structure for known in u.dependencies}
    reals = sorted({u.variable.name for u in structure} - {*FLAGS})
    base = {"k": 1e6, "b": 9.0, "club_speed": 35.0, "club_force": 0.0, "time": 8e-4}
    found = set()

    def values(model, known):
        time = known.pop("time")
        place(model, time, *(known.pop(name) for name in STATES))
        put(model, **known)
        return [*get(model, *reals), *get_all(model)[1]]

    for name in ("law 1", "law 2", "n = 1.6", "COR line"):
        for model, states in phases(make, KINDS[name]):
            point = base | dict(zip(STATES, states, strict=True))
            before = values(model, dict(point))
            for known, value in point.items():
                after = values(model, point | {known: value + (0.01 * abs(value) or 1e-4)})
                pairs = zip([*reals, *FLAGS], before, after, strict=True)
                found |= {(n, known) for n, a, b in pairs if a != b and not math.isnan(a)}
            assert values(model, dict(point)) == pytest.approx(before, nan_ok=True, rel=0, abs=0)
    assert found == listed
    # Club speed follows from the impulse in a swing: it must not be an algebraic loop.
    assert not found & {("impulse", name) for name in ("k", "b", "club_speed")}


def events_by(model, method="DOP853", stop=2e-3, rtol=1e-9, atol=1e-12):
    """Integrate by SciPy from event to event, as a host does; returns the times of events."""
    from scipy.integrate import solve_ivp

    def slope(t, y):
        model.set_time(t)
        model.set_states(list(y))
        return model.derivatives()

    def indicator(number):
        def event(t, y):
            slope(t, y)
            return model.indicators()[number]

        event.terminal, event.direction = True, -1
        return event

    assert model.update()[0] is False
    t, events, indicators = 0.0, [], [indicator(0), indicator(1)]
    while t < stop:
        run = solve_ivp(
            slope, (t, stop), model.states(), method, None, False, indicators, rtol=rtol, atol=atol
        )
        t = run.t[-1]
        slope(t, run.y[:, -1])
        if run.status == 1:
            events.append(t)
            assert len(events) < 4, events
            assert model.update()[0] is False
    return events


@pytest.mark.parametrize("values", [{}, {"law": 2}, {"law": 2, "exponent": 1.6}], ids=str)
def test_an_event_at_its_root_has_happened(values):
    """A host that restarts at the root that it located doesn't find it again and again."""
    for number in range(30):
        speed = 20.0 + 1.37 * number
        model = initialized(HybridComponent, pytest.fail, club_speed=speed, gap=0.003, **values)
        events = events_by(model)
        assert len(events) == 2, (speed, events)
        assert is_set(model, "separated")


def test_a_force_after_separation_in_model_exchange():
    """Momentum and energy run on, and the compression stays 0 where the positions cross."""
    names = ("momentum", "kinetic_energy", "compression")
    model = initialized(HybridComponent, pytest.fail, law=2)
    t = events_by(model)[-1]
    put_values(model, club_force=4e4)
    model.update()
    momentum = get_values(model, "momentum")[0]
    x_club, x_ball, v_club, v_ball = model.states()
    t, a = 0.04 - model.time(), 4e4 / 0.21
    assert model.derivatives() == [v_club, v_ball, a, 0.0]
    model.set_time(0.04)
    moved = x_club + v_club * t + 0.5 * a * t * t, x_ball + v_ball * t
    model.set_states([*moved, v_club + a * t, v_ball])
    found = get_values(model, *names)
    assert found[0] - momentum == pytest.approx(4e4 * t, rel=1e-9)
    assert found[1] == pytest.approx(0.105 * (v_club + a * t) ** 2 + 0.022965 * v_ball**2)
    assert moved[0] > moved[1]
    assert found[2] == 0.0
    # Pulled back.
    model.set_time(0.05)
    model.set_states([3.0, 2.0, 10.0, 55.0])
    assert get_values(model, "compression") == [0.0]


def test_the_compression_that_is_left_falls_in_model_exchange():
    """As in co-simulation: without force, from its value at separation."""
    values = {"law": 2, "b": 60.0, "club_force": 700.0}
    whole, stepped, model = (initialized(HybridComponent, pytest.fail, **values) for _ in range(3))
    model.update()
    whole.step(0.0, 1.0)
    end = get_values(whole, "contact_time")[0] * (1.0 + 2.0**-51)
    point, found = 0.0, []
    for time in (end, *(end + n * 2e-6 for n in range(1, 40))):
        assert stepped.step(point, time - point)
        point = time
        model.set_time(time)
        model.set_states(get_values(stepped, *STATES))
        if time == end:
            model.update()
        (left,), (expected,) = get_values(model, "compression"), get_values(stepped, "compression")
        assert left == pytest.approx(expected, abs=1e-17)
        found.append(left)
    assert found[0] > 1e-4
    assert found == sorted(found, reverse=True)
    assert found[-1] == 0.0


def test_the_start_time_is_that_of_the_first_evaluation():
    """pythonfmu3 doesn't pass it on; a later time, set before its states, isn't the start's."""
    model = initialized(HybridComponent, pytest.fail)
    model.update()
    states, slopes, h = model.states(), model.derivatives(), 5e-5
    model.set_time(0.5 * h)
    model.set_states([x + 0.5 * h * slope for x, slope in zip(states, slopes)])
    assert get_values(model, "touch_time", "contact_time") == [0.0, 0.5 * h]
    for first in ("derivatives", "set_states"):
        model = initialized(HybridComponent, pytest.fail)
        model.update()
        model.set_time(7.0)
        if first == "derivatives":
            model.derivatives()
        else:
            model.set_states(model.states())
        model.set_time(7.0 + h)
        model.set_states([0.001, 0.0, 34.0, 1.0])
        assert get_values(model, "touch_time") == [7.0]
        assert get_values(model, "contact_time") == pytest.approx([h], rel=1e-9)


def test_the_impulse_under_a_drag_is_unknown():
    """b may have changed between events; without drag it is the ball's momentum."""
    for law, b, known in ((1, 9.0, False), (1, 0.0, True), (2, 9.0, True)):
        model = initialized(HybridComponent, pytest.fail, law=law, b=b)
        model.update()
        model.set_time(1e-4)
        model.set_states([0.0035, 0.001, 30.0, 10.0])
        impulse = get_values(model, "impulse")[0]
        assert (impulse == 0.04593 * 10.0) is known
        put_values(model, b=3.0)
        put_values(model, b=0.0)
        assert math.isnan(get_values(model, "impulse")[0]) is (law == 1)


def test_a_refused_state_stops_a_solver():
    messages = []
    model = initialized(HybridComponent, messages.append)
    model.update()
    model.set_time(0.0)
    model.restore(HybridComponent.unpacked(b"no state"))
    assert "didn't make is refused" in str(messages[-1])
    assert all(map(math.isnan, model.derivatives()))
    assert model.update()[0]
    assert "the simulation must stop" in str(messages[-1])


@pytest.mark.model_exchange
def test_a_club_that_sets_off_from_the_ball(make):
    """Gap 0 and no closing: nothing happens until the club's speed comes, even without an event."""
    model = begin(make(FMU3Model), 7.0, club_speed=0.0)
    model.setTime(7.0)
    assert vector(model.getEventIndicators, 2)[0] > 0.0
    put(model, club_speed=10.0)
    place(model, 8.0, 1e-9, 0.0, 0.0, 0.0)
    assert vector(model.getEventIndicators, 2)[0] < 0.0
    model.enterEventMode()
    assert model.updateDiscreteStates()[3]  # the state of velocity has jumped to the club's speed
    assert vector(model.getContinuousStates) == [1e-9, 0.0, 10.0, 0.0]
    assert get_all(model)[1] == [True, True, False]
    assert get(model, "touch_time") == [8.0]


@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
@pytest.mark.parametrize("method", ["DOP853", "RK45"])
@pytest.mark.parametrize(
    "values",
    [{}, {"b": 900.0}, {"law": 2, "b": 0.0, "exponent": 12.0}, {"law": 2, "exponent": 1.6}],
    ids=str,
)
def test_no_separation_is_overlooked(values, method, rtol):
    """By a solver with steps of its own choice, which looks for changes of sign at their ends."""
    stepped, model = (initialized(HybridComponent, pytest.fail, **values) for _ in range(2))
    stepped.step(0.0, 1.0)
    (expected,) = get_values(stepped, "contact_time")
    atol = [0.02 * rtol, 0.02 * rtol, 35.0 * rtol, 35.0 * rtol]
    events = events_by(model, method, 5.0 * expected, rtol, atol)
    assert events == pytest.approx([expected], rel=1e3 * rtol)


# State


@pytest.mark.model_exchange
def test_a_state_in_model_exchange(make):
    """Saved in mid-contact, it goes on exactly as before: in this instance or another one."""
    first, second = begin(make(FMU3Model), gap=0.001), make(FMU3Model)

    def advance(model, n):
        if n == 2:
            model.enterEventMode()
            model.updateDiscreteStates()
        place(model, n * 2e-5, 3e-4 * n - 1e-3, 1e-4 * n, 35.0 - n, 2.0 * n)

    def path(model):
        found = []
        for n in range(4, 12):
            advance(model, n)
            found.append(repr(get_all(model)))
        return found

    for n in range(4):
        advance(first, n)
    put(first, k=1.2e6)
    data = packed(first)
    restore_packed(second, data)
    expected = path(first)
    restore_packed(first, data)
    assert path(first) == path(second) == expected
    # Of any other content it is refused or restored; no call is fatal.
    rng = random.Random(1)
    for _ in range(60):
        restore_packed(first, mutated(rng, data))
        for call in (first.getContinuousStateDerivatives, first.getContinuousStates):
            vector(call)
        first.updateDiscreteStates()
        get_all(first)
        restore_packed(first, data)


def test_co_simulation_and_model_exchange_keep_their_states_apart():
    messages = []
    stepped, solved, fresh = (initialized(HybridComponent, messages.append) for _ in range(3))
    plain = initialized(Component, messages.append)
    stepped.step(0.0, 1e-4)
    solved.update()
    solved.set_time(0.0)
    solved.derivatives()
    saved = stepped.snapshot(), solved.snapshot()
    before = stepped.reals([13, 17]), solved.states()
    for component, state in ((stepped, saved[1]), (solved, saved[0]), (plain, saved[1])):
        component.restore(state)
        assert "a state that this component didn't make is refused" in str(messages.pop())
    assert (stepped.reals([13, 17]), solved.states()) == before
    # An instance that is neither may become both.
    fresh.restore(saved[0])
    fresh.set_time(1e-4)
    assert "this instance has made steps" in str(messages[-1])
    assert all(map(math.isnan, fresh.derivatives()))


# Bad input


@pytest.mark.model_exchange
def test_bad_input_stops_a_solver(make):
    model = begin(make(FMU3Model))
    model.setTime(0.0)
    put(model, k=-1.0)
    assert all(map(math.isnan, vector(model.getContinuousStateDerivatives)))
    assert model.updateDiscreteStates()[1]
    assert "k = -1.0" in model.messages[0]
    put(model, k=1e6)
    assert vector(model.getContinuousStateDerivatives)[0] == 35.0
    assert not model.updateDiscreteStates()[1]


@pytest.mark.parametrize("bad", [{"exponent": 2.0}, {"k": math.inf}, {"k": 1e300, "m_club": 1e-9}])
@pytest.mark.parametrize(
    "kind", [pytest.param("ModelExchange", marks=pytest.mark.model_exchange), "CoSimulation"]
)
def test_bad_start_values_end_the_initialization(extracted, bad, kind, request):
    # The native FMU returns Error; pythonfmu3 can't, so there the first event ends the run.
    alone = request.config.getoption("--native")
    with pytest.raises(Exception, match="fmi3ExitInitializationMode" if alone else "terminat"):
        fmpy.simulate_fmu(extracted, fmi_type=kind, start_values=bad, use_event_mode=True)


@pytest.mark.model_exchange
def test_a_restitution_out_of_reach_stops_a_solver(make):
    line = {"law": 2, "restitution_at_rest": 0.5, "restitution_slope": 0.1}
    model = begin(make(FMU3Model), gap=0.001, **line)
    place(model, 0.001 / 35.0, 0.0, 0.0, 35.0, 0.0)
    assert model.updateDiscreteStates()[1]
    assert "club_speed = 35.0 m/s is refused at touch" in model.messages[-1]
    assert all(map(math.isnan, vector(model.getContinuousStateDerivatives)))


def test_no_type_of_values_is_fatal(make, is_native):
    """Types that no variable has, or another one; the step after it is refused."""
    slave = begin(make())
    for kind in ("Int32", "UInt64"):
        for reference in (0, 8, 20, 999, 2**32 - 1):
            for call, value in (("get", ()), ("set", ([1],))):
                with suppress(FMICallException) if is_native else nullcontext():
                    getattr(slave, f"{call}{kind}")([reference], *value)
                assert step_status(slave, 0.0, 1e-4) == 2
                put(slave, k=1e6)
    slave.doStep(0.0, 1e-4)


@pytest.mark.model_exchange
def test_no_call_of_a_solver_is_fatal(make):
    model = begin(make(FMU3Model), law=2, exponent=3.0)
    for value in (math.nan, math.inf, 1e308, -1e308):
        place(model, value, value, -value, -value, value)
        vector(model.getContinuousStateDerivatives)
        vector(model.getEventIndicators, 2)
        model.updateDiscreteStates()
        get_all(model)


@pytest.mark.model_exchange
def test_a_step_in_model_exchange_is_refused(make):
    slave = begin(make())
    slave.fmi3SetTime(slave.component, 0.0)
    with pytest.raises(FMICallException, match="discard"):
        slave.doStep(0.0, 1e-4)
