"""`golf-impact stress --quick`: its checks, their repetition, and that they can fail."""

import json

import pytest

from golf_impact.commands.stress import stress
from golf_impact.stress import all as all_
from golf_impact.stress import cases, invariants, special_points
from golf_impact.stress.driver import driver


@pytest.mark.parametrize(
    "impacts",
    [
        pytest.param((50, 30), marks=pytest.mark.ci),
        pytest.param((150, 100), marks=pytest.mark.nightly, id="--quick"),
    ],
)
def test_results(monkeypatch, tmp_path, impacts):
    """Every invariant holds; a worst case has its inputs."""
    monkeypatch.setitem(all_.IMPACTS, True, impacts)
    assert stress(quick=True, folder=tmp_path, seed=7) == 0
    results = json.loads((tmp_path / "stress.json").read_text())
    failed = {name: check for name, check in results["checks"].items() if not check["passed"]}
    assert failed == {}
    assert all(check["count"] > 0 for check in results["checks"].values())
    assert results["passed"]
    for run in results["tiny_steps"].values():
        assert max(run["errors"]) < 1e-14
    draws = {"random": cases.random_impact, "pushed": cases.pushed_impact}
    for name in ("momentum", "energy", "reference", "partition", "rising"):
        case = results["checks"][name]["case"]
        assert case["seed"] == 7
        draw = draws.get(case["kind"], special_points.special_impact)
        assert draw(7, case["number"]).values == case["values"]


def test_a_check_that_failed(monkeypatch, tmp_path, capsys):
    check = {"claim": "x", "passed": False, "worst": 1.0, "tolerance": 0.1, "count": 2}
    results = {"checks": {"energy": check | {"failures": 1}}, "impacts": 2, "passed": False}
    monkeypatch.setattr(all_, "all_checks", lambda quick, seed, begin: results)
    assert stress(quick=True, folder=tmp_path, seed=7) == 1
    printed = capsys.readouterr().out
    assert "all invariants but: energy" in printed
    assert "FAIL 1" in printed


@pytest.mark.parametrize("number", range(20))
def test_partitions_add_up_exactly(number):
    impact = cases.random_impact(5, number)
    for steps in cases.partitions(impact, 1e-4, 5).values():
        for segment in impact.segments:
            sizes = [s.length for s in steps if (s.k, s.b) == (segment.k, segment.b)]
            assert min(sizes) > 0.0
            # Not only math.fsum: whatever the order, no bit is lost.
            assert sum(sizes) == sum(reversed(sizes)) == segment.length


@pytest.mark.parametrize(
    ("fault", "check"),
    [
        ("club_velocity", "momentum"),
        ("max_compression", "reference"),
        ("mean_force", "mean_force"),
        ("kinetic_energy", "reference"),
    ],
)
def test_a_wrong_output_is_found(fault, check):
    ledger = invariants.Ledger(*invariants.CLAIMS)
    with driver() as fmu:
        outputs = fmu.outputs
        fmu.outputs = lambda: (right := outputs()) | {fault: right[fault] * (1.0 + 1e-11)}
        for number in range(4):
            impact = cases.random_impact(3, number)
            invariants.check(fmu, ledger, impact, 3, exact=number == 0)
    assert ledger.checks[check]["failures"]


@pytest.mark.parametrize(
    ("draw", "seed", "number"),
    [
        # A contact without end under law 1, some thousand oscillations: its energy balance ends
        # earlier; bodies that part slowly; an undamped contact that the force never lets end.
        (cases.random_impact, 20, 3821),
        (cases.pushed_impact, 1, 375),
        (cases.pushed_impact, 20, 25),
        *((cases.pushed_impact, 7, n) for n in range(3)),
    ],
)
def test_right_outputs_pass(draw, seed, number):
    ledger = invariants.Ledger(*invariants.CLAIMS)
    with driver() as fmu:
        invariants.check(fmu, ledger, draw(seed, number), seed, exact=draw is cases.pushed_impact)
    assert ledger.checks["energy"]["count"] == 1
    assert not any(check["failures"] for check in ledger.checks.values())
