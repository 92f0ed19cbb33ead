"""Ctrl-C and SIGTERM at any moment: exit 130, files whole and of one run, nothing left over."""

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command import COMMAND, run_python

STOPPED = "Stopped; nothing half-written is left."

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc")


def begun(arguments, temporary, cwd):
    """The command in a process of its own, as soon as it answers signals."""
    process = subprocess.Popen(
        [COMMAND, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=cwd,
        env={**os.environ, "TMPDIR": str(temporary)},
        # A test run in the background ignores Ctrl-C, and so would its children.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    while process.poll() is None and not answers(process.pid):
        time.sleep(0.001)
    return process


def answers(pid):
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("SigCgt"):
                return bool(int(line.split()[1], 16) >> (signal.SIGTERM - 1) & 1)
    return False


def stopped(arguments, delay, number, temporary, cwd):
    """Send a signal after a delay. Returns 130, or 0 or 1 if the command was faster."""
    process = begun(arguments, temporary, cwd)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(delay)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert "Traceback" not in said
    assert "Exception" not in said
    assert process.returncode in (130, 0, 1), said
    assert (STOPPED in said) == (process.returncode == 130)
    assert list(temporary.iterdir()) == []
    return process.returncode


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()} if folder.exists() else {}


def attack(tmp_path, times, seed, longest, arguments_of, allowed):
    """Stop a command so many times; in its folder there is always one of what is allowed."""
    temporary, out = tmp_path / "temporary", tmp_path / "out"
    temporary.mkdir()
    codes = []
    rng = random.Random(seed)
    for n in range(times):
        number = rng.choice([signal.SIGINT, signal.SIGTERM])
        delay = rng.uniform(0.0, longest)
        codes.append(stopped(arguments_of(n, out), delay, number, temporary, tmp_path))
        allowed(n, content(out))
    return codes


def run_of(n, out):
    """Runs whose results differ from each to the next."""
    return ("run", "--set", f"k={5e5 + 1e3 * n}", "--out", out)


def attack_run(tmp_path, times, longest):
    """The files of one run, all of them: they all name the same k, and agree with each other."""
    before = {}

    def whole(n, files):
        nonlocal before
        if files != before:
            k = 5e5 + 1e3 * n
            ends = (".csv", "_force.png", "_results.json", "_report.html")
            own = {f"custom_k={k:.0f}{end}" for end in ends}
            assert set(files) == set(before) | own
            assert not own & set(before)
            assert f"k = {k:g} N/m" in files[f"custom_k={k:.0f}_report.html"].decode()
        before = files

    return attack(tmp_path, times, 1, longest, run_of, whole)


def attack_build(tmp_path, times, longest):
    expected = tmp_path / "expected"
    subprocess.run([COMMAND, "build", "--out", expected / "x.fmu"], check=True, capture_output=True)
    right = content(expected)

    def build(n, out):
        out.mkdir(exist_ok=True)
        for file in out.iterdir():
            file.unlink()
        out.joinpath("x.fmu").write_bytes(b"old")
        return "build", "--out", out / "x.fmu"

    def whole(n, files):
        assert files in ({"x.fmu": b"old"}, right)

    return attack(tmp_path, times, 2, longest, build, whole)


def attack_bench(tmp_path, times, longest):
    def whole(n, files):
        assert set(files) in (set(), {"bench.json", "run_time_vs_error.png"})

    return attack(
        tmp_path, times, 3, longest, lambda n, out: ("bench", "--quick", "--out", out), whole
    )


@pytest.mark.parametrize(
    ("attacked", "times", "longest", "least"),
    [
        (attack_run, 5, 1.0, 1),
        pytest.param(attack_build, 3, 0.8, 0, marks=pytest.mark.ci),
        pytest.param(attack_bench, 2, 2.0, 2, marks=pytest.mark.ci),
        pytest.param(attack_run, 200, 2.0, 20, marks=pytest.mark.nightly),
        pytest.param(attack_build, 100, 1.2, 20, marks=pytest.mark.nightly),
        pytest.param(attack_bench, 20, 10.0, 10, marks=pytest.mark.nightly),
    ],
)
def test_a_command_stopped_at_any_moment(tmp_path, attacked, times, longest, least):
    assert attacked(tmp_path, times, longest).count(130) >= least


def test_inside_the_fmu(tmp_path):
    """In an exception's place: pythonfmu would make it fatal, and then the process crashes."""
    code = """
import os, signal, sys
from golf_impact import stopping
stopping.listen()
scratch = stopping.scratch_folder()
scratch.__enter__()
from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.impact_fmu import ImpactFmu
with ImpactFmu(current_fmu()[0]) as fmu:
    fmu.start()
    name = next(name for name in sys.modules if name.endswith(".component.component"))
    def look(frame, event, argument):
        if event == "call" and frame.f_globals.get("__name__") == name:
            sys.setprofile(None)
            os.kill(os.getpid(), signal.{signal})
    sys.setprofile(look)
    for _ in range(1000):
        fmu.impact()
print("not stopped")
"""
    for name in ("SIGINT", "SIGTERM"):
        done = run_python(
            code.replace("{signal}", name),
            code=130,
            env={**os.environ, "TMPDIR": str(tmp_path)},
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )
        assert done.stdout == ""
        assert done.stderr == f"{STOPPED}\n"
        assert list(tmp_path.iterdir()) == []


def test_held_back_while_a_file_is_written(tmp_path):
    code = """
import os, signal, sys, pathlib
from golf_impact import stopping
from golf_impact import files
stopping.listen()
replace = os.replace
def late(*names):
    os.kill(os.getpid(), signal.SIGTERM)
    replace(*names)
os.replace = late
files.write_together(pathlib.Path(sys.argv[1]), {"a": b"1", "b": b"2"})
print("not stopped")
"""
    done = run_python(code, tmp_path / "out", code=130)
    assert done.stdout == ""
    assert content(tmp_path / "out") == {"a": b"1", "b": b"2"}
