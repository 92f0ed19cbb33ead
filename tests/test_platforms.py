"""FMUs for Windows, under wine, and for aarch64, under qemu, with the results of this machine.

GOLF_IMPACT_WINDOWS and GOLF_IMPACT_ARM64 name folders that tests/README.md describes.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from contextlib import suppress
from pathlib import Path

import fmpy
import pytest
from command import ROOT, ended, golf_here, printed_values, refused, run
from compare import assert_close
from conftest import EXPECTED, HERE, LAW_1, LAW_2_CONTACT, repeated
from loaded import build_fmu
from test_standalone import extracted, guid, outputs

from golf_build import toolchain
from golf_build.archive import unpack, write_archive
from golf_build.system import build as build_system
from golf_impact import doctor
from golf_impact.errors import UserError
from golf_impact.flaws import check_fmu

FMPY_TASKS = HERE / "fmpy_tasks.py"

pytestmark = pytest.mark.ci


def _machine(name):
    """A fixture: the folder of a machine to test on; skips without it."""

    @pytest.fixture(scope="session")
    def machine():
        if name not in os.environ:
            pytest.skip(f"{name} isn't set: tests/README.md has what it names")
        return Path(os.environ[name]).resolve()

    return machine


windows, arm64 = _machine("GOLF_IMPACT_WINDOWS"), _machine("GOLF_IMPACT_ARM64")


def for_windows(windows, kind="standalone"):
    """How files for this machine and Windows are built."""
    pythons = {"linux64": None, "win64": windows / "python-embed-amd64.zip"}
    return {"standalone": True, "pythons": pythons} if kind == "standalone" else {}


@pytest.fixture(scope="session")
def fmus(once, windows):
    """A function that gives ClubBallImpact.fmu and ClubBallImpact.fmi3.fmu for Windows."""

    def fmus(kind="standalone"):
        return [once(f"{kind}.{n}.fmu", fmi=n, **for_windows(windows, kind)) for n in (2, 3)]

    return fmus


@pytest.fixture(scope="session")
def arm64_fmu(once, arm64):
    pythons = {"linux64": None, "aarch64": arm64 / "root"}
    return once("arm64.fmu", fmi=3, standalone=True, pythons=pythons)


def windows_path(path):
    return "Z:" + str(path).replace("/", "\\")


def installed(folder, packages, *platforms):
    """A folder with packages as pip installs them on another platform."""
    words = ["-m", "pip", "install", "-q", "--no-deps", "--only-binary=:all:", "--target", folder]
    words += ["--python-version=3.11", *(f"--platform={name}" for name in platforms)]
    run(sys.executable, *words, *packages.split(), timeout=300)
    return folder


# Importers in Python


def printed(*command, code=0, timeout=600):
    """The results that fmpy_tasks.py prints; `code` None: whatever the exit code is."""
    done = run(*command, code=code, timeout=timeout)
    return dict(json.loads(line) for line in done.stdout.splitlines() if line.startswith('["'))


def printed_by_plain(*command):
    """pythonfmu's DLLs hang or abort there at times; what has been printed counts all the same."""
    for _ in range(5):
        with suppress(subprocess.TimeoutExpired):
            if found := printed(*command, code=None, timeout=100):
                return found
    return {}


def numbers_of(results, *key):
    """Every number in nested results by its path."""
    if not isinstance(results, dict | list):
        return {key: results}
    items = results.items() if isinstance(results, dict) else enumerate(results)
    return {k: value for name, item in items for k, value in numbers_of(item, *key, name).items()}


def assert_equal(there, here):
    there, here = numbers_of(there), numbers_of(here)
    assert there.keys() == here.keys()
    assert there == {key: pytest.approx(value, rel=1e-12) for key, value in here.items()}


@pytest.mark.parametrize("kind", ["plain", "standalone"])
def test_fmpy_on_windows(windows, fmus, once, kind):
    """Co-simulation, Model Exchange, states, refusals, early return, the companions, the SSP."""
    system = once(f"{kind} system for Windows", build_system, **for_windows(windows, kind))
    files = [*fmus(kind), *sorted(system.glob("*.fmu")), *system.glob("*.ssp")]
    here = printed(sys.executable, FMPY_TASKS, *files)
    assert len(numbers_of(here)) > 140
    words = windows / "python", FMPY_TASKS
    there = {} if kind == "plain" else printed(*words, *map(windows_path, files))
    for file in files if kind == "plain" else ():
        there |= printed_by_plain(*words, windows_path(file))
    # Measured: no difference. Windows itself may have another libm than wine.
    assert_equal(there, here)


_ON_ARM64 = """
import runpy, sys
sys.path += sys.argv.pop(1).split(":")
del sys.argv[0]
runpy.run_path(sys.argv[0], run_name="__main__")
"""


def test_fmpy_on_arm64(arm64, arm64_fmu, tmp_path):
    """Where fmpy 0.3.32 has no CVODE: SciPy solves Model Exchange.

    Its simulate_fmu takes no FMU without a binary for x86-64 there; with one, it loads the right
    one.
    """
    wheels = [f"manylinux{end}_aarch64" for end in ("2014", "_2_17", "_2_27", "_2_28")]
    packages = "fmpy==0.3.32 attrs lark lxml msgpack numpy scipy"
    site = installed(tmp_path / "site", packages, *wheels)
    words = FMPY_TASKS, "--scipy", arm64_fmu
    there = printed(arm64 / "python", "-c", _ON_ARM64, f"{site}:{HERE}", *words)
    here = printed(sys.executable, *words)
    assert len(numbers_of(here)) > 40
    # Measured: none, and 1e-15 with SciPy.
    assert_equal(there, here)


# Native hosts on Windows


@pytest.fixture(scope="session")
def on_windows(windows, compiled):
    """Runs a host of tests/native_host there: its outputs."""
    by = shutil.which("x86_64-w64-mingw32-gcc-posix")
    if by is None:
        pytest.skip("there is no mingw-w64 on this machine")

    def on_windows(name, *words, **environment):
        program = compiled(name, "-static", by=[by], libraries=["-lshell32"], suffix=".exe")
        command, env = (windows / "run", program, *words), {**os.environ, **environment}
        done = run(*command, env=env, code=None)
        if (done.returncode, done.stdout + done.stderr) == (1, ""):
            # Seen once: wine itself ended, without a word; a crash has code 5.
            done = run(*command, env=env, code=None)
        return printed_values(ended(done, 0))

    return on_windows


TASKS = [("impact", "1e-3"), ("migrate",), ("gone", "50"), ("exit", "3")]


@pytest.mark.parametrize("times", repeated(1, 3, 20))
@pytest.mark.parametrize("name", ["fmu", "ü # + %20"])
def test_a_native_host_on_windows(on_windows, fmus, tmp_path, name, times):
    """No Python, no environment variable; threads that come and go, an end while others step."""
    folder = extracted(fmus()[0], tmp_path / name)
    for _ in range(times):
        for task in TASKS:
            assert on_windows("host", folder, guid(folder), *task) == LAW_1


def test_a_host_on_windows_with_its_own_python(on_windows, windows, fmus, tmp_path):
    """Of the same version: its python311.dll is another one."""
    folder = extracted(fmus()[0], tmp_path / "fmu")
    python = windows_path(windows / "cpython")
    task = ("later", python + "\\python311.dll")
    assert on_windows("host", folder, guid(folder), *task, PYTHONHOME=python) == LAW_1
    before = {"LIBPYTHON": task[1]}
    assert on_windows("host", folder, guid(folder), "impact", "1e-3", **before) == LAW_1


def test_a_plain_fmu_on_windows_needs_python3_dll(on_windows, windows, fmus, tmp_path):
    folder = extracted(fmus("plain")[0], tmp_path / "fmu")
    words = ("host", windows_path(folder), guid(folder), "impact", "1e-3")
    assert on_windows(*words, WINEPATH=windows_path(windows / "cpython")) == LAW_1
    with pytest.raises(AssertionError, match="Windows error 126"):
        on_windows(*words)


def test_fmus_on_windows_share_one_python(on_windows, fmus, tmp_path):
    folders = [extracted(fmus()[0], tmp_path / str(n)) for n in range(3)]
    jobs = [word for folder in folders for word in (folder, "ClubBallImpact", guid(folder))]
    assert on_windows("several", *jobs) == {"steps": 1200, "pythons": 1}


# FMI 3.0 in a native host


def check_host3(found, plain):
    assert found == pytest.approx(plain, rel=1e-12)
    assert found["refused"] == 1
    assert [found[f"thread_{n}"] for n in range(3)] == [found["law2_S"]] * 3
    expected = {f"law{law}_S": one["smash_factor"] for law, one in EXPECTED.items()}
    assert_close(found, expected, tolerance=1e-14)
    # Runge & Kutta, 2000 steps: 1e-14 measured.
    assert found["me_COR"] == pytest.approx(found["law2_COR"], rel=1e-12)
    assert found["event_2"] - found["event_1"] == pytest.approx(LAW_2_CONTACT, rel=1e-12)


@pytest.fixture(scope="session")
def host3_here(compiled, standalone_fmi3_path, tmp_path_factory):
    folder = extracted(standalone_fmi3_path, tmp_path_factory.mktemp("here"))
    return outputs(compiled("host3"), folder, guid(folder), env={})


def test_fmi3_in_a_native_host_on_windows(on_windows, fmus, host3_here, tmp_path):
    folder = extracted(fmus()[1], tmp_path / "ü #")
    check_host3(on_windows("host3", folder, guid(folder)), host3_here)


@pytest.mark.parametrize("times", repeated(1, 3, 50))
def test_fmi3_in_a_native_host_on_arm64(arm64, arm64_fmu, compiled, host3_here, tmp_path, times):
    pytest.importorskip("ziglang", reason="pip install 'golf-impact[standalone]'")
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", "aarch64-linux-gnu.2.36"]
    folder = extracted(arm64_fmu, tmp_path / "ü #")
    program = compiled("host3", by=zig, suffix=".arm64")
    for _ in range(times):
        check_host3(outputs(arm64 / "run", program, folder, guid(folder), env={}), host3_here)


# The file


def test_one_fmu_for_two_platforms(windows, fmus, tmp_path):
    file = fmus()[0]
    assert file.stat().st_size <= 7e6
    with zipfile.ZipFile(file) as archive:
        licences = {n.rpartition("/")[2] for n in archive.namelist() if "/licenses/" in n}
    assert {"python.txt", "python-windows.txt", "mingw-w64.txt"} <= licences
    again = build_fmu(tmp_path / "again.fmu", **for_windows(windows))
    assert again.read_bytes() == file.read_bytes()


@pytest.mark.nightly  # ziglang makes its libraries for Windows first: a minute
def test_ziglang_builds_for_windows(monkeypatch, windows, on_windows, tmp_path):
    pytest.importorskip("ziglang", reason="pip install 'golf-impact[standalone]'")
    monkeypatch.setattr(toolchain.shutil, "which", lambda name: None)
    fmu = build_fmu(tmp_path / "x.fmu", **for_windows(windows))
    folder = extracted(fmu, tmp_path / "fmu")
    for task in TASKS:
        assert on_windows("host", folder, guid(folder), *task) == LAW_1


def test_an_fmu_without_a_binary_for_this_machine(fmu_path, tmp_path):
    files = unpack(fmu_path).items()
    ours = re.compile("binaries/linux|documentation/SHA")
    foreign = write_archive(tmp_path / "x.fmu", {n: d for n, d in files if not ours.match(n)})
    (problem,) = (text for level, text in doctor.examine(foreign) if level == "problem")
    expected = f"no binary for this machine, {toolchain.this_machine()}, but for Windows AMD64"
    assert expected in problem
    with pytest.raises(UserError, match=expected):
        check_fmu(foreign)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--target win64", "without --standalone"),
        ("--standalone --target mac", "linux64, win64, aarch64"),
        ("--standalone --target win64", "python.org"),
        ("--standalone --target win64 --python 312.zip", "312.zip is refused: it has no python311"),
        ("--standalone --target win64 --python arm.zip", "arm.zip is refused: its python311.dll"),
        ("--standalone --target win64 --python no.zip", "No such file"),
        ("--standalone --python 312.zip", "--target win64"),
        ("--standalone --target aarch64 --sysroot .", "--fmi 3"),
        ("--standalone --target aarch64 --fmi 3", "--sysroot FOLDER"),
        ("--standalone --target aarch64 --fmi 3 --sysroot nothing", "has no libpython3.11"),
        ("--standalone --target aarch64 --fmi 3 --sysroot .", "isn't for Linux aarch64"),
    ],
)
def test_what_is_missing_for_a_target_is_named(tmp_path, options, words):
    python = {"vcruntime140.dll": b"", "LICENSE.txt": b""}
    for name, dll in (("312", "python312.dll"), ("arm", "python311.dll")):
        # The format PE: the place of the signature, the signature, the processor.
        data = b"MZ".ljust(60) + (64).to_bytes(4, "little") + b"PE\0\0\x64\xaa"
        write_archive(tmp_path / f"{name}.zip", python | {dll: data})
    (tmp_path / "libpython3.11.so.1.0").write_bytes(b"\x7fELF".ljust(18) + b"\x3e\0")
    before = sorted(tmp_path.iterdir())
    refused(golf_here("build", *options.split(), "--out", "x.fmu", cwd=tmp_path), words)
    assert sorted(tmp_path.iterdir()) == before


# golf-impact on Windows

#: As pip would install them, but for what wine 8 can't load: NumPy 2, and pydantic of newer typers.
_PACKAGES = """
numpy==1.26.4 pythonfmu==0.7.0 pythonfmu3==0.3.4 typer==0.15.4 click==8.1.8 shellingham
typing_extensions rich markdown-it-py mdurl pygments jinja2 markupsafe find-libpython platformdirs
matplotlib==3.10.7 contourpy cycler fonttools kiwisolver packaging pillow pyparsing python-dateutil
six scipy==1.14.1 colorama mpmath
"""
_MAIN = """
import sys
sys.path[:0] = sys.argv.pop(1).split(";")
from golf_impact.__main__ import main
main()
"""


@pytest.mark.nightly
def test_golf_impact_on_windows(windows, fmu_path, tmp_path):
    """All but the scenario loft, which needs numpy.trapezoid of NumPy 2, and calibrate.

    That ends in a function which wine 8.0 lacks (ucrtbase.cexp).
    """
    site = installed(tmp_path / "site", _PACKAGES, "win_amd64")
    (about,) = Path(fmpy.__file__).parents[1].glob("golf_impact-*.dist-info")
    shutil.copytree(about, site / about.name)
    folders = [site, *(ROOT / name for name in ("scenarios", "build", "fmu_src"))]
    path = ";".join(map(windows_path, folders))

    def golf(*words, **options):
        words = (windows / "python", "-c", _MAIN, path, *words)
        return run(*words, timeout=600, **options).stdout

    made, out = tmp_path / "made.fmu", windows_path(tmp_path / "results")
    golf("build", "--out", windows_path(made))
    assert made.read_bytes() == fmu_path.read_bytes()
    text = golf("run", "baseline", "system", "model_exchange", "--out", out)
    assert re.search(r"(\d+) of \1 checks passed", text)
    study = windows_path(ROOT / "scenarios" / "studies" / "club_fitting.toml")
    tables = [tmp_path / f"{workers}.csv" for workers in (1, 2)]
    for workers, table in zip((1, 2), tables, strict=True):
        golf("sweep", study, "--workers", workers, "--out", windows_path(table))
    assert tables[0].read_bytes() == tables[1].read_bytes()
    golf("stress", "--quick", "--out", out)
    assert "loads and runs here" in golf("doctor", windows_path(made))
