"""The reference results in an FMU, and how far its own results are from them on this machine."""

from __future__ import annotations

import csv
import io
import re
from itertools import pairwise
from pathlib import Path

import fmpy

from golf_build.archive import unpack
from golf_impact.fmu.loaded import LoadedFmu, LoadedFmu3


def _rows(text: bytes) -> list[dict[str, float]]:
    table = csv.DictReader(io.StringIO(text.decode()))
    return [{name: float(value) for name, value in row.items()} for row in table]


def deviations(path: Path) -> dict[str, float]:
    """The largest deviation in each case by its name, relative to the largest value of the output.

    Empty if the FMU has no reference results. UserError: it rejects a value or a step.
    """
    found, files = {}, unpack(path)
    three = fmpy.read_model_description(str(path)).fmiVersion == "3.0"
    for name in files:
        if not (case := re.fullmatch(r"(extra/.*/\w+?_(\w+))_ref\.csv", name)):
            continue
        rows = _rows(files[name])
        inputs = _rows(files.get(f"{case[1]}_in.csv", b""))
        start = csv.DictReader(io.StringIO(files.get(f"{case[1]}_start.csv", b"").decode()))
        with (LoadedFmu3 if three else LoadedFmu)(path) as fmu:
            fmu.begin({row["name"]: float(row["value"]) for row in start})
            if not three:
                fmu.end_initialization()
            outputs = [name for name in rows[0] if name != "time"]
            scales = {name: max(abs(row[name]) for row in rows) for name in outputs}
            worst = 0.0
            for now, then in pairwise(rows):
                for row in inputs:
                    if row["time"] == now["time"]:
                        fmu.set({name: value for name, value in row.items() if name != "time"})
                fmu.step(now["time"], then["time"] - now["time"])
                read = fmu.read(outputs)
                worst = max(worst, *(abs(read[n] - then[n]) / scales[n] for n in outputs))
        found[case[2]] = worst
    return found
