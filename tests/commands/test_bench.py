"""`golf-impact bench`: its rows, and that the other methods are what their names say.

Times aren't tested: a test run shares its machine with others.
"""

import cProfile
import json
import re
from itertools import pairwise

import pytest
from cases import DEFAULTS
from command import golf_here, refused
from shown import check_snapshot, result_lines

import run_time_vs_error
from golf_impact.commands import bench
from golf_impact.data.runs import PATH
from golf_impact.evidence import timing
from golf_impact.evidence.peers import fmus
from golf_impact.evidence.peers.ways import METRICS, OURS, Way
from golf_impact.evidence.reference import Reference
from golf_impact.report import scripts

COMPILED = pytest.mark.skipif(not fmus.compiler(), reason="there is no C compiler on this machine")


@COMPILED
def test_what_is_compared(monkeypatch, tmp_path, pytestconfig):
    """Every way with its error; times are made up. The steps of a method show its order."""
    results, run = [], scripts.run_script

    def run_script(*arguments, **options):
        return results.append(run(*arguments, **options)) or results[-1]

    def measure(jobs, rounds):
        return [1e-6 * (10 + (7 * n) % 61) for n in range(len(jobs))]

    monkeypatch.setattr(scripts, "run_script", run_script)
    monkeypatch.setattr(timing, "measure_interleaved", measure)
    golf_here("bench", "--out", tmp_path, code=0)
    found = json.loads((tmp_path / "bench.json").read_text())
    assert {"processor", "python", "fmpy", "pythonfmu"} <= found["machine"].keys()
    assert (tmp_path / "run_time_vs_error.png").read_bytes().startswith(b"\x89PNG")
    lines = [*result_lines(*results), "", *map(row_line, found["rows"])]
    # Errors of some units in the last place aren't the same everywhere.
    check_snapshot(pytestconfig, "bench.md", (re.sub(r"\de-1[4-9]", "0", line) for line in lines))


def row_line(row):
    """A row of bench.json."""
    numbers = (f"{key} {row[key]:.3g}" for key in ("law", "microseconds", "ratio"))
    return " | ".join([row["name"], row["called"], *numbers, f"error {row['error']:.0e}"])


def test_a_missing_package(monkeypatch, tmp_path):
    monkeypatch.setattr(bench, "find_spec", lambda name: None if name == "mpmath" else name)
    done = golf_here("bench", "--quick", cwd=tmp_path)
    refused(done, "bench needs mpmath: install it with ", "[bench]")


def test_without_a_compiler(impact, monkeypatch):
    """What is in C is named as not run."""
    monkeypatch.setattr(fmus, "compiler", lambda: None)
    monkeypatch.setattr(
        run_time_vs_error, "measure_interleaved", lambda jobs, **_: [1.0] * len(jobs)
    )
    result = run_time_vs_error.run(impact, quick=True)
    assert {row["name"] for row in result.cases.values()} == {OURS, fmus.PYTHON, "DOP853, SciPy"}
    names = "explicit Euler, C FMU, Runge–Kutta 4, C FMU, native FMU"
    assert result.words.endswith(f"Not run, without a C compiler: {names}.")


# Fairness: every impact is another one, rounds are interleaved; counts that speed follows from


def test_k_changes_at_every_impact(impact):
    ks, exact = [], Reference(DEFAULTS).outputs(1e-3)

    def solve(k):
        ks.append(k)
        return [float(exact[name]) for name in METRICS]

    row, _ = run_time_vs_error.measure(impact, 1, [Way("a", "b", lambda law: solve)] * 2, True)
    assert row.items() >= {"name": "a", "called": "b", "law": 1, "ratio": 1.0}.items()
    assert row["error"] < 1e-15
    assert len(ks) > 20
    assert all(a != b for a, b in pairwise(ks[:-2]))


def test_rounds_are_interleaved():
    order = []
    jobs = [lambda name=name: order.append(name) for name in "ab"]
    assert len(timing.measure_interleaved(jobs, rounds=3, least=0.0)) == 2
    assert "".join(order) == "aaabbb" + "ab" * 3


@pytest.mark.parametrize("law", [1, 2])
def test_calls_inside_the_fmu(fmu, law):
    """Few calls of the FMU's own functions for an impact, and as many for each step of any run."""
    slave, size = fmu.slave, 1e-7
    metrics, path = ([slave.references[n] for n in names] for names in (METRICS, PATH[:4]))

    def calls(*steps, outputs=path):
        def scene():
            for n, size in steps:
                slave.doStep(n * size, size)
                slave.getReal(outputs)

        profile = cProfile.Profile()
        profile.runcall(scene)
        codes = [(getattr(x.code, "co_filename", ""), x.callcount) for x in profile.getstats()]
        return sum(number for file, number in codes if "golf_physics_" in file)

    fmu.begin({"law": law})
    # Measured: 41 under law 1, 34 under law 2.
    assert 0 < calls((0, 1e-3), outputs=metrics) <= 50
    fmu.begin({"law": law})
    calls((0, size))
    few, many = (calls(*((n, size) for n in each)) for each in (range(1, 101), range(101, 3101)))
    # Measured: a little over 3 for each.
    assert 200 <= few <= 400
    assert many <= 31 * few
