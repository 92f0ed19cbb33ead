"""Co-simulation in FMI 3.0: events are announced, and steps return early."""

import math
import random
from contextlib import suppress
from ctypes import byref, c_bool, c_double

import pytest
from compare import assert_close
from conftest import CRITERIA, EXPECTED, LAW_2_CONTACT
from fmpy.fmi1 import FMICallException
from fmus import begin, discard, get, initialize, is_set, make_instance, put, step_status


@pytest.fixture
def make(way_of):
    slaves, folder = [], way_of("native, FMI 3.0").slave.unzipDirectory

    def make(**options):
        slaves.append(make_instance(folder, **{"eventModeUsed": True, **options}))
        return slaves[-1]

    yield make
    discard(*slaves)


def announced(slave):
    slave.enterEventMode()
    again, stop, nominals, jumped, defined, when = slave.updateDiscreteStates()
    assert (again, stop, nominals, jumped) == (False, False, False, False)
    slave.enterStepMode()
    return when if defined else None


@pytest.mark.parametrize("start", [0.0, -3.0, 1000.0])
def test_events_are_announced_at_the_exact_time(make, start):
    slave = begin(make(), start, gap=0.0035, law=2)
    # 4e-16 · A/T of the design's tolerances, and a double of the host's time.
    near = {"rel": 3e-16, "abs": 1e-18}
    assert announced(slave) == pytest.approx(start + 1e-4, **near)
    slave.doStep(start, 1e-6)
    touch = announced(slave)
    assert touch == pytest.approx(start + 1e-4, **near)
    assert slave.doStep(start + 1e-6, touch - (start + 1e-6)) == (True, False, False, touch)
    assert slave.getBoolean(slave.flags) == [True, True, False]
    separation = announced(slave)
    assert separation == pytest.approx(touch + LAW_2_CONTACT, **near)
    slave.doStep(touch, separation - touch)
    assert slave.getBoolean(slave.flags) == [True, False, True]
    assert announced(slave) is None
    assert_close(dict(zip(CRITERIA, get(slave, *CRITERIA))), EXPECTED[2])


@pytest.mark.parametrize("seed", range(40))
def test_a_step_to_the_announced_event_reaches_it(make, seed):
    """Touch and separation, wherever the host's clock stands: never an instant too early."""
    rng = random.Random(seed)
    point, step = rng.choice([0.0, rng.uniform(-1e3, 1e3)]), rng.uniform(1e-5, 1e-3)
    ranges = {"gap": (0.0, 10.0 ** (seed % 5)), "club_speed": (5.0, 70.0), "k": (1e5, 3e6)}
    slave = begin(make(), point, **{name: rng.uniform(*ends) for name, ends in ranges.items()})
    for flag in ("", "touched", "separated"):
        slave.doStep(point, step)
        point += step
        assert not flag or is_set(slave, flag), (flag, point)
        step = (announced(slave) or point + step) - point


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
    assert slave.getBoolean(slave.flags) == [True, False, True]
    assert 1e-4 < stiff < soft


@pytest.mark.parametrize("has_events", [True, False])
def test_an_early_return_at_touch(make, has_events):
    """An event in event mode alone. Also after a start value had to be corrected."""
    slave = make(earlyReturnAllowed=True, eventModeUsed=has_events)
    initialize(slave, gap=0.0035, exponent=1.5)
    with suppress(FMICallException):
        slave.exitInitializationMode()
    put(slave, exponent=1.0)
    touch = math.nextafter(0.0035 / 35.0, 1.0)
    assert slave.doStep(0.0, 1e-3) == (has_events, False, True, touch)
    assert slave.getBoolean(slave.flags) == [True, True, False]


def test_events_end_where_the_contact_cannot_be_computed(make):
    """A step beyond a touch that is refused is discarded, and returns at all."""
    slave = begin(make(), law=2, exponent=1.5, gap=0.01, club_force=1e10)
    flags, last = [c_bool(True) for _ in "123"], c_double(1.0)
    results = *map(byref, flags), byref(last)
    assert slave.dll.fmi3DoStep(slave.component, 0.0, 1e-3, True, *results) == 2
    assert [*(flag.value for flag in flags), last.value] == [False, False, False, 0.0]


def test_no_type_of_values_is_fatal(make):
    """Types that no variable has: Error, and the step after it is discarded."""
    slave = begin(make())
    for point, reference in enumerate((0, 8, 20, 999, 2**32 - 1)):
        for call, *values in ("getInt32",), ("setUInt64", [1]):
            with pytest.raises(FMICallException, match="error"):
                getattr(slave, call)([reference], *values)
            assert step_status(slave, point, 1.0) == 2
        slave.doStep(point, 1.0)
