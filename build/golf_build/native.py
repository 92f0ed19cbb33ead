"""The native FMU: the physics in C (fmu_src/native), for hosts without Python, on every platform.

ziglang compiles it for all platforms, byte for byte the same on each machine; without ziglang the C
compiler of this machine does, for this platform alone. The sources are in the FMU, too: importers
such as TwinCAT and Simulink compile them.
"""

import hashlib
import importlib.metadata
import importlib.resources
import importlib.util
import os
import platform
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import golf_physics
from golf_physics import variables as tables

from golf_build.archive import SUMS, checksums, scratch
from golf_build.errors import UnavailableError, UserError
from golf_build.extras import install_command
from golf_build.fmi2 import TABLES
from golf_build.native_header import NATIVE_LAWS, native_row
from golf_build.packaging import Builder
from golf_build.sources import HERE, c_sources

#: The ziglang of pyproject.toml's extra: other versions make other bytes.
ZIGLANG = "0.13.0"

_ZIG = (sys.executable, "-m", "ziglang")

#: Its C compiler.
ZIG_CC = (*_ZIG, "cc")

#: Whatever an importer's options are: no fused operations, no floating-point exceptions but where C
#: has them (clang's comparisons with NaN), and nothing visible but FMI's functions.
_FLAGS = (
    "-std=c99", "-O2", "-g0", "-ffp-contract=off", "-ftrapping-math", "-fvisibility=hidden",
    "-Wall", "-Wextra", "-Werror", "-pedantic",
)  # fmt: skip

#: None, for macOS: zig signs a library that has entitlements; without, those for arm64 alone.
_ENTITLEMENTS = {"entitlements.plist": b'<plist version="1.0"><dict/></plist>'}

_HEADERS = {
    2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}

#: Parts of a universal file begin at pages, which arm64 has of 2^14 bytes.
_ALIGNMENT = 14
_PAGE = 1 << _ALIGNMENT


class Target(NamedTuple):
    """A platform.

    Attributes:
        machine: system and processor by their usual names, as in `this_machine`.
        zig: its name for zig.
        suffix: of a library.
        folders: of the binaries in an FMU, by version of FMI.
    """

    machine: str
    zig: str
    suffix: str
    folders: dict[int, str]


#: In FMI 2.0 the two for macOS are one universal file.
TARGETS = (
    Target("Linux x86_64", "x86_64-linux-gnu.2.17", ".so", {2: "linux64", 3: "x86_64-linux"}),
    Target("Linux aarch64", "aarch64-linux-gnu.2.17", ".so", {3: "aarch64-linux"}),
    Target("Windows x86_64", "x86_64-windows-gnu", ".dll", {2: "win64", 3: "x86_64-windows"}),
    Target("macOS x86_64", "x86_64-macos.11.0", ".dylib", {2: "darwin64", 3: "x86_64-darwin"}),
    Target("macOS aarch64", "aarch64-macos.11.0", ".dylib", {2: "darwin64", 3: "aarch64-darwin"}),
)

#: Licences of what zig links into libraries for Windows beside the FMU's own code.
_NOTICES = {
    "zig.txt": "LICENSE",
    "musl.txt": "lib/libc/musl/COPYRIGHT",
    "mingw-w64.txt": "lib/libc/mingw/COPYING",
}


def this_machine() -> str:
    """System and processor, by names that `platform` doesn't always have."""
    names = {"Darwin": "macOS", "AMD64": "x86_64", "arm64": "aarch64"}
    return " ".join(names.get(one, one) for one in (platform.system(), platform.machine()))


def binaries_of(files: Mapping[str, bytes]) -> set[str]:
    """The machines for which an FMU has binaries, from its files by name."""
    found: set[str] = set()
    for name, data in files.items():
        if not name.startswith("binaries/"):
            continue
        folder = name.split("/")[1]
        if folder == "linux64" and data[18:20] == b"\xb7\0":
            # Where `here` puts it; the machine of an ELF file.
            found.add("Linux aarch64")
        else:
            known = {t.machine for t in TARGETS if folder in t.folders.values()}
            found |= known or {folder}
    return found


def pythonfmu_runs_here() -> bool:
    """Whether pythonfmu's runtime has a binary for this machine."""
    folders = [t.folders.get(2, "none") for t in TARGETS if t.machine == this_machine()]
    binaries = importlib.resources.files("pythonfmu") / "resources" / "binaries"
    return any((binaries / folder).is_dir() for folder in folders)


@dataclass(frozen=True)
class NativeBuilder(Builder):
    """Builds ClubBallImpact from C, for FMI 2.0 or 3.0."""

    #: For this machine alone, in the folder that fmpy loads from; also for aarch64 Linux, for which
    #: FMI 2.0 defines no folder.
    here: bool = False

    def digest(self) -> str:
        files = checksums(self._sources("") | self.documents()) + repr(_FLAGS).encode()
        return hashlib.sha256(self._describe("") + files).hexdigest()

    def files(self) -> dict[str, bytes]:
        """The FMU's files by name; UserError if there is no compiler, or C lacks an output."""
        fmi, model, token = self.fmi, self.model, self.guid()
        targets, sources = _targets(fmi, self.here), self._sources(token)
        _check_outputs(sources["outputs.c"].decode())
        made = {f"sources/{name}": data for name, data in sources.items()}
        made["modelDescription.xml"] = self._describe(token)
        if fmi == 3:
            description = HERE / "contents" / "buildDescription.xml"
            made["sources/buildDescription.xml"] = description.read_bytes()
        made |= self.documents([target.machine for target in targets])
        libraries: dict[str, list[bytes]] = {}
        with ThreadPoolExecutor() as pool:
            images = pool.map(lambda target: _library(target, sources, model), targets)
            for target, image in zip(targets, images):
                path = f"binaries/{target.folders[fmi]}/{model}{target.suffix}"
                libraries.setdefault(path, []).append(image)
        made |= {path: _universal(images) for path, images in libraries.items()}
        made["documentation/licenses/fmi-headers.txt"] = _comment(sources[_HEADERS[fmi][0]])
        if (zig := ziglang()) and any(target.suffix == ".dll" for target in targets):
            for name, file in _NOTICES.items():
                made[f"documentation/licenses/{name}"] = (zig / file).read_bytes()
        return made | {SUMS: checksums(made)}

    def _describe(self, token: str) -> bytes:
        tool = f"golf-impact {golf_physics.__version__} (native)"
        return self.describe(token, tool, sources=["all.c"])

    def _sources(self, token: str) -> dict[str, bytes]:
        """The C sources and FMI's headers."""
        import fmpy

        found = c_sources(token, self.fmi, self.start)
        for other in (f"fmi{5 - self.fmi}.c", "rows.c"):
            found.pop(other)
        headers = Path(fmpy.__file__).parent / "c-code"
        return found | {name: (headers / name).read_bytes() for name in _HEADERS[self.fmi]}


_ROWS = [native_row(row) for row in tables.VARIABLES + tables.MORE_VARIABLES]
_MODEL_EXCHANGE = {
    "laws": NATIVE_LAWS,
    "units": tables.UNITS | tables.MORE_UNITS,
    "unsolved": tables.CO_SIMULATION_ONLY,
    "derivatives": dict(zip(tables.DERIVATIVES, tables.STATES, strict=True)),
    "indicators": tables.INDICATORS,
    # Flags and touch_time change at events alone; what is NaN in Model Exchange belongs in
    # co-simulation to the step before: without dependencies.
    "dependencies": {row.name: row.dependencies for row in _ROWS if row.dependencies is not None},
}
_TABLES_3 = TABLES | _MODEL_EXCHANGE | {"rows": _ROWS}
_TABLES_2 = _TABLES_3 | {"rows": [row for row in _ROWS if row.causality != "independent"]}

#: By version of FMI.
BUILDERS = {
    2: NativeBuilder("ClubBallImpact.native", _TABLES_2),
    3: NativeBuilder("ClubBallImpact.fmi3", _TABLES_3, fmi=3),
}


def _comment(source: bytes) -> bytes:
    """The comment with the licence in a header of FMI."""
    at = source.index(b"Redistribution and use")
    text = source[source.rindex(b"/*", 0, at) + 2 : source.index(b"*/", at)]
    return b"FMI's headers, in sources:\n" + text


def _check_outputs(code: str) -> None:
    """UserError with the name of an output for which C has no case: it would be NaN."""
    for row in tables.VARIABLES:
        if row.start is None and not re.search(rf"\bVR_{row.name}\b", code):
            where = "fmu_src/native/outputs.c doesn't compute"
            raise UserError(f"--native: variables.py has the output {row.name}, which {where}")


# Compilers


def ziglang() -> Path | None:
    """The folder of ziglang, if it is installed in its one version."""
    found = importlib.util.find_spec("ziglang")
    if found is None or importlib.metadata.version("ziglang") != ZIGLANG:
        return None
    return Path(str(found.origin)).parent


def advice() -> str:
    """How to build for all platforms."""
    return f"ziglang {ZIGLANG} compiles for all platforms: {install_command('native')}"


def _targets(fmi: int, here: bool) -> list[Target]:
    if ziglang() and not here:
        return [target for target in TARGETS if fmi in target.folders]
    mine = [target for target in TARGETS if target.machine == this_machine()]
    if here:
        folder = f"{platform.system().lower()}64"
        mine = [target._replace(folders={2: folder, **target.folders}) for target in mine]
    if mine and fmi not in mine[0].folders:
        raise UnavailableError(f"--native is refused for FMI 2.0 on {this_machine()}: use --fmi 3")
    if not mine or (ziglang() is None and shutil.which(_cc()) is None):
        raise UnavailableError(
            f"{'--fmi 3' if fmi == 3 else '--native'} needs a C compiler: {advice()}; for this "
            f"platform alone {_cc()} does, if it is installed"
        )
    return mine


def _cc() -> str:
    return os.environ.get("CC", "cc")


def _library(target: Target, sources: dict[str, bytes], model: str) -> bytes:
    """The library for a platform."""
    out = f"{model}{target.suffix}"
    if ziglang() and target.suffix == ".dylib":
        command = [*_ZIG, "build-lib", "-dynamic", "-OReleaseFast", "-fstrip", "-lc"]
        # Otherwise the name is the folder of this build.
        command += ["-install_name", f"@rpath/{out}", "--entitlements", *_ENTITLEMENTS]
        command += ["-target", target.zig, f"-femit-bin={out}", "-cflags", *_FLAGS, "--", "all.c"]
    else:
        command = [*ZIG_CC, "-target", target.zig] if ziglang() else [_cc()]
        command += [*_FLAGS, "-s", "-shared", "all.c", "-o", out]
        command += ["-fPIC", "-lm"] if target.suffix != ".dll" else []
        command += [f"-Wl,-install_name,@rpath/{out}"] if target.suffix == ".dylib" else []
    made = compiled(command, sources | _ENTITLEMENTS, out, f"all.c for {target.zig}")
    return _timeless(made) if target.suffix == ".dll" else made


def compiled(command: list[str], sources: dict[str, bytes], out: str, what: str) -> bytes:
    """What a compiler makes of sources; UserError with its first message if it fails."""
    with scratch(sources) as folder:
        # zig keeps what it has compiled: its libraries below the home folder, this here, where no
        # other build at the same time replaces it.
        env = {"HOME": tempfile.gettempdir(), **os.environ, "ZIG_LOCAL_CACHE_DIR": str(folder)}
        done = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True)
        if done.returncode:
            errors = (line for line in done.stderr.splitlines() if "error" in line)
            why = next(errors, "without a message")
            raise UserError(f"{command[0]} fails on {what}: {why}")
        return (folder / out).read_bytes()


def _timeless(dll: bytes) -> bytes:
    """A library for Windows without the time of its build, in the header at the offset in 0x3c."""
    time = int.from_bytes(dll[0x3C:0x40], "little") + 8
    return dll[:time] + bytes(4) + dll[time + 4 :]


def _universal(images: list[bytes]) -> bytes:
    """One library for macOS of those for several machines, x86_64 first (mach-o/fat.h)."""
    if len(images) == 1:
        return images[0]
    head, body = struct.pack(">2I", 0xCAFEBABE, len(images)), b""
    for image in images:
        body += bytes(-len(body) % _PAGE)
        offset = _PAGE + len(body)
        head += struct.pack(">2I", *struct.unpack_from("<2I", image, 4))
        head += struct.pack(">3I", offset, len(image), _ALIGNMENT)
        body += image
    return head.ljust(_PAGE, b"\0") + body
