"""The native FMU: bits of the Python physics, platforms, sources, hosts without Python."""

import hashlib
import json
import math
import os
import random
import re
import shutil
import struct
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest
from command import golf_here, outputs, refused, run
from conftest import EXPECTED, HERE, LAW_1, LAW_2_CONTACT, repeated, some
from fmpy.fmi1 import FMICallException
from fmus import make_instance
from golf_physics.component.component import Component
from golf_physics.variables import VARIABLES
from programs import HEADERS, HOST_TASKS

import golf_impact.fmu
from golf_build import native
from golf_impact.fmu import Fmu, builder_of
from golf_impact.peers import fmus as peers

REALS = [v.reference for v in VARIABLES if (v.causality, v.type) == ("output", "Real")]

SANITIZERS = "-fsanitize=address,undefined"

#: Smaller numbers are left over where larger ones cancel: their bits are those of no function.
LEFT_OVER = 1e-50


# Equal bits


@pytest.fixture(scope="module")
def in_c(native_path):
    with Fmu(native_path) as fmu:
        yield fmu


class Both:
    """The component in Python and an instance of the native FMU, by the same calls."""

    def __init__(self, fmu, values):
        self.refusals = []
        self.python, self.fmu, self.c = Component(self.refusals.append), fmu, fmu.instance
        self.c.setFMUstate(fmu._initial)
        self.point = 0.0
        self.python.enter_initialization()
        self.c.setupExperiment()
        self.c.enterInitializationMode()
        for name, value in values.items():
            self.set(name, value)
        self.python.exit_initialization()
        self.c.exitInitializationMode()

    def set(self, name, value):
        reference = [self.fmu.references[name]]
        kind, put = ("Enumeration", "setInteger") if name == "law" else ("Real", "setReal")
        self.python.set_values(reference, [value], kind)
        getattr(self.c, put)(reference, [value])

    def step(self, size):
        """Whether both accept it; the sentences of a refusal are the same."""
        self.fmu._messages.clear()
        accepted = self.python.step(self.point, size)
        try:
            self.c.doStep(self.point, size)
            status = True
        except FMICallException:
            status = False
        assert status == bool(accepted)
        if accepted:
            self.point += size
        else:
            assert self.fmu._messages[-1] == str(self.refusals[-1])
        return accepted

    def compare(self):
        python, c = self.python.reals(REALS)[: len(REALS)], self.c.getReal(REALS)
        for reference, x, y in zip(REALS, python, c):
            same = struct.pack("<d", x) == struct.pack("<d", y) or (math.isnan(x) and math.isnan(y))
            assert same or max(abs(x), abs(y)) < LEFT_OVER, (reference, x, y)

    def snapshot(self, packed):
        """The states of both, through bytes if asked for, and the communication point."""
        python, state = self.python.snapshot(), self.c.getFMUstate()
        if packed:
            python = Component.unpacked(Component.packed(python))
            state = self.c.deserializeFMUState(self.c.serializeFMUState(state))
        return python, state, self.point

    def restore(self, snapshot):
        python, state, self.point = snapshot
        self.python.restore(python)
        self.c.setFMUstate(state)


def random_values(rng):
    """Inputs and parameters: laws, exponents, COR lines, heavy damping, forces, moving balls."""
    law = rng.choice([1, 2, 2])
    values = {"law": law, "k": 10 ** rng.uniform(4, 8), "club_speed": rng.uniform(0.1, 70.0)}
    values["b"] = rng.choice([0.0, 10 ** rng.uniform(-1, 4), 10 ** rng.uniform(0, 2)])
    several = {
        "ball_speed": rng.uniform(-20.0, 20.0), "gap": 10 ** rng.uniform(-5, -1),
        "m_club": 10 ** rng.uniform(-2, 1), "m_ball": 10 ** rng.uniform(-2, 1),
        "club_force": rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(0, 3.5),
    }  # fmt: skip
    values |= {name: value for name, value in several.items() if rng.random() < 0.3}
    if law == 2 and rng.random() < 0.6:
        values["exponent"] = rng.choice([1.5, rng.uniform(1.0, 3.0), rng.uniform(1.0, 12.0)])
    if law == 2 and rng.random() < 0.3:
        values |= {"restitution_at_rest": rng.uniform(0.3, 1.0)}
        values |= {"restitution_slope": rng.uniform(0.0, 0.004)}
    return values


def compare_bits(fmu, numbers):
    """Random impacts, with changes of inputs and restored states in between."""
    for number in numbers:
        rng = random.Random(number)
        both, saved = Both(fmu, random_values(rng)), None
        for _ in range(rng.randint(1, 12)):
            if rng.random() < 0.3:
                changed = {
                    "k": 10 ** rng.uniform(4, 8), "b": 10 ** rng.uniform(-1, 3),
                    "club_force": rng.uniform(-2e3, 2e3), "club_speed": rng.uniform(0.0, 60.0),
                }  # fmt: skip
                both.set(*rng.choice([*changed.items()]))
            if rng.random() < 0.2:
                saved = both.snapshot(packed=rng.random() < 0.5)
            if saved and rng.random() < 0.15:
                both.restore(saved)
            size = rng.choice([10 ** rng.uniform(-6, -3)] * 9 + [rng.choice([1e-9, 0.01, 1.0])])
            if both.step(size):
                both.compare()


@pytest.mark.skipif(sys.platform != "linux", reason="of another C library functions differ")
@pytest.mark.parametrize("block", some(4, range(40), 40))
def test_bits_are_those_of_the_python_physics(in_c, block):
    compare_bits(in_c, range(50 * block, 50 * (block + 1)))


# The file


@pytest.mark.parametrize("path", ["native_path", "native_fmi3_path"])
def test_the_file(request, path, tmp_path):
    """Small, the same bytes at every build; libraries that need the C library alone."""
    file, fmi = request.getfixturevalue(path), 3 if "fmi3" in path else 2
    assert file.stat().st_size < 1e6
    if native.fewer_platforms():
        pytest.skip(native.advice())
    again = native.build(builder_of(fmi=fmi), tmp_path / "again.fmu")
    assert again.read_bytes() == file.read_bytes()
    with zipfile.ZipFile(file) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    machines = {"Linux x86_64", "Windows AMD64", "Darwin x86_64", "Darwin arm64"}
    assert native.binaries_of(files) == machines | ({"Linux aarch64"} if fmi == 3 else set())
    licences = {name.rpartition("/")[2] for name in files if "/licenses/" in name}
    assert {"license.txt", "fmi-headers.txt", "zig.txt", "musl.txt", "mingw-w64.txt"} <= licences
    for name, data in files.items():
        if name.endswith(".dylib"):
            assert data[:4] in (b"\xca\xfe\xba\xbe", b"\xcf\xfa\xed\xfe"), name
            assert b"/usr/lib/libSystem.B.dylib" in data
            assert data.count(b"@rpath/ClubBallImpact.dylib") == (2 if fmi == 2 else 1)


@pytest.mark.parametrize("path", ["native_path", "native_fmi3_path"])
def test_libraries_for_macos_are_signed(request, path):
    """For arm64, where macOS asks for it: each page has the hash that the signature says."""
    if native.fewer_platforms():
        pytest.skip(native.advice())
    slices = []
    with zipfile.ZipFile(request.getfixturevalue(path)) as archive:
        for name in archive.namelist():
            data = archive.read(name)
            if data[:4] == b"\xca\xfe\xba\xbe" and name.endswith(".dylib"):
                for n in range(struct.unpack_from(">I", data, 4)[0]):
                    offset, size, power = struct.unpack_from(">3I", data, 16 + 20 * n)
                    assert offset % (1 << power) == 0
                    slices.append(data[offset : offset + size])
            elif name.endswith(".dylib"):
                slices.append(data)
    slices.sort(key=lambda image: image[:8])
    machines = [struct.unpack_from("<2I", image) for image in slices]
    assert machines == [(0xFEEDFACF, 0x01000007), (0xFEEDFACF, 0x0100000C)]
    for image in slices[1:]:
        commands = struct.unpack_from("<I", image, 16)[0]
        offset, start = 32, 0
        for _ in range(commands):
            kind, size = struct.unpack_from("<2I", image, offset)
            if kind == 0x1D:  # LC_CODE_SIGNATURE
                start, length = struct.unpack_from("<2I", image, offset + 8)
                assert start + length == len(image)
            offset += size
        directory = start + struct.unpack_from(">I", image, start + 16)[0]
        hashes, _, _, pages, limit = struct.unpack_from(">5I", image, directory + 16)
        size = 1 << image[directory + 39]
        assert (limit, pages) == (start, -(-start // size))
        for n in range(pages):
            page = image[size * n : min(size * (n + 1), limit)]
            at = directory + hashes + 32 * n
            assert image[at : at + 32] == hashlib.sha256(page).digest()


def test_it_exports_nothing_but_fmi(native_path, native_fmi3_path, tmp_path):
    if shutil.which("nm") is None:
        pytest.skip("there is no nm on this machine")
    for path, prefix in ((native_path, "fmi2"), (native_fmi3_path, "fmi3")):
        folder = Path(fmpy.extract(str(path), str(tmp_path / prefix)), "binaries")
        library = folder / ("linux64" if prefix == "fmi2" else "x86_64-linux") / "ClubBallImpact.so"
        lines = run("nm", "-D", "--defined-only", library).stdout.splitlines()
        assert lines
        assert all(line.split()[-1].startswith(prefix) for line in lines)
        needed = run("readelf", "-d", library).stdout
        assert set(re.findall(r"NEEDED.*\[(.*?)\]", needed)) <= {"libc.so.6", "libm.so.6"}


@pytest.mark.parametrize("path", ["native_path", "native_fmi3_path"])
def test_its_sources_compile(request, compiled, path, tmp_path):
    """Without a warning, in C99 alone, with a prefix for static linking."""
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("there is no gcc on this machine")
    folder = fmpy.extract(str(request.getfixturevalue(path)), str(tmp_path / "fmu"))
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2", "-c", f"-I{HEADERS}"]
    prefix = "FMI3" if "fmi3" in path else "FMI2"
    named = f"-D{prefix}_FUNCTION_PREFIX=golf_", "-o", tmp_path / "all.o"
    run(compiler, *flags, *named, Path(folder, "sources", "all.c"))
    if shutil.which("nm"):
        lines = run("nm", "--defined-only", "-g", tmp_path / "all.o").stdout.splitlines()
        assert lines
        assert all(line.split()[-1].startswith("golf_fmi") for line in lines)


@pytest.mark.ci
def test_fmpy_compiles_it(native_path, tmp_path):
    copy = shutil.copy(native_path, tmp_path / "ClubBallImpact.fmu")
    run(sys.executable, "-m", "fmpy", "compile", copy)
    row = fmpy.simulate_fmu(copy, stop_time=1e-3, output=["smash_factor"])[-1]
    assert row["smash_factor"] == pytest.approx(LAW_1["smash_factor"], rel=1e-13)


def test_without_a_compiler(monkeypatch, tmp_path):
    """One line says what is missing, and nothing is written."""
    monkeypatch.setattr(native, "ziglang", lambda: None)
    monkeypatch.setattr(native.shutil, "which", lambda name: None)
    done = golf_here("build", "--native", "--out", tmp_path / "x.fmu")
    refused(done, "--native needs a C compiler", "ziglang")
    assert list(tmp_path.iterdir()) == []


def test_this_machines_compiler_builds_for_it_alone(monkeypatch, compiled, tmp_path):
    monkeypatch.setattr(native, "ziglang", lambda: None)
    done = golf_here("build", "--native", "--out", tmp_path / "x.fmu", code=0)
    assert f"For {native.this_machine()} alone" in done.stderr
    with Fmu(tmp_path / "x.fmu") as fmu:
        fmu.start(law=2)
        fmu.step(0.0, 1.0)
        assert fmu.read([*EXPECTED[2]]) == pytest.approx(EXPECTED[2], rel=1e-14)


def test_illegal_calls_are_errors(native_path, tmp_path):
    slave = make_instance(fmpy.extract(str(native_path), str(tmp_path / "fmu")))
    slave.setupExperiment(startTime=0.0, stopTime=1e-3)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    reference = slave.references
    state = slave.getFMUstate()
    data = slave.serializeFMUstate(state)
    for call, *arguments in (
        (slave.getReal, [999]),
        (slave.getReal, [reference["touched"]]),
        (slave.setReal, [reference["smash_factor"]], [1.0]),
        (slave.setReal, [reference["m_club"]], [0.3]),
        (slave.setReal, [reference["k"], 999], [1e6, 1.0]),
        (slave.enterInitializationMode,),
        (slave.exitInitializationMode,),
        (slave.setupExperiment,),
        (slave.deSerializeFMUstate, data[:-1]),
        (slave.deSerializeFMUstate, bytes(len(data))),
        (slave.setFMUstate, None),
        (slave.doStep, 0.0, 1e-3 * (1 + 2e-6)),
    ):
        with pytest.raises(FMICallException) as raised:
            call(*arguments)
        assert raised.value.status == 3, call
    slave.setFMUstate(state)
    slave.doStep(0.0, 1e-3 * (1 + 5e-7))
    slave.setFMUstate(state)
    slave.setReal([reference["k"]], [-1.0])
    with pytest.raises(FMICallException, match="discard"):
        slave.doStep(0.0, 1e-4)
    slave.freeFMUstate(state)
    slave.freeInstance()


@pytest.mark.skipif(sys.platform != "linux", reason="glibc alone traps exceptions")
def test_a_host_that_traps_floating_point_exceptions(native_path, tmp_path):
    """None occurs, whatever the values; and NULL is no crash."""
    if shutil.which("gcc") is None:
        pytest.skip("there is no gcc on this machine")
    folder = fmpy.extract(str(native_path), str(tmp_path / "fmu"))
    command = ["gcc", "-std=c99", "-O1", "-w", f"-I{folder}/sources"]
    run(*command, HERE / "hosts" / "native_host" / "traps.c", "-o", tmp_path / "traps", "-lm")
    assert run(tmp_path / "traps", "1500", "1").stdout == "done\n"


@pytest.mark.ci
def test_where_pythonfmu_has_no_binary(monkeypatch, compiled, tmp_path):
    """The commands build and use the native FMU, and leave out what companions are for."""
    monkeypatch.setattr(native, "pythonfmu_runs_here", lambda: False)
    monkeypatch.setattr(peers, "pythonfmu_runs_here", lambda: False)
    monkeypatch.setattr(golf_impact.fmu, "default_path", lambda b: tmp_path / f"{b.name}.fmu")
    done = golf_here("run", "--out", tmp_path / "all", "--no-figures", code=0)
    assert f"ClubBallImpact.native.fmu, for {native.this_machine()} alone" in done.stderr
    assert "loft is left out" in done.stderr
    assert "system is left out" in done.stderr
    assert len(json.loads((tmp_path / "all" / "results.json").read_text())) >= 10
    golf_here("bench", "--quick", "--out", tmp_path / "bench", code=0)
    rows = json.loads((tmp_path / "bench" / "bench.json").read_text())["rows"]
    assert not [row for row in rows if "Python" in row["name"]]


def test_a_binary_for_arm64_in_fmi_2(native_fmi3_path):
    """It is where fmpy looks for it; FMI 2.0 has no folder of its own for it."""
    if native.fewer_platforms():
        pytest.skip(native.advice())
    with zipfile.ZipFile(native_fmi3_path) as archive:
        data = archive.read("binaries/aarch64-linux/ClubBallImpact.so")
    name = "binaries/linux64/ClubBallImpact.so"
    assert native.binaries_of({name: data}) == {"Linux aarch64"}


# Hosts


def guid_of(folder):
    text = Path(folder, "modelDescription.xml").read_text()
    return re.search(r'(?:guid|instantiationToken)="([^"]+)"', text)[1]


@pytest.fixture(scope="module")
def bare(compiled, native_path, tmp_path_factory):
    """Runs a task of the host in a root that has glibc, the host and the FMU alone."""
    root, host = tmp_path_factory.mktemp("root"), compiled("host")
    token = guid_of(fmpy.extract(str(native_path), str(root / "fmu")))
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


@pytest.mark.parametrize("task", [("impact", "1e-3"), *HOST_TASKS], ids=lambda task: task[0])
@pytest.mark.parametrize("times", repeated(1, 5, 20)[:2])
def test_in_a_root_with_nothing_but_libc(bare, task, times):
    for _ in range(times):
        assert bare(*task) == LAW_1


def check_host3(found):
    """What host3.c prints: threads, both laws, a restored state, early return at the events."""
    assert found["refused"] == 1
    # These threads round upwards.
    in_threads = [found[f"thread_{n}"] for n in range(3)]
    assert in_threads == pytest.approx([EXPECTED[2]["smash_factor"]] * 3, rel=1e-13)
    assert [found["law1_S"], found["law2_S"]] == [EXPECTED[n]["smash_factor"] for n in (1, 2)]
    assert found["event_2"] - found["event_1"] == pytest.approx(LAW_2_CONTACT, rel=1e-12)


def test_fmi3_in_a_native_host(compiled, native_fmi3_path, tmp_path):
    folder = fmpy.extract(str(native_fmi3_path), str(tmp_path / "ü #"))
    check_host3(outputs(compiled("host3"), folder, guid_of(folder), env={}))


@pytest.fixture(scope="module")
def sanitized(native_path, tmp_path_factory):
    """The extracted FMU with a library under AddressSanitizer and UBSan."""
    folder = fmpy.extract(str(native_path), str(tmp_path_factory.mktemp("sanitized")))
    library = Path(folder, "binaries", "linux64", "ClubBallImpact.so")
    flags = ["-std=c99", "-g", "-O1", "-shared", "-fPIC", SANITIZERS, "-fno-sanitize-recover=all"]
    run(shutil.which("gcc"), *flags, Path(folder, "sources", "all.c"), "-o", library, "-lm")
    return folder


@pytest.mark.ci
def test_hosts_under_sanitizers(compiled, sanitized):
    """The calls of the C host with instances that move between threads, come and go, fork."""
    host = compiled("host", SANITIZERS, suffix=".sanitized")
    for task in (("impact", "1e-6"), *HOST_TASKS):
        env = {"PATH": os.defpath, "ASAN_OPTIONS": "detect_leaks=0"}
        assert outputs(host, sanitized, guid_of(sanitized), *task, env=env) == LAW_1


@pytest.mark.ci
def test_random_impacts_under_sanitizers(sanitized, tmp_path):
    fmu = shutil.make_archive(str(tmp_path / "sanitized"), "zip", sanitized)
    asan = run(shutil.which("gcc"), "-print-file-name=libasan.so").stdout.strip()
    code = "import sys, test_native as t; fmu = t.Fmu(t.Path(sys.argv[1]))\n"
    code += "with fmu: t.compare_bits(fmu, range(300))"
    env = {
        "LD_PRELOAD": asan,
        "ASAN_OPTIONS": "detect_leaks=0",
        "PYTHONPATH": os.pathsep.join((str(HERE), str(HERE / "hosts"))),
    }
    run(sys.executable, "-c", code, fmu, env=os.environ | env)


# Other platforms, under wine and qemu


def _machine(name):
    """A fixture: the folder of a machine to test on; skips without it."""

    @pytest.fixture(scope="session")
    def machine():
        if name not in os.environ:
            pytest.skip(f"{name} isn't set: tests/README.md has what it names")
        return Path(os.environ[name]).resolve()

    return machine


windows, arm64 = _machine("GOLF_IMPACT_WINDOWS"), _machine("GOLF_IMPACT_ARM64")


def close(found, expected):
    assert found == pytest.approx(expected, rel=1e-13)


@pytest.mark.ci
@pytest.mark.parametrize("task", [("impact", "1e-3"), ("migrate",), ("gone", "50")])
def test_on_windows(windows, compiled, native_path, tmp_path, task):
    """No Python, no environment variable."""
    by = shutil.which("x86_64-w64-mingw32-gcc-posix")
    if by is None or native.fewer_platforms():
        pytest.skip("there is no mingw-w64, or no ziglang, on this machine")
    folder = fmpy.extract(str(native_path), str(tmp_path / "fmu"))
    program = compiled("host", "-static", by=[by], libraries=["-lshell32"], suffix=".exe")
    close(outputs(windows / "run", program, folder, guid_of(folder), *task), LAW_1)


@pytest.mark.ci
def test_on_arm64(arm64, compiled, native_fmi3_path, tmp_path):
    if native.fewer_platforms():
        pytest.skip(native.advice())
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", "aarch64-linux-gnu.2.36"]
    folder = fmpy.extract(str(native_fmi3_path), str(tmp_path / "ü #"))
    program = compiled("host3", by=zig, suffix=".arm64")
    found = outputs(arm64 / "run", program, folder, guid_of(folder), env={})
    assert found["refused"] == 1
    for law in (1, 2):
        assert found[f"law{law}_S"] == pytest.approx(EXPECTED[law]["smash_factor"], rel=1e-13)
    assert found["event_2"] - found["event_1"] == pytest.approx(LAW_2_CONTACT, rel=1e-12)
