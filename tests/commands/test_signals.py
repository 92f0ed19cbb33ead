"""Ctrl-C at any moment: exit 130, one line, files whole; never inside the FMU."""

import contextlib
import json
import random
import signal
import subprocess
import sys
import time

import pytest
from command import golf_started, run_python

STOPPED = "Stopped; nothing half-written is left."

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="POSIX's signals")


@pytest.mark.parametrize("times", [5, pytest.param(200, marks=pytest.mark.nightly)])
def test_a_run_stopped_at_any_moment(tmp_path, times):
    """Each of its files is whole, of this run or of an earlier one."""
    rng, codes = random.Random(1), []
    for n in range(times):
        k = 5e5 + 1e3 * n
        process = golf_started("run", "--set", f"k={k}", "--out", tmp_path)
        # Python itself has started then.
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(rng.uniform(0.15, 1.2))
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        codes.append(process.returncode)
        assert process.returncode in (130, 0), errors
        assert (STOPPED in errors) == (process.returncode == 130), errors
        assert "Traceback" not in errors
        for file in tmp_path.iterdir():
            text = file.read_bytes()
            if file.suffix == ".json":
                assert set(json.loads(text)) == {"custom"}
            elif file.suffix == ".html":
                assert text.endswith(b"</html>")
            elif file.suffix == ".png":
                assert text.endswith(b"IEND\xaeB`\x82")
            else:
                assert file.suffix == ".csv"
                assert text.endswith(b"\n")
    assert 130 in codes


def test_inside_the_fmu():
    """The exception is raised in the host: pythonfmu would make it fatal, and the process crash."""
    code = """
import os, signal, sys
from golf_impact import Impact
with Impact() as impact:
    impact.start()
    *_, name = (name for name in sys.modules if name.endswith(".component.component"))
    def interrupt(frame, event, argument):
        if event == "call" and frame.f_globals.get("__name__") == name:
            sys.setprofile(None)
            os.kill(os.getpid(), signal.SIGINT)
    sys.setprofile(interrupt)
    try:
        for _ in range(10_000):
            impact()
    except KeyboardInterrupt:
        print("interrupted", impact()["smash_factor"])
"""
    done = run_python(
        code, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler)
    )
    assert done.stdout == "interrupted 1.5641431548673967\n"
    assert done.stderr in ("", done.stderr if "Built" in done.stderr else "")


def test_a_file_that_is_not_finished_keeps_the_earlier_one(tmp_path, monkeypatch):
    import os

    from golf_impact.files import write

    file = write(tmp_path / "a.json", "1")

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write(file, "2")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["1"]


def test_a_command_ends_soon_after_the_signal(tmp_path):
    process = golf_started("run", "--out", tmp_path)
    time.sleep(1.0)
    begin = time.monotonic()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert time.monotonic() - begin < 10.0
