"""Fixtures for the companion FMUs: Swing, Launch and BallFlight, built once and loaded by fmpy."""

import fmpy
import pytest
from fmpy.fmi2 import FMU2Slave

from golf_impact.fmu import system


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Swing.fmu, Launch.fmu, BallFlight.fmu and GolfSwing.ssp."""
    return system.build_system(tmp_path_factory.mktemp("system"))


@pytest.fixture(scope="module")
def ssp(files):
    return files[-1]


@pytest.fixture(scope="module")
def drive(ssp, tmp_path_factory):
    """The four FMUs inside the .ssp by the names of the components."""
    return system.extract_fmus(ssp, tmp_path_factory.mktemp("drive"))


@pytest.fixture
def instance(tmp_path):
    """Instances of FMUs by path, terminated and freed at the end."""
    slaves = []

    def made(path, **values):
        description = fmpy.read_model_description(str(path))
        folder = fmpy.extract(str(path), str(tmp_path / f"{path.stem}{len(slaves)}"))
        slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=path.stem,
            instanceName=path.stem,
        )
        slave.instantiate()
        slaves.append(slave)
        slave.references = {v.name: v.valueReference for v in description.modelVariables}
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        put(slave, **values)
        slave.exitInitializationMode()
        return slave

    yield made
    for slave in slaves:
        slave.terminate()
        slave.freeInstance()


@pytest.fixture
def companion(files, instance):
    """Instances of a companion by the name of its FMU."""

    def made(name, **values):
        return instance(next(file for file in files if file.stem == name), **values)

    return made


def put(slave, **values):
    for name, value in values.items():
        if isinstance(value, bool):
            slave.setBoolean([slave.references[name]], [value])
        else:
            slave.setReal([slave.references[name]], [value])


def get(slave, *names):
    return slave.getReal([slave.references[name] for name in names])
