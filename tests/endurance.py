"""Long lives of FMUs, each in a process of its own; prints what it measured as JSON.

    python endurance.py TASK COUNT FOLDER [FOLDER]

A FOLDER is an extracted FMU 2.0.
"""

import gc
import json
import sys

import fmpy
from fmpy.fmi2 import FMU2Slave

from golf_impact.timing import resident_bytes


class Fmu:
    """What is needed of an extracted FMU to live through it."""

    def __init__(self, folder):
        self.folder = folder
        self.description = fmpy.read_model_description(folder)
        outputs = [v for v in self.description.modelVariables if v.causality == "output"]
        self.reals = [v.valueReference for v in outputs if v.type == "Real"]

    def made(self):
        slave = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="endurance",
        )
        slave.instantiate()
        return slave

    def initialize(self, slave):
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()

    def impact(self, slave):
        """Three steps, with a look in mid-contact, and all outputs at the end."""
        slave.doStep(0.0, 2e-4)
        slave.getReal(self.reals)
        slave.doStep(2e-4, 1e-4)
        slave.doStep(3e-4, 1.0)
        return slave.getReal(self.reals)

    def life(self):
        """From instantiation to the end."""
        slave = self.made()
        self.initialize(slave)
        state = slave.getFMUstate()
        outputs = self.impact(slave)
        slave.setFMUstate(state)
        slave.freeFMUstate(state)
        assert self.impact(slave) == outputs
        slave.terminate()
        slave.freeInstance()
        return outputs


def memory():
    gc.collect()
    return resident_bytes()


def instances(count, folder):
    """One instance after the other."""
    fmu = Fmu(folder)
    first = fmu.life()
    warm = max(1, count // 10)
    for _ in range(warm):
        assert fmu.life() == first
    before = memory()
    for _ in range(count):
        assert fmu.life() == first
    return {"instances": count + warm + 1, "bytes_each": (memory() - before) / count}


def cycles(count, folder):
    """One instance, taken back to its start again and again: by reset and by a restored state."""
    fmu = Fmu(folder)
    slave = fmu.made()
    fmu.initialize(slave)
    start = slave.getFMUstate()
    first = fmu.impact(slave)
    wrong = 0

    def back(n):
        if n % 2:
            slave.reset()
            fmu.initialize(slave)
        else:
            slave.setFMUstate(start)
        return fmu.impact(slave) != first

    warm = max(2, count // 10)
    for n in range(warm):
        wrong += back(n)
    before = memory()
    for n in range(count):
        wrong += back(n)
    gained = memory() - before
    slave.freeFMUstate(start)
    slave.terminate()
    slave.freeInstance()
    return {"cycles": count + warm, "wrong": wrong, "bytes_each": gained / count}


def start(count, *folders):
    """So many impacts in each of two FMUs in one process, which then ends as any other does."""
    fmus = [Fmu(folder) for folder in folders]
    slaves = [(fmu, fmu.made()) for fmu in fmus for _ in range(count)]
    for fmu, slave in slaves:
        fmu.initialize(slave)
    outputs = [fmu.impact(slave) for fmu, slave in slaves]
    for _, slave in slaves:
        slave.terminate()
        slave.freeInstance()
    return {"outputs": outputs}


if __name__ == "__main__":
    task, count, *folders = sys.argv[1:]
    print(json.dumps(globals()[task](int(count), *folders)), flush=True)
