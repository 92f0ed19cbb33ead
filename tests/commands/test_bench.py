"""`golf-impact bench`: its rows, and that the other methods are what their names say.

Times aren't tested: a test run shares its machine with others.
"""

import cProfile
import json
from collections import Counter
from itertools import pairwise
from pathlib import Path

import pytest
from cases import DEFAULTS
from command import golf_here, refused
from fmpy import read_model_description
from fmus import begin, get, make_instance

import run_time_vs_error
from golf_impact.commands import bench
from golf_impact.data.runs import PATH
from golf_impact.evidence.peers import dop853, empty_fmu, fmus, ways
from golf_impact.evidence.peers.ways import EMPTY, METRICS, NATIVE, OURS, Way
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
            assert (row["error"] is None) == (row["name"] == EMPTY)
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
    return fmus.extract_peers(tmp_path_factory.mktemp("peers"))[0]


@pytest.mark.parametrize("law", [1, 2])
@pytest.mark.parametrize("language", ["Python", pytest.param("C", marks=COMPILED)])
def test_orders_of_the_methods(law, language, peers):
    values = {"law": law, "k": 8e5, "b": 12.0, "m_club": 0.2, "club_speed": 40.0}
    values["ball_speed"] = -3.0

    def solved(language, order, dt):
        slave = begin(make_instance(peers[language]), order=order, dt=dt, **values)
        slave.doStep(0.0, 1e-3)
        return get(slave, *METRICS)

    for order, coarse in ((1, 1e-6), (4, 2.5e-6)):
        # Measured: 2.00, and 14.2 to 14.8.
        errors = [error(solved(language, order, dt), **values) for dt in (coarse, coarse / 2)]
        assert errors[0] / errors[1] == pytest.approx(2.0**order, rel=0.15)
        same = solved("Python", order, coarse)
        assert solved(language, order, coarse) == pytest.approx(same, rel=1e-13)


@pytest.mark.parametrize("law", [1, 2])
def test_dop853(law):
    for rtol, most in ((1e-6, 1e-5), (1e-12, 1e-10)):
        assert 0.0 < error(dop853.solve(law, rtol, 9e5), law=law, k=9e5) < most


def test_without_a_compiler_the_methods_are_in_python(fmu_path, tmp_path, monkeypatch):
    """Each is called in one way; sub-steps cover four decades."""
    monkeypatch.setattr(fmus, "compiler", lambda: None)
    with Impact(fmu_path) as impact:
        rows, points = ways.compared(impact, None, str(tmp_path), quick=False)
    assert "Runge–Kutta 4, Python FMU" in [way.name for way in rows]
    assert not [way.name for way in rows + points if "C FMU" in way.name]
    assert len({way[:2] for way in rows}) == len(rows)
    curves = Counter(way.name for way in points)
    assert len(curves) == 3
    assert min(curves.values()) >= 6
    steps = {f"k set, doStep of {dt} µs sub-steps, getReal" for dt in ("10", "0.001")}
    assert steps <= {way.called for way in points}


@COMPILED
def test_ways_in_c_compute_the_same(fmu_path, tmp_path):
    with Impact(fmu_path) as impact, Impact(current_native()) as in_c:
        rows, _ = ways.compared(impact, in_c, str(tmp_path), quick=True)
        for law in (1, 2):
            found = {way[:2]: way.prepare(law)(9e5) for way in rows}
            # Their bits, or those of the same scheme called by fmpy.
            for (name, called), values in found.items():
                same = OURS if name == NATIVE else name
                assert values == found[same, called.removeprefix("in C: ")]
                # The other law's are 0.02 away.
                assert name == EMPTY or error(values, law=law, k=9e5) < 6e-3


def test_the_empty_fmu_has_as_many_variables(fmu_path, tmp_path):
    empty = fmus.build_plain_fmu(Path(empty_fmu.__file__), tmp_path)
    ours, others = (
        Counter((v.causality, v.type) for v in read_model_description(path).modelVariables)
        for path in (fmu_path, empty)
    )
    assert ours == others


# Fairness: every impact is another one, rounds are interleaved; counts that speed follows from


def test_k_changes_at_every_impact(fmu_path):
    ks, exact = [], Reference(DEFAULTS).outputs(1e-3)

    def solve(k):
        ks.append(k)
        return [float(exact[name]) for name in METRICS]

    with Impact(fmu_path) as impact:
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
