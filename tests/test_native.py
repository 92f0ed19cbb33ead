"""The native FMU: the same bits as the Python physics; its file, its sources, sanitizers."""

import hashlib
import json
import os
import shutil
import struct
import subprocess
import sys
import zipfile

import fmpy
import pytest
from command import run, run_python
from conftest import HEADERS, HERE, build_native, some
from fmpy.fmi1 import FMICallException
from instances import make_instance
from native_cases import KINDS

from golf_build import native
from golf_build.fmi2 import BUILDER as FMI2
from golf_build.fmi3 import BUILDER as FMI3

FOLDERS = {
    2: {"linux64", "win64", "darwin64"},
    3: {"x86_64-linux", "aarch64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-darwin"},
}

#: As importers compile it, and as ours are.
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")


@pytest.fixture(scope="module", params=[2, 3])
def built(request, once):
    """The version of FMI, and the file."""
    fmi = request.param
    name = f"ClubBallImpact{'.fmi3' if fmi == 3 else ''}.native.fmu"
    return fmi, once(name, build_native, fmi=fmi)


@pytest.fixture(scope="module")
def unpacked(built, tmp_path_factory):
    return fmpy.extract(str(built[1]), str(tmp_path_factory.mktemp("native")))


@pytest.fixture(scope="module")
def library(built, unpacked):
    """The library of this platform and the token, of FMI 2.0."""
    if built[0] != 2 or sys.platform != "linux":
        pytest.skip("the comparison makes the calls of FMI 2.0, on Linux")
    token = fmpy.read_model_description(unpacked).guid
    return f"{unpacked}/binaries/linux64/ClubBallImpact.so", token


def compared(library, kind, count, seed, **environment):
    code = "import runpy, sys; del sys.argv[0]; runpy.run_path(sys.argv[0], None, '__main__')"
    script = str(HERE / "native_cases.py")
    env = {**os.environ, "PYTHONPATH": str(HERE), **environment}
    done = run_python(code, script, *library, kind, str(count), str(seed), env=env)
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("seed", some(1, range(20), 4))
@pytest.mark.parametrize("kind", KINDS)
def test_all_bits_are_those_of_the_python_physics(library, kind, seed):
    """Measured: none of 2.4 million values differs."""
    read, different = compared(library, kind, 20 if kind == "power pushed" else 150, seed)
    assert read > 3000
    assert not different


def test_the_comparison_can_fail(library, unpacked, tmp_path):
    """With fused multiplication and addition other bits come out."""
    compiler = _compiler()
    flags = ["-O2", "-ffp-contract=fast", "-mfma", "-shared", "-fPIC"]
    source = tmp_path / "sources"
    shutil.copytree(f"{unpacked}/sources", source)
    text = (
        (source / "golf.h").read_text().replace('optimize("fp-contract=off")', "poison none_such")
    )
    (source / "golf.h").write_text(text)
    fused = tmp_path / "fused.so"
    subprocess.run([compiler, *flags, source / "all.c", "-o", fused, "-lm"], check=True)
    _, different = compared((str(fused), library[1]), "linear", 20, 1)
    assert different


@pytest.mark.parametrize("kind", KINDS)
def test_sanitizers_are_silent(library, unpacked, tmp_path, kind):
    compiler, out = _compiler(), tmp_path / "sanitized.so"
    flags = ["-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    subprocess.run(
        [
            compiler,
            *STRICT,
            *flags,
            "-shared",
            "-fPIC",
            f"{unpacked}/sources/all.c",
            "-o",
            out,
            "-lm",
        ],
        check=True,
    )
    asan = subprocess.check_output([compiler, "-print-file-name=libasan.so"], text=True).strip()
    options = {"LD_PRELOAD": asan, "ASAN_OPTIONS": "detect_leaks=0"}
    _, different = compared((str(out), library[1]), kind, 10, 3, **options)
    assert not different


def test_a_host_that_traps_floating_point_exceptions(library, unpacked, tmp_path):
    """None occurs, whatever the values; and NULL is no crash."""
    compiler, out = _compiler(), tmp_path / "traps"
    command = [compiler, "-std=c99", "-O1", "-w", f"-I{unpacked}/sources"]
    command += [HERE / "native_host/traps.c", "-o", out, "-lm"]
    subprocess.run(command, check=True)
    assert run(out, "1500", "1").stdout == "done\n"


def test_illegal_calls_are_errors(library, unpacked):
    slave = make_instance(unpacked)
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


def _compiler():
    found = shutil.which("gcc")
    if found is None:
        pytest.skip("there is no gcc on this machine")
    return found


# The file


def test_its_platforms(built):
    fmi, path = built
    with zipfile.ZipFile(path) as file:
        names = file.namelist()
    found = {name.split("/")[1] for name in names if name.startswith("binaries/")}
    assert found == FOLDERS[fmi] or native.fewer_platforms()
    assert path.stat().st_size < 1_000_000
    assert not list(fmpy.validation.validate_fmu(str(path)))


def test_a_build_has_the_same_bytes_again(built, tmp_path):
    fmi, path = built
    again = native.build(FMI2 if fmi == 2 else FMI3, tmp_path / "again.fmu")
    assert again.read_bytes() == path.read_bytes()


def test_strict_compilers_accept_the_sources(unpacked, built, tmp_path):
    for compiler in filter(shutil.which, ("gcc", "clang")):
        for prefix in ([], [f"-DFMI{built[0]}_FUNCTION_PREFIX=Golf_"]):
            out = tmp_path / "all.o"
            source = f"{unpacked}/sources/all.c"
            subprocess.run([compiler, *STRICT, *prefix, "-c", source, "-o", out], check=True)
            shown = subprocess.check_output(["nm", "--defined-only", "-g", out], text=True)
            start = f"Golf_fmi{built[0]}" if prefix else f"fmi{built[0]}"
            names = [line.split()[-1] for line in shown.splitlines()]
            assert all(name.startswith(start) for name in names), names
            assert len(names) > 30
    assert HEADERS.is_dir()


def test_libraries_for_macos_are_signed(built, unpacked):
    """The universal file has both machines; each page has the hash that its signature says."""
    if native.fewer_platforms():
        pytest.skip("without ziglang there are none")
    paths = [f"{unpacked}/binaries/{folder}" for folder in FOLDERS[built[0]] if "darwin" in folder]
    slices = []
    for path in paths:
        with open(f"{path}/ClubBallImpact.dylib", "rb") as file:
            data = file.read()
        if data[:4] == struct.pack(">I", 0xCAFEBABE):
            (count,) = struct.unpack_from(">I", data, 4)
            for n in range(count):
                _, _, offset, size, align = struct.unpack_from(">5I", data, 8 + 20 * n)
                assert offset % (1 << align) == 0
                slices.append(data[offset : offset + size])
        else:
            slices.append(data)
    machines = [struct.unpack_from("<2I", image) for image in slices]
    assert sorted(machines) == [(0xFEEDFACF, 0x01000007), (0xFEEDFACF, 0x0100000C)]
    for image in slices:
        _check_signature(image)


def _check_signature(image):
    count, offset = struct.unpack_from("<I", image, 16)[0], 32
    for _ in range(count):
        kind, size = struct.unpack_from("<2I", image, offset)
        if kind == 0x1D:
            start, length = struct.unpack_from("<2I", image, offset + 8)
        offset += size
    assert start + length == len(image)
    assert struct.unpack_from(">I", image, start)[0] == 0xFADE0CC0
    directory = start + struct.unpack_from(">I", image, start + 16)[0]
    fields = struct.unpack_from(">9I4B", image, directory)
    hashes, pages, limit, page = fields[4], fields[7], fields[8], 1 << fields[12]
    assert limit == start
    for n in range(pages):
        digest = hashlib.sha256(image[n * page : min((n + 1) * page, limit)]).digest()
        at = directory + hashes + 32 * n
        assert image[at : at + 32] == digest
