"""The FMUs of the current sources, built where they are missing or out of date."""

import os
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from golf_build import archive, native, packaging, system
from golf_build.fmi2 import BUILDER as FMI2
from golf_build.sources import CHECKOUT
from golf_impact.data.errors import UnavailableError, UserError, unknown_name


def builder_of(name: str = "ClubBallImpact", fmi: int = 2) -> packaging.Builder:
    """The builder of an FMU; UserError if there is none of this name for this version of FMI.

    FMI 3.0 has the native ClubBallImpact alone.
    """
    if fmi not in (2, 3):
        raise UserError(f"fmi = {fmi!r} is refused: it must be 2 or 3")
    builders: dict[str, packaging.Builder] = {"ClubBallImpact": native.BUILDERS[3]}
    if fmi == 2:
        builders = {"ClubBallImpact": FMI2, **system.COMPANIONS}
    if name not in builders:
        raise unknown_name(f"FMU for FMI {fmi}.0", name, builders)
    return builders[name]


def default_path(builder: packaging.Builder | system.System) -> Path:
    """In build/ of a checkout; else in the user's cache folder, below the digest of the sources."""
    name = f"{builder.name}{builder.suffix}"
    if CHECKOUT:
        return CHECKOUT / "build" / name
    import platformdirs

    cache = platformdirs.user_cache_path("golf-impact")
    if not cache.is_absolute():
        # Without a home folder it would be a folder named ~ in the working folder.
        cache = Path(tempfile.gettempdir(), "golf-impact")
    return cache / builder.digest()[:16] / name


def current_fmu(name: str = "ClubBallImpact", fmi: int = 2) -> Path:
    """The file of an FMU of the current sources, built if it is missing or out of date.

    ClubBallImpact is the native FMU in FMI 3.0, and where pythonfmu has no binary.

    Args:
        name: ClubBallImpact, Swing, Launch or BallFlight.
        fmi: version of FMI; 3 for ClubBallImpact alone.

    Raises:
        UserError: there is no such FMU, the file can't be written, or there is no compiler.
        UnavailableError: it doesn't run on this machine.
    """
    builder = builder_of(name, fmi)
    if fmi == 3 or (name == "ClubBallImpact" and not native.pythonfmu_runs_here()):
        return current_native(fmi)
    return _current(builder)


def current_native(fmi: int = 2) -> Path:
    """The native FMU of the current sources, built for this machine if necessary.

    UserError: there is no compiler, or the file can't be written.
    """
    builder = native.BUILDERS[fmi]
    path = default_path(builder)
    machine = native.this_machine()
    if builder.is_current(path) and machine in native.binaries_of(archive.unpack(path)):
        return path
    return _build(replace(builder, here=True), path, f", for {machine} alone")


def current_system() -> Path:
    """GolfSwing.ssp of the current sources, built if necessary; see `current_fmu`."""
    return _current(system.SYSTEM)


def _current(builder: packaging.Builder | system.System) -> Path:
    if not native.pythonfmu_runs_here():
        name = f"{builder.name}{builder.suffix}"
        raise UnavailableError(f"pythonfmu has no binary for {native.this_machine()}: no {name}")
    path = default_path(builder)
    if builder.is_current(path):
        return path
    why = "it was out of date or damaged" if os.path.exists(path) else "it was missing"
    return _build(builder, path, f": {why}")


def _build(builder: packaging.Builder | system.System, path: Path, words: str) -> Path:
    try:
        builder.build(path)
    except OSError as error:
        raise UserError(
            f"can't write {path} ({error.strerror or error}): build it elsewhere, with "
            "`golf-impact build --out FILE`, and use it by --fmu FILE"
        ) from error
    print(f"Built {path}{words}.", file=sys.stderr)
    return path
