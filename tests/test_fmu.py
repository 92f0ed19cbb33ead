"""The built FMU through fmpy: its model description, and its results at any communication steps."""

import json
import random
import sys

import fmpy
import pytest
from command import run_python
from compare import assert_close
from conftest import HERE, numbers, reference_cases
from fmpy.validation import validate_fmu
from golf_physics.variables import VARIABLES

from golf_impact.errors import UserError
from golf_impact.facts.closed_forms import reduced_mass
from golf_impact.facts.scales import Scales
from golf_impact.fmu.file import build_fmu
from golf_impact.runs import METRICS, PATH
from golf_impact.stress.cases import random_impact, random_steps
from golf_impact.stress.reference import Reference

OUTPUTS = [v.name for v in VARIABLES if v.causality == "output" and v.type == "Real"]
FLAGS = [v.name for v in VARIABLES if v.type == "Boolean"]


def read_all(fmu):
    return fmu.read(OUTPUTS) | {name: fmu.read_flag(name) for name in FLAGS}


def values_of(case):
    values = {n: case[n] for n in ("k", "b", "club_speed", "m_club", "m_ball", "ball_speed")}
    return values | {"law": 1 if case["law"] == "absolute" else 2}


def test_fmpy_finds_no_problem(fmu_path):
    assert validate_fmu(str(fmu_path)) == []


@pytest.mark.plain
def test_model_description(fmu_path):
    description = fmpy.read_model_description(str(fmu_path), validate=True)
    assert description.fmiVersion == "2.0"
    assert description.modelName == "ClubBallImpact"
    simulation = description.coSimulation
    assert simulation.canGetAndSetFMUstate
    assert simulation.canSerializeFMUstate
    assert simulation.canHandleVariableCommunicationStepSize
    table = {v.name: v for v in description.modelVariables}
    assert list(table) == [row.name for row in VARIABLES]
    for row in VARIABLES:
        variable = table[row.name]
        assert variable.causality == row.causality
        # libcosim and ecos omit an Enumeration; they support an Integer.
        assert variable.type == ("Integer" if row.type == "Enumeration" else row.type)
        assert variable.description
        if row.type == "Real":
            assert variable.unit == row.unit
            assert float(variable.nominal) > 0.0
        if row.start is not None:
            assert float(variable.start) == row.start
    assert (table["k"].min, table["restitution_at_rest"].max) == ("0.0", "1.0")
    units = {u.name: {d.name for d in u.displayUnits} for u in description.unitDefinitions}
    assert {"mph", "km/h"} <= units["m/s"]
    unknowns = {u.variable.name for u in description.initialUnknowns}
    assert unknowns == {row.name for row in VARIABLES if row.causality == "output"}
    assert all(u.dependencies == [] for u in description.outputs)
    assert description.defaultExperiment.stopTime == "0.001"


def test_no_other_file_is_taken_for_an_fmu(tmp_path):
    other = tmp_path / "notes.txt"
    other.write_text("mine")
    with pytest.raises(UserError, match=r"must end in \.fmu"):
        build_fmu(other)
    assert other.read_text() == "mine"


def test_the_fmu_needs_no_numpy(fmu_path, tmp_path):
    fmpy.extract(str(fmu_path), str(tmp_path))
    entry = next(p.stem for p in (tmp_path / "resources").glob("club_ball_impact_*.py"))
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path / 'resources')!r}); "
        f"before = set(sys.modules); import {entry}; "
        "print(*(m for m in sys.modules if m not in before))"
    )
    done = run_python(code)
    modules = {name.split(".")[0] for name in done.stdout.split()}
    ours = {name for name in modules if name.startswith(("golf_physics_", "club_ball_impact_"))}
    assert len(ours) == 2
    assert modules - ours <= {*sys.stdlib_module_names, "pythonfmu"}


@pytest.mark.parametrize("case", reference_cases("impacts", "extremes"))
@pytest.mark.parametrize("pattern", ["one step", "1000 equal", "random"])
def test_reference_cases_by_any_steps(fmu, case, pattern):
    expected = {name: float(value) for name, value in case["expected"].items()}
    horizon = 1.3 * expected["contact_time"]
    if pattern == "one step":
        steps = [horizon]
    elif pattern == "1000 equal":
        steps = [horizon / 1000] * 1000
    else:
        rng = random.Random(1)
        cuts = sorted(rng.random() for _ in range(60))
        steps = [horizon * (b - a) for a, b in zip([0.0, *cuts], [*cuts, 1.0])]
    fmu.start(**values_of(case))
    point = 0.0
    for step in steps:
        fmu.step(point, step)
        point += step
    assert fmu.read_flag("separated")
    outputs = fmu.read(METRICS)
    scales = Scales(values_of(case), outputs, approach=0.0)
    expected["contact_displacement"] = expected["ball_position"]
    right = {name: expected[name] for name in expected.keys() & outputs.keys()}
    assert_close(outputs, right, scales, steps=pattern)


@pytest.mark.parametrize("seed", numbers(10, 40, 120))
def test_inputs_that_change_in_contact(fmu, seed):
    """All outputs after each step, with changes of k, b and club_speed, against the reference."""
    rng = random.Random(seed)
    case = random_impact(24, seed)
    exact = Reference(case.values)
    fmu.start(**case.values)
    point, reached = 0.0, []
    for step in random_steps(case, seed):
        inputs = {"k": step.k, "b": step.b}
        if rng.random() < 0.35:
            inputs["club_speed"] = case.values["club_speed"] * rng.uniform(-0.3, 1.5)
        for name, value in sorted(inputs.items(), reverse=bool(seed % 2)):
            fmu.slave.setReal(fmu.references([name]), [value])
        fmu.step(point, step.length)
        exact.step(step.length, **inputs)
        point += step.length
        reached.append((read_all(fmu), exact.outputs() | {"mean_force": exact.mean_force}))
    end = {name: float(value) for name, value in reached[-1][1].items()}
    touched = exact.u_club is not None
    start = case.values | {"club_speed": float(exact.u_club if touched else exact.club_speed)}
    mu = reduced_mass(start["m_club"], start["m_ball"])
    scales = Scales(
        start,
        end if touched else end | {"contact_time": point},
        approach=end["touch_time"],
        span=point,
        fastest=max(max((s.k / mu) ** 0.5, s.b / mu) for s in case.segments),
        after=end,
    )
    for ours, theirs in reached:
        # A value far larger than its scale (the energy of a faster approach) has rounding errors
        # of its own size.
        right = {n: ours[n] if abs(ours[n] - x) <= 1e-15 * abs(x) else x for n, x in theirs.items()}
        assert_close(ours, right, scales, seed=seed, steps=len(reached))


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


def test_before_touch(fmu):
    fmu.start(gap=0.1)
    fmu.step(0.0, 1e-3)
    outputs = read_all(fmu)
    assert outputs["club_position"] == pytest.approx(-0.1 + 0.035, abs=1e-17)
    assert not outputs["touched"]
    assert outputs["energy_efficiency"] == 1.0
    for name in ("smash_factor", "coefficient_of_restitution", "impulse", "max_force", "force"):
        assert outputs[name] == 0.0
    assert outputs["touch_time"] == 0.0


def test_start_time(fmu):
    fmu.restore_initial_state(fmu.slave)
    fmu.slave.setupExperiment(startTime=5.0)
    fmu.slave.enterInitializationMode()
    fmu.slave.setReal(fmu.references(["gap"]), [0.35])
    fmu.slave.exitInitializationMode()
    assert fmu.read(["touch_time"])["touch_time"] == 5.0
    fmu.slave.doStep(5.0, 1.0)
    assert fmu.read(["touch_time"])["touch_time"] == pytest.approx(5.01, abs=1e-15)


def test_bodies_that_never_separate(fmu):
    fmu.start(law=1, b=5000.0)
    fmu.step(0.0, 1.0)
    outputs = read_all(fmu)
    assert outputs["in_contact"]
    assert not outputs["separated"]
    assert outputs["contact_time"] == 1.0
    assert 0.0 <= outputs["force"] < outputs["max_force"]


def test_a_trajectory_equals_single_steps(fmu):
    path = fmu.trajectory(points=40, law=1, b=30.0)
    for n in (3, 17, 39):
        fmu.start(law=1, b=30.0)
        fmu.step(0.0, path["time"][n])
        for name, value in fmu.read(PATH).items():
            assert path[name][n] == pytest.approx(value, rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("law", [1, 2])
@pytest.mark.parametrize("count", [1, 3, 7, 10, 30, 49])
def test_touch_at_a_communication_point_is_not_final(fmu, law, count):
    """Whether a club speed set there still counts depends on rounding, not on earlier reads."""

    def finish(read_outputs):
        fmu.start(law=law, gap=0.035)
        size = 1e-3 / count
        for n in range(count):
            fmu.step(n * size, size)
        if read_outputs:
            now = fmu.read(OUTPUTS)
            assert min(now[n] for n in ("force", "compression", "contact_time", "impulse")) >= 0.0
            assert abs(now["smash_factor"]) <= 0.0
        fmu.slave.setReal(fmu.references(["club_speed"]), [40.0])
        fmu.step(count * size, 1.0)
        return fmu.read(METRICS)

    assert finish(read_outputs=True) == pytest.approx(finish(read_outputs=False), rel=1e-13)


@pytest.mark.parametrize("steps", [1, 700])
@pytest.mark.parametrize("case", range(4))
def test_power_law_through_the_fmu(fmu, case, steps):
    table = json.loads((HERE / "data" / "power_law.json").read_text())["cases"][case]
    inputs = {name: float(value) for name, value in table["inputs"].items()}
    exact = {name: float(value) for name, value in table["results"].items()}
    n, reference = inputs["n"], 0.005
    fmu.start(
        law=2,
        exponent=n,
        k=exact["kn"] * reference ** (n - 1.0),
        b=exact["c"] * reference ** ((n - 1.0) / 2.0),
        club_speed=inputs["u_club_mps"],
    )
    for step in range(steps):
        fmu.step(step * 1e-3 / steps, 1e-3 / steps)
    outputs = fmu.read(METRICS)
    names = {
        "contact_time": "T",
        "max_force": "F",
        "time_of_max_force": "tF",
        "max_compression": "dmax",
        "coefficient_of_restitution": "e",
        "ball_velocity": "v_ball",
        "club_velocity": "v_club",
    }
    for ours, theirs in names.items():
        # 7e-16 measured; the tolerance of a quadrature is 1e-10.
        assert outputs[ours] == pytest.approx(exact[theirs], rel=1e-12, abs=0), ours


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
