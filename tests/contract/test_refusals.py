"""What FMUs refuse: the message, no effect, no step until it is corrected; Ctrl-C in a host."""

import ctypes
import math
import random
from contextlib import suppress
from pathlib import Path

import fmpy
import fmus
import numpy as np
import pytest
from command import run_python
from compare import to_15_digits
from conftest import HERE, repeated
from fmpy.fmi1 import FMICallException
from ways import FMUS

from golf_build.system import COMPANIONS

NAN, INF = math.nan, math.inf

#: By model: variables, values that are refused, and the range that the message names.
REFUSED = {
    "ClubBallImpact": [
        *(("k", value, "0.001 and 1e+15") for value in (0.0, -1.0, NAN, INF, 1e16)),
        *(("b", value, "0 and 1e+09") for value in (-1e-9, 1e10)),
        *(("club_speed", value, "-1e+06 and 1e+06") for value in (NAN, INF, -1e7)),
        *(("club_force", value, "-1e+12 and 1e+12") for value in (-INF, 1e13)),
        *(("m_club", value, "1e-06 and 1e+06") for value in (0.0, 1e7)),
        ("m_ball", -0.1, "1e-06 and 1e+06"),
        ("ball_diameter", 0.0, "1e-06 and 1000"),
        ("ball_speed", -INF, "-1e+06 and 1e+06"),
        *(("gap", value, "0 and 1e+06") for value in (-1e-9, 1e7)),
        ("exponent", 0.5, "between 1 and 12"),
        ("reference_compression", 0.0, "1e-09 and 1000"),
        ("restitution_at_rest", 1.5, "between 0 and 1"),
        *(("restitution_slope", value, "0 and 1000") for value in (-1e-9, 1e4)),
        ("law", 99, "1 (absolute)"),
    ],
    "Swing": [
        ("club_mass", -1.0, "0.05 and 5"),
        ("impulse", NAN, ""),
    ],
    "Launch": [
        ("friction", -1.0, "0 and 1000"),
        ("ball_velocity", INF, ""),
    ],
    "BallFlight": [
        ("m_ball", 0.0, "0.01 and 1"),
        ("backspin", 1e9, "-5000 and 5000"),
    ],
}  # fmt: skip


def set_anyway(way, **values):
    """The native FMU returns Error for some that the others only refuse."""
    with suppress(FMICallException):
        way.set(**values)


def end(way, *sizes):
    """All variables after further steps."""
    for size in sizes:
        assert way.step(size), way.messages
    return repr(fmus.get_all(way.slave))


def check_recovery(way, name, good, begun):
    """After the refusal of a value: nothing has changed, and once corrected all goes on."""
    variable = way.slave.variables[name]
    read = getattr(way.slave, f"get{way.slave.types[name]}")
    assert read([variable.valueReference]) == [good]
    for _ in range(2):
        assert not way.step(1e-4), "refused until corrected"
        assert f"steps are refused until this is corrected: {name} = " in way.messages[-1]
    way.set(**{name: good})
    assert end(way, 1e-4, 0.4) == begun


def test_values(any_fmu):
    """Before the run, and those of inputs in it as well."""
    way, model = any_fmu, any_fmu.slave.description.modelName
    for name, value, allowed in REFUSED[model]:
        variable = way.slave.variables[name]
        good = int(variable.start) if name == "law" else float(variable.start)
        places = [()] if variable.causality == "parameter" else [(), (1e-4, 1e-4)]
        for before in places:
            way.begin()
            undisturbed = end(way, *before, 1e-4, 0.4)
            if before:
                way.begin()
                end(way, *before)
                set_anyway(way, **{name: value})
            else:
                way.begin({name: value})
            assert to_15_digits(f"{name} = {value}") in to_15_digits(way.messages[0])
            assert allowed in way.messages[0]
            check_recovery(way, name, good, undisturbed)


def test_the_last_illegal_calls_are_named(any_fmu):
    """No more than eight; they cost one step."""
    way = any_fmu.begin()
    read = getattr(way.slave, f"get{way.slave.real}")
    for _ in range(10):
        with suppress(FMICallException):
            read([999])
    assert not way.step(1e-4)
    assert way.messages[-1].count("value reference 999 is no Real variable") == 8
    assert way.step(1e-4)


def test_parameters_that_are_set_after_initialization(any_fmu):
    """Fixed; an equal value changes nothing."""
    way = any_fmu
    name, good, late = {
        "ClubBallImpact": ("m_club", 0.21, 0.3), "Swing": ("club_mass", None, 0.4),
        "Launch": ("friction", None, 0.3), "BallFlight": ("gravity", None, 9.0),
    }[way.slave.description.modelName]  # fmt: skip
    good = good or float(way.slave.variables[name].start)
    way.begin()
    undisturbed = end(way, 1e-4, 1e-4, 0.4)
    for steps in ((), (1e-4,)):
        way.begin()
        end(way, *steps)
        way.set(**{name: good})
        assert way.messages == []
        set_anyway(way, **{name: late})
        (message,) = way.messages
        assert f"{name} = {late}" in message
        assert f"a parameter is fixed once initialization has ended (at {good!r})" in message
        if steps:
            check_recovery(way, name, good, undisturbed)


def test_values_that_are_refused_together(fmu_way):
    """By the end of initialization; they are corrected by either."""
    for values, corrected in (
        ({"exponent": 2.0}, {"law": 2}),
        ({"exponent": 2.0}, {"exponent": 1.0}),
        ({"restitution_at_rest": 0.8}, {"law": 2}),
        ({"m_club": 1e-6, "m_ball": 2.0}, {"m_ball": 0.1}),
        ({"b": 1e9}, {"b": 9.0}),
        ({"b": 5e6}, {"k": 1e14}),
    ):
        fmu_way.begin(values | corrected)
        undisturbed = end(fmu_way, 1e-4, 0.4)
        fmu_way.begin(values)
        assert fmu_way.messages
        assert not fmu_way.step(1e-4)
        fmu_way.set(**corrected)
        assert end(fmu_way, 1e-4, 0.4) == undisturbed


def test_values_act_together_at_the_next_step(fmu_way):
    """The last ones, in any order; until then outputs belong to the last step, and read nothing."""
    way, force = fmu_way, {"law": 2, "b": 9.0}
    way.begin(force)
    end(way, 2e-4)
    before, saved = way.read(), way.save()
    paths = []
    for sets in (
        [("k", 5e5), ("b", 60.0)],
        [("b", 60.0), ("k", 2e6), ("k", 5e5)],
        [("k", -1.0), ("b", 60.0), ("k", 5e5)],
    ):
        way.restore(saved)
        for name, value in sets:
            way.set(**{name: value})
            assert way.read() == before
        assert way.step(1e-4)
        assert way.read() != before
        paths.append(end(way, 1e-4, 0.4))
    assert paths[1:] == paths[:1] * 2
    # Also at touch, which isn't passed before the first step.
    way.begin({"law": 2})
    assert way.read(["force", "max_force"]) == {"force": 9.0 * 35.0, "max_force": 9.0 * 35.0}
    way.set(club_speed=50.0, k=2e6)
    assert way["force"] == 9.0 * 35.0
    late = end(way, 0.4)
    way.begin({"law": 2, "club_speed": 50.0, "k": 2e6})
    assert end(way, 0.4) == late


STEPS = [
    *((1e-4, size, "step size") for size in (0.0, -1e-6, NAN, INF, -INF)),
    *(
        (point, 1e-4, "communication point")
        for point in (0.0, 2e-4, 1.5e-4, 1.00000101e-4, 0.99999899e-4, -1e-4, NAN, INF)
    ),
]


def test_steps(any_fmu):
    way = any_fmu
    way.begin()
    undisturbed = end(way, 1e-4, 1e-4, 0.4)
    for point, size, reason in STEPS:
        way.begin()
        end(way, 1e-4)
        assert not way.step(size, point)
        assert reason in way.messages[-1]
        # A millionth of the step is allowed.
        assert way.step(1e-4, 1.00000099e-4)
        way.time = 2e-4
        assert end(way, 0.4) == undisturbed


@pytest.mark.parametrize("name", [*FMUS, *COMPANIONS])
def test_times_in_single_precision(way_of, name):
    """1,000 steps of 0.02 s, whose points lie up to 5e-7 s off the sums of steps."""
    way, size = way_of(name), 0.02
    way.begin()
    for n in range(1000):
        assert way.step(size, float(np.float32(n * size))), way.messages
    # Never more than a quarter of the step.
    way.begin(start=1e3)
    assert way.step(1e-4)
    assert not way.step(1e-4, 1e3 + 1.26e-4)
    assert way.step(1e-4, 1e3 + 1.24e-4)


def test_calls_in_the_wrong_mode(any_fmu):
    way = any_fmu
    name = {"ClubBallImpact": "k", "Swing": "impulse"}.get(
        way.slave.description.modelName, "ball_velocity"
    )
    way.begin()
    way.restore((way._initial, 0.0))
    assert not way.step(1e-4, 0.0)
    assert "before the end of initialization" in way.messages[-1]
    way.begin()
    last = end(way, 0.4)
    saved = way.save()
    way.slave.terminate()
    assert repr(fmus.get_all(way.slave)) == last
    assert not way.step(1e-4)
    assert "after the end of the run" in way.messages[-1]
    set_anyway(way, **{name: 2.0})
    assert f"{name} can't be set after the end of the run" in way.messages[-1]
    way.restore(saved)
    assert repr(fmus.get_all(way.slave)) == last


# What a user sees


@pytest.mark.parametrize("name", ["FMI 2.0", "native, FMI 3.0", "native, FMI 2.0", "BallFlight"])
def test_a_refused_start_value_is_seen(way_of, capfd, name):
    """In simulate_fmu by default, and by the logger alone with logging on; nothing otherwise."""
    slave = way_of(name).slave
    variable, value, allowed = REFUSED[slave.description.modelName][0 if name in FMUS else -2]

    def simulate(value, **options):
        given = {"start_values": {variable: value}, "stop_time": 0.01, "step_size": 1e-3}
        with suppress(FMICallException):
            fmpy.simulate_fmu(slave.unzipDirectory, **given, **options)
        return capfd.readouterr()

    seen = simulate(value)
    first = f"{variable} = {value} " if "native" not in name else f"{variable} = {value:.15g} "
    sentences = [s for s in "".join(seen).splitlines() if first in s and "steps are" not in s]
    assert len(sentences) == 1
    assert "is refused: it must be" in sentences[0]
    assert allowed in sentences[0]
    # By the host's logger, or, without one, once, though every step is refused for it.
    by_logger = "native" in name
    assert seen.err == ("" if by_logger else f"{sentences[0]}\n")
    logged = simulate(value, debug_logging=True)
    assert first in logged.out
    assert logged.err == ""
    assert "".join(simulate(0.4)) == ""


@pytest.mark.plain
def test_each_refusal_is_written_once(way_of, capfd):
    """At each communication point."""
    slave = fmus.begin(fmus.make_instance(way_of("FMI 2.0").slave.unzipDirectory))
    for point in (0.0, 1e-3):
        for _ in range(3):
            fmus.put(slave, k=-1.0)
            assert fmus.step_status(slave, point, 1e-3) == 2
        fmus.put(slave, k=1e6)
        slave.doStep(point, 1e-3)
        assert capfd.readouterr().err.count("\n") == 1
    fmus.discard(slave)


# The native FMU


def test_numbers_in_sentences(way_of):
    """As C prints them, without the C library: 15 digits where they read back equal, or 17."""
    way, numbers = way_of("native, FMI 2.0").begin(), random.Random(35)
    random_numbers = [
        numbers.choice((1.0, 1.0 + 2.0**-52)) * 10.0 ** numbers.randint(16, 300) for _ in range(20)
    ]
    edges = [2.0**70, 1.7976931348623157e308, 5e-324, 2.2250738585072014e-308, 2.0**-1022, 1e-310]
    for number in [
        1e22,
        123456.5,
        0.1 + 0.2,
        1e15,
        1e-4,
        1e-5,
        9.5,
        3.0,
        INF,
        *edges,
        *random_numbers,
    ]:
        way.messages.clear()
        way.set(k=-number)
        text = f"{-number:.15g}"
        text = text if float(text) == -number else f"{-number:.17g}"
        assert way.messages[0].startswith(f"k = {text} N/m is refused"), way.messages


def test_what_an_instantiation_refuses(way_of):
    slave, messages = way_of("native, FMI 2.0").slave, []
    guid, callbacks = slave.guid.encode(), fmus.logging_to(lambda *words: messages.append(words))

    def instantiate(kind, guid):
        messages.clear()
        return slave.fmi2Instantiate(b"two", kind, guid, b"", ctypes.byref(callbacks), 0, 0)

    for kind, given, why in (
        (1, b"wrong", f"GUID or token = wrong is refused: this FMU has {slave.guid}"),
        (1, b"", "is refused"),
        (1, None, "GUID or token = NULL is refused"),
        (7, guid, "this interface is refused: this FMU has co-simulation and Model Exchange"),
    ):
        assert instantiate(kind, given) is None
        ((status, text),) = messages
        assert status == 3
        assert why in text
    made = instantiate(1, guid)
    assert made
    assert messages == []
    with pytest.raises(FMICallException, match="error"):
        slave.fmi2SetFMUstate(made, None)
    slave.fmi2FreeInstance(made)


_DISCARD, _ERROR = (2, b"logStatusDiscard"), (3, b"logStatusError")


@pytest.mark.parametrize(
    ("kind", "categories", "sent"),
    [
        ("FMI 2.0", [], [_DISCARD, _ERROR]),
        ("FMI 2.0", [b"logStatusDiscard"], [_DISCARD]),
        ("FMI 2.0", [b"logStatusError"], [_ERROR]),
        # In native FMUs errors are always sent.
        ("native, FMI 2.0", [], [_DISCARD, _ERROR]),
        ("native, FMI 2.0", [b"logStatusDiscard"], [_DISCARD, _ERROR]),
        ("native, FMI 2.0", [b"logAll"], [_DISCARD, _ERROR]),
        ("native, FMI 2.0", [b"logStatusError"], [_ERROR]),
        ("native, FMI 2.0", [b"unknown"], [_ERROR]),
        ("native, FMI 2.0", None, [_DISCARD, _ERROR]),
    ],
)
def test_categories_of_messages(way_of, kind, categories, sent):
    """Of the messages on a discarded step and a value, with these switched on; None: none."""
    slave, seen = way_of(kind).slave, []
    callbacks = fmus.defaultCallbacks.__class__.from_buffer_copy(fmus.defaultCallbacks)
    callbacks.logger = fmus.fmi2CallbackLoggerTYPE(lambda *words: seen.append(words[2:4]))
    resources = Path(slave.unzipDirectory, "resources").as_uri().encode()
    guid, names = slave.guid.encode(), categories or []
    two = slave.fmi2Instantiate(b"two", 1, guid, resources, ctypes.byref(callbacks), 0, 1)
    slave.fmi2SetupExperiment(two, 0, 0.0, 0.0, 0, 0.0)
    slave.fmi2EnterInitializationMode(two)
    slave.fmi2ExitInitializationMode(two)
    on, array = categories is not None, (ctypes.c_char_p * len(names))(*names)
    slave.fmi2SetDebugLogging(two, on, len(names), array)
    with suppress(FMICallException):
        slave.fmi2DoStep(two, 0.0, -1.0, 1)
    reference, value = ctypes.c_uint32(0), ctypes.c_double(-1.0)
    slave.fmi2SetReal(two, ctypes.byref(reference), 1, ctypes.byref(value))
    assert seen == sent
    slave.fmi2FreeInstance(two)


@pytest.mark.parametrize("name", FMUS)
@pytest.mark.parametrize("given", [{"k": -1.0}, {"m_club": -1.0}, {"law": 1, "exponent": 2.0}])
def test_a_refused_start_value_is_logged_once(way_of, name, given):
    way = way_of(name)
    with suppress(FMICallException):
        way.begin(given)
    assert len(way.messages) == 1


def test_a_wrong_token_is_refused(way_of):
    slave = fmpy.fmi3.FMU3Slave(
        guid="wrong", unzipDirectory=way_of("native, FMI 3.0").slave.unzipDirectory,
        modelIdentifier="ClubBallImpact", instanceName="one",
    )  # fmt: skip
    with pytest.raises(Exception, match="instantiate"):
        slave.instantiate()


# Signals: of hosts that are a Python, in processes of their own

_INSTANCE = """
import collections, ctypes, os, random, signal, sys, threading, time
sys.path.insert(0, sys.argv[2])
from fmpy import extract
from fmus import begin, discard, make_instance
folder = extract(sys.argv[1])
"""

_OWN_HANDLER = """
signal.signal(signal.SIGINT, print)
slave = begin(make_instance(folder))
print(signal.getsignal(signal.SIGINT) is print)
"""

_INTERRUPTED = """
# A process in the background ignores Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)
times, ready = int(sys.argv[3]), threading.Event()

def interrupt():
    waiting = random.Random(1)
    while True:
        ready.wait()
        time.sleep(waiting.uniform(0.002, 0.006))
        ready.clear()
        os.kill(os.getpid(), signal.SIGINT)

sys.setswitchinterval(1e-4)
threading.Thread(target=interrupt, daemon=True).start()
seen = collections.Counter()
for _ in range(times):
    slave = begin(make_instance(folder))
    try:
        ready.set()
        n = 0
        while True:
            slave.doStep(n * 1e-9, 1e-9)
            slave.getReal(slave.reals)
            n += 1
    except BaseException as error:
        seen[type(error).__name__] += 1
    discard(slave)
print(dict(seen))
"""


def test_a_hosts_own_handler_stays(fmu_path):
    assert run_python(_INSTANCE + _OWN_HANDLER, fmu_path, HERE).stdout == "True\n"


@pytest.mark.parametrize("name", ["ClubBallImpact", "Swing"])
@pytest.mark.parametrize("times", repeated(10, 60, 300))
def test_ctrl_c_is_a_keyboard_interrupt(fmu_path, system_files, name, times):
    file = fmu_path if name == "ClubBallImpact" else system_files()[0]
    done = run_python(_INSTANCE + _INTERRUPTED, file, HERE, times)
    assert done.stdout == f"{{'KeyboardInterrupt': {times}}}\n", done.stderr[-2000:]
