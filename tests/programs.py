"""Programs that drive the FMUs: in C (tests/hosts/native_host), and other importers."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from binascii import crc32
from pathlib import Path

import fmpy
import pytest
from command import outputs, run_python

from golf_impact.fmu.doctor import find_libpython

#: FMI's C headers.
HEADERS = Path(fmpy.__file__).parent / "c-code"


@pytest.fixture(scope="session")
def compiled(extracted, tmp_path_factory):
    """A function that compiles a file of tests/hosts/native_host and gives the program's path."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("there is no C compiler on this machine")
    folder = tmp_path_factory.mktemp("compiled")
    variables = fmpy.read_model_description(extracted).modelVariables
    macros = [f"-DVR_{v.name}={v.valueReference}" for v in variables]
    flags = ["-std=c11", "-Wall", "-Wextra", "-Wno-unused-parameter", "-Werror", "-O1", "-pthread"]

    def compiled(name, *options, by=(compiler,)):
        # Of another name wine runs no program.
        program = folder / f"{name}{crc32(repr((by, options)).encode())}.exe"
        if not program.exists():
            source = Path(__file__).parent / "hosts" / "native_host" / f"{name}.c"
            words = [*flags, f"-I{HEADERS}", *macros, *options, source, "-o", program]
            subprocess.run([*by, *words], check=True)
        return program

    return compiled


@pytest.fixture
def c_host(compiled, tmp_path):
    """A function that runs a task of native_host/host.c with an FMU: the values it prints."""

    def c_host(fmu, task, number=1, law=1, *options, binary=None, by=None, on=(), **environment):
        """Compiled with options, or by another compiler for a machine, where `on` runs it."""
        # A host that passes the address as it is may even have these: it is escapes that do harm.
        name = "fmu" if on else "native host #"
        folder = fmu if Path(fmu).is_dir() else fmpy.extract(str(fmu), str(tmp_path / name))
        about = fmpy.read_model_description(folder)
        fmi = about.fmiVersion[0]
        options = f"-DFMI={fmi}", *options
        program = compiled("host", *options, by=by) if by else compiled("host", *options)
        binary = binary or ("linux64" if fmi == "2" else "x86_64-linux") + "/ClubBallImpact.so"
        words = folder, f"binaries/{binary}", about.guid, law, task, number
        # No environment variable but those that are given.
        env = os.environ if on else {"PATH": os.defpath, **environment}
        return outputs(*on, program, *words, env=env)

    return c_host


@pytest.fixture(scope="session")
def freed(compiled):
    """A library to preload: access to pythonfmu's state after it is freed ends the process."""
    if sys.platform != "linux":
        pytest.skip("the library is of another kind there")
    return compiled("freed", "-shared", "-fPIC")


@pytest.fixture(scope="session")
def libpython():
    """A libpython that a native host can load the FMU with."""
    file = find_libpython()
    if file is None:
        pytest.skip("there is no shared libpython on this machine")
    return file


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
