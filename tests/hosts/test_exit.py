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
from conftest import HERE, build_plain_fmu, some

from golf_impact.peers import empty_fmu

_PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
from fmus import begin, discard, make_instance
_, end, *folders = sys.argv[1:]
slaves = [make_instance(folder, name) for folder in folders for name in ("one", "two")]
for slave in slaves:
    begin(slave)
    slave.doStep(0.0, 1e-3)
for slave in slaves[: {"free all": None, "free one": 1, "free none": 0}[end]]:
    discard(slave)
# Each FMU has run its own copy.
assert "golf_physics" not in sys.modules
print("done")
"""


@pytest.fixture
def ends(freed, tmp_path):
    def ends(*fmus, end="free all", code=0):
        folders = [fmpy.extract(str(fmu), str(tmp_path / fmu.stem)) for fmu in fmus]
        env = os.environ | {"LD_PRELOAD": str(freed)}
        done = run_python(_PROGRAM, HERE, end, *folders, code=code, env=env)
        assert done.stdout == "done\n", done.stderr

    return ends


@pytest.mark.parametrize("end", some(1, ["free none", "free one", "free all"]))
@pytest.mark.parametrize("path", ["fmu_path", "fmi3_path"])
def test_a_process_ends_cleanly(ends, request, path, end):
    ends(request.getfixturevalue(path), end=end)


def test_with_the_companions_it_ends_cleanly(ends, fmu_path, files):
    ends(fmu_path, *files[:-1])


def test_without_the_workaround_it_does_not(ends, tmp_path):
    # If this fails, pythonfmu has fixed it, and `host.at_exit` isn't needed any more.
    plain = build_plain_fmu(Path(empty_fmu.__file__), tmp_path)
    ends(plain, code=-signal.SIGSEGV)
