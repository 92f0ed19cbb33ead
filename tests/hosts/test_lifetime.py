"""How processes with FMUs end, and how FMUs live long: no use of freed memory, no memory gained.

On Linux pythonfmu's library drops its own state a second time at the end of a process (see
host.at_exit in fmu_src). As a rule that goes unnoticed; under the preloaded allocator of freed.c it
is a segmentation fault every time. Native hosts: test_hosts.py.
"""

import json
import os
import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import fmpy
import pytest
from command import run_python
from conftest import some

from golf_impact.evidence.peers import stepped_impact
from golf_impact.evidence.peers.fmus import build_plain_fmu

# The end

_END = """
import sys
from fmus import begin, discard, make_instance
end, *folders = sys.argv[1:]
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
        done = run_python(_END, end, *folders, code=code, env=env)
        assert done.stdout == "done\n", done.stderr

    return ends


@pytest.mark.parametrize("end", some(1, ["free one", "free none", "free all"]))
def test_a_process_ends_cleanly(ends, fmu_path, files, end):
    ends(fmu_path, *files[:-1], end=end)


def test_without_the_workaround_it_does_not(ends, tmp_path):
    # If this fails, pythonfmu has fixed it, and `host.at_exit` isn't needed any more.
    plain = build_plain_fmu(Path(stepped_impact.__file__), tmp_path)
    ends(plain, code=-signal.SIGSEGV)


# Unloading: every run of fmpy's extracts a library anew

_RUNS = """
import sys
from fmpy.ssp.simulation import simulate_ssp

def mappings():
    return sum(1 for _ in open("/proc/self/maps"))

counts = []
for _ in range(3):
    simulate_ssp(sys.argv[1], stop_time=1e-3, step_size=1e-3)
    counts.append(mappings())
# Of a library that stayed there would be six each time.
assert counts[-1] - counts[0] < 6, counts
"""


@pytest.mark.skipif(sys.platform != "linux", reason="there is no /proc")
def test_no_library_stays_loaded(files):
    """In a native host one stays, that which started Python: host `reload`, test_hosts.py."""
    run_python(_RUNS, files[-1])


# Long lives: cycles, and the bytes of memory that each leaves behind

_LIFE = """
import gc, json, os, sys
from fmus import begin, discard, make_instance
task, count, folder = sys.argv[1], int(sys.argv[2]), sys.argv[3]

def impact(slave):
    # With a read in mid-contact, and all real variables at the end.
    slave.doStep(0.0, 2e-4)
    slave.getReal(slave.reals)
    slave.doStep(2e-4, 1e-4)
    slave.doStep(3e-4, 1.0)
    return slave.getReal(slave.reals)

def one_instance(n):
    slave = begin(make_instance(folder))
    state = slave.getFMUstate()
    outputs = impact(slave)
    slave.setFMUstate(state)
    slave.freeFMUstate(state)
    assert impact(slave) == outputs == first
    discard(slave)

def one_restart(n):
    if n % 2:
        kept.reset()
        begin(kept)
    else:
        kept.setFMUstate(start)
    assert impact(kept) == first

kept = begin(make_instance(folder))
start, first = kept.getFMUstate(), impact(kept)
cycle = {"instances": one_instance, "restarts": one_restart}[task]

def resident_bytes():
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

for n in range(max(2, count // 10)):
    cycle(n)
before = resident_bytes()
for n in range(count):
    cycle(n)
print(json.dumps((resident_bytes() - before) / count))
"""


@pytest.mark.skipif(not Path("/proc/self/statm").is_file(), reason="there is no /proc")
@pytest.mark.parametrize("count", some(0, [200, 10_000], 1))
@pytest.mark.parametrize(("task", "times"), [("instances", 1), ("restarts", 10)])
def test_nothing_is_left_behind(fmu_path, tmp_path, record_property, task, times, count):
    """Beside an FMU by pythonfmu alone, of whose instances some bytes leak."""
    files = fmu_path, build_plain_fmu(Path(stepped_impact.__file__), tmp_path)
    folders = [fmpy.extract(str(file), str(tmp_path / f"{n}")) for n, file in enumerate(files)]
    count *= times
    # Without our workaround a process may crash at its end.
    life = partial(run_python, _LIFE, task, count, timeout=3600, code=None)
    with ThreadPoolExecutor(2) as pool:
        ours, plain = (json.loads(done.stdout) for done in pool.map(life, folders))
    record_property("bytes_each", (ours, plain))
    # Of a restart nothing: the smallest object has 16 bytes. Besides, only pages that aren't full.
    allowed = plain if task == "instances" else 4.0
    assert ours <= allowed + 300_000 / count
