"""Importers, for real: each has the same S, COR, v_C and v_B at steps of 1e-3, 1e-4 and 1e-6 s.

A step of 1e-3 s is longer than the whole contact. Tools with native libraries run in processes of
their own.
"""

import multiprocessing
import shutil
import sys
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import pytest
from command import ROOT, run
from compare import assert_close
from conftest import CRITERIA, EXPECTED, HERE
from fmus import begin, discard, get, make_instance
from programs import require, run_importer

STEPS = (1e-3, 1e-4, 1e-6)
STOP = 0.005


def same(results, law=1):
    # Measured: 3e-16.
    assert_close(results, EXPECTED[law], law=law)


# fmpy


@pytest.mark.parametrize("law", [1, 2])
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("path", ["fmu_path", "fmi3_path"])
def test_simulate_fmu(request, path, step, law):
    fmu = str(request.getfixturevalue(path))
    rows = fmpy.simulate_fmu(
        fmu,
        stop_time=STOP,
        step_size=step,
        output_interval=step,
        start_values={"law": law},
        output=CRITERIA,
        use_event_mode=path == "fmi3_path",
        early_return_allowed=True,
    )
    same({name: rows[name][-1] for name in CRITERIA}, law)
    # pythonfmu3 0.3.4 drops early return; if it no longer does, event mode can do all of FMI 3.0.
    early = fmpy.read_model_description(fmu).coSimulation.mightReturnEarlyFromDoStep
    assert (len(rows) == round(STOP / step) + 1) == (not early)


def one_run(extracted, law):
    slave = begin(make_instance(extracted), law=law)
    for n in range(500):
        slave.doStep(n * 1e-5, 1e-5)
    results = dict(zip(CRITERIA, get(slave, *CRITERIA)))
    discard(slave)
    return results


def test_threads(extracted):
    laws = [1, 2] * 6
    with ThreadPoolExecutor(4) as pool:
        for law, results in zip(laws, pool.map(one_run, [extracted] * 12, laws), strict=True):
            same(results, law)


_PROCESSES = """
import multiprocessing, sys
sys.path.insert(0, sys.argv[2])
from test_interop import one_run, same

if __name__ == "__main__":
    extracted, method = sys.argv[1], sys.argv[3]
    same(one_run(extracted, 1))  # a fork then has a loaded FMU in it
    with multiprocessing.get_context(method).Pool(2) as pool:
        laws = [1, 2] * 4
        for law, results in zip(laws, pool.starmap(one_run, [(extracted, law) for law in laws])):
            same(results, law)
    print("done")
"""


@pytest.mark.ci
@pytest.mark.parametrize("method", multiprocessing.get_all_start_methods())
def test_processes(extracted, tmp_path, method):
    script = tmp_path / "processes.py"
    script.write_text(_PROCESSES)
    done = run(sys.executable, script, extracted, HERE, method, cwd=ROOT)
    assert done.stdout.strip().endswith("done"), done.stderr[-2000:]


# Other tools

_COSIM = """
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
execution = CosimExecution.from_step_size(round(step * 1e9))
index = execution.add_local_slave(CosimLocalSlave(fmu, "impact"))
variables = {v.name.decode(): v for v in execution.slave_variables(index)}
if law != 1:
    assert execution.integer_initial_value(index, variables["law"].reference, law)
observer = CosimObserver.create_last_value()
assert execution.add_observer(observer) and execution.step(steps)
values = observer.last_real_values(index, [variables[name].reference for name in names])
"""

_ECOS = """
from ecospy.EcosSimulation import EcosSimulation
from ecospy.EcosSimulationStructure import EcosSimulationStructure
with EcosSimulationStructure() as structure:
    structure.add_model("impact", fmu)
    structure.add_parameter_set("case", {"impact::law": law})
    with EcosSimulation(structure=structure, step_size=step) as simulation:
        assert simulation.init(parameter_set="case")
        simulation.step(steps)
        values = [simulation.get_real(f"impact::{name}") for name in names]
"""


@pytest.mark.importers
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize(
    ("tool", "code", "path", "law"),
    [
        *(("libcosimpy", _COSIM, "fmu_path", law) for law in (1, 2)),
        *(("ecospy", _ECOS, "fmu_path", law) for law in (1, 2)),
        # Of an Enumeration, as law is in FMI 3.0, ecos keeps the start value.
        ("ecospy", _ECOS, "fmi3_path", 1),
    ],
)
def test_other_importers(request, tool, code, path, step, law):
    given = str(request.getfixturevalue(path)), step, round(STOP / step), law
    same(run_importer(tool, f"fmu, step, steps, law = given\n{code}", CRITERIA, *given), law)


# fmu-manipulation-toolbox


def _toolbox(command, *arguments):
    require("fmu_manipulation_toolbox")
    program = shutil.which(command, path=str(Path(sys.executable).parent))
    done = run(program, *arguments)
    return done.stdout + done.stderr


@pytest.mark.importers
@pytest.mark.parametrize("path", ["fmu_path", "fmi3_path", "native_path"])
def test_fmutool_finds_it_compliant(request, path):
    output = _toolbox("fmutool", "-check", "-input", request.getfixturevalue(path))
    assert f"seems to be compliant with FMI-{'3' if path == 'fmi3_path' else '2'}.0" in output
    assert "No semantic error" in output


def test_what_omsimulator_reads(ssp):
    """It aborts without its annotation in the system, which the schema has last."""
    with zipfile.ZipFile(ssp) as archive:
        root = ElementTree.fromstring(archive.read("SystemStructure.ssd"))
    annotations = root.find("{*}System")[-1]
    assert annotations[0].get("type") == "org.openmodelica"
    (master,) = annotations.findall(".//{*}FixedStepMaster")
    assert (master.get("description"), float(master.get("stepSize"))) == ("oms-ma", 1e-4)


@pytest.mark.importers
@pytest.mark.parametrize("step", STEPS[:2])
def test_a_container_with_another_fmu(fmu_path, files, tmp_path, step):
    shutil.copy(fmu_path, tmp_path / "ClubBallImpact.fmu")
    shutil.copy(files[2], tmp_path / "BallFlight.fmu")
    links = ("ball_velocity", "separated", "touch_time", "contact_time")
    lines = [
        "rule;from_fmu;from_port;to_fmu;to_port",
        "FMU;ClubBallImpact.fmu;;;",
        "FMU;BallFlight.fmu;;;",
        *(f"LINK;ClubBallImpact.fmu;{name};BallFlight.fmu;{name}" for name in links),
        *(f"OUTPUT;ClubBallImpact.fmu;{name};;{name}" for name in CRITERIA),
        "OUTPUT;BallFlight.fmu;carry;;carry",
    ]
    (tmp_path / "both.csv").write_text("\n".join(lines) + "\n")
    _toolbox("fmucontainer", "-fmu-directory", tmp_path, "-container", f"both.csv:{step}")
    program = """
import fmpy
fmu, step = given
rows = fmpy.simulate_fmu(fmu, stop_time=0.01, step_size=step, output_interval=step, output=names)
values = [float(rows[name][-1]) for name in names]
"""
    names = [*CRITERIA, "carry"]
    results = run_importer("fmpy", program, names, str(tmp_path / "both.fmu"), step)
    same(results)
    assert results["carry"] == pytest.approx(158.79718480716062, rel=1e-12)
