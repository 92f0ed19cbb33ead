"""Fixtures for the companion FMUs: Swing, Launch and BallFlight, built once and loaded by fmpy."""

import fmpy
import loaded as system
import pytest
from instances import begin, discard, make_instance


@pytest.fixture(scope="session")
def files(system_files):
    """Swing.fmu, Launch.fmu, BallFlight.fmu and GolfSwing.ssp."""
    return system_files()


@pytest.fixture(scope="session")
def ssp(files):
    return files[-1]


@pytest.fixture(scope="session")
def drive(ssp, tmp_path_factory):
    """The four FMUs inside the .ssp by the names of the components."""
    return system.extract_fmus(ssp, tmp_path_factory.mktemp("drive"))


@pytest.fixture
def made():
    """Instances of extracted FMUs, terminated and freed at the end."""
    slaves = []

    def made(folder, kind=None, **options):
        slaves.append(make_instance(folder, f"instance {len(slaves)}", kind, **options))
        return slaves[-1]

    yield made
    discard(*slaves)


@pytest.fixture
def instance(made, tmp_path_factory):
    """Initialized instances of FMUs by path."""

    def instance(path, **values):
        return begin(
            made(fmpy.extract(str(path), str(tmp_path_factory.mktemp(path.stem)))), **values
        )

    return instance


@pytest.fixture
def companion(files, instance):
    """Instances of a companion by the name of its FMU."""

    def made(name, **values):
        return instance(next(file for file in files if file.stem == name), **values)

    return made
