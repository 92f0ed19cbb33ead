"""Any order of FMI calls: no crash, and never a wrong number afterwards.

A hypothesis state machine, `call_order.py`, makes the calls in a process of its own; the C host
then makes those of FMI 2.0 again. What no FMU can prevent is left out, since pythonfmu's C layer
doesn't survive it:
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

# Examples, rules of each, and seed. The same sequences every time, more of them in CI; 100,200 new
# ones at night, of the impact: long ones (some 1300 calls), where errors pile up, and more short
# ones. The last number makes each run another one to pytest.
LONG, SHORT = 60, 20
RUNS = [
    pytest.param((12, LONG, 1, 0), id="few"),
    pytest.param((100, LONG, 1, 0), id="ci", marks=pytest.mark.ci),
]
for n in range(334):
    sizes = (300, LONG if n < 100 else SHORT, 0, n)
    RUNS.append(pytest.param(sizes, id=f"night{n}", marks=pytest.mark.nightly))


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """A function that runs the state machine, which must not fail: its calls and results."""

    def played(folder, examples, steps, seed):
        file = tmp_path_factory.mktemp("trace") / "trace"
        script = HERE / "contract" / "call_order.py"
        command = sys.executable, "-X", "faulthandler", script, folder, file, examples, steps, seed
        env = os.environ | {"PYTHONPATH": str(HERE)}
        done = run(*command, env=env, code=None, timeout=None)
        text = file.read_text()
        if done.returncode < 0 or done.returncode > 128:
            _, _, last = text.rpartition("fill new-sequence")
            pytest.fail(f"crashed ({done.returncode}) in the last of these calls:{last}")
        assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-12000:]
        counts = json.loads(done.stdout.splitlines()[-1])
        # Enough happened.
        assert counts["accepted steps"] > examples * steps / 10
        assert counts["refused steps"] > examples * steps / 10
        assert counts["comparisons"] > examples * steps / 40
        print(counts)
        file.unlink()
        # OK, Discard, and Error, perhaps for calls that aren't supported alone; never Fatal.
        assert {line.split()[1] for line in text.splitlines() if line.startswith("=")} <= {*"023"}
        return text

    return played


@pytest.mark.parametrize("examples", [10, pytest.param(100, marks=pytest.mark.ci)])
def test_every_order_of_calls(any_fmu, played, examples):
    """By the same rules: what is refused in one FMU is refused in the others."""
    slow = any_fmu.slave.description.modelName == "Swing"
    played(any_fmu.slave.unzipDirectory, examples // 2 if slow else examples, 40, 1)


@pytest.fixture(scope="module", params=RUNS)
def trace(request, extracted, played):
    return played(extracted, *request.param[:3])


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
    for call, result, wanted in zip(calls, results, expected, strict=True):
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
