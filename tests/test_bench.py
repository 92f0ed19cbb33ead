"""`golf-impact bench --quick`: what it writes, and that its checks can fail.

Times aren't tested: a test run shares its machine with others.
"""

import cProfile
import json
from collections import Counter
from itertools import islice
from pathlib import Path

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from loaded import LoadedFmu, build_plain_fmu

from golf_impact.benchmarks import accuracy, empty_fmu
from golf_impact.benchmarks.all import FIGURES, is_met
from golf_impact.benchmarks.impact import METRICS
from golf_impact.benchmarks.work_precision import FMU_ONCE, FMU_STEPPED
from golf_impact.closed_forms import definitions
from golf_impact.commands.bench import bench
from golf_impact.peers import document_fmu
from golf_impact.peers.compiled import SUB_STEP, compiled_fmu, compiler
from golf_impact.peers.problem import Case, Outcome, errors
from golf_impact.reference import Reference, exact_outcome
from golf_impact.stress.cases import named_cases
from golf_impact.stress.driver import driver
from golf_impact.timing import median_ratio, run_interleaved


@pytest.mark.ci
def test_results(tmp_path):
    code = bench(quick=True, folder=tmp_path)
    results = json.loads((tmp_path / "bench.json").read_text())
    assert results["passed"] == all(target["passed"] for target in results["targets"].values())
    assert code == (0 if results["passed"] else 1)
    assert (tmp_path / "run_time_vs_error.png").read_bytes().startswith(b"\x89PNG")
    limits = {key: row["limit"] for key, row in FIGURES.items()}
    assert list(results["targets"]) == [k for k in limits if compiler() or "compiled" not in k]
    for key, target in results["targets"].items():
        assert results[key] > 0.0
        assert target == {"limit": limits[key], "passed": is_met(limits[key], results[key])}
    assert {"processor", "python", "fmpy", "pythonfmu", "fmu"} <= results["machine"].keys()
    assert len(results["conclusion"]) == 3
    # Worst measured: 1.2e-15 in 45,000 numbers of the full run.
    assert results["worst_error"] <= 1e-13
    assert results["worst_error_is_of"]["numbers_compared"] > 10_000
    for methods in results["run_time_vs_error"].values():
        by_method = {series["method"]: series for series in methods}
        euler = by_method["the document's scheme as FMU"]
        per_step = [error / dt for error, dt in zip(euler["errors"], euler["settings"])]
        assert per_step == pytest.approx([per_step[-1]] * len(per_step), rel=0.3)  # of order 1
        for method in (FMU_STEPPED, FMU_ONCE):
            assert max(by_method[method]["errors"]) < 1e-14


@pytest.mark.skipif(not compiler(), reason="there is no C compiler on this machine")
@pytest.mark.parametrize("law", [1, 2])
def test_compiled_peers_are_the_methods_they_name(law, tmp_path):
    """Euler's numbers are those of the scheme in Python, RK4 is of order 4; the FMUs are valid."""
    case = Case(law=law, k=8e5, b=12.0, ball_speed=-3.0)

    def solved(path, dt):
        """Outcome, and S, COR, E."""
        with LoadedFmu(path) as peer:
            slave = peer.instance(dt=dt, **vars(case))
            slave.doStep(0.0, 1e-3)
            outcome = Outcome(*slave.getReal(peer.references(Outcome._fields)))
            return outcome, slave.getReal(peer.references(METRICS))

    same, _ = solved(build_plain_fmu(Path(document_fmu.__file__), tmp_path), SUB_STEP["euler"])
    for method in SUB_STEP:
        path = compiled_fmu(method, tmp_path)
        assert validate_fmu(path) == []
        if method == "rk4":
            exact = exact_outcome(case)
            coarse, fine = (max(errors(case, solved(path, dt)[0], exact)) for dt in (1e-5, 5e-6))
            assert coarse / fine == pytest.approx(16.0, rel=0.1)
        outcome, metrics = solved(path, SUB_STEP[method])
        if method == "euler":
            assert max(errors(case, outcome, same)) < 1e-15
        before = 0.5 * (case.m_club * 35.0**2 + case.m_ball * 3.0**2)
        right = definitions(vars(case), {**outcome._asdict(), "kinetic_energy_initial": before})
        assert metrics == pytest.approx([right[name] for name in METRICS], rel=1e-14)


def calls_inside(scene):
    """How many Python functions of the FMU's own modules a scene calls."""
    profile = cProfile.Profile()
    profile.runcall(scene)
    codes = ((getattr(row.code, "co_filename", ""), row.callcount) for row in profile.getstats())
    return sum(number for file, number in codes if "golf_physics_" in file)


@pytest.mark.parametrize("law", [1, 2])
def test_calls_inside_the_fmu(fmu, law):
    """Few calls for an impact, and as many for each step of any run."""
    metrics = fmu.references(METRICS)
    read = fmu.references(("force", "club_position", "ball_position", "club_velocity"))
    slave = fmu.slave

    def impact():
        slave.doStep(0.0, 1e-3)
        slave.getReal(metrics)

    def steps(begin, end):
        for n in range(begin, end):
            slave.doStep(n * 1e-7, 1e-7)
            slave.getReal(read)

    fmu.start(law=law)
    # Measured: 41 under law 1, 34 under law 2.
    assert 0 < calls_inside(impact) <= 50
    fmu.start(law=law)
    steps(0, 1)
    few, many = calls_inside(lambda: steps(1, 101)), calls_inside(lambda: steps(101, 3101))
    # Measured: a little over 3 for each.
    assert 200 <= few <= 400
    assert many <= 31 * few


def test_the_empty_fmu_has_as_many_variables(fmu_path, tmp_path):
    empty = build_plain_fmu(Path(empty_fmu.__file__), tmp_path)
    ours, others = (
        Counter((v.causality, v.type) for v in read_model_description(path).modelVariables)
        for path in (fmu_path, empty)
    )
    assert ours == others


def test_the_accuracy_check_can_fail(monkeypatch):
    right = Reference.outputs

    def wrong(self):
        return {**right(self), "max_force": right(self)["max_force"] * (1 + 1e-12)}

    monkeypatch.setattr(Reference, "outputs", wrong)
    few = [*islice(named_cases(), 5)]
    monkeypatch.setattr(accuracy.cases, "named_cases", lambda randoms: few)
    with driver() as fmu:
        worst = accuracy.worst_error(fmu, 0)
    assert worst["worst_error"] == pytest.approx(1e-12, rel=0.01)
    assert worst["output"] == "max_force"


def test_rounds_are_interleaved_and_their_ratios_taken():
    order = []
    jobs = {"a": lambda: order.append("a") or 2.0, "b": lambda: order.append("b") or 4.0}
    assert run_interleaved(jobs, rounds=2) == {"a": [2.0, 2.0], "b": [4.0, 4.0]}
    assert order == ["b", "a", "a", "b", "b", "a"]
    # The median of ratios, not the ratio of medians.
    assert median_ratio([1.0, 9.0, 4.0], [1.0, 3.0, 1.0]) == 3.0
