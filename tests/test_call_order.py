"""Any order of FMI calls: no crash, and never a wrong number afterwards.

A hypothesis state machine makes the calls in a process of its own; the C host then makes the same
calls again. What pythonfmu's C layer itself can't survive is left out, no FMU has a say in it:
- NULL as component, instance name or resource folder; NULL as state to restore or serialize;
- a component or state that was freed, a state freed twice, a buffer longer than the state;
- a string that isn't UTF-8, or a folder of resources that isn't there;
- anything after Fatal: FMI forbids it, and the Python objects are gone by then. In a host that is
  Python itself, Ctrl-C in the middle of a call is Fatal: KeyboardInterrupt is an exception too.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

HERE = Path(__file__).resolve().parent
MACHINE = HERE / "call_order_machine.py"


def last_sequence(trace):
    """The calls of the sequence that a trace ends in."""
    calls = [line for line in trace.splitlines() if not line.startswith("=")]
    begins = [n for n, line in enumerate(calls) if line.startswith("fill new-sequence")]
    return calls[begins[-1] + 1 :] if begins else calls


# The same sequences every time, more of them in CI; 100,000 new ones (seed 0) at night, in runs of
# 300: long ones of 60 rules (some 1300 calls), where errors pile up, and more short ones of 20. The
# number makes each run another one to pytest.
LONG, SHORT, LONG_NIGHTS, NIGHTS = 60, 20, 100, 334
RUNS = [
    pytest.param((0, 1, 20, LONG), id="few"),
    pytest.param((0, 1, 100, LONG), id="ci", marks=pytest.mark.ci),
    *(
        pytest.param(
            (n, 0, 300, LONG if n < LONG_NIGHTS else SHORT),
            id=f"night{n}",
            marks=pytest.mark.nightly,
        )
        for n in range(NIGHTS)
    ),
]


@pytest.fixture(scope="module", params=RUNS)
def trace(request, extracted, tmp_path_factory):
    """The calls and answers of a run of the state machine, which must not fail."""
    _, seed, examples, steps = request.param
    file = tmp_path_factory.mktemp("trace") / "trace"
    arguments = [extracted, file, examples, steps, seed]
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", MACHINE, *map(str, arguments)],
        env=os.environ | {"PYTHONPATH": str(HERE)},
        capture_output=True,
        text=True,
    )
    text = file.read_text()
    if done.returncode < 0 or done.returncode > 128:
        calls = "\n".join(last_sequence(text))
        pytest.fail(f"crashed ({done.returncode}) in the last of these calls:\n{calls}")
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-12000:]
    counts = json.loads(done.stdout.splitlines()[-1])
    # The machine really got somewhere.
    assert counts["accepted steps"] > examples * steps / 6
    assert counts["refused steps"] > examples * steps / 6
    assert counts["comparisons"] > examples * steps / 12
    print(counts)
    yield text
    file.unlink()


def test_every_order_of_calls(trace):
    statuses = {line.split()[1] for line in trace.splitlines() if line.startswith("=")}
    # OK, Discard, and Error for calls that pythonfmu doesn't support; never Fatal.
    assert statuses == {"0", "2", "3"}


def test_a_c_host_gets_the_same_answers(trace, extracted, libpython, compiled):
    lines = trace.splitlines()
    calls = [line for line in lines if not line.startswith("=")]
    expected = [numbers(line[2:]) for line in lines if line.startswith("=")]
    done = subprocess.run(
        [compiled("replay"), extracted, fmpy.read_model_description(extracted).guid],
        input="\n".join(calls) + "\n",
        env={"PATH": os.defpath, "LD_PRELOAD": str(libpython)},
        capture_output=True,
        text=True,
    )
    *answers, last = done.stdout.splitlines() or [""]
    if done.returncode != 0:
        pytest.fail(
            f"the host ended with {done.returncode} in {calls[len(answers)]}: {done.stderr}"
        )
    assert last == "done"
    assert len(answers) == len(expected)
    for call, answer, wanted in zip(calls, answers, expected):
        assert numbers(answer) == wanted, call


def numbers(line):
    """An answer with its numbers written in one way: C and Python write other zeros."""
    return [float.fromhex(w).hex() if "0x" in w else w.replace("-nan", "nan") for w in line.split()]


def test_the_trace_of_a_crash_is_its_sequence():
    trace = "new fresh\n= 0\nfill new-sequence \n= 0\nnew 0\n= 0\nstep 0 0x0p+0 0x1p-10\n"
    assert last_sequence(trace) == ["new 0", "step 0 0x0p+0 0x1p-10"]


def test_the_comparison_can_fail(extracted):
    """Driven by other calls than the accepted ones, the fresh instance shows it."""
    from call_order import Session

    session = Session(extracted)
    session.new("0")
    session.setup("0", 0.0)
    session.enter("0")
    session.exit("0")
    session.step("0", 0.0, 1e-4)
    session.compare("0")
    model = session.models["0"]
    model.steps = (*model.steps[:-1], (0.0, 1.0000000000000002e-4, model.steps[-1][2], False))
    with pytest.raises(AssertionError, match="force"):
        session.compare("0")
    session.clear()
