"""The end of a process that has loaded the FMU: nothing may touch memory that has been freed.

pythonfmu's library drops its own state a second time then (see host.at_exit in fmu_src). As a rule
that goes unnoticed; under the preloaded allocator it is a segmentation fault every time. Native
hosts: see test_native_host.py.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest
from conftest import some

from golf_impact.benchmarks import empty_fmu
from golf_impact.fmu import system
from golf_impact.fmu.file import build_plain_fmu

_PROGRAM = """
import sys
import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
folder, end = sys.argv[1:]
description = fmpy.read_model_description(folder, validate=False)
kind = FMU3Slave if description.fmiVersion == "3.0" else FMU2Slave
slaves = [
    kind(guid=description.guid, unzipDirectory=folder, instanceName=name,
         modelIdentifier=description.coSimulation.modelIdentifier)
    for name in ("one", "two")
]
for slave in slaves:
    slave.instantiate()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.doStep(0.0, 1e-3)
for slave in slaves[: {"free all": 2, "free one": 1, "free none": 0}[end]]:
    slave.terminate()
    slave.freeInstance()
# Each FMU has run its own copy.
assert "golf_physics" not in sys.modules
print("done")
"""


@pytest.fixture
def run(freed, tmp_path):
    def run(fmu, end="free all"):
        folder = fmpy.extract(str(fmu), str(tmp_path / f"extracted {fmu.stem}"))
        done = subprocess.run(
            [sys.executable, "-c", _PROGRAM, folder, end],
            env={**os.environ, "LD_PRELOAD": str(freed)},
            capture_output=True,
            text=True,
            timeout=100,
        )
        assert done.stdout == "done\n", done.stderr
        return done.returncode

    return run


@pytest.mark.parametrize("end", some(1, ["free none", "free one", "free all"]))
@pytest.mark.parametrize("path", ["fmu_path", "fmi3_path"])
def test_a_process_ends_cleanly(run, request, path, end):
    assert run(request.getfixturevalue(path), end) == 0


def test_with_a_companion_it_ends_cleanly(run, tmp_path):
    swing, _, flight, _ = system.build_system(tmp_path / "system")
    assert {swing.stem, flight.stem} == {"Swing", "BallFlight"}
    assert [run(swing), run(flight)] == [0, 0]


def test_without_the_remedy_it_does_not(run, tmp_path):
    # If this fails, pythonfmu has mended it, and `release_at_exit` can go.
    plain = build_plain_fmu(Path(empty_fmu.__file__), tmp_path)
    assert run(plain) == -signal.SIGSEGV
