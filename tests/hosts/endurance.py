"""Long lives of FMUs, each in a process of its own; prints what it measured as JSON.

    python endurance.py TASK COUNT FOLDER

FOLDER is an extracted FMU 2.0.
"""

import gc
import json
import os
import sys
from pathlib import Path

from fmus import begin, discard, make_instance


def resident_bytes(process="self"):
    """Resident memory of a process; None on systems without /proc."""
    file = Path(f"/proc/{process}/statm")
    # wine shows Windows programs a /proc.
    if os.name == "nt" or not file.is_file():
        return None
    return int(file.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def impact(slave):
    """Three steps, with a read in mid-contact, and all real variables at the end."""
    slave.doStep(0.0, 2e-4)
    slave.getReal(slave.reals)
    slave.doStep(2e-4, 1e-4)
    slave.doStep(3e-4, 1.0)
    return slave.getReal(slave.reals)


def live(folder):
    """A life from instantiation to the end; its results."""
    slave = begin(make_instance(folder))
    state = slave.getFMUstate()
    outputs = impact(slave)
    slave.setFMUstate(state)
    slave.freeFMUstate(state)
    assert impact(slave) == outputs
    discard(slave)
    return outputs


def memory():
    gc.collect()
    return resident_bytes()


def growth(count, cycle):
    """A cycle again and again: how often, and the bytes that each leaves behind."""
    warm = max(2, count // 10)
    for n in range(warm):
        cycle(n)
    before = memory()
    for n in range(count):
        cycle(n)
    return {"cycles": count + warm, "bytes_each": (memory() - before) / count}


def instances(count, folder):
    """One instance after the other."""
    first = live(folder)

    def cycle(n):
        assert live(folder) == first

    return growth(count, cycle)


def restarts(count, folder):
    """One instance, taken back to its start again and again: by reset and by a restored state."""
    slave = begin(make_instance(folder))
    start = slave.getFMUstate()
    first = impact(slave)

    def cycle(n):
        if n % 2:
            slave.reset()
            begin(slave)
        else:
            slave.setFMUstate(start)
        assert impact(slave) == first

    return growth(count, cycle)


if __name__ == "__main__":
    task, count, folder = sys.argv[1:]
    print(json.dumps(globals()[task](int(count), folder)), flush=True)
