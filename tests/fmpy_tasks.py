"""Runs FMUs in fmpy, as a program for the Python of another platform: results as JSON, by task.

python fmpy_tasks.py [--scipy] FILES: .fmu files and an .ssp. SciPy, or fmpy's CVODE, which not all
platforms have, solves Model Exchange.
"""

import json
import sys

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Model
from fmpy.ssp.simulation import simulate_ssp
from instances import begin, discard, get, make_instance, put, solve_by_scipy

NAMES = ["smash_factor", "coefficient_of_restitution", "club_velocity", "ball_velocity"]

SCIPY = sys.argv[1:2] == ["--scipy"]


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
        if about.modelExchange and SCIPY:
            values[f"law {law}, SciPy"] = solved(file, law)
        elif about.modelExchange:
            options = {"fmi_type": "ModelExchange", "stop_time": 1e-3, "relative_tolerance": 1e-10}
            start = {"law": law, "gap": 0.0035}
            values[f"law {law}, CVODE"] = last(file, start_values=start, **options)
    if about.coSimulation.mightReturnEarlyFromDoStep:
        options = {"use_event_mode": True, "early_return_allowed": True, "output_interval": 1e-3}
        start = {"law": 2, "gap": 0.0035}
        rows = fmpy.simulate_fmu(file, stop_time=1e-3, start_values=start, **options)
        values["events"] = [float(time) for time in rows["time"]]
    return values


def solved(file, law):
    """Model Exchange without fmpy's CVODE."""
    model = begin(make_instance(fmpy.extract(file), kind=FMU3Model), law=law)
    solve_by_scipy(model, 1.0, "DOP853", rtol=1e-12, atol=1e-14)
    return get(model, *NAMES)


def calls(file):
    """Two instances: a state restored in contact, k changed there, and a refused value."""
    folder = fmpy.extract(file)
    one, other = (begin(make_instance(folder, name)) for name in ("one", "other"))
    for instance in (one, other):
        instance.doStep(0.0, 1e-4)
    word = "State" if hasattr(one, "getFMUState") else "state"
    state = getattr(one, f"getFMU{word}")()
    values = {}
    for name, k in (("state", 1e6), ("k changed", 2e6), ("restored", 1e6)):
        put(one, k=k)
        one.doStep(1e-4, 9e-4)
        values[name] = get(one, *NAMES)
        getattr(one, f"setFMU{word}")(state)
    getattr(one, f"freeFMU{word}")(state)
    try:
        put(other, k=-1.0)
        other.doStep(1e-4, 1e-4)
    except FMICallException as error:
        values["refused"] = error.status
    discard(one, other)
    return values


def results(file):
    if file.endswith(".ssp"):
        rows = simulate_ssp(file, stop_time=0.97, step_size=1e-3)
        row = rows[-1]
        return {name: float(row[name]) for name in rows.dtype.names}
    about = fmpy.read_model_description(file)
    if about.modelName == "ClubBallImpact":
        return impacts(file, about) | calls(file)
    names = [v.name for v in about.modelVariables if v.causality == "output" and v.type == "Real"]
    options = {"stop_time": 1.0, "step_size": 1e-2, "output_interval": 1e-2}
    return {"1 s": last(file, names, **options)}


if __name__ == "__main__":
    for file in sys.argv[1 + SCIPY :]:
        print(json.dumps([file.replace("\\", "/").rpartition("/")[2], results(file)]), flush=True)
