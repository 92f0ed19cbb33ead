"""Where the FMU file is, and building it when it is missing or out of date."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from scenarios.errors import UserError

_HERE = Path(__file__).resolve().parent
_CHECKOUT = _HERE.parent / "build" / "build_fmu.py"
_INSTALLED = _HERE / "fmu_build" / "build_fmu.py"


def builder() -> ModuleType:
    """The build script: the checkout's, else the one that was installed with this package.

    build/ is no package (it would shadow the module `build`), so it is loaded by its path.
    """
    path = _CHECKOUT if _CHECKOUT.is_file() else _INSTALLED
    spec = importlib.util.spec_from_file_location("golf_impact_build_fmu", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def default_path(build: ModuleType) -> Path:
    """build/ in a checkout; else the user's cache, under the digest of the sources."""
    if _CHECKOUT.is_file():
        return _CHECKOUT.parent / f"{build.NAME}.fmu"
    import platformdirs

    cache = platformdirs.user_cache_path("golf-impact")
    return cache / build.digest()[:16] / f"{build.NAME}.fmu"


def build_fmu(out: Path | None = None) -> Path:
    """Build the FMU.

    Args:
        out: the file to write; where the scenarios look for it by default.

    Raises:
        UserError: the file can't be written.
    """
    build = builder()
    out = default_path(build) if out is None else out
    if out.is_dir():
        raise UserError(f"{out} is a folder; give the name of the .fmu file to write")
    try:
        return build.build(out)
    except OSError as error:
        raise UserError(f"can't write {out}: {error.strerror or error}") from error


def current_fmu() -> tuple[Path, str | None]:
    """The FMU of the present sources, built if need be.

    Returns:
        The file, and why it was built (None if it was there).
    """
    build = builder()
    path = default_path(build)
    if not path.exists():
        why = "it was missing"
    elif build.is_current(path):
        return path, None
    else:
        why = "its sources have changed"
    return build_fmu(path), why


def build_plain_fmu(script: Path, folder: Path) -> Path:
    """Package a self-contained slave as pythonfmu does, with nothing added.

    Args:
        script: the Python file with the slave.
        folder: where the .fmu goes.
    """
    from pythonfmu.builder import FmuBuilder

    path, modules = list(sys.path), set(sys.modules)
    try:
        return FmuBuilder.build_FMU(script, dest=folder)
    finally:
        sys.path[:] = path
        if script.stem not in modules:
            sys.modules.pop(script.stem, None)
