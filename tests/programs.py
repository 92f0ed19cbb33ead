"""Programs that drive the FMUs: in C (tests/hosts/native_host), and other importers."""

import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest
from command import run_python

from golf_impact.fmu.doctor import find_libpython

#: FMI's C headers.
HEADERS = Path(fmpy.__file__).parent / "c-code"

#: Tasks of the C host with an instance, and their arguments; each ends with the impact of LAW_1.
HOST_TASKS = [("migrate",), ("gone", "50"), ("fork",)]


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
            source = Path(__file__).parent / "hosts" / "native_host" / f"{name}.c"
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
