"""The platforms of standalone FMUs, and their compilers."""

import hashlib
import importlib
import importlib.util
import platform
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import NamedTuple

from golf_build import elf
from golf_build.archive import checksums, scratch
from golf_build.extras import install_command
from golf_build.packaging import fmu_source

#: Of the Python that builds; those that are included have the same one.
VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"


class StandaloneError(Exception):
    """This machine can't build a standalone FMU; the message is what to do."""


class Target(NamedTuple):
    """A platform for which standalone FMUs are built."""

    machine: str  #: system and processor, as the module platform names them
    folders: dict[int, str]  #: of binaries, by version of FMI
    zig: str  #: the target in ziglang's words; an old glibc's symbols, whatever this machine has
    suffix: str  #: of shared libraries


#: By name on the command line.
TARGETS = {
    "linux64": Target(
        "Linux x86_64", {2: "linux64", 3: "x86_64-linux"}, "x86_64-linux-gnu.2.17", ".so"
    ),
    "win64": Target(
        "Windows AMD64", {2: "win64", 3: "x86_64-windows"}, "x86_64-windows-gnu", ".dll"
    ),
    "aarch64": Target("Linux aarch64", {3: "aarch64-linux"}, "aarch64-linux-gnu.2.17", ".so"),
}


class PrivatePython(NamedTuple):
    """What is included in a standalone FMU beside its loader."""

    library: str  #: the name that the loader loads
    files: dict[str, bytes]  #: they lie beside the loader
    licences: dict[str, bytes]
    macros: tuple[str, ...] = ()  #: options that the loader is compiled with


def this_machine() -> str:
    """System and processor, as in `Target`."""
    return f"{platform.system()} {platform.machine()}"


def tool(target: Target, name: str) -> list[str]:
    """The command of a compiler (cc) or of dlltool; StandaloneError if there is none."""
    windows = target.suffix == ".dll"
    gnu = [f"x86_64-w64-mingw32-{name}".replace("cc", end) for end in ("gcc-posix", "gcc")]
    found = next(filter(None, map(shutil.which, gnu)), None) if windows else None
    if found is None and importlib.util.find_spec("ziglang") is not None:
        options = ["-target", target.zig] if name == "cc" else []
        return [sys.executable, "-m", "ziglang", name, *options]
    if not windows and target.machine == this_machine():
        found = shutil.which("cc") or shutil.which("gcc")
    if found is None:
        other = "mingw-w64" if windows else f"cc on {target.machine}"
        raise StandaloneError(
            f"--standalone for {target.machine} needs a C compiler: install one with "
            f"`{install_command('standalone')}`, or install {other}"
        )
    return [found]


def licences(target: Target) -> dict[str, bytes]:
    """Of what the compiler adds of its own; GCC's has an exception for that."""
    if "ziglang" not in tool(target, "cc"):
        return {}
    folder = importlib.import_module("ziglang").__path__[0]
    return {"zig.txt": Path(folder, "LICENSE").read_bytes()}


def run_tool(command: list[str], folder: Path, file: str) -> None:
    """Run a compiler's command in a folder; StandaloneError if it fails."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        why = done.stderr.strip() or "no message"
        raise StandaloneError(f"--standalone: {command[0]} can't make {file}: {why}")


def headers() -> Path:
    """The folder of this Python's C headers; StandaloneError if they are missing."""
    folder = Path(sysconfig.get_path("include"))
    if not (folder / "Python.h").exists():
        raise StandaloneError(
            f"--standalone needs Python.h, not found in {folder} (Debian, Ubuntu: "
            f"apt-get install libpython{VERSION}-dev)"
        )
    return folder


def digest_of(files: dict[str, bytes], blob: bytes) -> str:
    """Of all that a private Python consists of: these files, the frozen modules, the loader."""
    everything = {**files, **loader(), "standard_library.bin": blob}
    return hashlib.sha256(checksums(everything)).hexdigest()


def loader() -> dict[str, bytes]:
    """Its C sources by name."""
    return {file.name: file.read_bytes() for file in fmu_source("loader").iterdir()}


def compile_library(target: Target, files: dict[str, bytes], name: str, *options: str) -> bytes:
    """Compile a C source of the loader to a shared library without sections."""
    import fmpy

    headers = Path(fmpy.__file__).parent / "c-code"
    command = [*tool(target, "cc"), "-std=gnu11", "-O2", "-g0", "-shared", "-Wall", "-Wextra"]
    command += [f"-I{headers}", "-I.", name, "-o", f"made{target.suffix}", *options]
    windows = target.suffix == ".dll"
    if windows:
        command += ["-s", "-static-libgcc"]
        command += ["-Wl,--no-insert-timestamp"] * ("ziglang" not in command)
    else:
        command += ["-fPIC", "-Wl,-rpath,$ORIGIN", "-Wl,--enable-new-dtags", "-Wl,-z,nodelete"]
        command += ["-pthread", "-ldl"]
    with scratch(loader() | files) as folder:
        run_tool(command, folder, name)
        made = (folder / f"made{target.suffix}").read_bytes()
    return made if windows else elf.strip(made)
