"""Calls of golf-impact: in a separate process, or in this one, which takes a tenth of the time."""

import io
import os
import signal
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from types import SimpleNamespace

from golf_impact.commands import app
from golf_impact.stopping import SIGNALS

COMMAND = Path(sys.executable).with_name("golf-impact")


def golf(*arguments, cwd=None, env=None, program=(COMMAND,), **options):
    """Run the command as a user does, in a subprocess."""
    return subprocess.run(
        [*program, *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, "COLUMNS": "120", **(env or {})},
        **options,
    )


def golf_here(*arguments, cwd=None):
    """Run the command in this process; arguments and results as those of `golf`."""
    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    out, err, before = io.StringIO(), io.StringIO(), Path.cwd()
    try:
        os.chdir(cwd or before)
        with redirect_stdout(out), redirect_stderr(err):
            code = app.one_line([str(argument) for argument in arguments])
    finally:
        os.chdir(before)
        for number, handler in handlers.items():
            signal.signal(number, handler)
    return SimpleNamespace(returncode=code, stdout=out.getvalue(), stderr=err.getvalue())


def refused(done, *words):
    """Assert exit code 2 and one line on stderr with these words (after "Built …", if any)."""
    assert done.returncode == 2, (done.returncode, done.stderr)
    (line,) = (line for line in done.stderr.splitlines() if not line.startswith("Built "))
    assert line.startswith("Error: ")
    for word in words:
        assert str(word) in line
