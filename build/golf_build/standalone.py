"""An FMU for hosts without Python: any of ours, with a Python of its own and a loader in C.

The loader (fmu_src/loader) takes the place of pythonfmu's library, which has undefined symbols of
Python. What it starts is the libpython of the Python that builds, with the few modules that the FMU
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
import tempfile
import uuid
from functools import cache
from pathlib import Path
from typing import NamedTuple

from golf_build import elf
from golf_build.archive import SUMS, packed, sums, unpacked, whole
from golf_build.extras import install_command
from golf_build.packaging import HERE

SUFFIX = ".standalone"

_RUNTIMES = ("pythonfmu", "pythonfmu3")

#: Libraries of glibc, which every host has.
_GLIBC = re.compile(r"(lib(c|m|dl|pthread|rt|util)|ld-linux-x86-64)\.so\.\d")

#: The others that a libpython or one of its modules may need, and their licences.
_LICENCES = {"libz.so.1": "zlib", "libexpat.so.1": "expat", "libmpdec.so": "libmpdec"}

#: In place of modules that pythonfmu imports but the FMU has no use for.
_STAND_INS = {
    "uuid": "# The real one loads libuuid, which writes into /var/lib; nobody reads this number.\n"
    "def uuid1():\n    return None\n",
    "ctypes": "# The real one looks for Python in the global scope: it would find the host's.\n"
    "class c_uint64:\n    def __init__(self, value):\n        self.value = value\n",
}


class StandaloneError(Exception):
    """This machine can't build a standalone FMU; the text says what to do."""


class PrivatePython(NamedTuple):
    """What travels in a standalone FMU beside its loader.

    Attributes:
        library: the name that the loader asks for.
        files: by name; they lie beside the loader.
        licences: text by name.
        modules: that are frozen in, and the extension modules.
        glibc: the oldest glibc that all of them can do with.
    """

    library: str
    files: dict[str, bytes]
    licences: dict[str, bytes]
    modules: tuple[str, ...]
    glibc: tuple[int, ...]


# What the machine has


def compiler() -> list[str]:
    """The command of a C compiler.

    Raises:
        StandaloneError: there is none.
    """
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
    """The shared library of this Python.

    Raises:
        StandaloneError: it has none, or isn't one that can travel.
    """
    import find_libpython

    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    machine = f"{platform.system()} {platform.machine()}"
    if machine != "Linux x86_64" or platform.python_implementation() != "CPython":
        raise StandaloneError(
            f"--standalone is refused on {machine} with {platform.python_implementation()}: "
            "it is built on Linux x86_64 with CPython (the plain FMU is for the others)"
        )
    if sysconfig.get_config_var("Py_GIL_DISABLED"):
        raise StandaloneError("--standalone needs a Python with its global lock, not 3.xt")
    found = find_libpython.find_libpython()
    if found is None or ".so" not in Path(found).name:
        raise StandaloneError(
            f"--standalone needs libpython{version}.so, and this Python is a static one (Debian, "
            f"Ubuntu: apt-get install libpython{version}-dev; pyenv: "
            "PYTHON_CONFIGURE_OPTS=--enable-shared pyenv install)"
        )
    return Path(found).resolve()


def _headers() -> Path:
    folder = Path(sysconfig.get_path("include"))
    if not (folder / "Python.h").exists():
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        raise StandaloneError(
            f"--standalone needs Python.h, not found in {folder} (Debian, Ubuntu: "
            f"apt-get install libpython{version}-dev)"
        )
    return folder


def _system_library(name: str, wanted_by: Path) -> Path:
    """Where the dynamic linker finds a library that a file needs."""
    listed = subprocess.run(["ldd", str(wanted_by)], capture_output=True, text=True, check=True)
    for line in listed.stdout.splitlines():
        key, _, place = line.strip().partition(" => ")
        if key == name and place.startswith("/"):
            return Path(place.rpartition(" (")[0]).resolve()
    raise StandaloneError(f"{wanted_by} needs {name}, which isn't found on this machine")


# Python, and what goes with it


def _portable(file: Path) -> bytes:
    """A library of this machine, for others."""
    # The newer hypot differs in how it tells errors, which Python looks at in neither.
    data = elf.older(file.read_bytes(), "hypot", "GLIBC_2.35", "GLIBC_2.2.5")
    return elf.unplaced(data)


def _frozen(modules: dict[str, bytes], own: list[str]) -> list[tuple[str, bool | None, str]]:
    """What these modules need; see `frozen_modules`."""
    with tempfile.TemporaryDirectory(prefix="golf-impact-build-") as scratch:
        files = modules | {f"{name}.py": text.encode() for name, text in _STAND_INS.items()}
        files["frozen_modules.py"] = (HERE / "frozen_modules.py").read_bytes()
        for name, data in files.items():
            file = Path(scratch, name)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(data)
        done = subprocess.run(
            [sys.executable, "-s", "-S", "-B", "frozen_modules.py", *own],
            cwd=scratch,
            env={"PYTHONHASHSEED": "0", "PATH": os.defpath},
            capture_output=True,
            text=True,
        )
    if done.returncode:
        why = done.stderr.strip().splitlines()[-1]
        raise StandaloneError(f"--standalone: the FMU's modules can't be compiled: {why}")
    return [(name, package, text) for name, package, text in json.loads(done.stdout)]


def _blob(rows: list[tuple[str, bool | None, str]]) -> bytes:
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
    for runtime in _RUNTIMES:
        for file in importlib.metadata.files(runtime) or []:
            name = file.as_posix()
            if re.fullmatch(rf"{runtime}/\w+\.py", name) and file.stem not in (
                *("__main__", "builder", "csvbuilder", "deploy", "osutil"),
            ):
                text = file.read_text()
                files[name] = re.sub(r"(?m)^from \.builder .*$", "", text).encode()
    return files


def _module_name(path: str) -> str:
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _compiled(files: dict[str, bytes | Path], source: str, out: str, *options: str) -> bytes:
    """A shared library from C sources."""
    import fmpy

    folder = loader_folder()
    with tempfile.TemporaryDirectory(prefix="golf-impact-build-") as scratch:
        sources = {file.name: file.read_bytes() for file in folder.iterdir()}
        for name, data in {**sources, **files}.items():
            Path(scratch, name).write_bytes(data.read_bytes() if isinstance(data, Path) else data)
        headers = Path(fmpy.__file__).parent / "c-code"
        command = [*compiler(), "-std=gnu11", "-O2", "-g0", "-shared", "-fPIC", "-Wall", "-Wextra"]
        command += [f"-I{headers}", "-I.", source, "-o", out, *options]
        command += ["-Wl,-rpath,$ORIGIN", "-Wl,--enable-new-dtags", "-Wl,-z,nodelete"]
        done = subprocess.run(
            [*command, "-pthread", "-ldl"], cwd=scratch, capture_output=True, text=True
        )
        if done.returncode:
            why = done.stderr.strip() or "no message"
            raise StandaloneError(f"--standalone: {command[0]} can't compile {source}: {why}")
        return elf.stripped(Path(scratch, out).read_bytes())


def loader_folder() -> Path:
    """The sources in C: in this package if it is installed."""
    installed = HERE / "loader"
    return installed if installed.is_dir() else HERE.parents[1] / "fmu_src" / "loader"


@cache
def private_python() -> PrivatePython:
    """The Python that travels along.

    Raises:
        StandaloneError: this machine can't build it.
    """
    compiler()
    python, include = libpython(), _headers()
    runtime = _runtime_modules()
    # What the physics imports decides which modules these are; its own code is every FMU's.
    from golf_build.packaging import bundled

    physics = {f"golf_impact/{name}": data for name, data in bundled().items()}
    own = sorted(_module_name(path) for path in (*runtime, *physics))
    rows = _frozen({**runtime, **physics}, own)
    rows = [row for row in rows if row[0].partition(".")[0] != "golf_impact"]
    extensions = {name: Path(path) for name, package, path in rows if package is None}

    # By the name under which others ask for them: where they are.
    libraries: dict[str, Path] = {elf.soname(python.read_bytes()): python}
    todo = [python, *extensions.values()]
    while todo:
        file = todo.pop()
        for name in elf.needed(file.read_bytes()):
            if name not in libraries and not _GLIBC.fullmatch(name):
                libraries[name] = _system_library(name, file)
                todo.append(libraries[name])
    contents = {name: _portable(file) for name, file in libraries.items()}
    modules = {f"{name}.so": _portable(file) for name, file in extensions.items()}
    blob = _blob(rows)

    total = hashlib.sha256(blob)
    for name in ("private_python.c", "platform.h"):
        total.update((loader_folder() / name).read_bytes())
    for _, data in sorted({**contents, **modules}.items()):
        total.update(hashlib.sha256(data).digest())
    digest = total.hexdigest()
    # A library's name is its own, too: nobody else's of that name may be taken for it.
    names = {name: (f"golf{n}" + digest)[: len(name)] for n, name in enumerate(sorted(contents))}
    files = {names[name]: elf.renamed(data, names) for name, data in contents.items()}
    own_modules = {f"golf-{digest[:12]}-{name}": data for name, data in modules.items()}
    files |= {name: elf.renamed(data, names) for name, data in own_modules.items()}
    library = f"golf-python-{digest[:16]}.so"
    compiled = _compiled(
        {**files, "standard_library.bin": blob},
        "private_python.c",
        library,
        # All of them, in the order in which they are loaded: what one of them needs is there then.
        *("-L.", "-Wl,--no-as-needed", *(f"-l:{name}" for name in files), "-Wl,--as-needed"),
        f"-I{include}",
        # Debian's pyconfig.h asks for another one by a path from there, which has glibc's, too.
        *("-idirafter", str(include.parent)),
        f"-Wl,-soname,{library}",
        "-DEXTENSIONS=" + " ".join(f"X({name})" for name in sorted(extensions)),
    )
    # A compiler's linker reads the sections, the dynamic one doesn't.
    files = {name: elf.stripped(data) for name, data in files.items()} | {library: compiled}
    return PrivatePython(
        library=library,
        files=files,
        licences=_licences(contents, extensions),
        modules=tuple(row[0] for row in rows),
        glibc=max(elf.glibc(data) for data in files.values()),
    )


def _licences(contents: dict[str, bytes], extensions: dict[str, Path]) -> dict[str, bytes]:
    """Of all that travels along."""
    places = [
        Path(sysconfig.get_path("stdlib")) / "LICENSE.txt",
        Path(f"/usr/share/doc/python{sys.version_info.major}.{sys.version_info.minor}/copyright"),
    ]
    python = next((file for file in places if file.exists()), None)
    if python is None:
        raise StandaloneError(f"--standalone needs Python's licence, not found at {places[0]}")
    found = {"python.txt": python.read_bytes()}
    texts = HERE / "licenses"
    wanted = {"libmpdec"} if "_decimal" in extensions else set()
    for name in contents:
        key = next((k for k in _LICENCES if name.startswith(k)), None)
        if key is not None:
            wanted.add(_LICENCES[key])
        elif not name.startswith("libpython"):
            raise StandaloneError(
                f"--standalone: this Python needs {name}, whose licence isn't known: use another"
            )
    return found | {f"{name}.txt": (texts / f"{name}.txt").read_bytes() for name in sorted(wanted)}


# FMUs


def standalone(files: dict[str, bytes]) -> dict[str, bytes]:
    """The files of a plain FMU, made independent of a Python on the machine.

    Args:
        files: of the FMU, by name.

    Raises:
        StandaloneError: this machine can't build it.
    """
    python = private_python()
    (old,) = (name for name in files if re.fullmatch(r"binaries/[\w-]*linux[\w-]*/\w+\.so", name))
    fmi = 3 if "x86_64-linux" in old else 2
    entry = files["resources/slavemodule.txt"].decode().strip()
    sources = {
        name.removeprefix("resources/"): data
        for name, data in files.items()
        if re.fullmatch(r"resources/.*\.py", name)
    }
    own = {n: d for n, d in sources.items() if n.partition("/")[0] not in _RUNTIMES}
    names = sorted(_module_name(path) for path in own)
    if fmi == 2:
        names = [name for name in names if not name.endswith("_fmi3")]
    rows = _frozen({**_runtime_modules(), **own}, names)
    ours = {name.partition(".")[0] for name in names}
    mine = [row for row in rows if row[0].partition(".")[0] in ours]
    known = set(python.modules)
    stray = [row[0] for row in rows if row not in mine and row[0] not in known]
    assert not stray, stray
    loader = _compiled(
        {"modules.bin": _blob(mine)},
        f"fmi{fmi}.c",
        "loader.so",
        f'-DMODULE="{entry}"',
        f'-DCLASS="{Path(old).stem}"',
        f'-DPRIVATE_PYTHON="{python.library}"',
    )
    folder = old.rpartition("/")[0]
    made = {n: d for n, d in files.items() if not n.startswith("binaries/") and n != SUMS}
    made[old] = loader
    made |= {f"{folder}/{name}": data for name, data in python.files.items()}
    made |= {f"documentation/licenses/{name}": data for name, data in python.licences.items()}
    made["modelDescription.xml"] = _described(files["modelDescription.xml"], made)
    return made | {SUMS: sums(made)} if SUMS in files else made


def _described(written: bytes, made: dict[str, bytes]) -> bytes:
    """The description: no tool is needed, and the GUID is that of other binaries."""
    text, count = re.subn(rb'needsExecutionTool="true"', b'needsExecutionTool="false"', written)
    assert count >= 1
    # FMI 3.0: pythonfmu3 can't return early, the loader can.
    mode = b'hasEventMode="true"'
    text = text.replace(mode, mode + b' mightReturnEarlyFromDoStep="true"')
    binaries = {name: data for name, data in made.items() if name.startswith("binaries/")}

    def other(match: re.Match) -> bytes:
        token = str(uuid.uuid5(uuid.UUID(match[2].decode()), sums(binaries).decode()))
        return match[1] + token.encode() + match[3]

    text, count = re.subn(rb'((?:guid|instantiationToken)=")([0-9a-f-]+)(")', other, text)
    assert count == 1
    return text


def build(plain: Path, out: Path) -> Path:
    """Write the standalone FMU of a plain one.

    Raises:
        StandaloneError: this machine can't build it.
        OSError: it can't be written.
    """
    made = packed(standalone(unpacked(plain)))
    out.parent.mkdir(parents=True, exist_ok=True)
    with whole(out) as stream:
        stream.write(made)
    return out.resolve()


def glibc_of(fmu: Path) -> tuple[int, ...] | None:
    """The oldest glibc that a standalone FMU can do with, as (2, 17); None for another FMU."""
    files = unpacked(fmu)
    libraries = [
        data for name, data in files.items() if re.match(r"binaries/[\w-]*linux[\w-]*/.", name)
    ]
    if not any("/golf-python-" in name for name in files):
        return None
    return max(elf.glibc(data) for data in libraries)
