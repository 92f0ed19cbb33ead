"""Fixtures for the companion FMUs: Swing, Launch and BallFlight, built once and loaded by fmpy."""

from functools import cache

import fmpy
import pytest
from fmus import begin, discard, make_instance


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
    folder = tmp_path_factory.mktemp("drive")
    fmpy.extract(str(ssp), str(folder))
    return {file.stem: file for file in folder.rglob("*.fmu")}


@pytest.fixture(scope="session")
def folder_of(tmp_path_factory):
    """A function that extracts an FMU, once."""
    return cache(lambda path: fmpy.extract(str(path), str(tmp_path_factory.mktemp(path.stem))))


@pytest.fixture
def instance(folder_of):
    """Initialized instances of FMUs by path."""
    slaves = []

    def instance(path, **values):
        slaves.append(make_instance(folder_of(path), f"instance {len(slaves)}"))
        return begin(slaves[-1], **values)

    yield instance
    discard(*slaves)


@pytest.fixture
def companion(files, instance):
    """Instances of a companion by the name of its FMU."""

    def made(name, **values):
        return instance(next(file for file in files if file.stem == name), **values)

    return made
