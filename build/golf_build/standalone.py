"""An FMU for hosts without Python: any of ours, with a Python of its own and a loader in C.

The loader (fmu_src/loader) takes the place of pythonfmu's library, which has undefined symbols of
Python. It starts the libpython of the Python that builds, with the few modules that the FMU
imports frozen into a library beside it. Linux on x86-64 only.
"""

import hashlib
import importlib.metadata
import importlib.util
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import uuid
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import NamedTuple

from golf_build import elf
from golf_build.archive import SUMS, checksums, scratch, unpack
from golf_build.extras import install_command
from golf_build.packaging import HERE, RUNTIMES, bundle, fmu_source

SUFFIX = ".standalone"

_VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"

#: Libraries of glibc, which every host has.
_GLIBC = re.compile(r"(lib(c|m|dl|pthread|rt|util)|ld-linux-x86-64)\.so\.\d")

#: The others that a libpython or one of its modules may need, whose licences are known.
_KNOWN = ("libpython", "libz.", "libexpat.", "libmpdec.")

#: Modules of pythonfmu and pythonfmu3 that package FMUs.
_PACKERS = ("__main__", "builder", "csvbuilder", "deploy", "osutil")

#: In place of modules that pythonfmu imports but the FMU has no use for.
_STAND_INS = {
    "uuid": "# The real one loads libuuid, which writes into /var/lib; this number is never read.\n"
    "def uuid1():\n    return None\n",
    "ctypes": "# The real one searches for Python in the global scope: it would find the host's.\n"
    "class c_uint64:\n    def __init__(self, value):\n        self.value = value\n",
}


class StandaloneError(Exception):
    """This machine can't build a standalone FMU; the message is what to do."""


class PrivatePython(NamedTuple):
    """What is included in a standalone FMU beside its loader."""

    library: str  #: the name that the loader loads
    files: dict[str, bytes]  #: they lie beside the loader
    licences: dict[str, bytes]
    modules: tuple[str, ...]  #: frozen ones and extension modules


# This machine


def compiler() -> list[str]:
    """The command of a C compiler; StandaloneError if there is none."""
    if importlib.util.find_spec("ziglang") is not None:
        # An old glibc's symbols, whatever this machine has.
        return [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-linux-gnu.2.17"]
    found = shutil.which("cc") or shutil.which("gcc")
    if found is None:
        raise StandaloneError(
            "--standalone needs a C compiler: install one with "
            f"`{install_command('standalone')}`, or install cc"
        )
    return [found]


def libpython() -> Path:
    """The shared library of this Python; StandaloneError if none can be included."""
    import find_libpython

    machine = f"{platform.system()} {platform.machine()}"
    if machine != "Linux x86_64" or platform.python_implementation() != "CPython":
        raise StandaloneError(
            f"--standalone is refused on {machine} with {platform.python_implementation()}: "
            "it is built on Linux x86_64 with CPython (the plain FMU is for the others)"
        )
    found = find_libpython.find_libpython()
    if found is None or ".so" not in Path(found).name:
        raise StandaloneError(
            f"--standalone needs libpython{_VERSION}.so, and this Python is a static one (Debian, "
            f"Ubuntu: apt-get install libpython{_VERSION}-dev; pyenv: "
            "PYTHON_CONFIGURE_OPTS=--enable-shared pyenv install)"
        )
    return Path(found).resolve()


def _headers() -> Path:
    folder = Path(sysconfig.get_path("include"))
    if not (folder / "Python.h").exists():
        raise StandaloneError(
            f"--standalone needs Python.h, not found in {folder} (Debian, Ubuntu: "
            f"apt-get install libpython{_VERSION}-dev)"
        )
    return folder


def _libraries(files: list[Path]) -> dict[str, Path]:
    """Dependencies of these libraries, without glibc: paths on this machine, by name."""
    libraries = {}
    for file in files:
        listed = subprocess.run(["ldd", file], capture_output=True, text=True, check=True).stdout
        for name, place in re.findall(r"(\S+) => (/.*)(?= \()", listed):
            if not _GLIBC.fullmatch(name):
                libraries[name] = Path(place).resolve()
    return libraries


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


def _loader() -> dict[str, bytes]:
    """Its C sources by name."""
    return {file.name: file.read_bytes() for file in fmu_source("loader").iterdir()}


def _compile(files: dict[str, bytes], name: str, *options: str) -> bytes:
    """Compile C sources to a shared library without sections."""
    import fmpy

    headers = Path(fmpy.__file__).parent / "c-code"
    command = [*compiler(), "-std=gnu11", "-O2", "-g0", "-shared", "-fPIC", "-Wall", "-Wextra"]
    command += [f"-I{headers}", "-I.", name, "-o", "made.so", *options]
    command += ["-Wl,-rpath,$ORIGIN", "-Wl,--enable-new-dtags", "-Wl,-z,nodelete"]
    command += ["-pthread", "-ldl"]
    with scratch(_loader() | files) as folder:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if done.returncode:
            why = done.stderr.strip() or "no message"
            raise StandaloneError(f"--standalone: {command[0]} can't compile {name}: {why}")
        return elf.strip((folder / "made.so").read_bytes())


@cache
def private_python() -> PrivatePython:
    """The Python that is included; StandaloneError if this machine can't build it."""
    compiler()
    python, include = libpython(), _headers()
    # The modules are those that the physics imports; its own code is in every FMU.
    physics = {f"golf_physics/{name}": data for name, data in bundle().items()}
    rows = _freeze(_runtime_modules() | physics)
    rows = [row for row in rows if row[0].partition(".")[0] != "golf_physics"]
    extensions = {name: Path(path) for name, package, path in rows if package is None}
    # By the name that dependents use.
    libraries = {python.name: python} | _libraries([python, *extensions.values()])
    contents = {name: file.read_bytes() for name, file in libraries.items()}
    modules = {f"{name}.so": file.read_bytes() for name, file in extensions.items()}
    blob = _blob(rows)
    everything = {**contents, **modules, **_loader(), "standard_library.bin": blob}
    digest = hashlib.sha256(checksums(everything)).hexdigest()
    # Private names of the libraries as well: another one of that name must not be taken.
    names = {name: (f"golf{n}" + digest)[: len(name)] for n, name in enumerate(sorted(contents))}
    files = {names[name]: data for name, data in contents.items()}
    files |= {f"golf-{digest[:12]}-{name}": data for name, data in modules.items()}
    files = {name: elf.rename(data, names) for name, data in files.items()}
    library = f"golf-python-{digest[:16]}.so"
    # All of them, in the order in which they are loaded: what one of them needs is there then.
    linked = ["-L.", "-Wl,--no-as-needed", *(f"-l:{name}" for name in files), "-Wl,--as-needed"]
    # Debian's pyconfig.h includes another one relative to that folder, which has glibc's headers.
    included = [f"-I{include}", "-idirafter", str(include.parent)]
    names_of_modules = " ".join(f"X({name})" for name in sorted(extensions))
    compiled = _compile(
        {**files, "standard_library.bin": blob},
        "private_python.c",
        *linked,
        *included,
        f"-Wl,-soname,{library}",
        f"-DEXTENSIONS={names_of_modules}",
    )
    # A compiler's linker reads the sections, the dynamic one doesn't.
    files = {name: elf.strip(data) for name, data in files.items()} | {library: compiled}
    return PrivatePython(library, files, _licences(contents), tuple(row[0] for row in rows))


def _licences(libraries: Iterable[str]) -> dict[str, bytes]:
    """Of Python and of everything included."""
    for name in libraries:
        if not name.startswith(_KNOWN):
            raise StandaloneError(
                f"--standalone: this Python needs {name}, whose licence isn't known: use another"
            )
    places = (
        Path(sysconfig.get_path("stdlib")) / "LICENSE.txt",
        Path(f"/usr/share/doc/python{_VERSION}/copyright"),
    )
    python = next((file for file in places if file.exists()), None)
    if python is None:
        raise StandaloneError(f"--standalone needs Python's licence, not found at {places[0]}")
    others = {file.name: file.read_bytes() for file in (HERE / "licenses").iterdir()}
    return others | {"python.txt": python.read_bytes()}


# FMUs


def standalone(files: dict[str, bytes]) -> dict[str, bytes]:
    """The files of a plain FMU, made independent of a Python on the machine.

    StandaloneError: this machine can't build it.
    """
    python = private_python()
    (old,) = (name for name in files if re.fullmatch(r"binaries/[\w-]*linux[\w-]*/\w+\.so", name))
    folder = old.rpartition("/")[0]
    found = (re.fullmatch(r"resources/((\w+).*\.py)", name) for name in files)
    own = {one[1]: files[one[0]] for one in found if one and one[2] not in RUNTIMES.values()}
    rows = _freeze(_runtime_modules() | own)
    ours = {_module_name(name).partition(".")[0] for name in own}
    mine = [row for row in rows if row[0].partition(".")[0] in ours]
    stray = {row[0] for row in rows if row not in mine} - {*python.modules}
    assert not stray, stray
    # Other binaries have another GUID (in FMI 3.0: token), which the loader compares.
    text = files["modelDescription.xml"].decode()
    (plain,) = re.findall(' (?:guid|instantiationToken)="([0-9a-f-]+)"', text)
    token = str(uuid.uuid5(uuid.UUID(plain), python.library))
    made = {n: d for n, d in files.items() if not n.startswith("binaries/") and n != SUMS}
    made[old] = _compile(
        {"modules.bin": _blob(mine)},
        "fmi3.c" if folder.endswith("/x86_64-linux") else "fmi2.c",
        f'-DMODULE="{files["resources/slavemodule.txt"].decode().strip()}"',
        f'-DCLASS="{Path(old).stem}"',
        f'-DPRIVATE_PYTHON="{python.library}"',
        f'-DTOKEN="{token}"',
    )
    made |= {f"{folder}/{name}": data for name, data in python.files.items()}
    made |= {f"documentation/licenses/{name}": data for name, data in python.licences.items()}
    # FMI 3.0: pythonfmu3 can't return early, the loader can.
    mode = 'hasEventMode="true"'
    text = text.replace(mode, mode + ' mightReturnEarlyFromDoStep="true"').replace(plain, token)
    made["modelDescription.xml"] = text.encode()
    return made | {SUMS: checksums(made)}


def glibc_of(fmu: Path) -> tuple[int, ...] | None:
    """The oldest glibc that a standalone FMU can do with, as (2, 17); None for another FMU."""
    files = unpack(fmu)
    if not any("/golf-python-" in name for name in files):
        return None
    return max(elf.glibc(data) for name, data in files.items() if name.startswith("binaries/"))
