"""Fixtures for all tests: the built FMUs, and tables of reference cases."""

import gc
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

import fmpy
import pytest
from filelock import FileLock
from hypothesis import HealthCheck, settings

from golf_build import native
from golf_build.system import COMPANIONS, SYSTEM
from golf_build.system import build as build_system
from golf_impact.fmu import current_fmu

pytest_plugins = ["companions", "programs", "ways"]

HERE = Path(__file__).resolve().parent

# Tests compare what commands print: without colours, which CI services ask for, and equally wide.
os.environ.pop("FORCE_COLOR", None)
os.environ["COLUMNS"] = "120"

# Where containers switch bytecode off, each process would compile all its modules anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

#: s; with the defaults.
LAW_2_CONTACT = 6.010445569987614e-4

#: S, COR and velocities (m/s) of the defaults by law; `cases.exact` has more.
CRITERIA = ("smash_factor", "coefficient_of_restitution", "club_velocity", "ball_velocity")
_RESULTS = {
    1: (1.5641431548673965, 0.9490239649368044, 21.529171647570728, 54.74501042035888),
    2: (1.5842497138122187, 0.9307477583617195, 22.872568440767466, 55.44873998342765),
}
EXPECTED = {law: dict(zip(CRITERIA, results)) for law, results in _RESULTS.items()}

#: Fixtures: the FMU in Python, and the native ones for each version of FMI.
FILES = ("fmu_path", "native_path", "native_fmi3_path")


def holds_c(path):
    """Whether it is a native FMU."""
    return path.stem.endswith((".native", ".fmi3"))


# The same examples every time, with --ci more of them; at night, new ones and far more:
# --hypothesis-profile=nightly.
_slow_is_fine = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
_same = {"derandomize": True, "database": None}
settings.register_profile("few", max_examples=30, **_same, **_slow_is_fine)
settings.register_profile("ci", max_examples=100, **_same, **_slow_is_fine)
settings.register_profile("nightly", max_examples=10_000, print_blob=True, **_slow_is_fine)


def pytest_addoption(parser):
    parser.addoption("--native", action="store_true", help="test the native FMUs instead")
    parser.addoption("--ci", action="store_true", help="also what takes long, as .ci/run does")
    parser.addoption("--update", action="store_true", help="write files of expected output anew")
    parser.addoption("--may-skip", help="fail if a test skips for a reason without this pattern")


def pytest_configure(config):
    some.at_night = "nightly" in config.getoption("markexpr")
    if not config.getoption("--hypothesis-profile"):
        settings.load_profile("ci" if config.getoption("--ci") else "few")


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    """What a machine has must be tested there: a skip that .ci/run can't explain is a failure."""
    expected = session.config.getoption("--may-skip")
    terminal = session.config.pluginmanager.get_plugin("terminalreporter")
    if expected is None or terminal is None:
        return
    reasons = {report.longrepr[2] for report in terminal.stats.get("skipped", [])}
    if unexplained := sorted(why for why in reasons if not re.search(expected, why)):
        terminal.write_line(f"Tests skipped here that should run: {unexplained}", red=True)
        session.exitstatus = 1


@pytest.hookimpl(tryfirst=True)
def pytest_xdist_auto_num_workers(config):
    """The tests of a file stay in one process: without others, or if they write files, in this."""
    if config.getoption("--update"):
        return 0
    files = {argument.partition("::")[0] for argument in config.args}
    return 0 if len(files) == 1 and files.pop().endswith(".py") else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    # Nightly and browser tests are selected only by name, with -m.
    named = config.getoption("markexpr")
    left_out = {mark for mark in ("nightly", "browser") if mark not in named}
    if config.getoption("--native"):
        left_out.add("plain")
    if not config.getoption("--ci"):
        left_out |= {"ci", "importers"}
    kept, dropped = [], []
    for item in items:
        if "browser" in item.fixturenames:
            item.add_marker("browser")
        if {"fmu", "fmu_path"} & {*item.fixturenames}:
            item.add_marker("exchanged")
        (dropped if any(map(item.get_closest_marker, left_out)) else kept).append(item)
    config.hook.pytest_deselected(items=dropped)
    items[:] = kept


def pytest_collection_finish():
    """The garbage collector needn't walk what imports and collection have left in memory."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def _temporary(tmp_path_factory):
    """What tools, and processes that are killed, leave behind goes where pytest cleans up."""
    os.environ["TMPDIR"] = tempfile.tempdir = str(tmp_path_factory.mktemp("left"))


@pytest.fixture(scope="session", autouse=True)
def _commands_find_the_fmus():
    """Otherwise they report that they had to build them."""
    if native.pythonfmu_runs_here():
        current_fmu()


@pytest.fixture(autouse=True)
def _figures_are_closed():
    """pyplot keeps figures, and warns about many."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")


@pytest.fixture(scope="session")
def once(pytestconfig):
    """Builds a file or folder once for all processes, and for later runs while its sources stay."""
    kept = Path(pytestconfig.cache.mkdir("built"))

    def once(name, digest, build, kind="all"):
        place = kept / f"{name}.{kind}"
        path = place / digest[:16] / name
        with FileLock(f"{place}.lock"):
            if not path.exists():
                shutil.rmtree(place, ignore_errors=True)
                making = Path(tempfile.mkdtemp(dir=kept))
                build(making / name)
                place.mkdir()
                making.rename(path.parent)
        return path

    return once


def _built(name):
    """A fixture: an FMU of `ways.FMUS`, built from the current sources."""

    @pytest.fixture(scope="session")
    def path(once, request):
        from ways import fmu_file

        in_c = name == "FMI 2.0" and request.config.getoption("--native")
        return fmu_file(once, f"native, {name}" if in_c else name)

    return path


fmu_path = _built("FMI 2.0")
native_path, native_fmi3_path = _built("native, FMI 2.0"), _built("native, FMI 3.0")


@pytest.fixture(scope="session")
def system_files(once):
    """A function that returns Swing.fmu, Launch.fmu, BallFlight.fmu and GolfSwing.ssp."""

    def system_files():
        folder = once("system", SYSTEM.digest(), build_system)
        return [*(folder / f"{name}.fmu" for name in COMPANIONS), folder / "GolfSwing.ssp"]

    return system_files


@pytest.fixture(scope="session")
def extracted(fmu_path, tmp_path_factory):
    """The FMU's folder."""
    return fmpy.extract(str(fmu_path), str(tmp_path_factory.mktemp("extracted")))


def some(few, values, more=None):
    """Values for `parametrize`: the first in every run, others with --ci, the rest at night.

    Args:
        few: how many of them every time.
        values: a list, or a dict whose keys are their names.
        more: how many with --ci; all, unless it is given.
    """

    named = values if isinstance(values, dict) else {str(value): value for value in values}
    more = len(named) if more is None else more
    marks = [[]] * few + [[pytest.mark.ci]] * (more - few)
    # Tens of thousands, which take 1 s to collect.
    marks += [[pytest.mark.nightly]] * ((len(named) - more) * some.at_night)
    return [
        pytest.param(value, id=name, marks=mark)
        for (name, value), mark in zip(named.items(), marks)
    ]


#: Whether they are asked for.
some.at_night = False


def numbers(few, more, many):
    """Seeds of random cases: a few, more with --ci, many at night."""
    return some(few, range(many), more)


def repeated(few, more, many):
    """Numbers of repetitions: in every run, with --ci and at night."""
    return some(1, [few, more, many], 2)
