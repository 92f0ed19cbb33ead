"""An FMU for hosts without Python: any of ours, with a Python of its own and a loader in C.

The loader (fmu_src/loader) takes the place of pythonfmu's library, which has undefined symbols of
Python. It starts a libpython of the version that builds (`linux`, `windows`), with the few modules
that the FMU imports frozen into a library beside it. One FMU can have binaries for several
platforms.
"""

import importlib.metadata
import json
import os
import platform
import re
import subprocess
import sys
import uuid
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import golf_physics

from golf_build import linux, toolchain, windows
from golf_build.archive import SUMS, checksums, scratch
from golf_build.packaging import HERE, RUNTIMES, bundle
from golf_build.toolchain import TARGETS, PrivatePython, StandaloneError, this_machine

SUFFIX = ".standalone"

#: Platforms by name in `TARGETS`, and where their Python comes from: a zip for Windows, a root
#: folder, or this machine. None or empty: this machine's platform, with the Python that builds.
Pythons = Mapping[str, Path | None] | None

#: Modules of pythonfmu and pythonfmu3 that package FMUs.
_PACKERS = ("__main__", "builder", "csvbuilder", "deploy", "osutil")

#: In place of modules that pythonfmu imports but the FMU has no use for.
_STAND_INS = {
    "uuid": "# The real one loads libuuid, which writes into /var/lib; this number is never read.\n"
    "def uuid1():\n    return None\n",
    "ctypes": "# The real one searches for Python in the global scope: it would find the host's.\n"
    "class c_uint64:\n    def __init__(self, value):\n        self.value = value\n",
}


# The included Python


def _freeze(modules: dict[str, bytes]) -> list[list]:
    """Compile these modules and those they import; rows as `frozen_modules` prints them."""
    files = modules | {f"{name}.py": text.encode() for name, text in _STAND_INS.items()}
    files["frozen_modules.py"] = (HERE / "frozen_modules.py").read_bytes()
    with scratch(files) as folder:
        done = subprocess.run(
            [sys.executable, "-s", "-S", "-B", "frozen_modules.py", *map(_module_name, modules)],
            cwd=folder,
            env={"PYTHONHASHSEED": "0", "PATH": os.defpath},
            capture_output=True,
            text=True,
        )
    if done.returncode:
        why = done.stderr.strip().splitlines()[-1]
        raise StandaloneError(f"--standalone: the FMU's modules can't be compiled: {why}")
    return json.loads(done.stdout)


def _blob(rows: list[list]) -> bytes:
    """Modules as the loader reads them."""
    data = b""
    for name, package, text in rows:
        if package is not None:
            code = bytes.fromhex(text)
            data += name.encode() + bytes((0, package)) + len(code).to_bytes(4, "little") + code
    return data


def _runtime_modules() -> dict[str, bytes]:
    """Sources of pythonfmu and pythonfmu3, without what packages FMUs."""
    files = {}
    for runtime in RUNTIMES.values():
        for file in importlib.metadata.files(runtime) or []:
            name = file.as_posix()
            if re.fullmatch(rf"{runtime}/\w+\.py", name) and file.stem not in _PACKERS:
                text = file.read_text()
                files[name] = re.sub(r"(?m)^from \.builder .*$", "", text).encode()
    return files


def _module_name(path: str) -> str:
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


@cache
def standard_library() -> list[list]:
    """Modules that every FMU imports, in rows as `frozen_modules` prints them."""
    # They are those that the physics imports; its own code is in every FMU.
    physics = {f"golf_physics/{name}": data for name, data in bundle().items()}
    rows = _freeze(_runtime_modules() | physics)
    return [row for row in rows if row[0].partition(".")[0] != "golf_physics"]


def this_platform() -> str:
    """The target that this machine is; StandaloneError if none can be built here."""
    for name, target in TARGETS.items():
        if target.machine == this_machine() and platform.system() == "Linux":
            return name
    raise StandaloneError(
        f"--standalone is refused on {this_machine()}: it is built on Linux (x86_64, aarch64), for "
        "Windows, too, by --target win64; the plain FMU is for the others"
    )


@cache
def private_python(name: str, source: Path | None = None) -> PrivatePython:
    """The Python that is included for a target; StandaloneError if this machine can't build it."""
    if platform.python_implementation() != "CPython":
        raise StandaloneError(
            f"--standalone is refused with {platform.python_implementation()}: it is built by "
            "CPython on Linux (the plain FMU is for the others)"
        )
    this_platform()
    target = TARGETS[name]
    toolchain.tool(target, "cc")
    rows = standard_library()
    blob, modules = _blob(rows), {row[0]: row[2] for row in rows if row[1] is None}
    system = windows if target.suffix == ".dll" else linux
    return system.private_python(target, source, modules, blob)


# FMUs


def standalone(files: dict[str, bytes], pythons: Pythons) -> dict[str, bytes]:
    """The files of a plain FMU, by name, made independent of a Python on the machine.

    StandaloneError: this machine can't build it.
    """
    pythons = pythons or {this_platform(): None}
    (old,) = (name for name in files if re.fullmatch(r"binaries/[\w-]*linux[\w-]*/\w+\.so", name))
    fmi = 3 if "/x86_64-linux/" in old else 2
    for name in pythons:
        if fmi not in TARGETS[name].folders:
            raise StandaloneError(
                f"--target {name} is refused for FMI {fmi}.0, which has no folder for its "
                "binaries: build with --fmi 3"
            )
    chosen = {name: private_python(name, source) for name, source in pythons.items()}
    model = Path(old).stem
    found = (re.fullmatch(r"resources/((\w+).*\.py)", name) for name in files)
    own = {one[1]: files[one[0]] for one in found if one and one[2] not in RUNTIMES.values()}
    rows = _freeze(_runtime_modules() | own)
    ours = {_module_name(name).partition(".")[0] for name in own}
    mine = [row for row in rows if row[0].partition(".")[0] in ours]
    stray = {row[0] for row in rows if row not in mine} - {row[0] for row in standard_library()}
    assert not stray, stray
    # Other binaries have another GUID (in FMI 3.0: token), which the loader compares.
    text = files["modelDescription.xml"].decode()
    (plain,) = re.findall(' (?:guid|instantiationToken)="([0-9a-f-]+)"', text)
    token = str(uuid.uuid5(uuid.UUID(plain), " ".join(p.library for p in chosen.values())))
    left_out = (SUMS, "documentation/externalDependencies.txt")
    made = {n: d for n, d in files.items() if not n.startswith("binaries/") and n not in left_out}
    for name, python in chosen.items():
        target = TARGETS[name]
        folder = f"binaries/{target.folders[fmi]}"
        made[f"{folder}/{model}{target.suffix}"] = toolchain.compile_library(
            target,
            {"modules.bin": _blob(mine)},
            f"fmi{fmi}.c",
            f'-DMODULE="{files["resources/slavemodule.txt"].decode().strip()}"',
            f'-DCLASS="{model}"',
            f'-DPRIVATE_PYTHON="{python.library}"',
            f'-DTOKEN="{token}"',
            *python.macros,
        )
        made |= {f"{folder}/{name}": data for name, data in python.files.items()}
        licences = python.licences | toolchain.licences(target)
        made |= {f"documentation/licenses/{n}": data for n, data in licences.items()}
    # FMI 3.0: pythonfmu3 can't return early, the loader can.
    mode = 'hasEventMode="true"'
    text = text.replace(mode, mode + ' mightReturnEarlyFromDoStep="true"').replace(plain, token)
    made["modelDescription.xml"] = re.sub(
        ' generationTool="[^"]*"', f' generationTool="golf-impact {golf_physics.__version__}"', text
    ).encode()
    return made | {SUMS: checksums(made)}


def binaries_of(files: dict[str, bytes]) -> dict[str, dict[str, bytes]]:
    """Of an FMU's files the binaries by name, by machine as in `Target` (or the folder's name)."""
    machines = {folder: t.machine for t in TARGETS.values() for folder in t.folders.values()}
    binaries: dict[str, dict[str, bytes]] = {}
    for name, data in files.items():
        if found := re.fullmatch("binaries/([^/]+)/(.+)", name):
            binaries.setdefault(machines.get(found[1], found[1]), {})[found[2]] = data
    return binaries
