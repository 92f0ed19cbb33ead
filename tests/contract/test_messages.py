"""Messages: what a user sees of a refusal, numbers, categories; Ctrl-C in a Python that is host."""

import ctypes
import math
import random
from contextlib import suppress

import fmpy
import fmus
import pytest
from command import run_python
from conftest import repeated
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2LastSuccessfulTime, fmi2Terminated


@pytest.mark.parametrize("name", ["FMI 2.0", "native, FMI 3.0", "native, FMI 2.0", "BallFlight"])
def test_a_refused_start_value_is_seen(way_of, capfd, name):
    """In simulate_fmu by default, and by the logger alone with logging on; nothing otherwise."""
    folder = way_of(name).slave.unzipDirectory
    variable = "m_ball" if name == "BallFlight" else "k"

    def simulate(value, **options):
        given = {"start_values": {variable: value}, "stop_time": 0.01, "step_size": 1e-3}
        with suppress(FMICallException):
            fmpy.simulate_fmu(folder, **given, **options)
        return capfd.readouterr()

    seen, first = simulate(-1.5), f"{variable} = -1.5 "
    (sentence,) = (s for s in "".join(seen).splitlines() if first in s and "steps are" not in s)
    assert "is refused: it must be" in sentence
    # By the host's logger, or, without one, once, though every step is refused for it.
    assert seen.err == ("" if "native" in name else f"{sentence}\n")
    logged = simulate(-1.5, debug_logging=True)
    assert first in logged.out
    assert logged.err == ""
    assert "".join(simulate(0.4)) == ""


@pytest.mark.plain
@pytest.mark.parametrize(("name", "variable"), [("FMI 2.0", "k"), ("BallFlight", "wind_speed")])
def test_each_refusal_is_written_once(way_of, capfd, name, variable):
    """At each communication point."""
    slave = fmus.begin(fmus.make_instance(way_of(name).slave.unzipDirectory))
    (good,) = fmus.get(slave, variable)
    for point in (0.0, 1e-3):
        for _ in range(3):
            fmus.put(slave, **{variable: -1e300})
            assert fmus.step_status(slave, point, 1e-3) == 2
        fmus.put(slave, **{variable: good})
        slave.doStep(point, 1e-3)
        assert capfd.readouterr().err.count("\n") == 1
    fmus.discard(slave)


def test_numbers_in_sentences(way_of):
    """As C prints them, without the C library: with at most 12 digits."""
    way, numbers = way_of("native, FMI 2.0").begin(), random.Random(35)
    values = [1e22, 123456.5, 0.1 + 0.2, 1e15, 1e-4, 1e-5, 9.5, 3.0, math.inf, 2.0**70, 5e-324]
    values += [1.7976931348623157e308, 2.2250738585072014e-308, 1e-310, 999999999999.75, 1e12]
    values += [numbers.uniform(1.0, 10.0) * 10.0 ** numbers.randint(-300, 300) for _ in range(20)]
    values += [math.nextafter(10.0 ** numbers.randint(-300, 300), 0.0) for _ in range(20)]
    for value in values:
        way.messages.clear()
        way.set(k=-value)
        assert way.messages[0].startswith(f"k = {-value:.12g} N/m is refused"), way.messages


def test_status_after_a_refused_step(way_of):
    """FMI 2.0: where the last accepted step ended, wherever the refused one was to begin."""
    way = way_of("native, FMI 2.0").begin(start=2.0)
    for refused in (False, True):
        assert way.step(1e-4, point=5.0 if refused else None) != refused
        assert way.slave.getRealStatus(fmi2LastSuccessfulTime) == 2.0 + 1e-4
        assert way.slave.getBooleanStatus(fmi2Terminated) == refused


def test_what_an_instantiation_refuses(way_of):
    slave, messages = way_of("native, FMI 2.0").slave, []
    guid, callbacks = slave.guid.encode(), fmus.logging_to(lambda *words: messages.append(words))

    def instantiate(kind, guid):
        messages.clear()
        return slave.fmi2Instantiate(b"two", kind, guid, b"", ctypes.byref(callbacks), 0, 0)

    for kind, given, why in (
        (1, b"wrong", f"GUID or token = wrong is refused: this FMU has {slave.guid}"),
        # A host takes the sentence for a format.
        (1, b"100%s", f"GUID or token = 100%%s is refused: this FMU has {slave.guid}"),
        (1, b"", "is refused"),
        (1, None, "GUID or token = NULL is refused"),
        (7, guid, "this interface is refused: this FMU has co-simulation and Model Exchange"),
    ):
        assert instantiate(kind, given) is None
        ((status, text, _),) = messages
        assert status == 3
        assert why in text
    made = instantiate(1, guid)
    assert made
    assert messages == []
    with pytest.raises(FMICallException, match="error"):
        slave.fmi2SetFMUstate(made, None)
    slave.fmi2FreeInstance(made)
    with pytest.raises(Exception, match="instantiate"):
        fmpy.fmi3.FMU3Slave(
            guid="wrong", unzipDirectory=way_of("native, FMI 3.0").slave.unzipDirectory,
            modelIdentifier="ClubBallImpact", instanceName="one",
        ).instantiate()  # fmt: skip


#: Of messages on a discarded step and on a value, those sent with these categories switched on;
#: None: none. In native FMUs errors always are.
SENT = {
    "FMI 2.0": (
        ([], ["Discard", "Error"]), (["logStatusDiscard"], ["Discard"]),
        (["logStatusError"], ["Error"]),
    ),
    "native, FMI 2.0": (
        ([], ["Discard", "Error"]), (["logStatusDiscard"], ["Discard", "Error"]),
        (["logAll"], ["Discard", "Error"]), (["logStatusError"], ["Error"]),
        (["unknown"], ["Error"]), (None, ["Discard", "Error"]),
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", SENT)
def test_categories_of_messages(way_of, kind):
    seen, folder = [], way_of(kind).slave.unzipDirectory
    callbacks = fmus.logging_to(lambda status, text, category: seen.append((status, category)))
    for categories, sent in SENT[kind]:
        slave = fmus.begin(fmus.make_instance(folder, loggingOn=True, callbacks=callbacks))
        slave.setDebugLogging(categories is not None, categories or [])
        assert fmus.step_status(slave, 0.0, -1.0) == 2
        fmus.put(slave, k=-1.0)
        found = [({2: "Discard", 3: "Error"}[status], of.decode()) for status, of in seen]
        assert found == [(name, f"logStatus{name}") for name in sent], categories
        fmus.discard(slave)
        seen.clear()


# Signals: of hosts that are a Python, in processes of their own

_INSTANCE = """
import collections, os, random, signal, sys, threading
from fmpy import extract
from fmus import begin, discard, make_instance, step_status
folder = extract(sys.argv[1])
"""

_ALONE = """
def made():
    slaves.append(begin(make_instance(folder)))

slaves = []
# Another thread can't set a handler, and needs none.
thread = threading.Thread(target=made)
thread.start()
thread.join()
assert len(slaves) == 1
signal.signal(signal.SIGINT, print)
made()
assert signal.getsignal(signal.SIGINT) is print
discard(*slaves)
for stderr in None, open(os.devnull, "w"):
    sys.stderr = stderr
    if stderr:
        stderr.close()
    slave = begin(make_instance(folder), k=-1.0)
    assert step_status(slave, 0.0, 1e-3) == 2
    discard(slave)
print("done")
"""

_INTERRUPTED = """
# A process in the background ignores Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.setswitchinterval(1e-4)
waiting, seen = random.Random(1), collections.Counter()
for _ in range(int(sys.argv[2])):
    slave, n = begin(make_instance(folder)), 0
    ctrl_c = threading.Timer(waiting.uniform(0.002, 0.006), os.kill, (os.getpid(), signal.SIGINT))
    try:
        ctrl_c.start()
        while True:
            slave.doStep(n * 1e-9, 1e-9)
            slave.getReal(slave.reals)
            n += 1
    except BaseException as error:
        seen[type(error).__name__] += 1
    discard(slave)
print(dict(seen))
"""


@pytest.mark.plain
def test_a_hosts_handler_and_stderr(fmu_path):
    """The handler stays, also where another thread made the first instance; stderr may lack."""
    assert run_python(_INSTANCE + _ALONE, fmu_path).stdout == "done\n"


@pytest.mark.parametrize("name", ["ClubBallImpact", "Swing"])
@pytest.mark.parametrize("times", repeated(10, 60, 300))
def test_ctrl_c_is_a_keyboard_interrupt(fmu_path, system_files, name, times):
    file = fmu_path if name == "ClubBallImpact" else system_files()[0]
    done = run_python(_INSTANCE + _INTERRUPTED, file, times)
    assert done.stdout == f"{{'KeyboardInterrupt': {times}}}\n", done.stderr[-2000:]
