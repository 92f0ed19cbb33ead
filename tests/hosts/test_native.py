"""The native FMU: what a build contains, platforms, sources, sanitizers, hosts without Python."""

import json
import os
import re
import shutil
import sys
from ctypes import c_int, c_size_t
from itertools import product
from pathlib import Path

import fmpy
import pytest
from command import golf_here, refused, run, run_python
from compare import assert_close
from conftest import EXPECTED, LAW_2_CONTACT
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave
from fmus import begin, make_instance, step_status
from programs import HEADERS

from golf_build import native
from golf_build.archive import unpack, write_archive
from golf_impact.evidence.peers import fmus as peers
from golf_impact.fmu import Fmu

SANITIZERS = "-fsanitize=address,undefined"


def on_path(program):
    """Its path; skips without it."""
    path = shutil.which(program)
    if path is None:
        pytest.skip(f"there is no {program} on this machine")
    return path


# The file


@pytest.fixture(scope="session")
def for_all(once):
    """A function that returns the FMU for all platforms by version of FMI."""

    def for_all(fmi):
        builder = native.BUILDERS[fmi]
        return once(f"{builder.name}.fmu", builder.digest(), builder.build)

    return for_all


@pytest.mark.ci  # eight builds by zig
@pytest.mark.parametrize("fmi", [2, 3])
def test_what_a_build_contains(request, for_all, fmi):
    """Small, the same bytes at every build; libraries that need the C library alone."""
    file = for_all(fmi)
    assert file.stat().st_size < 1e6
    files = unpack(file)
    again = unpack(request.getfixturevalue("native_path" if fmi == 2 else "native_fmi3_path"))
    shared = [name for name in again if name.startswith(("binaries", "sources"))]
    assert any(name.startswith("binaries") for name in shared)
    for name in (*shared, "modelDescription.xml"):
        assert again[name] == files[name], name
    (dll,) = (data for name, data in files.items() if name.endswith(".dll"))
    header = int.from_bytes(dll[0x3C:0x40], "little")
    assert dll[header : header + 4] == b"PE\0\0"
    assert dll[header + 8 : header + 12] == bytes(4), "the time of the build"
    # Of macOS found from wherever the file is; the second is the identifier in the signature.
    names = "@rpath/ClubBallImpact.dylib", "ClubBallImpact.dylib", "/usr/lib/libSystem.B.dylib"
    libraries = b"".join(data for name, data in files.items() if name.endswith(".dylib"))
    images = re.split(rb"(?=\xcf\xfa\xed\xfe)", libraries)[1:]
    for image in images:
        assert {name.decode() for name in re.findall(rb"[@\w./]+\.dylib", image)} == {*names}
    assert len(images) == 2


@pytest.fixture(params=["native, FMI 2.0", "native, FMI 3.0"])
def unpacked(request, way_of):
    """An extracted FMU of either version."""
    return Path(way_of(request.param).slave.unzipDirectory)


def test_it_exports_nothing_but_fmi(unpacked):
    (library,) = (unpacked / "binaries").rglob("*.so")
    lines = run(on_path("nm"), "-D", "--defined-only", library).stdout.splitlines()
    names = {line.split()[-1][:4] for line in lines}
    assert names == {"fmi3" if "x86_64-linux" in str(library) else "fmi2"}
    needed = run("readelf", "-d", library).stdout
    assert set(re.findall(r"NEEDED.*\[(.*?)\]", needed)) <= {"libc.so.6", "libm.so.6"}


@pytest.mark.ci
def test_its_sources_compile(unpacked, tmp_path):
    """Without a warning, in C99 alone, with a prefix for static linking."""
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "-c", f"-I{HEADERS}"]
    prefixes = [f"-DFMI{fmi}_FUNCTION_PREFIX=golf_" for fmi in (2, 3)]
    run(on_path("gcc"), *flags, *prefixes, unpacked / "sources" / "all.c", "-o", tmp_path / "all.o")
    lines = run("nm", "--defined-only", "-g", tmp_path / "all.o").stdout.splitlines()
    assert {line.split()[-1][:8] for line in lines} == {"golf_fmi"}


@pytest.mark.parametrize("option", ["-Ofast", "-ffast-math", "-ffinite-math-only"])
def test_options_that_make_it_wrong_dont_compile(unpacked, option):
    """Under these NaN and infinity are no values: bad values would be accepted."""
    source = unpacked / "sources" / "all.c"
    done = run(on_path("gcc"), option, "-w", "-fsyntax-only", source, code=1)
    assert "results would be wrong" in done.stderr


@pytest.mark.ci
def test_fmpy_compiles_it(native_path, tmp_path):
    copy = shutil.copy(native_path, tmp_path / "ClubBallImpact.fmu")
    run(sys.executable, "-m", "fmpy", "compile", copy)
    golf_here("doctor", copy, code=0)
    golf_here("run", "--fmu", copy, "--set", "k=8e5", "--no-figures", "--out", tmp_path, code=0)
    row = fmpy.simulate_fmu(copy, stop_time=1e-3, output=["smash_factor"])[-1]
    assert row["smash_factor"] == pytest.approx(EXPECTED[1]["smash_factor"], rel=1e-13)


def test_changed_files_are_no_compiled_ones(native_path, tmp_path):
    files = unpack(native_path)
    files["sources/law.c"] += b" "
    copy = write_archive(tmp_path / "ClubBallImpact.fmu", files)
    refused(golf_here("run", "--fmu", copy, "--set", "k=8e5"), "it has been changed")


@pytest.mark.ci
def test_doctor_looks_into_an_ssp(files):
    shown = golf_here("doctor", files[-1], code=0).stdout
    for name in ("ClubBallImpact", "Swing", "Launch", "BallFlight"):
        assert f"resources/{name}.fmu loads and runs here" in " ".join(shown.split())


@pytest.mark.parametrize("program", [None, "echo 'all.c: note\nall.c:1: error: no space' >&2"])
def test_without_a_compiler_that_works(monkeypatch, tmp_path, program):
    """One line says what is missing, or has its first error; nothing is written."""
    compiler, out = tmp_path / "cc", tmp_path / "new"
    words = "--native needs a C compiler: ziglang", f"for this platform alone {compiler} does"
    if program:
        compiler.write_text(f"#!/bin/sh\n{program}\nexit 1\n")
        compiler.chmod(0o755)
        words = (f"{compiler} fails on all.c for", "all.c:1: error: no space")
    monkeypatch.setattr(native, "ziglang", lambda: None)
    monkeypatch.setenv("CC", str(compiler))
    refused(golf_here("build", "--native", "--out", out / "x.fmu"), *words)
    assert not out.exists()


# Without ziglang all native FMUs of these tests are built so.
@pytest.mark.ci
def test_this_machines_compiler_builds_for_it_alone(monkeypatch, compiled, tmp_path):
    monkeypatch.setattr(native, "ziglang", lambda: None)
    done = golf_here("build", "--native", "--out", tmp_path / "x.fmu", code=0)
    assert f"For {native.this_machine()} alone" in done.stderr
    with Fmu(tmp_path / "x.fmu") as fmu:
        fmu.start(law=2)
        fmu.step(0.0, 1.0)
        assert fmu.read([*EXPECTED[2]]) == pytest.approx(EXPECTED[2], rel=1e-14)


def test_a_step_beyond_the_stop_time_is_an_error(unpacked):
    """Other illegal calls: test_lockstep.py."""
    slave = begin(make_instance(unpacked), stop=1e-3)
    assert step_status(slave, 0.0, 1e-3 * (1 + 2e-6)) == 3
    slave.doStep(0.0, 1e-3 * (1 + 5e-7))
    slave.freeInstance()


@pytest.mark.parametrize("kind", [FMU2Slave, FMU2Model, FMU3Slave, FMU3Model])
def test_null_is_no_crash(way_of, kind):
    """In place of each pointer."""
    way = way_of("native, FMI 2.0" if "2" in kind.__name__ else "native, FMI 3.0")
    slave = make_instance(way.slave.unzipDirectory, kind=kind)

    def argument(kind, is_missing):
        if is_missing or isinstance(getattr(kind, "_type_", ""), str):
            # A count; the kind of a status that there is.
            return kind(*{c_size_t: (1,), c_int: (2,)}.get(kind, ()))
        return (kind._type_ * 8)()

    for component, (name, function) in product((None, slave.component), slave._functions.items()):
        for missing in range(len(function.argtypes)):
            given = [argument(kind, n == missing) for n, kind in enumerate(function.argtypes)]
            if component and "Instan" not in name:
                given[0] = component
            function(*given)
    slave.freeInstance()


@pytest.mark.ci
def test_where_pythonfmu_has_no_binary(monkeypatch, compiled, tmp_path):
    """The commands build and use the native FMU, and leave out what companions are for."""
    monkeypatch.setattr(native, "pythonfmu_runs_here", lambda: False)
    monkeypatch.setattr(peers, "pythonfmu_runs_here", lambda: False)
    where = "golf_impact.fmu.current.default_path"
    monkeypatch.setattr(where, lambda builder: tmp_path / f"{builder.name}.fmu")
    done = golf_here("run", "--out", tmp_path / "all", "--no-figures", code=0)
    assert f"ClubBallImpact.native.fmu, for {native.this_machine()} alone" in done.stderr
    assert "loft is left out" in done.stderr
    assert "system is left out" in done.stderr
    assert len(json.loads((tmp_path / "all" / "results.json").read_bytes())) >= 10
    golf_here("bench", "--quick", "--out", tmp_path / "bench", code=0)
    rows = json.loads((tmp_path / "bench" / "bench.json").read_bytes())["rows"]
    assert not [row for row in rows if "Python" in row["name"]]


# In C


def check_early_return(c_host, *words, **machine):
    found = c_host(*words, "early", 1, 2, **machine)
    times = found.pop("event_1"), found.pop("event_2")
    assert times == pytest.approx((1e-4, 1e-4 + LAW_2_CONTACT), rel=1e-13)
    assert_close(found, EXPECTED[2])


def test_early_return_in_a_native_host(c_host, native_fmi3_path):
    check_early_return(c_host, native_fmi3_path)


@pytest.mark.ci
def test_under_sanitizers(c_host, native_path, tmp_path):
    """AddressSanitizer and UBSan: instances that move between threads, random impacts."""
    folder = fmpy.extract(str(native_path), str(tmp_path))
    library = Path(folder, "binaries", "linux64", "ClubBallImpact.so")
    flags = ["-std=c99", "-g", "-O1", "-shared", "-fPIC", SANITIZERS, "-fno-sanitize-recover=all"]
    run(on_path("gcc"), *flags, Path(folder, "sources", "all.c"), "-o", library, "-lm")
    env = {"ASAN_OPTIONS": "detect_leaks=0"}
    for task in ("impact", 1e-6), ("threads", 50):
        assert c_host(folder, *task, 1, SANITIZERS, **env) == EXPECTED[1]
    code = """
import sys
from random_cases import history
from ways import InFmu, InProcess
fmu, physics = InFmu(sys.argv[1]), InProcess()
for number in range(300):
    assert history(fmu, number) == history(physics, number)
"""
    env["LD_PRELOAD"] = run(on_path("gcc"), "-print-file-name=libasan.so").stdout.strip()
    run_python(code, folder, env=os.environ | env)


# Other platforms, under wine and qemu

ZIG = sys.executable, "-m", "ziglang", "cc", "-target"


@pytest.mark.ci
@pytest.mark.parametrize(
    ("machine", "fmi", "binary", "compiler"),
    [
        ("WINDOWS", 2, "win64/ClubBallImpact.dll", ["x86_64-w64-mingw32-gcc-posix", "-static"]),
        ("ARM64", 3, "aarch64-linux/ClubBallImpact.so", [*ZIG, "aarch64-linux-gnu.2.36"]),
    ],
)
def test_on_another_platform(for_all, c_host, machine, fmi, binary, compiler):
    """Under wine and qemu; there is no Python there."""
    if (name := f"GOLF_IMPACT_{machine}") not in os.environ:
        pytest.skip(f"{name} isn't set: tests/README.md has what it names")
    on_path(compiler[0])
    where = {"binary": binary, "by": compiler, "on": [Path(os.environ[name]).resolve() / "run"]}
    for task in ("impact", 1e-3), ("threads", 50):
        assert_close(c_host(for_all(fmi), *task, 2, **where), EXPECTED[2])
    if fmi == 3:
        check_early_return(c_host, for_all(fmi), **where)
