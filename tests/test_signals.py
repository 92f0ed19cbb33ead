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
from command import golf_started, run_python

STOPPED = "Stopped; nothing half-written is left."

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc")


def begin(arguments, temporary, cwd):
    """The command in a process of its own, as soon as it handles signals."""
    env = {**os.environ, "TMPDIR": str(temporary)}
    process = golf_started(*arguments, cwd=cwd, env=env)
    while process.poll() is None and not handles_sigterm(process.pid):
        time.sleep(0.001)
    return process


def handles_sigterm(pid):
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("SigCgt"):
                return bool(int(line.split()[1], 16) >> (signal.SIGTERM - 1) & 1)
    return False


def stop(arguments, delay, number, temporary, cwd):
    """Send a signal after a delay. Returns 130, or 0 or 1 if the command was faster."""
    process = begin(arguments, temporary, cwd)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(delay)
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert "Traceback" not in errors
    assert "Exception" not in errors
    assert process.returncode in (130, 0, 1), errors
    assert (STOPPED in errors) == (process.returncode == 130)
    assert list(temporary.iterdir()) == []
    return process.returncode


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()} if folder.exists() else {}


@pytest.mark.parametrize(
    ("times", "longest", "least"),
    [(5, 1.0, 1), pytest.param(200, 2.0, 20, marks=pytest.mark.nightly)],
)
def test_a_run_stopped_at_any_moment(tmp_path, times, longest, least):
    """Its files are all there or none: they name its k, and those of earlier runs stay."""
    temporary, out = tmp_path / "temporary", tmp_path / "out"
    temporary.mkdir()
    rng, codes, before = random.Random(1), [], {}
    for n in range(times):
        k = 5e5 + 1e3 * n
        arguments = ("run", "--set", f"k={k}", "--out", out)
        number, delay = rng.choice([signal.SIGINT, signal.SIGTERM]), rng.uniform(0.0, longest)
        codes.append(stop(arguments, delay, number, temporary, tmp_path))
        files = content(out)
        if files != before:
            ends = (".csv", "_force.png", "_results.json", "_report.html")
            own = {f"custom_k={k:.0f}{end}" for end in ends}
            assert set(files) == set(before) | own
            assert not own & set(before)
            assert f"k = {k:g} N/m" in files[f"custom_k={k:.0f}_report.html"].decode()
        before = files
    assert codes.count(130) >= least


def test_inside_the_fmu(tmp_path):
    """No exception: pythonfmu would make it fatal, and then the process crashes."""
    code = """
import os, signal, sys
from golf_impact import stopping
stopping.listen()
scratch = stopping.scratch_folder()
scratch.__enter__()
from golf_impact.fmu.file import current_fmu
from loaded import ImpactFmu
with ImpactFmu(current_fmu()[0]) as fmu:
    fmu.start()
    name = next(name for name in sys.modules if name.endswith(".component.component"))
    def interrupt(frame, event, argument):
        if event == "call" and frame.f_globals.get("__name__") == name:
            sys.setprofile(None)
            os.kill(os.getpid(), signal.{signal})
    sys.setprofile(interrupt)
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
