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
from command import golf_here, refused, run
from conftest import LAW_1, repeated
from test_standalone import extracted, guid, outputs

from golf_build import toolchain
from golf_impact.commands import doctor
from golf_impact.fmu.file import build_fmu
from golf_impact.fmu.system import build_system

HERE = Path(__file__).resolve().parent
FILES = ("plain", "standalone")

pytestmark = pytest.mark.ci


def machine(name):
    """The folder of a machine to test on; skips without it."""
    folder = os.environ.get(name)
    if not folder:
        pytest.skip(f"{name} isn't set: tests/README.md has what it names")
    return Path(folder).resolve()


@pytest.fixture(scope="session")
def windows():
    return machine("GOLF_IMPACT_WINDOWS")


@pytest.fixture(scope="session")
def arm64():
    return machine("GOLF_IMPACT_ARM64")


@pytest.fixture(scope="session")
def fmus(once, windows):
    """A function that gives ClubBallImpact.fmu and ClubBallImpact.fmi3.fmu for Windows."""

    def fmus(kind):
        how = {"standalone": True, "pythons": for_windows(windows)} if kind == "standalone" else {}
        return [once(f"{kind}.{n}.fmu", fmi=n, **how) for n in (2, 3)]

    return fmus


@pytest.fixture(scope="session")
def arm64_fmu(once, arm64):
    pythons = {"linux64": None, "aarch64": arm64 / "root"}
    return once("arm64.fmu", fmi=3, standalone=True, pythons=pythons)


def for_windows(windows):
    """Platforms of standalone FMUs, and where their Python comes from."""
    return {"linux64": None, "win64": windows / "python-embed-amd64.zip"}


def windows_path(path):
    return "Z:" + str(path).replace("/", "\\")


def numbers_of(results, *key):
    """Every number in nested results by its path."""
    if not isinstance(results, dict | list):
        return {key: results}
    items = results.items() if isinstance(results, dict) else enumerate(results)
    return {k: value for name, item in items for k, value in numbers_of(item, *key, name).items()}


# Windows, under wine


def results(python, files, paths, attempts=1):
    """What fmpy_tasks.py prints there, as numbers by their paths."""
    found = {}
    for file, path in zip(files, paths, strict=True):
        words = [str(word) for word in (python, HERE / "fmpy_tasks.py", path)]
        codes, done = [], None
        while len(codes) < attempts and codes[-1:] != [0]:
            with suppress(subprocess.TimeoutExpired):
                done = subprocess.run(words, capture_output=True, text=True, timeout=100)
            codes.append(done and done.returncode)
        assert codes[-1] == 0, (file, codes, done and done.stderr[-2000:])
        lines = [line for line in done.stdout.splitlines() if line.startswith('["')]
        found |= numbers_of(dict(map(json.loads, lines)))
    return found


@pytest.mark.parametrize("kind", FILES)
def test_fmpy_on_windows(windows, fmus, once, kind):
    """Co-simulation, Model Exchange, states, refusals, early return, the companions, the SSP."""
    how = {"standalone": True, "pythons": for_windows(windows)} if kind == "standalone" else {}
    system = once(f"{kind} system for Windows", build_system, **how)
    files = [*fmus(kind), *sorted(system.glob("*.fmu")), *system.glob("*.ssp")]
    # pythonfmu's DLLs abort there at times; nothing else does.
    attempts = 5 if kind == "plain" else 1
    there = results(windows / "python", files, map(windows_path, files), attempts)
    here = results(sys.executable, files, files)
    assert there.keys() == here.keys()
    assert len(here) > 140
    # Measured: no difference. Windows itself may have another libm than wine.
    assert there == {key: pytest.approx(value, rel=1e-12) for key, value in here.items()}


@pytest.fixture(scope="session")
def on_windows(windows, compiled):
    """Runs a host of tests/native_host there: its outputs."""
    by = shutil.which("x86_64-w64-mingw32-gcc-posix")
    if by is None:
        pytest.skip("there is no mingw-w64 on this machine")

    def on_windows(name, *words, **environment):
        program = compiled(name, "-static", by=[by], libraries=["-lshell32"], suffix=".exe")
        env = {**os.environ, **environment}
        return outputs(windows / "run", program, *words, env=env)

    return on_windows


TASKS = [("impact", "1e-3"), ("migrate",), ("gone", "50"), ("exit", "3")]


@pytest.mark.parametrize("times", repeated(1, 3, 20))
@pytest.mark.parametrize("name", ["fmu", "ü # + %20"])
def test_a_native_host_on_windows(on_windows, fmus, tmp_path, name, times):
    """No Python, no environment variable; threads that come and go, an end while others step."""
    folder = extracted(fmus("standalone")[0], tmp_path / name)
    for _ in range(times):
        for task in TASKS:
            assert on_windows("host", folder, guid(folder), *task) == LAW_1


def test_a_host_on_windows_with_its_own_python(on_windows, windows, fmus, tmp_path):
    """Of the same version: its python311.dll is another one."""
    folder = extracted(fmus("standalone")[0], tmp_path / "fmu")
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
    folders = [extracted(fmus("standalone")[0], tmp_path / str(n)) for n in range(3)]
    jobs = [word for folder in folders for word in (folder, "ClubBallImpact", guid(folder))]
    assert on_windows("several", *jobs) == {"steps": 1200, "pythons": 1}


# FMI 3.0 in a native host


def check_host3(found, plain):
    assert found == pytest.approx(plain, rel=1e-12)
    assert found["refused"] == 1
    assert [found[f"thread_{n}"] for n in range(3)] == [found["law2_S"]] * 3
    assert (found["law1_S"], found["law2_S"]) == pytest.approx((1.5641431548673967,
        1.5842497138122187), rel=1e-14)  # fmt: skip
    # Runge & Kutta, 2000 steps: 1e-14 measured.
    assert found["me_COR"] == pytest.approx(found["law2_COR"], rel=1e-12)
    assert found["event_2"] - found["event_1"] == pytest.approx(6.010445569987614e-4, rel=1e-12)


@pytest.fixture(scope="session")
def host3_here(compiled, standalone_fmi3_path, tmp_path_factory):
    folder = extracted(standalone_fmi3_path, tmp_path_factory.mktemp("here"))
    return outputs(compiled("host3"), folder, guid(folder), env={})


def test_fmi3_in_a_native_host_on_windows(on_windows, fmus, host3_here, tmp_path):
    folder = extracted(fmus("standalone")[1], tmp_path / "ü #")
    check_host3(on_windows("host3", folder, guid(folder)), host3_here)


@pytest.fixture(scope="session")
def arm64_zig():
    pytest.importorskip("ziglang", reason="pip install 'golf-impact[standalone]'")
    return [sys.executable, "-m", "ziglang", "cc", "-target", "aarch64-linux-gnu.2.36"]


@pytest.mark.parametrize("times", repeated(1, 3, 50))
def test_fmi3_in_a_native_host_on_arm64(
    arm64, arm64_zig, arm64_fmu, compiled, host3_here, tmp_path, times
):
    folder = extracted(arm64_fmu, tmp_path / "ü #")
    program = compiled("host3", by=arm64_zig, suffix=".arm64")
    for _ in range(times):
        check_host3(outputs(arm64 / "run", program, folder, guid(folder), env={}), host3_here)


_PYTHON_HOST = """
import ctypes as c, sys
fmu = c.CDLL(sys.argv[1] + "/binaries/aarch64-linux/ClubBallImpact.so")
make = fmu.fmi3InstantiateCoSimulation
make.restype = c.c_void_p
log = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_char_p, c.c_char_p)(print)
one = c.c_void_p(make(b"one", sys.argv[2].encode(), None, *[c.c_bool(0)] * 4, None, c.c_size_t(0),
                      None, log, None))
start = [c.c_bool(0), c.c_double(0), c.c_double(0), c.c_bool(0), c.c_double(0)]
assert fmu.fmi3EnterInitializationMode(one, *start) == 0 == fmu.fmi3ExitInitializationMode(one)
flags, end = (c.c_bool * 3)(), c.c_double()
at = [c.byref(flags, n) for n in range(3)]
step = fmu.fmi3DoStep(one, c.c_double(0), c.c_double(1e-3), c.c_bool(1), *at, c.byref(end))
value = c.c_double()
read = [c.byref(c.c_uint(int(sys.argv[3]))), c.c_size_t(1), c.byref(value), c.c_size_t(1)]
assert step == 0 == fmu.fmi3GetFloat64(one, *read)
print("smash_factor", value.value)
print("done")
"""


def test_python_on_arm64(arm64, arm64_fmu, tmp_path):
    folder = extracted(arm64_fmu, tmp_path / "fmu")
    variables = fmpy.read_model_description(str(folder)).modelVariables
    (reference,) = (v.valueReference for v in variables if v.name == "smash_factor")
    words = (arm64 / "python", "-c", _PYTHON_HOST, folder, guid(folder), reference)
    assert outputs(*words)["smash_factor"] == LAW_1["smash_factor"]


# The file


def test_one_fmu_for_two_platforms(windows, fmus, tmp_path):
    file = fmus("standalone")[0]
    assert file.stat().st_size <= 7e6
    with zipfile.ZipFile(file) as archive:
        licences = {n.rpartition("/")[2] for n in archive.namelist() if "/licenses/" in n}
    assert {"python.txt", "python-windows.txt", "mingw-w64.txt"} <= licences
    again = build_fmu(tmp_path / "again.fmu", standalone=True, pythons=for_windows(windows))
    assert again.read_bytes() == file.read_bytes()


@pytest.mark.nightly  # ziglang makes its libraries for Windows first: a minute
def test_ziglang_builds_for_windows(monkeypatch, windows, on_windows, tmp_path):
    pytest.importorskip("ziglang", reason="pip install 'golf-impact[standalone]'")
    monkeypatch.setattr(toolchain.shutil, "which", lambda name: None)
    pythons = {"win64": windows / "python-embed-amd64.zip"}
    folder = extracted(
        build_fmu(tmp_path / "x.fmu", standalone=True, pythons=pythons), tmp_path / "fmu"
    )
    for task in TASKS:
        assert on_windows("host", folder, guid(folder), *task) == LAW_1


def test_doctor_says_that_an_fmu_has_no_binary_for_this_machine(fmu_path, tmp_path):
    foreign = tmp_path / "foreign.fmu"
    with zipfile.ZipFile(fmu_path) as old, zipfile.ZipFile(foreign, "w") as new:
        for name in old.namelist():
            if not re.match("binaries/linux|documentation/SHA", name):
                new.writestr(name, old.read(name))
    (problem,) = (text for level, text in doctor.examine(foreign) if level == "problem")
    assert f"no binary for this machine, {toolchain.this_machine()} (it has: Windows" in problem


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--target win64", "without --standalone"),
        ("--standalone --target mac", "linux64, win64, aarch64"),
        ("--standalone --target win64", "python.org"),
        ("--standalone --target win64 --python {0}", "it has no python3"),
        ("--standalone --target win64 --python {0}.zip", "No such file"),
        ("--standalone --python {0}", "--target win64"),
        ("--standalone --target aarch64 --sysroot .", "--fmi 3"),
        ("--standalone --target aarch64 --fmi 3", "--sysroot FOLDER"),
        ("--standalone --target aarch64 --fmi 3 --sysroot .", "has no libpython3"),
    ],
)
def test_what_is_missing_for_a_target_is_named(fmu_path, tmp_path, options, words):
    options = options.format(fmu_path).split()
    refused(golf_here("build", *options, "--out", tmp_path / "x.fmu"), words)
    assert list(tmp_path.iterdir()) == []


# golf-impact on Windows

#: As pip would install them, but for what wine 8 can't load: NumPy 2, and pydantic of newer typers.
_PACKAGES = """
numpy==1.26.4 pythonfmu==0.7.0 pythonfmu3==0.3.4 typer==0.15.4 click==8.1.8 shellingham
typing_extensions rich markdown-it-py mdurl pygments jinja2 markupsafe find-libpython platformdirs
matplotlib==3.10.7 contourpy cycler fonttools kiwisolver packaging pillow pyparsing python-dateutil
six scipy==1.14.1 colorama
"""
_MAIN = """
import sys
sys.path[:0] = sys.argv.pop(1).split(";")
from golf_impact.__main__ import main
if __name__ == "__main__":
    main()
"""


@pytest.mark.nightly
def test_golf_impact_on_windows(windows, fmu_path, tmp_path):
    site, root = tmp_path / "site", HERE.parent
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", site]
    pip += ["--platform", "win_amd64", "--python-version", "3.11", "--only-binary=:all:"]
    subprocess.run([*pip, *_PACKAGES.split()], check=True, stderr=subprocess.DEVNULL)
    (about,) = Path(fmpy.__file__).parents[1].glob("golf_impact-*.dist-info")
    shutil.copytree(about, site / about.name)
    folders = [site, *(root / name for name in ("scenarios", "build", "fmu_src"))]
    (tmp_path / "main.py").write_text(_MAIN)
    path = ";".join(map(windows_path, folders))

    def golf(*words, **options):
        words = (windows / "python", windows_path(tmp_path / "main.py"), path, *words)
        return run(*words, timeout=300, **options).stdout

    made = tmp_path / "made.fmu"
    golf("build", "--out", windows_path(made))
    assert made.read_bytes() == fmu_path.read_bytes()
    text = golf("run", "baseline", "system", "--out", windows_path(tmp_path / "results"))
    assert re.search(r"(\d+) of \1 checks passed", text)
    study = windows_path(root / "scenarios" / "studies" / "club_fitting.toml")
    tables = [tmp_path / f"{workers}.csv" for workers in (1, 2)]
    for workers, table in zip((1, 2), tables, strict=True):
        golf("sweep", study, "--workers", workers, "--out", windows_path(table))
    assert tables[0].read_bytes() == tables[1].read_bytes()
    assert "loads and runs here" in golf("doctor", windows_path(made))
