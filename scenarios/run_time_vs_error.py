"""Run time and error of S, COR and E of an impact: this FMU, other calls and other methods.

The document's impact under both laws; k changes at every impact, so that no result is in a cache.
What is needed only once (extraction, instances, initialization) is prepared outside the timer.
"""

import tempfile
from contextlib import ExitStack
from itertools import cycle

import matplotlib.pyplot as plt

from golf_impact.evidence.peers import fmus, ways
from golf_impact.evidence.peers.ways import METRICS, NATIVE, OURS, STEP
from golf_impact.evidence.reference import Reference
from golf_impact.evidence.timing import measure_interleaved
from golf_impact.fmu import Impact, current_native
from golf_impact.scenario import Result, main

LAWS = {1: "drag on each body", 2: "damper between the bodies"}
STIFFNESSES = [1e6 * (0.9 + 0.2 * (37 * n % 101) / 101) for n in range(101)]  # N/m
ACCURACIES = (1e-3, 1e-12)  # of a good measurement; nearly of double precision


def measure(impact, law, compared, quick):
    """The rows of bench.json under this law, of all ways."""
    baseline = {v.name: float(v.start) for v in impact.description.modelVariables if v.start}
    exact = Reference(baseline | {"law": law}).outputs(STEP)
    ks, solve = cycle(STIFFNESSES), [way.prepare(law) for way in compared]
    jobs = [lambda each=each: each(next(ks)) for each in solve]
    seconds = measure_interleaved(jobs, rounds=5 if quick else 21)
    rows = []
    for way, time, each in zip(compared, seconds, solve):
        found = zip(METRICS, each(baseline["k"]))
        error = max(float(abs(value - exact[name])) for name, value in found)
        row = {"name": way.name, "called": way.called, "law": law}
        row |= {"microseconds": 1e6 * time, "ratio": time / seconds[0], "error": error}
        rows.append(row)
    return rows


def plot(rows):
    """The work–precision diagram under both laws: error against run time."""
    figure, both = plt.subplots(1, 2, sharey=True, figsize=(10.0, 4.6))
    for axes, (law, damping) in zip(both, LAWS.items()):
        for name in dict.fromkeys(row["name"] for row in rows[law]):
            of_name = [row for row in rows[law] if row["name"] == name]
            points = [(row["microseconds"], row["error"]) for row in of_name]
            if name == OURS:
                axes.loglog(*points[0], "*", ms=16, zorder=3, label=name)
            else:
                axes.loglog(*zip(*sorted(points)), "o-", ms=4, label=name)
        axes.set(title=f"law {law}: {damping}", xlabel="run time of an impact (µs)")
    both[0].set_ylabel("error of S, COR and E")
    figure.suptitle("Other methods are faster only at a larger error")
    figure.legend(*both[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def conclude(law, rows):
    """In words: the best of the other calls, and of the other methods by their accuracy."""

    def best(rows, words):
        row = min(rows, key=lambda row: row["ratio"])
        return f"{row['ratio']:.2g} times as long {words} ({row['name']}, {row['called']})"

    others = [row for row in rows if row["name"] not in (OURS, NATIVE)]
    methods = " and ".join(
        best((row for row in others if row["error"] < limit), f"at an error below {limit:g}")
        for limit in ACCURACIES
    )
    calls = best((row for row in rows[1:] if row["name"] == OURS), "at best")
    return f"Law {law}: simulate_fmu takes {calls}; other methods take {methods}."


def run(impact, quick=False, track=iter):
    """Compare the ways; the cases of the result are the rows of bench.json."""
    result, rows = Result("Run time and error of S, COR and E of an impact"), {}
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="golf-impact-"))
        in_c = stack.enter_context(Impact(current_native())) if fmus.compiler() else None
        table, points = ways.compared(impact, in_c, folder, quick)
        for law in track([*LAWS]):
            rows[law] = measure(impact, law, table + points, quick)
            result.cases |= {f"{row['name']}, {row['called']}, law {law}": row for row in rows[law]}
            title = f"S, COR and E of an impact: law {law}, k = 1 MN/m, b = 9 N·s/m"
            cells = [
                [name, called, f"{time:.3g}", f"{ratio:.2g}", f"{error:.0e}"]
                for name, called, _, time, ratio, error in map(dict.values, rows[law][: len(table)])
            ]
            result.tables.append((title, ["", "called", "µs", "ratio", "error"], cells))
    result.figures["run_time_vs_error"] = plot(rows)
    result.words = " ".join(conclude(law, rows[law]) for law in LAWS)
    if not in_c:
        names = ", ".join((fmus.EULER, fmus.RUNGE_KUTTA, NATIVE))
        result.words += f" Not run, without a C compiler: {names}."
    return result


if __name__ == "__main__":
    main(run)
