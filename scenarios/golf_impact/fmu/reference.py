"""The reference results in an FMU, and how far its own results are from them on this machine."""

import csv
import io
import re
from itertools import pairwise
from pathlib import Path

from golf_build.archive import unpack
from golf_impact.fmu.loaded import LoadedFmu, LoadedFmu3


def loaded(path: Path) -> LoadedFmu:
    """An FMU of either version of FMI, for use in a `with` block."""
    fmu = LoadedFmu(path)
    return LoadedFmu3(path) if fmu.description.fmiVersion == "3.0" else fmu


def deviations(path: Path) -> dict[str, float]:
    """The largest deviation in each case by its name, relative to the largest value of the output.

    Empty if the FMU has no reference results. UserError: it rejects a value or a step.
    """
    found, files = {}, unpack(path)

    def rows(name: str) -> list[dict[str, str]]:
        return [*csv.DictReader(io.StringIO(files.get(name, b"").decode()))]

    def numbers(name: str) -> list[dict[str, float]]:
        return [{key: float(value) for key, value in row.items()} for row in rows(name)]

    for name in files:
        if not (case := re.fullmatch(r"(extra/.*/\w+?_(\w+))_ref\.csv", name)):
            continue
        expected = numbers(name)
        inputs = {row.pop("time"): row for row in numbers(f"{case[1]}_in.csv")}
        outputs, worst = [output for output in expected[0] if output != "time"], 0.0
        scales = {output: max(abs(row[output]) for row in expected) for output in outputs}
        with loaded(path) as fmu:
            fmu.start(**{r["name"]: float(r["value"]) for r in rows(f"{case[1]}_start.csv")})
            for now, then in pairwise(expected):
                fmu.set(inputs.get(now["time"], {}))
                fmu.step(now["time"], then["time"] - now["time"])
                for output, value in fmu.read(outputs).items():
                    worst = max(worst, abs(value - then[output]) / scales[output])
        found[case[2]] = worst
    return found
