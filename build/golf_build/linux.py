"""A private Python for Linux: libpython, its libraries and extension modules, renamed."""

import hashlib
import re
import subprocess
import sysconfig
from collections.abc import Iterable, Mapping
from pathlib import Path

from golf_build import elf
from golf_build.archive import checksums
from golf_build.packaging import HERE
from golf_build.toolchain import (
    VERSION,
    PrivatePython,
    StandaloneError,
    Target,
    compile_library,
    loader,
    this_machine,
)

#: Libraries of glibc, which every host has.
_GLIBC = re.compile(r"(lib(c|m|dl|pthread|rt|util)|ld-linux-(x86-64|aarch64))\.so\.\d")

#: The others that a libpython or one of its modules may need, whose licences are known.
_KNOWN = ("libpython", "libz.", "libexpat.", "libmpdec.")


def _libpython() -> Path:
    """The shared library of this Python; StandaloneError if none can be included."""
    import find_libpython

    found = find_libpython.find_libpython()
    if found is None or ".so" not in Path(found).name:
        raise StandaloneError(
            f"--standalone needs libpython{VERSION}.so, and this Python is a static one (Debian, "
            f"Ubuntu: apt-get install libpython{VERSION}-dev; pyenv: "
            "PYTHON_CONFIGURE_OPTS=--enable-shared pyenv install)"
        )
    return Path(found).resolve()


def _in_sysroot(sysroot: Path, pattern: str, package: str) -> Path:
    for folder in ("usr/lib/aarch64-linux-gnu", "usr/lib64", "usr/lib", "usr", "lib", "."):
        if found := sorted((sysroot / folder).glob(pattern)):
            return found[0]
    raise StandaloneError(
        f"--sysroot {sysroot} has no {pattern} of Python {VERSION}, which builds here (Debian's "
        f"package {package} for arm64)"
    )


def _libraries(files: list[Path], sysroot: Path | None) -> dict[str, Path]:
    """Dependencies of these libraries, without glibc: paths on this machine, by name."""
    libraries: dict[str, Path] = {}
    if sysroot is not None:
        for file in files:
            for name in elf.needed(file.read_bytes()):
                if not _GLIBC.fullmatch(name) and name not in libraries:
                    found = _in_sysroot(sysroot, name, "of that library").resolve()
                    libraries |= {name: found} | _libraries([found], sysroot)
        return libraries
    for file in files:
        listed = subprocess.run(["ldd", file], capture_output=True, text=True, check=True).stdout
        for name, place in re.findall(r"(\S+) => (/.*)(?= \()", listed):
            if not _GLIBC.fullmatch(name):
                libraries[name] = Path(place).resolve()
    return libraries


def private_python(
    target: Target, sysroot: Path | None, modules: Mapping[str, str | None], blob: bytes
) -> PrivatePython:
    """The Python that is included; StandaloneError if it can't be built.

    Args:
        target: its platform.
        sysroot: the root folder of such a machine; None for this one.
        modules: the extension modules needed, and their paths on this machine; none if built in.
        blob: the frozen modules.
    """
    if sysroot is None:
        if target.machine != this_machine():
            raise StandaloneError(
                f"--target for {target.machine} needs --sysroot FOLDER on {this_machine()}: a "
                f"folder with libpython{VERSION}.so.1.0 and the headers of such a machine (Debian: "
                f"libpython{VERSION}-dev:arm64, unpacked)"
            )
        python, include = _libpython(), Path(sysconfig.get_path("include"))
        if not (include / "Python.h").exists():
            raise StandaloneError(
                f"--standalone needs Python.h, not found in {include} (Debian, Ubuntu: "
                f"apt-get install libpython{VERSION}-dev)"
            )
        extensions = {name: Path(path) for name, path in modules.items() if path}
        licence = Path(sysconfig.get_path("stdlib")) / "LICENSE.txt"
        copyright_ = Path(f"/usr/share/doc/python{VERSION}/copyright")
    else:
        package = f"libpython{VERSION}-dev"
        python = _in_sysroot(sysroot, f"libpython{VERSION}.so.1.0", package).resolve()
        include = _in_sysroot(sysroot, f"include/python{VERSION}/Python.h", package).parent
        found = {n: [*sysroot.glob(f"**/lib-dynload/{n}.cpython-*.so")] for n in modules}
        extensions = {name: files[0] for name, files in found.items() if files}
        licence = sysroot / f"usr/lib/python{VERSION}/LICENSE.txt"
        copyright_ = sysroot / f"usr/share/doc/libpython{VERSION}-minimal/copyright"
    # By the name that dependents use.
    libraries = {python.name: python} | _libraries([python, *extensions.values()], sysroot)
    contents = {name: file.read_bytes() for name, file in libraries.items()}
    for name in modules:
        if name not in extensions and b"%s\0" % name.encode() not in contents[python.name]:
            raise StandaloneError(f"--standalone: {python} has no module {name}")
    added = {f"{name}.so": file.read_bytes() for name, file in extensions.items()}
    everything = {**contents, **added, **loader(), "standard_library.bin": blob}
    digest = hashlib.sha256(checksums(everything)).hexdigest()
    # Private names of the libraries as well: another one of that name must not be taken.
    names = {name: (f"golf{n}" + digest)[: len(name)] for n, name in enumerate(sorted(contents))}
    files = {names[name]: data for name, data in contents.items()}
    files |= {f"golf-{digest[:12]}-{name}": data for name, data in added.items()}
    files = {name: elf.rename(data, names) for name, data in files.items()}
    library = f"golf-python-{digest[:16]}.so"
    # All of them, in the order in which they are loaded: what one of them needs is there then.
    linked = ["-L.", "-Wl,--no-as-needed", *(f"-l:{name}" for name in files), "-Wl,--as-needed"]
    # Debian's pyconfig.h includes another one relative to that folder, which has glibc's headers.
    included = [f"-I{include}", "-idirafter", str(include.parent)]
    names_of_modules = " ".join(f"X({name})" for name in sorted(extensions))
    compiled = compile_library(
        target,
        {**files, "standard_library.bin": blob},
        "private_python.c",
        *linked,
        *included,
        f"-Wl,-soname,{library}",
        f"-DEXTENSIONS={names_of_modules}",
    )
    # A compiler's linker reads the sections, the dynamic one doesn't.
    files = {name: elf.strip(data) for name, data in files.items()} | {library: compiled}
    return PrivatePython(library, files, _licences(contents, licence, copyright_))


def _licences(libraries: Iterable[str], *places: Path) -> dict[str, bytes]:
    """Of Python, at one of these places, and of everything included."""
    for name in libraries:
        if not name.startswith(_KNOWN):
            raise StandaloneError(
                f"--standalone: this Python needs {name}, whose licence isn't known: use another"
            )
    python = next((file for file in places if file.exists()), None)
    if python is None:
        raise StandaloneError(f"--standalone needs Python's licence, not found at {places[0]}")
    others = {file.name: file.read_bytes() for file in (HERE / "licenses").iterdir()}
    return others | {"python.txt": python.read_bytes()}
