import sys
from pathlib import Path
from typing import Annotated

from typer import Option

from golf_impact.data.errors import UserError

EPILOG = (
    "Examples: golf-impact build --out ClubBallImpact.fmu · golf-impact build --native · "
    "golf-impact build --fmi 3 · golf-impact build --system"
)

_OUT = "The file to write; if omitted, in build/ of a checkout, else in the cache folder."
_SYSTEM = "Also build the companion FMUs and GolfSwing.ssp, the system of all of them."
_FMI = "Version of FMI; 3 implies --native (ClubBallImpact.fmi3.fmu)."
_NATIVE = "Compiled from C, for hosts without Python (ClubBallImpact.native.fmu)."


def build(
    out: Annotated[Path | None, Option(metavar="FILE.fmu", help=_OUT)] = None,
    system: Annotated[bool, Option("--system", help=_SYSTEM)] = False,
    fmi: Annotated[int, Option(metavar="2|3", help=_FMI)] = 2,
    native: Annotated[bool, Option("--native", help=_NATIVE)] = False,
) -> None:
    """Build ClubBallImpact.fmu from its sources.

    It holds a Python model for hosts in Python; with --native libraries for Linux, Windows and
    macOS, and their C sources.
    """
    from golf_build import native as in_c
    from golf_build import system as systems
    from golf_impact.data.files import check
    from golf_impact.fmu.current import builder_of, default_path
    from golf_impact.fmu.file import check_temporary_folder

    if fmi not in (2, 3):
        raise UserError(f"--fmi {fmi} is refused: it must be 2 or 3")
    if fmi == 3 and system:
        raise UserError("--system is refused with --fmi 3: the FMUs of the system are FMI 2.0")
    native = native or fmi == 3
    if system or not native:
        check_temporary_folder()
    builder = in_c.BUILDERS[fmi] if native else builder_of()
    out = out or default_path(builder)
    if not str(out).endswith(".fmu"):
        raise UserError(f"{out} is refused: the file's name must end in .fmu")
    check(out)
    try:
        made = [builder.build(out)]
        if system:
            made += systems.build(made[0].parent, native).values()
    except OSError as error:
        raise UserError(f"can't write {out}: {error.strerror or error}") from error
    print(*made, sep="\n")
    if native and not in_c.ziglang():
        print(f"For {in_c.this_machine()} alone: {in_c.advice()}", file=sys.stderr)
