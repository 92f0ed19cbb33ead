"""The reference results in the FMUs: `python tests/tools/reference_results.py` writes them.

They come from stress's reference, which has 80 digits and shares nothing with the FMU.
"""

from pathlib import Path

from golf_physics.variables import VARIABLES

import golf_build
from golf_impact.evidence.reference import Reference

FOLDER = Path(golf_build.__file__).parent / "contents" / "reference"

#: Those that Model Exchange has, too.
OUTPUTS = (
    "force", "club_position", "ball_position", "club_velocity", "ball_velocity", "compression",
    "smash_factor", "coefficient_of_restitution", "energy_efficiency", "contact_time", "impulse",
)  # fmt: skip

STEPS_PER_SECOND, LAST = 50_000, 50

#: Start values, and k (N/m) from a communication point on.
CASES = {
    "law1": ({}, {}),
    "law2": ({"law": 2}, {}),
    "k_changed": ({"law": 2}, {15: 8e5}),
}


def reference_results():
    """The files' contents by name."""
    files = {}
    times = [n / STEPS_PER_SECOND for n in range(LAST + 1)]
    for case, (start, changes) in CASES.items():
        values = {row.name: row.start for row in VARIABLES if row.start is not None} | start
        exact, rows = Reference(values, [(times[n], {"k": k}) for n, k in changes.items()]), []
        for time in times:
            outputs = exact.outputs(time)
            # Below 1e-60 they are rounding errors of 80 digits.
            numbers = (float(outputs[name]) for name in OUTPUTS)
            rows.append([time, *(0.0 if abs(x) < 1e-60 else x for x in numbers)])
        name = f"ClubBallImpact_{case}"
        files[f"{name}_ref.csv"] = table(["time", *OUTPUTS], *rows)
        options = (("StartTime", 0.0), ("StopTime", times[-1]), ("StepSize", times[1]))
        files[f"{name}_ref.opt"] = table(*options, ("RelTol", 1e-10))
        if start:
            files[f"{name}_start.csv"] = table(("name", "value"), *start.items())
        if changes:
            k = [(times[n], value) for n, value in changes.items()]
            before = [(0.0, values["k"]), (k[0][0], values["k"])]
            files[f"{name}_in.csv"] = table(("time", "k"), *before, *k, (times[-1], k[-1][1]))
    return files


def table(*rows):
    return "".join(",".join(map(str, row)) + "\n" for row in rows)


if __name__ == "__main__":
    for name, text in reference_results().items():
        (FOLDER / name).write_text(text, newline="\n")
