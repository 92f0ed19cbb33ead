"""Runs FMUs in fmpy, as a program for the Python of another platform: results as JSON, by task.

python fmpy_tasks.py FILES: .fmu files and an .ssp.
"""

import json
import sys

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.ssp.simulation import simulate_ssp

NAMES = ["smash_factor", "coefficient_of_restitution", "club_velocity", "ball_velocity"]


def last(file, names=NAMES, **options):
    row = fmpy.simulate_fmu(file, output=names, **options)[-1]
    return [float(row[name]) for name in names]


def impacts(file, about):
    """Both laws, several steps; and by CVODE."""
    values = {}
    for law in (1, 2):
        for step in (1e-3, 1e-4, 1e-6):
            options = {"stop_time": 1e-3, "step_size": step, "output_interval": step}
            values[f"law {law}, {step}"] = last(file, start_values={"law": law}, **options)
        if about.modelExchange:
            options = {"fmi_type": "ModelExchange", "stop_time": 1e-3, "relative_tolerance": 1e-10}
            start = {"law": law, "gap": 0.0035}
            values[f"law {law}, CVODE"] = last(file, start_values=start, **options)
    if about.coSimulation.mightReturnEarlyFromDoStep:
        options = {"use_event_mode": True, "early_return_allowed": True, "output_interval": 1e-3}
        start = {"law": 2, "gap": 0.0035}
        rows = fmpy.simulate_fmu(file, stop_time=1e-3, start_values=start, **options)
        values["events"] = [float(time) for time in rows["time"]]
    return values


def calls(file, about):
    """Two instances: a state restored in contact, and a refused value."""
    three = about.fmiVersion == "3.0"
    kind = fmpy.fmi3.FMU3Slave if three else fmpy.fmi2.FMU2Slave
    names = {"guid": about.guid, "modelIdentifier": about.coSimulation.modelIdentifier}
    folder = fmpy.extract(file)
    references = {v.name: v.valueReference for v in about.modelVariables}
    get, put = ("getFloat64", "setFloat64") if three else ("getReal", "setReal")
    made = []
    for n in range(2):
        one = kind(unzipDirectory=folder, instanceName=str(n), **names)
        one.instantiate(loggingOn=True)
        one.setupExperiment(startTime=0.0) if not three else None
        one.enterInitializationMode()
        one.exitInitializationMode()
        one.doStep(0.0, 1e-4)
        made.append(one)
    read = [references[name] for name in NAMES]
    one, other = made
    save, load, free = (getattr(one, f"{do}FMU{'S' if three else 's'}tate") for do in
                        ("get", "set", "free"))  # fmt: skip
    state = save()
    one.doStep(1e-4, 9e-4)
    first = [float(value) for value in getattr(one, get)(read)]
    load(state)
    getattr(one, put)([references["k"]], [2e6])
    one.doStep(1e-4, 9e-4)
    changed = [float(value) for value in getattr(one, get)(read)]
    load(state)
    free(state)
    one.doStep(1e-4, 9e-4)
    again = [float(value) for value in getattr(one, get)(read)]
    try:
        getattr(other, put)([references["k"]], [-1.0])
        other.doStep(1e-4, 1e-4)
        refused = None
    except FMICallException as error:
        refused = error.status
    for one in made:
        one.terminate()
        one.freeInstance()
    return {"state": first, "k changed": changed, "restored": again, "refused": refused}


def results(file):
    if file.endswith(".ssp"):
        rows = simulate_ssp(file, stop_time=0.97, step_size=1e-3)
        row = rows[-1]
        return {name: float(row[name]) for name in rows.dtype.names}
    about = fmpy.read_model_description(file)
    if about.modelName == "ClubBallImpact":
        return impacts(file, about) | calls(file, about)
    names = [v.name for v in about.modelVariables if v.causality == "output" and v.type == "Real"]
    options = {"stop_time": 1.0, "step_size": 1e-2, "output_interval": 1e-2}
    return {"1 s": last(file, names, **options)}


if __name__ == "__main__":
    for file in sys.argv[1:]:
        print(json.dumps([file.replace("\\", "/").rpartition("/")[2], results(file)]), flush=True)
