"""The end of a process that has loaded the FMU: nothing may touch memory that has been freed.

pythonfmu's library drops its own state a second time then (see host.at_exit in fmu_src). As a rule
that goes unnoticed; under the preloaded allocator it is a segmentation fault every time. Native
hosts: see test_native_host.py.
"""

import os
import signal
from pathlib import Path

import fmpy
import pytest
from command import run_python
from conftest import HERE, some

from golf_impact.benchmarks import empty_fmu
from golf_impact.fmu.file import build_plain_fmu

_PROGRAM = """
import sys
sys.path.insert(0, sys.argv[3])
from instances import begin, discard, make_instance
folder, end, _ = sys.argv[1:]
slaves = [make_instance(folder, name) for name in ("one", "two")]
for slave in slaves:
    begin(slave)
    slave.doStep(0.0, 1e-3)
for slave in slaves[: {"free all": 2, "free one": 1, "free none": 0}[end]]:
    discard(slave)
# Each FMU has run its own copy.
assert "golf_physics" not in sys.modules
print("done")
"""


@pytest.fixture
def ends(freed, tmp_path):
    def ends(fmu, end="free all", code=0):
        folder = fmpy.extract(str(fmu), str(tmp_path / f"extracted {fmu.stem}"))
        done = run_python(
            _PROGRAM, folder, end, HERE, code=code, env=os.environ | {"LD_PRELOAD": str(freed)}
        )
        assert done.stdout == "done\n", done.stderr

    return ends


@pytest.mark.parametrize("end", some(1, ["free none", "free one", "free all"]))
@pytest.mark.parametrize("path", ["fmu_path", "fmi3_path"])
def test_a_process_ends_cleanly(ends, request, path, end):
    ends(request.getfixturevalue(path), end)


def test_with_a_companion_it_ends_cleanly(ends, files):
    for fmu in files[:-1]:
        ends(fmu)


def test_without_the_workaround_it_does_not(ends, tmp_path):
    # If this fails, pythonfmu has fixed it, and `host.at_exit` isn't needed any more.
    plain = build_plain_fmu(Path(empty_fmu.__file__), tmp_path)
    ends(plain, code=-signal.SIGSEGV)
