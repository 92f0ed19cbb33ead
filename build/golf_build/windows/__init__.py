"""A private Python for Windows, from python.org's embeddable zip.

`pyconfig.h` is CPython 3.11's own PC/pyconfig.h; the other headers of a Python are the same on all
platforms. LICENSE.txt is their licence.
"""

import re
import zipfile
from collections.abc import Iterable
from pathlib import Path

from golf_build import toolchain
from golf_build.archive import scratch, unpack
from golf_build.packaging import HERE
from golf_build.toolchain import VERSION, PrivatePython, StandaloneError, Target

#: The version of pyconfig.h, and the last zip of that version.
_HEADERS = "3.11"
_DOWNLOAD = "https://www.python.org/ftp/python/3.11.9/python-3.11.9-embed-amd64.zip"

#: What private_python.c uses of Python's DLL.
_FUNCTIONS = re.compile(r"\bPy\w+(?=\()")


def private_python(
    target: Target, archive: Path | None, modules: Iterable[str], blob: bytes
) -> PrivatePython:
    """As `linux.private_python`, from python.org's "Windows embeddable package (64-bit)"."""
    if VERSION != _HEADERS:
        raise StandaloneError(
            f"--target win64 is refused with Python {VERSION}: build with Python {_HEADERS}, whose "
            "Windows headers are included"
        )
    if archive is None:
        raise StandaloneError(f"--target win64 needs --python ZIP: download {_DOWNLOAD}")
    dll = f"python{VERSION.replace('.', '')}.dll"
    needed = (dll, "vcruntime140.dll", "LICENSE.txt")
    try:
        inside = unpack(archive)
    except (OSError, zipfile.BadZipFile) as error:
        raise StandaloneError(
            f"--python {archive} can't be read: {getattr(error, 'strerror', 0) or error}"
        ) from error
    why = ""
    if missing := [name for name in needed if name not in inside]:
        why = f"it has no {missing[0]}, which Python {VERSION} needs"
    # In the format PE the place of the signature is at 60; the processor follows it.
    elif inside[dll][int.from_bytes(inside[dll][60:64], "little") :][4:6] != b"\x64\x86":
        why = f"its {dll} is for another processor"
    if why:
        raise StandaloneError(f"--python {archive} is refused: {why}: download {_DOWNLOAD}")
    added = {name: inside[f"{name}.pyd"] for name in modules if f"{name}.pyd" in inside}
    contents = {name: inside[name] for name in (*needed[:2], *(f"{n}.pyd" for n in added))}
    digest = toolchain.digest_of(contents, blob)
    # Windows finds a loaded library by its name: that of a host's own Python must be another. The
    # extension modules name it; the new name has the same length.
    own = f"g{digest}"[: len(dll) - 4] + ".dll"
    pyds = {name: f"golf-{digest[:12]}-{name}.pyd" for name in added}
    files = {own: inside[dll], "vcruntime140.dll": inside["vcruntime140.dll"]}
    files |= {pyds[n]: data.replace(dll.encode(), own.encode()) for n, data in added.items()}
    library = f"golf-python-{digest[:16]}.dll"
    functions = {*_FUNCTIONS.findall(toolchain.loader()["private_python.c"].decode())}
    exports = {own: [*sorted(functions), "PyImport_FrozenModules DATA"]}
    exports |= {pyd: [f"PyInit_{name}"] for name, pyd in pyds.items()}
    folder = toolchain.headers()
    included = {
        f"python/{file.relative_to(folder).as_posix()}": file.read_bytes()
        for file in (*folder.glob("*.h"), *folder.glob("cpython/*.h"))
    }
    # Not this machine's.
    included["python/pyconfig.h"] = (HERE / "windows" / "pyconfig.h").read_bytes()
    compiled = toolchain.compile_library(
        target,
        included | _import_libraries(target, exports) | {"standard_library.bin": blob},
        "private_python.c",
        "-Ipython",
        *(f"lib{n}.a" for n in range(len(exports))),
        "-DEXTENSIONS=" + " ".join(f"X({name})" for name in sorted(added)),
    )
    # The compiler's start-up code has a licence as well.
    texts = (HERE / "windows" / "mingw-w64.txt", *(HERE / "licenses").iterdir())
    licences = {file.name: file.read_bytes() for file in texts}
    licences["python-windows.txt"] = inside["LICENSE.txt"]
    return PrivatePython(library, files | {library: compiled}, licences, (f'-DPYTHON_DLL="{own}"',))


def _import_libraries(target: Target, exports: dict[str, list[str]]) -> dict[str, bytes]:
    """Libraries to link DLLs by, lib0.a and so on: what is used of each of them, by its name."""
    definitions = {
        f"{n}.def": "\n".join([f"LIBRARY {dll}", "EXPORTS", *names]).encode()
        for n, (dll, names) in enumerate(exports.items())
    }
    with scratch(definitions) as folder:
        for n in range(len(exports)):
            command = [*toolchain.tool(target, "dlltool"), "-m", "i386:x86-64", "-d", f"{n}.def"]
            toolchain.run_tool([*command, "-l", f"lib{n}.a"], folder, f"lib{n}.a")
        return {file.name: file.read_bytes() for file in folder.glob("lib*.a")}
