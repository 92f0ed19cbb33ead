"""`golf-impact build`."""

from pathlib import Path
from typing import Annotated

from typer import Option

from golf_impact.errors import UserError

EPILOG = (
    "Examples: golf-impact build --out ClubBallImpact.fmu · golf-impact build --system · "
    "golf-impact build --fmi 3 · golf-impact build --standalone"
)

_OUT = "The file to write; if omitted, in build/ of a checkout, else in the cache folder."
_SYSTEM = "Also build the companion FMUs and GolfSwing.ssp, the system of all of them."
_FMI = "Version of FMI; 3 also has Model Exchange (ClubBallImpact.fmi3.fmu)."
_STANDALONE = "Include a Python interpreter, for hosts without one (….standalone.fmu)."


def build(
    out: Annotated[Path | None, Option(metavar="FILE.fmu", help=_OUT)] = None,
    system: Annotated[bool, Option("--system", help=_SYSTEM)] = False,
    fmi: Annotated[int, Option(min=2, max=3, metavar="2|3", help=_FMI)] = 2,
    standalone: Annotated[bool, Option("--standalone", help=_STANDALONE)] = False,
) -> None:
    """Build ClubBallImpact.fmu from its sources."""
    from golf_impact.fmu.archive import check_temporary_folder
    from golf_impact.fmu.file import build_fmu
    from golf_impact.fmu.system import build_system
    from golf_impact.stopping import held

    check_temporary_folder()
    if fmi == 3 and system:
        raise UserError("--system is refused with --fmi 3: the FMUs of the system are FMI 2.0")
    # Either all files are written or none.
    with held():
        files = [build_fmu(out, fmi, standalone)]
        if system:
            files += build_system(files[0].parent, standalone).values()
    print(*files, sep="\n")
