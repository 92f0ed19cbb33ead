"""`golf-impact stress`: what is tried, its repetition by the seed, and that each check can fail."""

import json
import random

import numpy as np
import pytest
from command import golf_here
from conftest import some

import stability
from golf_impact.evidence import checks
from golf_impact.evidence.random_impacts import (
    BASELINE,
    ImpactCase,
    critical_damping,
    random_impact,
)
from golf_impact.evidence.scales import TOLERANCE


@pytest.mark.ci
def test_results(tmp_path):
    """Nothing fails; a largest error has the case that repeats it."""
    golf_here("stress", "--quick", "--seed", 7, "--out", tmp_path, code=0)
    found = json.loads((tmp_path / "stress.json").read_text())["checks"]
    assert found.keys() == stability.CLAIMS.keys()
    assert (tmp_path / "stability.png").read_bytes().startswith(b"\x89PNG")
    by_name = {name: case for name, case, *_ in stability.list_impacts(7, quick=True)}
    for check in found.values():
        assert check["count"] > 0
        # Worst measured: 1.3e-14, a time at ζ = 1057 under a push.
        assert check["worst"] <= min(check["tolerance"], 2e-14)
        assert by_name[check["case"]["impact"]].values.items() <= check["case"].items()


def test_what_is_tried():
    impacts = stability.list_impacts(20, quick=False)
    drawn = [case for name, case, *_ in impacts if name.startswith("seed")]
    assert len(drawn) >= 1000
    assert sum(exact for *_, exact, _ in impacts) >= 200
    assert sum("club_force" in case.values for case in drawn) == len(drawn) / 10
    assert len(drawn) / 4 < sum(bool(case.changes) for case in drawn) < len(drawn)
    values = {name: np.array([case.values[name] for case in drawn]) for name in (*BASELINE, "law")}
    assert {*values["law"]} == {1, 2}

    def spread(values):
        return np.log10([min(values), max(values)]).round().tolist()

    assert spread(values["k"]) == [2, 12]
    assert spread(values["m_club"] / values["m_ball"]) == [-6, 6]
    critical = np.array([critical_damping(case.values) for case in drawn])
    assert min(values["b"]) == 0.0
    assert max(values["b"] / critical) > 1e3
    scales = [0.5 * case.closing * c for case, c in zip(drawn, critical)]
    steps = [(step.club_force, c) for case, c in zip(drawn, scales) for step in case.steps()]
    forces = [abs(force) / scale for force, scale in steps if force]
    assert min(forces) < 1e-3
    assert 1.5 < max(forces) < 2.0


def test_a_seed_repeats_impacts():
    first, again, other = (stability.list_impacts(seed, quick=True) for seed in (7, 7, 8))
    assert first == again
    assert first[40] != other[40]


@pytest.mark.parametrize("number", range(20))
def test_steps_add_up_exactly(number):
    """Not only by math.fsum: whatever the order, no bit is lost; changes are set when they act."""
    case = random_impact(5, number)
    total = sum(step.length for step in case.steps())
    for _, steps in case.patterns(1e-4, random.Random(number), 64):
        sizes = [step.length for step in steps]
        assert min(sizes) > 0.0
        assert sum(sizes) == sum(reversed(sizes)) == total == pytest.approx(case.end, rel=1e-12)
        begins = np.cumsum([0.0, *sizes[:-1]])
        for time, inputs in case.changes:
            assert steps[np.argmin(abs(begins - time))].k == inputs["k"]


def errors_of(impact, case):
    """The largest error of each check."""
    worst = {}
    for which, _, _, error in checks.check(impact, case, random.Random(1), exact=True):
        worst[which] = max(error, worst.get(which, 0.0))
    return worst


@pytest.mark.parametrize("number", [0, 9])
def test_right_outputs_pass(impact, number):
    """Without a force on the head, and with one."""
    worst = errors_of(impact, stability.list_impacts(3, quick=True)[38 + number][1])
    assert worst.keys() == stability.CLAIMS.keys()
    assert max(worst.values()) < TOLERANCE
    assert worst["state"] == 0.0


@pytest.mark.parametrize(
    ("fault", "check"),
    [
        ("momentum", "momentum"), ("contact_displacement", "momentum"),
        ("mean_force", "momentum"), ("kinetic_energy", "energy"),
        ("max_compression", "reference"), ("ball_velocity", "reference"),
        ("club_velocity", "patterns"), ("force", "order"), ("contact_time", "order"),
        ("separated", "order"), ("ball_velocity", "state"),
    ],
)  # fmt: skip
def test_a_wrong_output_is_found(impact, monkeypatch, fault, check):
    follow, runs = checks.follow, iter(range(1000))

    def wrong(impact, time, steps):
        path = follow(impact, time, steps)
        if not path:  # of no steps
            return path
        # Flags and results so far go backwards; one error grows with steps, another with runs.
        growth = {"patterns": 1e-14 * len(steps), "state": 1e-11 * next(runs)}.get(check, 1e-11)
        found = path[fault][::-1] if check == "order" else path[fault] * (1.0 + growth)
        return {**path, fault: found}

    monkeypatch.setattr(checks, "follow", wrong)
    values = {**BASELINE, "law": 1, "b": 0.0 if check == "energy" else 9.0}
    assert errors_of(impact, ImpactCase(values, 9e-4))[check] > TOLERANCE


@pytest.mark.parametrize("worst", some(1, [2e-13, 0.0]))
def test_the_exit_code_of_an_error(monkeypatch, tmp_path, worst):
    """stress.json has the case with the largest one."""

    def check(impact, case, rng, exact, equal):
        for name in stability.CLAIMS:
            largest = name == "momentum" and case.values["k"] == 1e12
            yield name, "force", equal, worst if largest else 0.0

    monkeypatch.setattr(stability, "check", check)
    monkeypatch.setattr(checks, "check", check)
    done = golf_here("stress", "--quick", "--seed", 7, "--out", tmp_path, code=int(worst > 0.0))
    sign = "✗" if worst > 0.0 else "✓"
    assert f"{sign} {stability.CLAIMS['momentum']}" in done.stdout
    found = json.loads((tmp_path / "stress.json").read_text())["checks"]["momentum"]
    assert (found["worst"], found["tolerance"]) == (worst, TOLERANCE)
    assert found["count"] == len(stability.list_impacts(7, quick=True))
    if worst:
        expected = {"impact": "stiff, law 1", "output": "force", "k": 1e12}
        assert found["case"].items() >= expected.items()
