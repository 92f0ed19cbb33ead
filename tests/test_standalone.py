"""The standalone FMU: in hosts without Python, beside other Pythons, and built the same every time.

The plain FMU's tests of what it computes run on this file, too: pytest --standalone.
"""

import importlib.util
import json
import os
import platform
import re
import shutil
import sys
import sysconfig
import zipfile
from pathlib import Path

import find_libpython
import fmpy
import pytest
from cases import CASES
from command import golf, golf_here, outputs, run, run_python
from conftest import HEADERS, HERE, HOST_TASKS, LAW_1, LAW_2_CONTACT, repeated
from golf_physics.variables import VARIABLES
from instances import begin, discard, get, make_instance
from loaded import build_fmu, run_ssp

from golf_build import standalone, toolchain
from golf_build.packaging import fmu_source
from golf_impact import doctor


@pytest.fixture(scope="module")
def system(standalone_path, system_files):
    """Paths of the four FMUs and of the .ssp."""
    return [standalone_path, *system_files(standalone=True)]


def extracted(fmu, folder):
    fmpy.extract(str(fmu), str(folder))
    return folder


def guid(folder):
    text = (folder / "modelDescription.xml").read_text()
    return re.search(r'(?:guid|instantiationToken)="([^"]+)"', text)[1]


@pytest.fixture
def hosted(compiled, standalone_path, tmp_path):
    """Runs a task of the host, by default without environment variables."""

    def hosted(*task, fmu=standalone_path, name="fmu", **env):
        folder = extracted(fmu, tmp_path / name)
        return outputs(compiled("host"), folder, guid(folder), *task, env=env)

    return hosted


# A root with nothing in it


@pytest.fixture(scope="module")
def bare(compiled, standalone_path, tmp_path_factory):
    """Runs a task of the host in a root that has glibc, the host and the FMU alone."""
    root, host = tmp_path_factory.mktemp("root"), compiled("host")
    token = guid(extracted(standalone_path, root / "fmu"))
    shutil.copy(host, root / "host")
    listed = run("ldd", host).stdout
    libc = next(Path(line.split()[2]) for line in listed.splitlines() if "libc.so.6" in line)
    names = ("libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0")
    for file in (*(libc.parent / name for name in names), Path("/lib64/ld-linux-x86-64.so.2")):
        (root / file.parent.relative_to("/")).mkdir(parents=True, exist_ok=True)
        shutil.copy(file, root / file.relative_to("/"))
    path = os.pathsep.join((os.defpath, "/usr/sbin", "/sbin"))
    chroot, unshare = shutil.which("chroot", path=path), shutil.which("unshare", path=path)
    enter = [chroot] if os.geteuid() == 0 else [unshare, "--map-root-user", chroot]
    if None in enter or run(*enter, root, "/host", code=None).returncode != 1:
        pytest.skip("this user may not change the root folder, or there is no chroot or unshare")
    return lambda *task: outputs(*enter, root, "/host", "/fmu", token, *task, env={})


TASKS = [("impact", "1e-3"), *HOST_TASKS, ("signals",), ("exit", "3")]


@pytest.mark.parametrize("times", repeated(1, 20, 20)[:2])
@pytest.mark.parametrize("task", TASKS, ids=lambda task: task[0])
def test_in_a_root_with_nothing_but_libc(bare, task, times):
    for _ in range(times):
        assert bare(*task) == LAW_1


# The numbers


def _calls(values):
    """An impact as lines for replay: see fmi2_calls."""
    names = {variable.name: variable.reference for variable in VARIABLES}
    yield from ("new i", "log i 1", f"set i integer {names['law']}={values['law']}")
    for name in sorted(values.keys() - {"law"}):
        yield f"set i real {names[name]}={values[name]!r}"
    yield from ("setup i 0.0", "enter i", "exit i")
    outputs = " ".join(str(v.reference) for v in VARIABLES if v.type == "Real")
    point = 0.0
    for step in (1e-5, 1e-4, 3e-4, 1e-3, 1.0, 1e3):
        yield f"step i {point!r} {step!r}"
        yield f"get i real {outputs}"
        point += step
    yield from ("save i s", "pack i s b", "show b", "drop i s", "free i")


def test_the_private_python_has_the_plain_fmus_numbers(
    compiled, standalone_path, fmu_path, libpython, tmp_path
):
    """Every case of the tests' table: to the last bit, and the state's bytes."""
    lines = [line for case in CASES.values() for line in _calls(case.values)]
    results = []
    preloaded = {"LD_PRELOAD": str(libpython), "PYTHONHOME": sys.base_prefix}
    for fmu, env in ((standalone_path, {}), (fmu_path, preloaded)):
        folder = extracted(fmu, tmp_path / fmu.stem)
        options = {"input": "\n".join(lines), "env": env, "timeout": 300}
        done = run(compiled("replay"), folder, guid(folder), **options)
        assert done.stdout.endswith("done\n"), done.stderr[-2000:]
        results.append(done.stdout.splitlines())
    assert len(results[0]) == len(lines) + 1 > 1000
    differences = [row for row in zip(lines, *results) if row[1] != row[2]]
    assert not differences, differences[:3]


# Hosts that do otherwise


@pytest.mark.parametrize("name", ["ü # + ( %20", "%41", "a space", "ends in ~"])
def test_folders_of_odd_names_that_are_read_only(compiled, standalone_path, tmp_path, name):
    folder = extracted(standalone_path, tmp_path / name)
    before = sorted(folder.rglob("*"))
    for path in [folder, *before]:
        path.chmod(0o555 if path.is_dir() else 0o444)
    host = compiled("host")
    assert outputs(host, folder, guid(folder), "impact", "1e-3", env={}) == LAW_1
    # Root may write there all the same.
    assert sorted(folder.rglob("*")) == before
    for path in [folder, *before]:
        path.chmod(0o755)


def test_a_hostile_environment(hosted, tmp_path):
    (tmp_path / "json.py").write_text("raise SystemExit('not this one')")
    (tmp_path / "libz.so.1").write_text("no library")
    names = ("PYTHONHOME", "PYTHONPATH", "PYTHONSTARTUP", "LD_LIBRARY_PATH")
    env = dict.fromkeys(names, str(tmp_path)) | {"PYTHONMALLOC": "nonsense", "LC_ALL": "nonsense"}
    assert hosted("impact", "1e-3", **env) == LAW_1


def test_a_host_with_a_python(hosted, libpython):
    """That it starts later, or that doesn't run."""
    assert hosted("later", libpython, PYTHONHOME=sys.base_prefix) == LAW_1
    assert hosted("impact", "1e-4", LD_PRELOAD=str(libpython)) == LAW_1


# Several FMUs


@pytest.fixture(scope="module")
def several(compiled):
    def several(folders, *options):
        binaries = [next(folder.glob("binaries/linux64/[A-Z]*.so")) for folder in folders]
        jobs = zip(folders, (binary.stem for binary in binaries), map(guid, folders), strict=True)
        words = [word for job in jobs for word in job]
        return outputs(compiled("several"), *options, *words, env={})

    return several


@pytest.mark.ci
def test_fmus_started_at_once_share_one_python(several, system, tmp_path):
    """Of every kind, and so many that cost little; their folders go while others run."""
    folders = [extracted(fmu, tmp_path / str(n)) for n, fmu in enumerate(system[:4] * 5)]
    for _ in range(10):
        four = several(folders[:4])
        assert (four["steps"], four["pythons"]) == (1600, 1)
    one, all_ = several(folders[:1]), several(folders, "-r")
    assert all_["pythons"] == 1
    assert list(tmp_path.iterdir()) == []
    # A private copy of Python would be 11 MB each time; 0.3 MB measured, a thread's stack included.
    assert (all_["kilobytes"] - one["kilobytes"]) / 19 < 1000


# Python hosts


def pythons():
    """This CPython 3 and every other one of this machine: Debian's, pyenv's."""
    found = [Path("/usr/bin/python3"), *Path.home().glob(".pyenv/versions/3.*/bin/python3")]
    return [str(python) for python in (sys.executable, *found) if Path(python).exists()]


@pytest.mark.parametrize("python", pythons())
def test_pythons_by_ctypes(standalone_path, python, tmp_path):
    """From 3.10 on they are reused; an older one gets the private one beside it."""
    folder = extracted(standalone_path, tmp_path / "fmu")
    variables = fmpy.read_model_description(str(folder)).modelVariables
    references = {v.name: v.valueReference for v in variables}
    words = [folder, guid(folder), references["smash_factor"], references["ball_velocity"]]
    done = run(python, HERE / "native_host" / "python_host.py", *words)
    *values, libraries = map(float, done.stdout.split())
    assert values == [LAW_1["smash_factor"], LAW_1["ball_velocity"]]
    old = run(python, "-c", "import sys; print(sys.version_info < (3, 10))").stdout
    assert libraries == (old.strip() == "True")


# libcosim without Python


@pytest.mark.ci
def test_libcosims_library_runs_the_system(compiled, system, system_files, tmp_path):
    package = pytest.importorskip("libcosimpy", reason="pip install 'golf-impact[interop]'")
    library = Path(package.__file__).parent / "libcosimc" / "libcosimc.so"
    folder = tmp_path / "ssp"
    shutil.unpack_archive(str(system[4]), folder, "zip")
    results = outputs(compiled("cosim"), library, folder, 9700, env={"TMPDIR": str(tmp_path)})
    # The drive by fmpy.ssp, with the plain FMUs; 1e-12 as in test_system.py.
    expected = run_ssp(system_files()[-1], 1e-3, 0.967)["ClubBallImpact.smash_factor"][-1]
    assert results["smash_factor"] == pytest.approx(expected, rel=1e-12)


# FMI 3.0

TOUCH = 1e-4


@pytest.fixture
def slave(standalone_fmi3_path, tmp_path):
    """An FMI 3.0 instance that starts 3.5 mm before touch, under law 2."""
    folder = extracted(standalone_fmi3_path, tmp_path / "fmu")
    made = []

    def slave(start=0.0, logging=False, **modes):
        made.append(make_instance(folder, loggingOn=logging, **modes))
        return begin(made[-1], start, law=2, gap=0.0035)

    yield slave
    discard(*made)


@pytest.mark.ci
@pytest.mark.parametrize("event_mode", [True, False])
def test_the_event_that_a_step_reports(slave, event_mode):
    """An event is the host's to handle where a step ends with it, not where the step went on."""
    for early in (True, False):
        one = slave(eventModeUsed=event_mode, earlyReturnAllowed=early)
        assert one.doStep(0.0, 5e-5) == (False, False, False, 5e-5)
        event, _, returned, last = one.doStep(5e-5, 1e-3 - 5e-5)
        assert (event, returned) == (event_mode and early, early)
        assert last == (pytest.approx(TOUCH, rel=4e-16) if early else 1e-3)
    for start in (5.0, 0.0):
        watched = slave(start, eventModeUsed=True, earlyReturnAllowed=True)
        point, ends = start, []
        while len(ends) < 2:
            event, _, _, point = watched.doStep(point, start + 1e-3 - point)
            ends += [point] * event
            assert get(watched, "touch_time") == [pytest.approx(ends[0], rel=4e-16)]
        expected = [start + TOUCH, start + TOUCH + LAW_2_CONTACT]
        assert ends == pytest.approx(expected, rel=4e-16)
    # Until separation the step goes on past touch; at its end the event is reported.
    for end in ends:
        assert slave(eventModeUsed=event_mode).doStep(0.0, end) == (event_mode, False, False, end)


@pytest.mark.ci
def test_errors_are_logged_unless_the_host_has_chosen_others(slave):
    chosen = ((False, []), (True, ["logStatusWarning"]), (True, ["logStatusError"]))
    for logging in (False, True):
        one = slave(logging=logging)
        for on, names in chosen:
            one.setFloat64([0], [-1.0])
            one.setDebugLogging(on, names)
        assert len(one.messages) == 2
        one.setFloat64([0], [-1.0])
        assert len(one.messages) == 3


# The file


def test_what_it_brings(standalone_path, fmu_path):
    names = set(zipfile.ZipFile(standalone_path).namelist())
    licences = {*standalone.private_python(standalone.this_platform()).licences, "python.txt"}
    assert {f"documentation/licenses/{name}" for name in licences} <= names
    assert not any(name.startswith("binaries/win") for name in names)
    assert standalone_path.stat().st_size <= 5e6
    modules = {row[0] for row in standalone.standard_library() if row[2] is not None}
    top = {name.partition(".")[0] for name in modules}
    assert {"decimal", "_decimal", "json", "math", "pythonfmu", "threading"} <= top
    assert not {"asyncio", "email", "http", "numpy", "socket", "ssl", "tkinter", "unittest"} & top
    assert len(modules) < 90
    texts = [zipfile.ZipFile(f).read("modelDescription.xml") for f in (standalone_path, fmu_path)]
    own, plain = (re.split(rb'guid="([^"]+)"|generationTool="[^"]+"', text) for text in texts)
    # What lies between them is the same, the GUID isn't.
    assert own[::2] == plain[::2]
    assert set(own[1::2]) & set(plain[1::2]) == {None}


@pytest.mark.ci
def test_it_is_reproducible(standalone_path, tmp_path):
    again = tmp_path / "again.fmu"
    program = "from golf_impact.__main__ import main; main()"
    env = {**os.environ, "PYTHONHASHSEED": "7"}
    run_python(program, "build", "--standalone", "--out", again, env=env)
    assert again.read_bytes() == standalone_path.read_bytes()


@pytest.mark.ci
def test_built_by_debians_python(hosted, tmp_path):
    """Its pyconfig.h lies elsewhere, and its modules are in libpython."""
    python, code = "/usr/bin/python3", "import sys; print(sys.version_info[:2])"
    reported = run(python, "-c", code)
    if sys.base_prefix == "/usr" or reported.stdout.strip() != f"{sys.version_info[:2]}":
        pytest.skip(f"{python} is the one that builds anyway, or of another version")
    # An FMU that was loaded here has left its resources behind, with a pythonfmu that can't build.
    ours = [p for p in sys.path if not p.startswith(sys.base_prefix) and "resources" not in p]
    fmu, code = tmp_path / "debian.fmu", "from golf_impact.__main__ import main; main()"
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(ours)}
    done = golf("build", "--standalone", "--out", fmu, env=env, program=(python, "-c", code))
    if "apt-get install" in done.stderr:
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stderr
    assert hosted("impact", "1e-3", fmu=fmu) == LAW_1
    assert fmu.stat().st_size <= 5e6


@pytest.mark.ci
@pytest.mark.parametrize(
    "target",
    [
        *("x86_64-linux-gnu.2.17", "aarch64-linux-gnu.2.17", "x86_64-macos", "aarch64-macos"),
        # The compiler builds its Windows libraries first: four minutes.
        pytest.param("x86_64-windows-gnu", marks=pytest.mark.nightly),
    ],
)
def test_the_loader_compiles_without_warnings(target, tmp_path):
    """No more than that for macOS; test_platforms.py runs it for aarch64 and Windows."""
    pytest.importorskip("ziglang", reason="pip install 'golf-impact[standalone]'")
    shutil.copytree(fmu_source("loader"), tmp_path, dirs_exist_ok=True)
    (tmp_path / "modules.bin").write_bytes(b"")
    words = [sys.executable, "-m", "ziglang", "cc", "-target", target, "-std=gnu11", "-shared"]
    words += ["-fPIC", "-Wall", "-Wextra", "-Werror", f"-I{HEADERS}", "-I.", "-o", "loader.so"]
    words += [f'-D{n}="x"' for n in ("MODULE", "CLASS", "PRIVATE_PYTHON", "PYTHON_DLL", "TOKEN")]
    for source in ("fmi2.c", "fmi3.c"):
        run(*words, source, cwd=tmp_path, timeout=None)


@pytest.mark.ci
def test_bench_native(standalone_path, libpython, tmp_path):
    done = golf_here("bench", "--native", "--quick", "--out", tmp_path)
    # 1 on a busy machine: how fast it is isn't tested.
    assert done.returncode in (0, 1), done.stderr
    figures = json.loads((tmp_path / "bench_native.json").read_text())["figures"]
    assert {"first_instantiate_ms", "step_us", "read_us", "memory_mb", "three_mb"} < set(figures)


@pytest.mark.ci
@pytest.mark.parametrize("fmi", ["", "_fmi3"])
def test_what_doctor_says_on_native_hosts(request, fmi, libpython):
    def lines(fmu):
        found = doctor.examine(request.getfixturevalue(fmu))
        return [text for _, text in found if text.startswith("native")]

    (line,) = lines(f"standalone{fmi}_path")
    assert re.search(r"needs glibc 2\.\d+ or newer, and nothing of Python", line)
    recommended, line = lines(f"{fmi[1:] or 'fmu'}_path")
    assert "golf-impact build --standalone" in recommended
    assert f"LD_PRELOAD={libpython}" in line


# Machines that can't build it


@pytest.mark.parametrize(
    ("place", "name", "value", "words"),
    [
        (shutil, "which", None, "install one with `"),
        (platform, "system", "Windows", "refused on Windows"),
        (find_libpython, "find_libpython", None, "--enable-shared"),
        (sysconfig, "get_path", "/nowhere", "Python.h"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_missing_is_named(monkeypatch, tmp_path, place, name, value, words):
    if name == "which":
        monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(place, name, lambda *_: value)
    standalone.private_python.cache_clear()
    with pytest.raises(toolchain.StandaloneError) as caught:
        build_fmu(tmp_path / "x.fmu", standalone=True)
    assert words in str(caught.value)
    assert list(tmp_path.iterdir()) == []
