import sys
from pathlib import Path
from typing import Annotated

from typer import Option

from golf_build.toolchain import TARGETS
from golf_impact.errors import UserError

EPILOG = (
    "Examples: golf-impact build --out ClubBallImpact.fmu · golf-impact build --system · "
    "golf-impact build --fmi 3 · golf-impact build --standalone · golf-impact build --standalone "
    "--target win64 --python embed-amd64.zip"
)

_OUT = "The file to write; if omitted, in build/ of a checkout, else in the cache folder."
_SYSTEM = "Also build the companion FMUs and GolfSwing.ssp, the system of all of them."
_FMI = "Version of FMI; 3 also has Model Exchange (ClubBallImpact.fmi3.fmu)."
_STANDALONE = "Include a Python interpreter, for hosts without one (….standalone.fmu)."
_NATIVE = "The physics in C, without Python, for all platforms (….native.fmu); co-simulation only."
_TARGET = "Platform of the standalone FMU, repeatable; by default this machine."
_PYTHON = "Python for win64: the embeddable zip of python.org."
_SYSROOT = "Root folder of an aarch64 Linux, with libpython and its headers."


def build(
    out: Annotated[Path | None, Option(metavar="FILE.fmu", help=_OUT)] = None,
    system: Annotated[bool, Option("--system", help=_SYSTEM)] = False,
    fmi: Annotated[int, Option(min=2, max=3, metavar="2|3", help=_FMI)] = 2,
    standalone: Annotated[bool, Option("--standalone", help=_STANDALONE)] = False,
    native: Annotated[bool, Option("--native", help=_NATIVE)] = False,
    target: Annotated[list[str], Option(metavar="|".join(TARGETS), help=_TARGET)] = [],  # noqa: B006
    python: Annotated[Path | None, Option(metavar="ZIP", help=_PYTHON)] = None,
    sysroot: Annotated[Path | None, Option(metavar="FOLDER", help=_SYSROOT)] = None,
) -> None:
    """Build ClubBallImpact.fmu from its sources."""
    from golf_build import standalone as alone
    from golf_build import system as systems
    from golf_build.archive import write_archive
    from golf_impact.flaws import check_temporary_folder
    from golf_impact.fmu import builder_of, default_path

    check_temporary_folder()
    if native:
        print(_build_native(out, fmi))
        return
    if fmi == 3 and system:
        raise UserError("--system is refused with --fmi 3: the FMUs of the system are FMI 2.0")
    for name in target:
        if name not in TARGETS:
            raise UserError(f"--target {name} is refused: choose from {', '.join(TARGETS)}")
    if target and not standalone:
        raise UserError("--target is refused without --standalone: plain FMUs have no Python")
    for option, value, name in (("--python", python, "win64"), ("--sysroot", sysroot, "aarch64")):
        if value is not None and name not in target:
            raise UserError(f"{option} is refused without --target {name}")
    pythons = {name: {"win64": python, "aarch64": sysroot}.get(name) for name in target}
    builder = builder_of(fmi=fmi)
    if out is None:
        out = default_path(builder)
        out = out.with_name(f"{builder.name}{alone.SUFFIX if standalone else ''}.fmu")
    if not str(out).endswith(".fmu"):
        raise UserError(f"{out} is refused: the file's name must end in .fmu")
    try:
        files = builder.files()
        made = [write_archive(out, alone.standalone(files, pythons) if standalone else files)]
        if system:
            made += systems.build(made[0].parent, standalone, pythons).values()
    except alone.StandaloneError as error:
        raise UserError(str(error)) from error
    except OSError as error:
        raise UserError(f"can't write {out}: {error.strerror or error}") from error
    print(*made, sep="\n")


def _build_native(out: Path | None, fmi: int) -> Path:
    from golf_build import native
    from golf_impact.fmu import builder_of, default_path

    builder = builder_of(fmi=fmi)
    out = out or default_path(builder).with_name(f"{builder.name}{native.SUFFIX}.fmu")
    if not str(out).endswith(".fmu"):
        raise UserError(f"{out} is refused: the file's name must end in .fmu")
    try:
        made = native.build(builder, out)
    except native.NativeError as error:
        raise UserError(str(error)) from error
    except OSError as error:
        raise UserError(f"can't write {out}: {error.strerror or error}") from error
    if platforms := native.fewer_platforms():
        print(f"For {platforms} alone: {native.advice()}", file=sys.stderr)
    return made
