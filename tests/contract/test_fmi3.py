"""Co-simulation in FMI 3.0: events are announced, and steps return early."""

import math
import random
from contextlib import suppress
from ctypes import byref, c_bool, c_double

import fmus
import pytest
import random_cases
from conftest import numbers
from fmpy.fmi1 import FMICallException

#: s; doubles of the host's time, and of the sum of touch and contact time.
NEAR = {"rel": 1e-15, "abs": 1e-15}


@pytest.fixture
def make(way_of):
    slaves, folder = [], way_of("native, FMI 3.0").slave.unzipDirectory

    def make(**options):
        slaves.append(fmus.make_instance(folder, **options))
        return slaves[-1]

    yield make
    fmus.discard(*slaves)


def announced(slave):
    """When the next event is, s; infinite if there is none."""
    slave.enterEventMode()
    again, stop, nominals, jumped, defined, when = slave.updateDiscreteStates()
    assert (again, stop, nominals, jumped) == (False, False, False, False)
    slave.enterStepMode()
    return when if defined else math.inf


def step(slave, point, size):
    """What doStep returns: its status; whether there is an event, the end, an early return; where
    it ended, s.
    """
    flags, last = [c_bool(True) for _ in "123"], c_double(1.0)
    results = *map(byref, flags), byref(last)
    status = slave.dll.fmi3DoStep(slave.component, point, size, True, *results)
    return status, *(flag.value for flag in flags), last.value


@pytest.mark.parametrize("number", numbers(80, 1000, 20_000))
def test_events(make, number):
    """Announced at their time, with inputs set since the step; a step there reaches it.

    Wherever the host's clock stands, and never an instant too early. Without event mode a step
    may return early, too, but there is no event.
    """
    rng, values = random.Random(number), random_cases.accepted(number, pushed=0.3)
    start = point = rng.choice([0.0, rng.uniform(-1e3, 1e3)])
    values["gap"] *= 10.0 ** rng.randint(0, 4)
    has_events, may_return = rng.choice([(True, True), (True, False), (False, True)])
    slave = make(eventModeUsed=has_events, earlyReturnAllowed=may_return)
    # Half of them begin with a start value that is corrected late.
    fmus.initialize(slave, start, **values | {"gap": rng.choice([values["gap"], -1.0])})
    with suppress(FMICallException):
        slave.exitInitializationMode()
    fmus.put(slave, gap=values["gap"])
    before = slave.getBoolean(slave.flags)
    for n in range(12):
        if rng.random() < 0.4:
            k = values["k"] * 10.0 ** rng.uniform(0, 3)  # no more damping than is allowed
            fmus.put(slave, k=k, club_speed=rng.uniform(5.0, 80.0))
        state, when = fmus.saved(slave), announced(slave)
        to_event = [when - point] if point < when < math.inf else []
        if to_event and 1e-6 * (when - point) > math.ulp(when):  # otherwise a rounding error
            to_event.insert(0, (1.0 - 1e-6) * (when - point))
        for size in (*to_event, 10.0 ** rng.uniform(-6, -3) if n < 11 else 1e3):
            fmus.call_state(slave, "set", state)
            status, *found, last = step(slave, point, size)
            # At the event itself rounding decides.
            returns = may_return and (when < point + size or (size == when - point and found[-1]))
            if status:
                assert (status, *found, last) == (2, False, False, False, point)
                break
            is_event = has_events and (returns or when == point + size)
            assert found == [is_event, False, returns]
            assert abs(last - (when if returns else point + size)) <= math.ulp(last) * returns
            now = slave.getBoolean(slave.flags)
            happened = sum(fmus.get(slave, "touch_time", "contact_time"))
            is_reached = when <= last or size == when - point
            # A change of inputs may part the bodies at once.
            at_once = happened == pytest.approx(point, **NEAR)
            assert (now != before) == is_reached or at_once
            if size == when - point:
                assert happened == pytest.approx(when, **NEAR)
        fmus.call_state(slave, "free", state)
        point, before = last, slave.getBoolean(slave.flags)


def test_status_of_messages(make):
    """That of the call that they are about."""
    seen = []
    slave = fmus.begin(make(logMessage=lambda *words: seen.append(words[1:3])))
    assert fmus.step_status(slave, 0.0, -1.0) == 2
    fmus.put(slave, k=-1.0)
    assert seen == [(2, b"logStatusDiscard"), (3, b"logStatusError")]


def test_no_type_of_values_is_fatal(make):
    """Types that no variable has: Error, and the step after it is discarded."""
    slave = fmus.begin(make())
    for point, reference in enumerate((0, 8, 20, 999, 2**32 - 1)):
        for call, *values in ("getInt32",), ("setUInt64", [1]):
            with pytest.raises(FMICallException, match="error"):
                getattr(slave, call)([reference], *values)
            assert fmus.step_status(slave, point, 1.0) == 2
        slave.doStep(point, 1.0)
