"""Swing ⇄ ClubBallImpact → Launch → BallFlight: the .ssp in three tools, by any steps."""

import math
import re
from functools import cache
from xml.etree import ElementTree

import fmpy
import integrations
import numpy as np
import pytest
from compare import assert_close
from conftest import HERE, some
from fmpy.ssp.simulation import simulate_ssp
from fmus import begin, discard, get, is_set, make_instance, put
from programs import run_importer
from test_swing import AT_THE_BALL, sequence

import golf_impact
from golf_build import native
from golf_build.archive import unpack
from golf_build.system import CONNECTIONS, DRIVE, SYSTEM

STOP = 0.98  # s: by then the ball has been launched, and the swing has the impulse


#: Outputs by component: all tools find their last values.
READ = {
    "Swing": ("club_speed", "head_speed", "reaction_impulse"),
    "ClubBallImpact": ("ball_velocity", "impulse", "touch_time", "smash_factor"),
    "Launch": ("ball_speed", "launch_angle", "backspin"),
    "BallFlight": ("carry", "apex"),
}
NAMES = [f"{part}.{name}" for part, names in READ.items() for name in names]


def run_system(fmus, steps):
    """Run the system by steps of any sizes (s); an output reaches the others in the next one.

    `fmus` are the files by component. Returns the values of NAMES.
    """
    slaves = {name: begin(make_instance(fmpy.extract(str(fmus[name])), name)) for name in fmus}
    # Its own start value is a speed at which it would touch the ball at once.
    put(slaves["ClubBallImpact"], club_speed=get(slaves["Swing"], "club_speed")[0])
    time = 0.0
    for size in steps:
        for slave in slaves.values():
            slave.doStep(time, size)
        for start, output, end, name in CONNECTIONS:
            is_flag = slaves[start].types[output] == "Boolean"
            value = is_set(slaves[start], output) if is_flag else get(slaves[start], output)[0]
            put(slaves[end], **{name: value})
        time += size
    found = [value for part, names in READ.items() for value in get(slaves[part], *names)]
    discard(*slaves.values())
    return dict(zip(NAMES, found, strict=True))


# Programs for `run_importer`.
TOOLS = {
    "libcosimpy": """
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
execution = CosimExecution.from_ssp_file(ssp, step_size=round(step * 1e9))
observer = CosimObserver.create_last_value()
assert execution.add_observer(observer) and execution.step(steps)
values = []
for name in names:
    component, variable = name.split(".")
    slave = execution.slave_index_from_instance_name(component)
    reference = next(v.reference for v in execution.slave_variables(slave)
                     if v.name.decode() == variable)
    values += observer.last_real_values(slave, [reference])
""",
    "ecospy": """
from ecospy.EcosSimulation import EcosSimulation
with EcosSimulation(ssp_path=ssp, step_size=step) as simulation:
    assert simulation.init()
    simulation.step(steps)
    values = [simulation.get_real(name.replace(".", "::")) for name in names]
""",
}


def by_fmpy(ssp, step, stop=STOP, names=NAMES):
    """Values of `names` at the end of a drive."""
    # fmpy adds up its steps: half a step less, and it ends at the stop time.
    end = (math.ceil(stop / step) - 0.5) * step
    rows = simulate_ssp(str(ssp), stop_time=end, step_size=step)
    return {name: float(rows[name][-1]) for name in names}


def run_in(tool, ssp, step):
    if tool == "fmpy":
        return by_fmpy(ssp, step)
    given = str(ssp), step, math.ceil(STOP / step)
    return run_importer(tool, f"ssp, step, steps = given\n{TOOLS[tool]}", NAMES, *given)


@pytest.fixture(scope="module")
def by_our_host(drive):
    """The same by our own host, by communication step."""

    @cache
    def run(step):
        return run_system(drive, [step] * math.ceil(STOP / step))

    return run


@pytest.mark.parametrize(
    "step", [*some(1, [5e-3, 1e-3, 1e-4]), pytest.param(1e-5, marks=pytest.mark.nightly)]
)
@pytest.mark.parametrize(
    "tool", ["fmpy", *(pytest.param(tool, marks=pytest.mark.importers) for tool in TOOLS)]
)
def test_the_same_numbers_in_every_tool(tool, ssp, by_our_host, step):
    assert run_in(tool, ssp, step) == pytest.approx(by_our_host(step), rel=1e-12, abs=0.0)


@pytest.mark.parametrize("seed", some(2, range(4)))
def test_any_steps_give_the_same_drive(drive, by_our_host, seed):
    steps = sequence(seed)
    # Long enough for the ball to be launched and the swing to have the impulse.
    steps = steps[: np.searchsorted(np.cumsum(steps), 1.0 + 5.0 * steps.max()) + 1]
    last, expected = run_system(drive, steps.tolist()), by_our_host(5e-3)
    names = "Launch.backspin", "Launch.ball_speed", "ClubBallImpact.impulse", "BallFlight.carry"
    assert_close(last, {name: expected[name] for name in names}, tolerance=1e-12, seed=seed)
    # The swing gets all of the impulse, and the drive's start values act.
    impulse, ball = last["ClubBallImpact.impulse"], last["ClubBallImpact.ball_velocity"]
    assert last["Swing.reaction_impulse"] == impulse
    assert impulse == pytest.approx(0.04593 * ball, rel=1e-13)
    assert 9.0 < math.degrees(last["Launch.launch_angle"]) < 14.0
    assert 2200.0 < last["Launch.backspin"] * 30.0 / math.pi < 3200.0
    assert 220.0 < last["BallFlight.carry"] < 270.0


@pytest.mark.ci
def test_a_native_impact_gives_the_same_drive(by_our_host, monkeypatch, tmp_path):
    """The start values of the drive are in its library, too: here, by this machine's compiler."""
    monkeypatch.setattr(native, "ziglang", lambda: None)
    try:
        ssp = SYSTEM.build(tmp_path / "native.ssp", native=True)
    except golf_impact.UserError as error:
        pytest.skip(str(error))
    assert by_fmpy(ssp, 5e-3) == pytest.approx(by_our_host(5e-3), rel=1e-12)


# The files


@pytest.mark.plain
def test_the_files_beside_the_ssp_keep_their_start_values(files, drive, fmu_path):
    beside = {file.stem: file for file in (*files[:-1], fmu_path)}
    for name, path in drive.items():
        own, inside = (
            {v.name: v.start for v in fmpy.read_model_description(str(file)).modelVariables}
            for file in (beside[name], path)
        )
        changed = {one: float(inside[one]) for one in own if own[one] != inside[one]}
        assert changed == DRIVE[name]


def test_the_drive_fits_the_swing(drive, instance):
    """Attack angle, effective mass and COR in the .ssp are those that they are described as."""
    swing = instance(drive["Swing"])
    swing.doStep(0.0, 1e-3)
    launch, impact = DRIVE["Launch"], DRIVE["ClubBallImpact"]
    assert get(swing, "effective_mass")[0] == pytest.approx(launch["m_club"], rel=1e-9)
    turned = 1.0 / launch["m_club"] + launch["strike_height"] ** 2 / launch["head_inertia"]
    assert impact["m_club"] == pytest.approx(1.0 / turned, rel=1e-15)
    assert DRIVE["Swing"]["spin_loft"] == launch["dynamic_loft"] - launch["attack_angle"]
    _, (_, _, path, _) = integrations.swing(swing, [0.3])
    assert path == pytest.approx(launch["attack_angle"], abs=1e-8)
    cor = impact["restitution_at_rest"] - impact["restitution_slope"] * 113 * 0.44704
    assert cor == pytest.approx(0.801, abs=5e-4)


#: Ball and head of the system as parameters of `golf_impact.drive`.
OF_THE_DRIVE = DRIVE["ClubBallImpact"] | DRIVE["Launch"]
LOFT, PATH = (OF_THE_DRIVE.pop(name) for name in ("dynamic_loft", "attack_angle"))


def test_a_drive_in_python_is_that_of_the_system(ssp):
    """The swing gives the speed; at the .ssp's stop time the ball has landed."""
    structure = ElementTree.fromstring(unpack(ssp)["SystemStructure.ssd"])
    stop = float(structure.find("{*}DefaultExperiment").get("stopTime"))
    names = [f"Launch.{name}" for name in ("ball_speed", "launch_angle", "backspin")]
    names += [f"BallFlight.{name}" for name in ("carry", "apex", "flight_time", "land_angle")]
    more = ["BallFlight.landed", "BallFlight.distance", "ClubBallImpact.smash_factor"]
    names += ["ClubBallImpact.ball_velocity", *more]
    expected = by_fmpy(ssp, 5e-2, stop, names)
    landed, distance, smash_factor = map(expected.pop, more)
    speed = expected["ClubBallImpact.ball_velocity"] / smash_factor / math.cos(LOFT - PATH)
    found = golf_impact.drive("tour", speed, LOFT, PATH, **OF_THE_DRIVE)
    assert landed == 1.0
    assert distance == pytest.approx(found["carry"], rel=1e-12)
    assert found["smash_factor"] == pytest.approx(smash_factor, rel=1e-12)
    for name, value in expected.items():
        assert found[name.partition(".")[2]] == pytest.approx(value, rel=1e-12), name


def test_parameters_of_the_system_by_fmpy(ssp):
    """The README's lines set another loft; `drive` with it has the same launch and flight."""
    text = (HERE.parent / "fmu_src/golf_physics/companions/README.md").read_text("utf-8")
    (code,) = (one for one in re.findall("```python\n(.*?)```", text, re.S) if "ssp" in one)
    found: dict = {}
    exec(code.replace("build/GolfSwing.ssp", str(ssp)), found)
    loft, attack = (found["values"][f"Launch.{one}"] for one in ("dynamic_loft", "attack_angle"))
    same = golf_impact.drive("tour", AT_THE_BALL, loft, attack, **OF_THE_DRIVE)
    for name in ("Launch.launch_angle", "BallFlight.carry"):
        assert found["rows"][name][-1] == pytest.approx(same[name.partition(".")[2]], rel=1e-9)
