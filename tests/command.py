"""Processes; calls of golf-impact in a separate one, or in this one in a tenth of the time."""

import io
import os
import shlex
import shutil
import signal
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from types import SimpleNamespace

from golf_impact.commands import app

ROOT = Path(__file__).resolve().parent.parent
#: All documents of a checkout, but for the changelog.
DOCUMENTS = (
    *(ROOT / name for name in ("README.md", ".github/CONTRIBUTING.md", "build/README.md")),
    *(p for name in ("fmu_src", "scenarios", "tests") for p in (ROOT / name).rglob("README.md")),
)
COMMAND = Path(sys.executable).with_name("golf-impact")


def checkout(folder):
    """A copy of the checkout without built files, and the environment that runs it."""
    ignored = shutil.ignore_patterns("__pycache__", "*.fmu", "*.ssp")
    for name in (parts := ("scenarios", "build", "fmu_src")):
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    shutil.copy(ROOT / "LICENSE", folder)
    return {"PYTHONPATH": os.pathsep.join(str(folder / name) for name in parts)}


def ended(done, code):
    """Assert this exit code, unless it is None; returns what ended."""
    assert code in (None, done.returncode), (done.returncode, done.stdout[-2000:], done.stderr)
    return done


def run(*command, code=0, timeout=100, **options):
    """Run a process that must end with this exit code; None: with any."""
    words = list(map(str, command))
    done = subprocess.run(words, capture_output=True, text=True, timeout=timeout, **options)
    return ended(done, code)


def outputs(*command, **options):
    """Run a C host; the values that it prints."""
    return printed_values(run(*command, **options))


def printed_values(done):
    """The values that a C host has printed, by name, before the line "done"."""
    # libcosim writes its log there, too.
    printed = done.stdout.splitlines()
    *lines, last = (line for line in printed if not line.startswith("["))
    assert last == "done"
    return {name: float(value) for name, value in map(str.split, lines)}


def run_python(program, *arguments, **options):
    """Run a Python program, given as text, that may import from tests/; see `run`."""
    env = options.pop("env", None) or os.environ
    path = [str(ROOT / "tests"), *filter(None, [env.get("PYTHONPATH")])]
    env = env | {"PYTHONPATH": os.pathsep.join(path)}
    return run(sys.executable, "-c", program, *arguments, env=env, **options)


def golf(*arguments, env=None, program=(COMMAND,), code=None, **options):
    """Run the command as a user does, in a subprocess; it must end with this exit code, if any."""
    options = {"timeout": None, "env": {**os.environ, **(env or {})}, **options}
    return run(*program, *arguments, code=code, **options)


def interruptible():
    """In a process that begins: a test run in the background ignores Ctrl-C, as its children do."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def golf_here(*arguments, cwd=None, code=None):
    """Run the command in this process; arguments and results as those of `golf`."""
    out, err, before = io.StringIO(), io.StringIO(), Path.cwd()
    try:
        os.chdir(cwd or before)
        with redirect_stdout(out), redirect_stderr(err):
            ended_with = app.one_line([str(argument) for argument in arguments])
    finally:
        os.chdir(before)
    done = SimpleNamespace(returncode=ended_with, stdout=out.getvalue(), stderr=err.getvalue())
    return ended(done, code)


def refused(done, *words):
    """Assert exit code 2 and one line on stderr with these words (after "Built …", if any)."""
    assert done.returncode == 2, (done.returncode, done.stderr)
    (line,) = (line for line in done.stderr.splitlines() if not line.startswith("Built "))
    assert line.startswith("Error: ")
    for word in words:
        assert str(word) in line


def check_refused(folder, line, *words):
    """Assert that a command line in this folder is refused with these words, and writes nothing."""
    before = contents(folder)
    refused(golf_here(*shlex.split(line), cwd=folder), *words)
    assert contents(folder) == before


def contents(folder):
    """Kind, size and time of all files in a folder; of folders and links the kind."""
    found = {path: path.lstat() for path in folder.rglob("*") if path.name != "__pycache__"}
    return {
        path: (one.st_mode, *((one.st_size, one.st_mtime_ns) if path.is_file() else ()))
        for path, one in found.items()
    }
