"""`golf-impact bench`: its rows, and that the other methods are what their names say.

Times aren't tested: a test run shares its machine with others.
"""

import cProfile
import json
from collections import Counter
from itertools import pairwise

import pytest
from cases import DEFAULTS
from command import golf_here, refused
from fmus import begin, get, make_instance

import run_time_vs_error
from golf_impact.commands import bench
from golf_impact.data.runs import PATH
from golf_impact.evidence.peers import dop853, fmus, ways
from golf_impact.evidence.peers.ways import METRICS, NATIVE, OURS, Way
from golf_impact.evidence.reference import Reference
from golf_impact.evidence.timing import measure_interleaved
from golf_impact.fmu import Impact, current_native

COMPILED = pytest.mark.skipif(not fmus.compiler(), reason="there is no C compiler on this machine")


def error(found, **values):
    """The largest error of S, COR and E."""
    exact = Reference(DEFAULTS | values).outputs(1e-3)
    return max(abs(x - float(exact[name])) for x, name in zip(found, METRICS, strict=True))


@pytest.mark.ci
def test_results(tmp_path):
    golf_here("bench", "--quick", "--out", tmp_path, code=0)
    results = json.loads((tmp_path / "bench.json").read_text())
    assert {"processor", "python", "fmpy", "pythonfmu"} <= results["machine"].keys()
    assert (tmp_path / "run_time_vs_error.png").read_bytes().startswith(b"\x89PNG")
    for law in (1, 2):
        rows = [row for row in results["rows"] if row["law"] == law]
        assert (rows[0]["name"], rows[0]["ratio"]) == (OURS, 1.0)
        for row in rows:
            assert row["called"]
            assert row["ratio"] == pytest.approx(row["microseconds"] / rows[0]["microseconds"])
        # Measured: 4e-16.
        assert max(row["error"] for row in rows if row["name"] in (OURS, NATIVE)) < 1e-14
        steps = [row for row in rows if row["name"].startswith(("explicit Euler", "Runge–Kutta"))]
        assert all(1e-15 < row["error"] < 0.1 for row in steps)


def test_a_missing_package(monkeypatch, tmp_path):
    monkeypatch.setattr(bench, "find_spec", lambda name: None if name == "mpmath" else name)
    done = golf_here("bench", "--quick", cwd=tmp_path)
    refused(done, "bench needs mpmath: install it with ", "[bench]")


# The other methods


@pytest.fixture(scope="module")
def peers(tmp_path_factory):
    return fmus.extract_peers(tmp_path_factory.mktemp("peers"))


@COMPILED
@pytest.mark.parametrize("law", [1, 2])
@pytest.mark.parametrize(
    ("name", "order", "coarse"), [(fmus.EULER, 1, 1e-6), (fmus.RUNGE_KUTTA, 4, 2.5e-6)]
)
def test_orders_of_the_methods(law, name, order, coarse, peers):
    values = {"law": law, "k": 8e5, "b": 12.0}

    def solved(name, dt):
        slave = begin(make_instance(peers[name]), dt=dt, **values)
        slave.doStep(0.0, 1e-3)
        return get(slave, *METRICS)

    # Measured: 2.00, and 14.4.
    errors = [error(solved(name, dt), **values) for dt in (coarse, coarse / 2)]
    assert errors[0] / errors[1] == pytest.approx(2.0**order, rel=0.15)
    if order == 1:
        assert solved(fmus.PYTHON, coarse) == pytest.approx(solved(name, coarse), rel=1e-13)


@pytest.mark.parametrize("law", [1, 2])
def test_dop853(law):
    for rtol, most in ((1e-6, 1e-5), (1e-12, 1e-10)):
        assert 0.0 < error(dop853.solve(law, rtol, 9e5), law=law, k=9e5) < most


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


@COMPILED
def test_what_is_compared(impact, tmp_path):
    """Each is called in one way, for both laws; sub-steps cover four decades."""
    with Impact(current_native()) as in_c:
        rows, points = ways.compared(impact, in_c, str(tmp_path), quick=False)
        for law in (1, 2):
            # The other law's results are 0.02 away.
            errors = {way[:2]: error(way.prepare(law)(9e5), law=law, k=9e5) for way in rows}
            assert len(errors) == len(rows)
            assert max(errors.values()) < 6e-3
    assert len(rows) == 9
    curves = Counter(way.name for way in points)
    assert len(curves) == 3
    assert min(curves.values()) >= 6
    steps = {f"k set, doStep of {dt} µs sub-steps, getReal" for dt in ("10", "0.001")}
    assert steps <= {way.called for way in points}


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
    assert len(measure_interleaved(jobs, rounds=3, least=0.0)) == 2
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
