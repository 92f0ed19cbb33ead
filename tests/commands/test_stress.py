"""`golf-impact stress`: what is tried, its repetition by the seed, and that each check can fail."""

import json
import random

import numpy as np
import pytest
from command import golf_here

import stability
from golf_impact.evidence import checks as impact_checks
from golf_impact.evidence import random_impacts
from golf_impact.evidence.scales import TOLERANCE
from golf_impact.fmu import Impact


@pytest.fixture(scope="module")
def impact(fmu_path):
    with Impact(fmu_path) as impact:
        yield impact


@pytest.mark.ci
def test_results(tmp_path):
    """Nothing fails; a largest error has the case that repeats it."""
    golf_here("stress", "--quick", "--seed", 7, "--out", tmp_path, code=0)
    checks = json.loads((tmp_path / "stress.json").read_text())["checks"]
    assert checks.keys() == stability.CLAIMS.keys()
    assert (tmp_path / "stability.png").read_bytes().startswith(b"\x89PNG")
    by_name = {name: case for name, case, *_ in stability.list_impacts(7, quick=True)}
    for check in checks.values():
        assert check["count"] > 0
        # Worst measured: 1.3e-14, a time at ζ = 1057 under a push.
        assert check["worst"] <= min(check["tolerance"], 2e-14)
        assert by_name[check["case"]["impact"]].values.items() <= check["case"].items()


def test_what_is_tried():
    impacts = stability.list_impacts(20, quick=False)
    drawn = [case for name, case, *_ in impacts if name.startswith("seed")]
    assert len(drawn) >= 1000
    assert sum(exact for *_, exact, _ in impacts) >= 100
    assert max(equal for *_, equal in impacts) == 10_000
    assert sum("club_force" in case.values for case in drawn) == len(drawn) / 10
    assert {case.values["law"] for case in drawn} == {1, 2}
    changed = [case for case in drawn if len(case.segments) > 1]
    assert len(drawn) / 4 < len(changed) < len(drawn)

    def spread(values):
        return [f"{power:.0f}" for power in np.log10([min(values), max(values)])]

    assert spread([case.values["k"] for case in drawn]) == ["2", "12"]
    assert spread([case.values["m_club"] / case.values["m_ball"] for case in drawn]) == ["-6", "6"]
    ratios = [c.values["b"] / random_impacts.critical_damping(c.values) for c in drawn]
    assert min(ratios) == 0.0
    assert max(ratios) > 1e3
    pushes = [
        abs(segment.club_force)
        / (0.5 * case.closing * random_impacts.critical_damping(case.values))
        for case in drawn
        for segment in case.segments
        if segment.club_force
    ]
    assert min(pushes) < 1e-3
    assert 1.5 < max(pushes) < 2.0


def test_a_seed_repeats_impacts():
    first, again, other = (stability.list_impacts(seed, quick=True) for seed in (7, 7, 8))
    assert first == again
    assert first[40] != other[40]


def test_steps_add_up_exactly():
    """Not only by math.fsum: whatever the order, no bit is lost."""
    for number in range(20):
        case = random_impacts.random_impact(5, number)
        patterns = random_impacts.step_patterns(case, 1e-4, random.Random(number))
        for steps in patterns.values():
            for segment in case.segments:
                sizes = [s.length for s in steps if (s.k, s.b) == (segment.k, segment.b)]
                assert min(sizes) > 0.0
                assert sum(sizes) == sum(reversed(sizes)) == segment.length


def errors_of(impact, case):
    """The largest error of each check."""
    worst = {}
    for which, _, _, error in impact_checks.check(impact, case, random.Random(1), exact=True):
        worst[which] = max(error, worst.get(which, 0.0))
    return worst


def impact_case(**values):
    values = random_impacts.BASELINE | {"law": 1} | values
    return random_impacts.ImpactCase(values, random_impacts.segments_of(values, 9e-4))


@pytest.mark.parametrize("number", [None, *range(4), 9])
def test_right_outputs_pass(impact, number):
    case = impact_case() if number is None else random_impacts.random_impact(3, number)
    if number == 9:
        case = random_impacts.pushed(case, random.Random(9))
    worst = errors_of(impact, case)
    assert worst.keys() == stability.CLAIMS.keys()
    assert max(worst.values()) < TOLERANCE
    assert worst["state"] == 0.0


@pytest.mark.parametrize(
    ("fault", "check"),
    [
        ("momentum", "momentum"),
        ("contact_displacement", "momentum"),
        ("mean_force", "momentum"),
        ("kinetic_energy", "energy"),
        ("max_compression", "reference"),
        ("ball_velocity", "reference"),
        ("club_velocity", "patterns"),
        ("force", "order"),
        ("contact_time", "order"),
        ("separated", "order"),
    ],
)
def test_a_wrong_output_is_found(impact, monkeypatch, fault, check):
    follow = impact_checks.follow

    def wrong(impact, time, steps):
        path = follow(impact, time, steps)
        if not path:  # of no steps
            return path
        # Flags and results so far go backwards; one error grows with the number of steps.
        size = 1.0 + (1e-14 * len(steps) if check == "patterns" else 1e-11)
        return path | {fault: path[fault][::-1] if check == "order" else path[fault] * size}

    monkeypatch.setattr(impact_checks, "follow", wrong)
    case = impact_case(b=0.0 if check == "energy" else 9.0)
    assert errors_of(impact, case)[check] > TOLERANCE


def test_another_state_is_found(impact, monkeypatch):
    slave, states = impact.instance, []
    restore = slave.setFMUstate
    for m_ball in (0.05, 0.04593):
        case = impact_case(law=2, m_ball=m_ball)
        steps = random_impacts.step_patterns(case, 6e-4, random.Random(1))["equal"]
        impact_checks.start(impact, case)
        impact_checks.follow(impact, 0.0, steps[: len(steps) // 2])
        states.append(slave.getFMUstate())
    assert impact_checks.state_error(impact, case, steps) == 0.0
    monkeypatch.setattr(slave, "setFMUstate", lambda state: restore(states[0]))
    assert impact_checks.state_error(impact, case, steps) > 0.0


@pytest.mark.parametrize("worst", [0.0, 2e-13])
def test_the_exit_code_of_an_error(monkeypatch, tmp_path, worst):
    """stress.json has the case with the largest one."""

    def check(impact, case, rng, exact, equal):
        for name in stability.CLAIMS:
            largest = name == "momentum" and case.values["k"] == 1e12
            yield name, "force", equal, worst if largest else 0.0

    monkeypatch.setattr(impact_checks, "check", check)
    done = golf_here("stress", "--quick", "--seed", 7, "--out", tmp_path, code=int(worst > 0.0))
    sign = "✗" if worst > 0.0 else "✓"
    assert f"{sign} {stability.CLAIMS['momentum']}" in done.stdout
    found = json.loads((tmp_path / "stress.json").read_text())["checks"]["momentum"]
    assert (found["worst"], found["tolerance"]) == (worst, TOLERANCE)
    assert found["count"] == len(stability.list_impacts(7, quick=True))
    if worst:
        assert (
            found["case"].items()
            >= {"impact": "stiff, law 1", "output": "force", "k": 1e12}.items()
        )
