"""The built FMU through fmpy: its results at any communication steps."""

import random
from itertools import pairwise

import pytest
from cases import CASES, SHARES, exact, exact_path, horizon
from command import golf_here, refused
from compare import assert_close
from conftest import numbers
from golf_physics.variables import VARIABLES

from golf_impact.random_impacts import random_impact, random_steps
from golf_impact.reference import Reference
from golf_impact.runs import METRICS
from golf_impact.scales import Scales, reduced_mass

OUTPUTS = [v.name for v in VARIABLES if v.causality == "output" and v.type == "Real"]
FLAGS = [v.name for v in VARIABLES if v.type == "Boolean"]


def read_all(fmu):
    return fmu.read(OUTPUTS) | {name: fmu.read_flag(name) for name in FLAGS}


def test_no_other_file_is_taken_for_an_fmu(tmp_path):
    other = tmp_path / "notes.txt"
    other.write_text("mine")
    refused(golf_here("build", "--out", other), "must end in .fmu")
    assert other.read_text() == "mine"


PATTERNS = {
    "one step": [],
    "1000 equal": [place / 1000 for place in range(1, 1000)],
    "random": [*SHARES, *(random.Random(1).random() for _ in range(60))],
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("shares", PATTERNS.values(), ids=PATTERNS)
def test_cases_by_any_steps(fmu, name, shares):
    """Every output on the way and at the end; of power laws those known."""
    case, end = CASES[name], horizon(name)
    later, path = dict(case.changes), {end: exact(name)}
    if case.is_linear:
        path = exact_path(name)
    reached = []
    fmu.start(**case.given)
    for point, after in pairwise(sorted({0.0, *later, *(end * share for share in shares), end})):
        if point in later:
            fmu.set(later[point])
        fmu.step(point, after - point)
        if after in path:
            reached.append((after, read_all(fmu)))
    assert reached[-1][1]["separated"] == (name != "sticks")
    changed = [case.values | inputs for inputs in (*later.values(), {})]
    inputs = [(values["k"], values["b"]) for values in changed]
    # The speed that counts is the first one that is set before touch.
    scales = scales_of(changed[0], reached[-1][1], end, inputs)
    for time, outputs in reached:
        # Of a power law the worst is 7e-16, though only 1e-10 is stated.
        assert_close(outputs, path[time], scales, case=name, time=time, steps=len(shares))


def scales_of(values, end, span, inputs):
    """Scales of errors at the end of a run of `span` s; `inputs` are all k and b that it had."""
    mu = reduced_mass(values)
    end = {name: float(value) for name, value in end.items()}
    return Scales(
        values,
        end if end["touched"] else end | {"contact_time": span},
        approach=end["touch_time"],
        span=span,
        fastest=max(max((k / mu) ** 0.5, b / mu) for k, b in inputs),
        after=end,
    )


@pytest.mark.parametrize("seed", numbers(10, 40, 120))
def test_inputs_that_change_in_contact(fmu, seed):
    """All outputs after each step, with changes of k, b and club_speed, against the reference."""
    rng = random.Random(seed)
    case = random_impact(24, seed)
    exact = Reference(case.values)
    fmu.start(**case.values)
    point, reached = 0.0, []
    for step in random_steps(case, rng):
        inputs = {"k": step.k, "b": step.b}
        if rng.random() < 0.35:
            inputs["club_speed"] = case.values["club_speed"] * rng.uniform(-0.3, 1.5)
        for name, value in sorted(inputs.items(), reverse=bool(seed % 2)):
            fmu.slave.setReal(fmu.references([name]), [value])
        fmu.step(point, step.length)
        exact.step(step.length, **inputs)
        point += step.length
        reached.append((read_all(fmu), exact.outputs() | {"mean_force": exact.mean_force}))
    speed = exact.club_speed if exact.u_club is None else exact.u_club
    inputs = [(segment.k, segment.b) for segment in case.segments]
    scales = scales_of(case.values | {"club_speed": float(speed)}, exact.outputs(), point, inputs)
    for n, (ours, theirs) in enumerate(reached):
        # A value far larger than its scale (the energy of a faster approach) has rounding errors
        # of its own size.
        right = {o: ours[o] if abs(ours[o] - x) <= 1e-15 * abs(x) else x for o, x in theirs.items()}
        assert_close(ours, right, scales, seed=seed, step=n)


def test_a_value_set_after_initialization_counts(fmu):
    fmu.start(law=2)
    before = fmu.read(["force", "coefficient_of_restitution", "max_force"])
    # The right limit at the start: the bodies touch, and the damper pushes at once.
    assert before["force"] == before["max_force"] == 9.0 * 35.0
    assert before["coefficient_of_restitution"] == -1.0
    fmu.slave.setReal(fmu.references(["club_speed", "k"]), [50.0, 2e6])
    assert fmu.read(["force"])["force"] == 9.0 * 35.0
    fmu.step(0.0, 1.0)
    late = fmu.read(METRICS)
    assert late == fmu.impact(METRICS, law=2, club_speed=50.0, k=2e6)


def test_power_law_in_mid_contact_by_any_steps(fmu):
    def run(cuts):
        fmu.start(law=2, exponent=1.5, b=30.0)
        point = 0.0
        for cut in (*cuts, 2e-4):
            fmu.step(point, cut - point)
            point = cut
        fmu.slave.setReal(fmu.references(["k", "b"]), [2e6, 60.0])
        fmu.step(point, 1e-3)
        return fmu.read(METRICS)

    assert run((1e-5, 1.1e-4)) == pytest.approx(run(()), rel=1e-12)
