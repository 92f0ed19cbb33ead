"""A private Python for Linux: libpython, its libraries and extension modules, renamed."""

import re
import subprocess
import sysconfig
from collections.abc import Iterable, Mapping
from pathlib import Path

from golf_build import elf, toolchain
from golf_build.packaging import HERE
from golf_build.toolchain import VERSION, PrivatePython, StandaloneError, Target

#: Libraries of glibc, which every host has.
_GLIBC = re.compile(r"(lib(c|m|dl|pthread|rt|util)|ld-linux-(x86-64|aarch64))\.so\.\d")

#: The others that a libpython or one of its modules may need, whose licences are known.
_KNOWN = ("libpython", "libz.", "libexpat.", "libmpdec.")


def libpython() -> Path:
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


def _find(sysroot: Path, pattern: str) -> Path:
    """A file below the folders of libraries, or of headers, of a system's root folder."""
    for folder in ("usr/lib/*-linux-gnu", "usr/lib64", "usr/lib", "usr", "lib", "."):
        if found := sorted(sysroot.glob(f"{folder}/{pattern}")):
            return found[0].resolve()
    raise StandaloneError(
        f"--sysroot {sysroot} has no {pattern}, of the Python that builds here ({VERSION}; Debian: "
        f"libpython{VERSION}-dev for arm64, unpacked)"
    )


def _libraries(files: Iterable[Path], sysroot: Path | None) -> dict[str, Path]:
    """Dependencies of these libraries, without glibc: paths on this machine, by name."""
    libraries: dict[str, Path] = {}
    files = [*files]
    for file in files:
        if sysroot is None:
            done = subprocess.run(["ldd", file], capture_output=True, text=True, check=True)
            found = dict(re.findall(r"(\S+) => (/.*)(?= \()", done.stdout))
        else:
            found = dict.fromkeys(elf.needed(file.read_bytes()), "")
        for name in sorted(found.keys() - libraries.keys()):
            if not _GLIBC.fullmatch(name):
                place = _find(sysroot, name) if sysroot else Path(found[name]).resolve()
                libraries[name] = place
                files.append(place)
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
    if sysroot is None and target.machine != toolchain.this_machine():
        raise StandaloneError(
            f"a binary for {target.machine} needs --sysroot FOLDER here: libpython{VERSION}.so.1.0 "
            f"and its headers (Debian: libpython{VERSION}-dev for arm64, unpacked)"
        )
    if sysroot is None:
        python, include = libpython(), toolchain.headers()
        extensions = {name: Path(path) for name, path in modules.items() if path}
        licence = Path(sysconfig.get_path("stdlib")) / "LICENSE.txt"
        copyright_ = Path(f"/usr/share/doc/python{VERSION}/copyright")
    else:
        python = _find(sysroot, f"libpython{VERSION}.so.1.0")
        if elf.machine(python.read_bytes()) != target.machine:
            raise StandaloneError(
                f"--sysroot {sysroot} is refused: {python} isn't for {target.machine}"
            )
        include = _find(sysroot, f"include/python{VERSION}/Python.h").parent
        beside = [*sysroot.glob(f"usr/lib*/python{VERSION}/lib-dynload/*.so")]
        extensions = {n: file for file in beside if (n := file.name.partition(".")[0]) in modules}
        licence = sysroot / f"usr/lib/python{VERSION}/LICENSE.txt"
        copyright_ = sysroot / f"usr/share/doc/libpython{VERSION}-minimal/copyright"
    # By the name that dependents use.
    libraries = {python.name: python} | _libraries([python, *extensions.values()], sysroot)
    contents = {name: file.read_bytes() for name, file in libraries.items()}
    added = {f"{name}.so": file.read_bytes() for name, file in extensions.items()}
    digest = toolchain.digest_of({**contents, **added}, blob)
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
    compiled = toolchain.compile_library(
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
    licences = _licences(contents, licence, copyright_)
    if sysroot is not None:
        licences["python-aarch64.txt"] = licences.pop("python.txt")
    return PrivatePython(library, files, licences)


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
