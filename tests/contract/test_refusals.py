"""Messages to hosts and recovery: refused values, refused calls, damaged states, Ctrl-C."""

import ctypes
import json
from contextlib import contextmanager, nullcontext
from random import Random

import fmpy
import pytest
from command import run_python
from conftest import HERE, repeated, some
from fmpy.fmi1 import FMICallException
from fmus import begin, discard, logging_to, make_instance, mutated, put, with_checksum


@pytest.fixture(scope="module")
def fmus(fmu_path, fmi3_path, request, system_files):
    """Every FMU; ClubBallImpact plain, or native with --native."""
    *companions, _ = system_files()
    named = {file.name.split(".")[0]: file for file in companions}
    return {"fmi2": fmu_path, "fmi3": fmi3_path, **named}


BAD = {
    "fmi2": ("k", -1.0, "> 0"),
    "fmi3": ("k", -1.0, "> 0"),
    "Swing": ("club_mass", -1.0, "1e-06 to 1000"),
    "Launch": ("friction", -1.0, "0 to 1e+09"),
    "BallFlight": ("m_ball", 0.0, "1e-06 to 1000"),
}


# Refused values


def simulate(fmu, start, **options):
    """What `simulate_fmu` prints, on stdout and on stderr, and the exception if there is one."""
    program = """
import fmpy, json, sys
fmu, start, options = json.loads(sys.argv[1])
try:
    fmpy.simulate_fmu(fmu, start_values=start, stop_time=0.01, step_size=1e-3, **options)
except Exception as error:
    print(error)
"""
    given = json.dumps([str(fmu), start, options])
    done = run_python(program, given)
    return done.stdout, done.stderr


@pytest.mark.parametrize("name", some(3, ["fmi2", "Swing", "fmi3", "Launch", "BallFlight"]))
def test_a_refused_start_value_is_seen(fmus, request, is_native, name):
    """By default, and with logging on by the logger alone; nothing about accepted values."""
    variable, value, allowed = BAD[name]
    out, err = simulate(fmus[name], {variable: value})
    (seen,) = {line for line in (out + err).splitlines() if f"{variable} = {value} " in line} - {
        line for line in out.splitlines() if "steps are refused" in line
    }
    assert "is refused: it must be" in seen
    assert allowed in seen
    if request.config.getoption("--native") and name in ("fmi2", "fmi3"):
        # By the host's logger, and the run ends there.
        assert "ExitInitializationMode failed with status 3 (error)" in out
        assert err == ""
    elif name == "fmi3":
        # pythonfmu3 forwards errors even if logging is off.
        assert err == ""
    else:
        # Once, though every step is refused for it.
        assert (out, err) == ("", f"{fmus[name].stem}: {seen.partition(': ')[2]}\n")
    out, err = simulate(fmus[name], {variable: value}, debug_logging=True)
    assert f"{variable} = {value}" in out
    assert err == ""
    assert simulate(fmus[name], {variable: 0.4}) == ("", "")


@pytest.mark.plain
@pytest.mark.parametrize(
    ("fmu", "name", "bad", "good"), [("fmi2", "k", -1.0, 1e6), ("BallFlight", "backspin", 1e9, 0.0)]
)
def test_each_refusal_is_written_once(fmus, capfd, fmu, name, bad, good):
    """At each communication point."""
    with instance(fmus[fmu]) as slave:
        for point in (0.0, 1e-3):
            for _ in range(3):
                put(slave, **{name: bad})
                with pytest.raises(FMICallException):
                    slave.doStep(point, 1e-3)
            put(slave, **{name: good})
            slave.doStep(point, 1e-3)
            assert capfd.readouterr().err.count("\n") == 1


@contextmanager
def instance(fmu, **values):
    """An initialized instance."""
    slave = begin(make_instance(fmpy.extract(str(fmu))), **values)
    yield slave
    discard(slave)


# States of companions

_SEPARATED = {"separated": True, "ball_velocity": 50.0}
_SPEEDS = {"club_velocity": 24.0, "smash_factor": 50.0 / 35.0, "coefficient_of_restitution": 0.74}
RUNS = {"Swing": {}, "Launch": _SEPARATED | _SPEEDS, "BallFlight": _SEPARATED}


@pytest.mark.parametrize("name", RUNS)
def test_a_damaged_state_is_refused_and_has_no_effect(fmus, name):
    with instance(fmus[name], **RUNS[name]) as slave, instance(fmus[name]) as other:
        for n in range(900):
            slave.doStep(n * 1e-3, 1e-3)
        state = slave.getFMUstate()
        whole = bytes(slave.serializeFMUstate(state))
        damaged = [
            bytes([*whole[:n], whole[n] ^ 1 << n % 8, *whole[n + 1 :]])
            for n in range(0, len(whole), 7)
        ]
        longer = whole.replace(b"]", b", 1.0]", 1)
        assert longer != whole
        for data in (*damaged, longer, b"", b"{}", b"[1]", whole[:-1], whole + b" "):
            bad = other.deSerializeFMUstate(data)
            other.setFMUstate(bad)
            other.freeFMUstate(bad)
            with pytest.raises(FMICallException):
                other.doStep(0.0, 1e-3)
        other.doStep(0.0, 1e-3)
        copy = other.deSerializeFMUstate(whole)
        other.setFMUstate(copy)
        for one in (slave, other):
            one.doStep(0.9, 1e-3)
        assert slave.getReal(slave.reals) == other.getReal(slave.reals)
        slave.freeFMUstate(state)
        other.freeFMUstate(copy)


def step_status(slave):
    try:
        slave.doStep(0.9, 1e-3)
    except FMICallException as error:
        return error.status
    return fmpy.fmi2.fmi2OK


@pytest.mark.parametrize("name", RUNS)
def test_a_state_of_another_content_is_never_fatal(fmus, name):
    random = Random(name)
    with instance(fmus[name], **RUNS[name]) as slave:
        for n in range(900):
            slave.doStep(n * 1e-3, 1e-3)
        whole = bytes(slave.serializeFMUstate(slave.getFMUstate()))
        for data in [with_checksum(b"[" * 100_000), *(mutated(random, whole) for _ in range(200))]:
            state = slave.deSerializeFMUstate(data)
            slave.setFMUstate(state)
            slave.freeFMUstate(state)
            assert step_status(slave) in (fmpy.fmi2.fmi2OK, fmpy.fmi2.fmi2Discard)
            slave.getReal(slave.reals)


@pytest.mark.parametrize("name", ["BallFlight", "fmi2"])
def test_a_state_of_another_fmu_is_refused(fmus, is_native, name):
    with instance(fmus["Swing"]) as swing, instance(fmus[name]) as other:
        state = swing.getFMUstate()
        with pytest.raises(FMICallException) if is_native and name == "fmi2" else nullcontext():
            other.setFMUstate(state)
        with pytest.raises(FMICallException):
            other.doStep(0.0, 1e-3)
        other.doStep(0.0, 1e-3)
        swing.freeFMUstate(state)


# The native FMU


@pytest.fixture
def loaded(native_path):
    """An instance of the native FMU."""
    with instance(native_path) as slave:
        yield slave


def instantiate(slave, kind, guid):
    messages = []
    slave.kept = callbacks = logging_to(lambda *words: messages.append(words))
    made = slave.fmi2Instantiate(b"two", kind, guid, b"", ctypes.byref(callbacks), 0, 0)
    return made, messages


def test_what_an_instantiation_refuses(loaded):
    guid = loaded.guid.encode()
    for kind, given, why in (
        (1, b"wrong", f"GUID or token = wrong is refused: this FMU has {loaded.guid}"),
        (1, b"", "is refused"),
        (1, None, "GUID or token = NULL is refused"),
        (0, guid, "this FMU has co-simulation only"),
    ):
        made, ((status, text),) = instantiate(loaded, kind, given)
        assert (made, status) == (None, 3)
        assert why in text
    made, messages = instantiate(loaded, 1, guid)
    assert made
    assert messages == []
    with pytest.raises(FMICallException, match="error"):
        loaded.fmi2SetFMUstate(made, None)
    loaded.fmi2FreeInstance(made)


def test_a_wrong_token_is_refused(native_fmi3_path):
    folder = fmpy.extract(str(native_fmi3_path))
    slave = fmpy.fmi3.FMU3Slave(
        guid="wrong", unzipDirectory=folder, modelIdentifier="ClubBallImpact", instanceName="one"
    )
    with pytest.raises(Exception, match="instantiate"):
        slave.instantiate()


def test_a_host_that_traps_nan(native_path):
    """A comparison with NaN would be SIGFPE; flushed to 0, small numbers would be others."""
    program = """
import ctypes, os, sys
sys.path.insert(0, sys.argv[2])
from test_refusals import instance
with instance(sys.argv[1]) as slave:
    libm = ctypes.CDLL("libm.so.6")
    nan = (ctypes.c_double * 1)(float("nan"))
    references = (ctypes.c_uint * 1)(0)
    libm.feenableexcept(1)
    slave.fmi2SetReal(slave.component, references, 1, nan)
    trapping = libm.fegetexcept()
    libm.fedisableexcept(1)
    print(trapping)
"""
    done = run_python(program, native_path, HERE / "contract")
    assert done.stdout.splitlines()[-1] == "1"


# Ctrl-C in a host that is a Python

_INTERRUPTED = """
import collections, os, random, signal, sys, threading, time
sys.path.insert(0, sys.argv[2])
from test_refusals import instance
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
    with instance(sys.argv[1]) as slave:
        try:
            ready.set()
            n = 0
            while True:
                slave.doStep(n * 1e-9, 1e-9)
                slave.getReal(slave.reals)
                n += 1
        except BaseException as error:
            seen[type(error).__name__] += 1
print(dict(seen))
"""


@pytest.mark.parametrize("name", ["fmi2", "Swing"])
@pytest.mark.parametrize("times", repeated(20, 60, 300))
def test_ctrl_c_is_a_keyboard_interrupt(fmus, name, times):
    done = run_python(_INTERRUPTED, fmus[name], HERE / "contract", times)
    assert done.stdout == f"{{'KeyboardInterrupt': {times}}}\n", done.stderr[-2000:]


def test_a_hosts_own_handler_stays(fmus):
    program = """
import signal, sys
sys.path.insert(0, sys.argv[2])
from test_refusals import instance
signal.signal(signal.SIGINT, print)
with instance(sys.argv[1]) as slave:
    assert signal.getsignal(signal.SIGINT) is print
"""
    run_python(program, fmus["fmi2"], HERE / "contract")
