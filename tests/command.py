"""golf-impact as tests call it: in a process of its own, or here, which costs a tenth."""

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
    """The command as a user meets it: a subprocess."""
    return subprocess.run(
        [*program, *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, "COLUMNS": "120", **(env or {})},
        **options,
    )


def golf_here(*arguments, cwd=None):
    """The same arguments and answers, without a process of their own: for what is one of many."""
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
    """Exit code 2 and one line on stderr that has these words (beside that an FMU was built)."""
    assert done.returncode == 2, (done.returncode, done.stderr)
    (line,) = (line for line in done.stderr.splitlines() if not line.startswith("Built "))
    assert line.startswith("Error: ")
    for word in words:
        assert str(word) in line
