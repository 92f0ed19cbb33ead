"""Fixtures for all tests: the built FMUs, and tables of reference cases."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import fmpy
import pytest
from command import run_python
from filelock import FileLock
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Discard, fmi2Error
from fmus import discard, get, initialize, is_set, make_instance, put
from hypothesis import HealthCheck, settings

from golf_build import native
from golf_build.packaging import packaged
from golf_build.system import COMPANIONS
from golf_build.system import build as build_system
from golf_impact.doctor import find_libpython_for
from golf_impact.errors import UserError, first_line
from golf_impact.fmu import builder_of
from golf_impact.runs import ImpactRuns, Named

pytest_plugins = ["companions", "ways"]

HERE = Path(__file__).resolve().parent

#: FMI's C headers.
HEADERS = Path(fmpy.__file__).parent / "c-code"

#: s; with the defaults.
LAW_2_CONTACT = 6.010445569987614e-4

#: S, COR and velocities (m/s) of the defaults by law; `cases.exact` has more.
LAW_1 = {
    "smash_factor": 1.5641431548673967,
    "coefficient_of_restitution": 0.9490239649368046,
    "club_velocity": 21.529171647570724,
    "ball_velocity": 54.74501042035889,
}
CRITERIA = (*LAW_1,)
_LAW_2 = (1.5842497138122187, 0.9307477583617195, 22.872568440767466, 55.44873998342765)
EXPECTED = {1: LAW_1, 2: dict(zip(CRITERIA, _LAW_2))}

#: Fixtures: the FMU for each version of FMI, plain and native.
FILES = ("fmu_path", "fmi3_path", "native_path", "native_fmi3_path")


def holds_c(path):
    """Whether it is a native FMU."""
    return "native" in path.name


def build_fmu(out, fmi=2):
    """Build ClubBallImpact.fmu."""
    return builder_of(fmi=fmi).build(out)


def build_plain_fmu(script, folder):
    """Package a self-contained slave with pythonfmu, without additions."""
    with packaged(2, script.stem, script.read_bytes(), {}) as fmu:
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(fmu, folder))


def build_native(path, fmi):
    native.build(builder_of(fmi=fmi), path)


# The same examples every time, with --ci more of them; at night, new ones and far more:
# --hypothesis-profile=nightly.
_slow_is_fine = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
_same = {"derandomize": True, "database": None}
settings.register_profile("few", max_examples=40, **_same, **_slow_is_fine)
settings.register_profile("ci", max_examples=100, **_same, **_slow_is_fine)
settings.register_profile("nightly", max_examples=10_000, print_blob=True, **_slow_is_fine)


def pytest_addoption(parser):
    parser.addoption("--native", action="store_true", help="test the native FMUs instead")
    parser.addoption("--ci", action="store_true", help="also what takes long, as .ci/run does")


def pytest_configure(config):
    if not config.getoption("--hypothesis-profile"):
        settings.load_profile("ci" if config.getoption("--ci") else "few")


@pytest.hookimpl(tryfirst=True)
def pytest_xdist_auto_num_workers(config):
    """The tests of a file stay in one process: without others, in this one."""
    files = {argument.partition("::")[0] for argument in config.args}
    return 0 if len(files) == 1 and files.pop().endswith(".py") else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    # Nightly and browser tests are selected only by name, with -m.
    named = config.getoption("markexpr")
    left_out = {mark for mark in ("nightly", "browser") if mark not in named}
    if config.getoption("--native"):
        left_out |= {"plain", "model_exchange"}
    if not config.getoption("--ci"):
        left_out.add("ci")
    kept, dropped = [], []
    for item in items:
        if "browser" in item.fixturenames:
            item.add_marker("browser")
        (dropped if any(map(item.get_closest_marker, left_out)) else kept).append(item)
    config.hook.pytest_deselected(items=dropped)
    items[:] = kept


#: Tasks of the C host with an instance, and their arguments; each ends with the impact of LAW_1.
HOST_TASKS = [("migrate",), ("gone", "50"), ("fork",)]


@pytest.fixture(scope="session", autouse=True)
def _temporary(tmp_path_factory):
    """What tools, and processes that are killed, leave behind goes where pytest cleans up."""
    os.environ["TMPDIR"] = tempfile.tempdir = str(tmp_path_factory.mktemp("left"))


@pytest.fixture(autouse=True)
def _figures_are_closed():
    """pyplot keeps figures, and warns about many."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")


@pytest.fixture(scope="session")
def once(tmp_path_factory):
    """Build an FMU once for all processes of a test run, in the first one that needs it."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent

    def once(name, build=build_fmu, **how):
        path = folder / "built" / Path(name).stem / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(path.with_suffix(".lock")):
            if not path.exists():
                build(path, **how)
        return path

    return once


def _built(name, fmi, in_c=False):
    """A fixture: the FMU, built from the current sources, for a version of FMI."""

    @pytest.fixture(scope="session")
    def path(once, request):
        if in_c or request.config.getoption("--native"):
            require_native()
            return once(f"ClubBallImpact{name}.native.fmu", build_native, fmi=fmi)
        return once(f"ClubBallImpact{name}.fmu", fmi=fmi)

    return path


fmu_path, fmi3_path = _built("", 2), _built(".fmi3", 3)
native_path, native_fmi3_path = _built("", 2, in_c=True), _built(".fmi3", 3, in_c=True)


@pytest.fixture(scope="session")
def is_native(request):
    """Whether the FMUs are native ones: these return Error for an illegal call."""
    return request.config.getoption("--native")


@pytest.fixture(scope="session")
def system_files(once):
    """A function that returns Swing.fmu, Launch.fmu, BallFlight.fmu and GolfSwing.ssp."""

    def system_files(in_c=False):
        if in_c:
            require_native()
        folder = once("native system" if in_c else "system", build_system, native=in_c)
        suffix = native.SUFFIX if in_c else ""
        files = [folder / f"{name}.fmu" for name in COMPANIONS]
        return [*files, folder / f"GolfSwing{suffix}.ssp"]

    return system_files


@pytest.fixture(scope="session")
def extracted(fmu_path, tmp_path_factory):
    """The FMU's folder."""
    return fmpy.extract(str(fmu_path), str(tmp_path_factory.mktemp("extracted")))


class ImpactFmu(ImpactRuns):
    """ClubBallImpact.fmu for FMI 2.0, in one instance for any number of runs.

    For use in a `with` block.

    Attributes:
        slave: the instance; see `make_instance`.
        messages: of its logger, since the last `start`.
    """

    def __init__(self, path):
        self.slave = make_instance(fmpy.extract(str(path)), loggingOn=True)
        self.variables, self.messages = self.slave.variables, self.slave.messages
        self.description = self.slave.description
        kinds = ("output", "Real")
        self.real_outputs = [
            name for name, v in self.variables.items() if (v.causality, v.type) == kinds
        ]
        # Restoring it is far cheaper than a reset, which makes a new Python object.
        self._initial = self.slave.getFMUstate()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.slave.freeFMUstate(self._initial)
        discard(self.slave)

    def default(self, name):
        """The start value of an input or parameter."""
        return float(self.variables[name].start)

    def references(self, names):
        return [self.slave.references[name] for name in names]

    def begin_run(self, values):
        """Begin a run with these inputs and parameters (SI units); refusals are messages."""
        self.slave.setFMUstate(self._initial)
        initialize(self.slave)
        self.set(values)
        try:
            self.slave.exitInitializationMode()
        except FMICallException as error:
            if error.status != fmi2Error or not self.messages:
                raise

    def start(self, **values):
        """Begin a run with these inputs and parameters; UserError if they are refused."""
        self.messages.clear()
        self.begin_run(values)
        if self.messages:
            raise UserError(self.messages[0])

    def set(self, values):
        """Set inputs and parameters (SI units)."""
        put(self.slave, **values)

    def step(self, point, size):
        """Make a communication step of `size` s from `point`, s; UserError if it is discarded."""
        try:
            self.slave.doStep(point, size)
        except FMICallException as error:
            if error.status != fmi2Discard:
                raise
            raise UserError(self.messages[-1] if self.messages else first_line(error)) from error

    def read(self, names):
        """Values of Real variables at this communication point, by name (SI units)."""
        return Named(zip(names, get(self.slave, *names), strict=True))

    def read_flag(self, name):
        return is_set(self.slave, name)


@pytest.fixture(scope="session")
def _loaded(fmu_path):
    with ImpactFmu(fmu_path) as fmu:
        yield fmu


@pytest.fixture
def fmu(_loaded):
    """One instance for all tests; each begins a new run."""
    _loaded.messages.clear()
    return _loaded


@pytest.fixture(scope="session")
def compiled(extracted, tmp_path_factory):
    """A function that compiles a file of tests/hosts/native_host and gives the program's path."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("there is no C compiler on this machine")
    folder = tmp_path_factory.mktemp("compiled")
    variables = fmpy.read_model_description(extracted).modelVariables
    macros = [f"-DVR_{v.name}={v.valueReference}" for v in variables]
    flags = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-O1", f"-I{HEADERS}", *macros]

    def compiled(name, *options, by=(compiler,), libraries=("-ldl", "-pthread", "-lm"), suffix=""):
        program = folder / f"{name}{suffix}"
        if not program.exists():
            source = HERE / "hosts" / "native_host" / f"{name}.c"
            subprocess.run([*by, *flags, *options, source, "-o", program, *libraries], check=True)
        return program

    return compiled


@pytest.fixture(scope="session")
def freed(compiled):
    """A library to preload: access to pythonfmu's state after it is freed ends the process."""
    if sys.platform != "linux":
        pytest.skip("the library is of another kind there")
    return compiled("freed", "-shared", "-fPIC")


@pytest.fixture(scope="session")
def libpython(fmu_path):
    """A libpython that a native host can load the FMU with."""
    file = find_libpython_for(fmu_path)
    if file is None:
        pytest.skip("there is no shared libpython on this machine")
    return file


@pytest.fixture
def no_figure_stays_open():
    yield
    import matplotlib.pyplot as plt

    plt.close("all")


def require(tool):
    """Skip without this importer of the extra interop."""
    if importlib.util.find_spec(tool) is None:
        pytest.skip(f"{tool} isn't installed (pip install golf-impact[interop])")
    if tool == "ecospy":
        loads = subprocess.run([sys.executable, "-c", "import ecospy.lib"], capture_output=True)
        if loads.returncode:
            pytest.skip("ecospy can't be loaded: apt-get install libtbb12")


def run_importer(tool, code, names, *given):
    """The values of `names` that a program of another importer finds, in a process of its own.

    Native libraries don't all like each other. The program has `names` and `given`, and sets
    `values`.
    """
    require(tool)
    prelude = "import json, sys\nnames, *given = json.loads(sys.argv[1])\n"
    program = f'{prelude}{code}\nprint("values", json.dumps(list(values)))'
    done = run_python(program, json.dumps([names, *given]), timeout=900)
    # libcosim writes its log to stdout as well.
    (line,) = (text for text in done.stdout.splitlines() if text.startswith("values "))
    return dict(zip(names, json.loads(line.removeprefix("values ")), strict=True))


def require_native():
    """Skip where native FMUs can't be built: without ziglang and without a C compiler."""
    if native.fewer_platforms() and shutil.which("cc") is None:
        pytest.skip(native.advice())


def some(few, values, more=None):
    """Values for `parametrize`: the first in every run, others with --ci, the rest at night.

    Args:
        few: how many of them every time.
        values: a list, or a dict whose keys are their names.
        more: how many with --ci; all, unless it is given.
    """

    def marks(n):
        if n < few:
            return []
        return [pytest.mark.ci if more is None or n < more else pytest.mark.nightly]

    named = values if isinstance(values, dict) else {str(value): value for value in values}
    return [
        pytest.param(value, id=name, marks=marks(n))
        for n, (name, value) in enumerate(named.items())
    ]


def numbers(few, more, many):
    """Seeds of random cases: a few, more with --ci, many at night."""
    return some(few, range(many), more)


def repeated(few, more, many):
    """Numbers of repetitions: in every run, with --ci and at night."""
    return some(1, [few, more, many], 2)
