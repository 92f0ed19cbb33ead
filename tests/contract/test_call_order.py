"""Any order of FMI calls: no crash, and never a wrong number afterwards.

A hypothesis state machine makes the calls in a process of its own; the C host then makes the same
calls again. What no FMU can prevent is left out, since pythonfmu's C layer doesn't survive it:
- NULL as component, instance name or resource folder; NULL as state to restore or serialize;
- a component or state that was freed, a state freed twice, a buffer longer than the state;
- a string that isn't UTF-8, or a folder of resources that isn't there;
- anything after Fatal: FMI forbids it, and the Python objects are gone by then.
"""

import json
import os
import sys

import fmpy
import pytest
from call_order import Session
from command import run
from conftest import HERE

MACHINE = HERE / "contract" / "call_order_machine.py"

# Examples, rules of each, and seed. The same sequences every time, more of them in CI; 100,200 new
# ones at night: long ones (some 1300 calls), where errors pile up, and more short ones. The last
# number makes each run another one to pytest.
LONG, SHORT = 60, 20
RUNS = [
    pytest.param((20, LONG, 1, 0), id="few"),
    pytest.param((100, LONG, 1, 0), id="ci", marks=pytest.mark.ci),
]
for n in range(334):
    sizes = (300, LONG if n < 100 else SHORT, 0, n)
    RUNS.append(pytest.param(sizes, id=f"night{n}", marks=pytest.mark.nightly))


@pytest.fixture(scope="module", params=RUNS)
def trace(request, extracted, tmp_path_factory):
    """The calls and results of a run of the state machine, which must not fail."""
    return played(extracted, tmp_path_factory, *request.param[:3])


def played(extracted, tmp_path_factory, examples, steps, seed):
    file = tmp_path_factory.mktemp("trace") / "trace"
    arguments = extracted, file, examples, steps, seed
    command = sys.executable, "-X", "faulthandler", MACHINE, *arguments
    env = os.environ | {"PYTHONPATH": str(HERE)}
    done = run(*command, env=env, code=None, timeout=None)
    text = file.read_text()
    if done.returncode < 0 or done.returncode > 128:
        _, _, last = text.rpartition("fill new-sequence")
        pytest.fail(f"crashed ({done.returncode}) in the last of these calls:{last}")
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-12000:]
    counts = json.loads(done.stdout.splitlines()[-1])
    # Enough happened.
    assert counts["accepted steps"] > examples * steps / 6
    assert counts["refused steps"] > examples * steps / 6
    assert counts["comparisons"] > examples * steps / 20
    print(counts)
    file.unlink()
    return text


def test_every_order_of_calls(trace):
    statuses = {line.split()[1] for line in trace.splitlines() if line.startswith("=")}
    # OK, Discard, and Error for calls that pythonfmu doesn't support; never Fatal.
    assert statuses == {"0", "2", "3"}


@pytest.mark.parametrize("examples", [8, pytest.param(100, marks=pytest.mark.ci)])
@pytest.mark.parametrize("name", ["Swing", "Launch", "BallFlight"])
def test_every_order_of_calls_to_a_companion(name, examples, files, tmp_path_factory):
    """By the same rules: what is refused in one FMU is refused in the others."""
    (file,) = (file for file in files if file.stem == name)
    folder = fmpy.extract(str(file), str(tmp_path_factory.mktemp(name)))
    trace = played(folder, tmp_path_factory, examples, 40, 1)
    assert {line.split()[1] for line in trace.splitlines() if line.startswith("=")} == {
        "0", "2", "3",
    }  # fmt: skip


def test_a_c_host_gets_the_same_results(trace, extracted, libpython, compiled):
    lines = trace.splitlines()
    calls = [line for line in lines if not line.startswith("=")]
    expected = [in_one_notation(line[2:]) for line in lines if line.startswith("=")]
    command = compiled("replay"), extracted, fmpy.read_model_description(extracted).guid
    env = {"PATH": os.defpath, "LD_PRELOAD": str(libpython)}
    done = run(*command, input="\n".join(calls) + "\n", env=env, code=None, timeout=None)
    *results, last = done.stdout.splitlines() or [""]
    if done.returncode != 0:
        pytest.fail(f"the host ended ({done.returncode}) in {calls[len(results)]}: {done.stderr}")
    assert last == "done"
    assert len(results) == len(expected)
    for call, result, wanted in zip(calls, results, expected):
        assert in_one_notation(result) == wanted, call


def in_one_notation(line):
    """A result with its numbers as Python writes them; C writes other zeros and NaNs."""
    return [float.fromhex(w).hex() if "0x" in w else w.replace("-nan", "nan") for w in line.split()]


def test_the_comparison_can_fail(extracted):
    """A fresh instance that is driven by other calls than the accepted ones deviates."""
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
