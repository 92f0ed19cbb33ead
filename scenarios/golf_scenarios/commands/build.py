"""`golf-impact build`."""

from pathlib import Path
from typing import Annotated

import typer

from golf_scenarios.errors import UserError

EPILOG = (
    "Examples: golf-impact build --out ClubBallImpact.fmu · golf-impact build --system · "
    "golf-impact build --fmi 3 · golf-impact build --standalone"
)


def build(
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="The .fmu file to write.",
            show_default="build/ of a checkout, else the user's cache folder",
        ),
    ] = None,
    system: Annotated[
        bool,
        typer.Option(
            "--system",
            help="Also Swing.fmu, BallFlight.fmu and GolfSwing.ssp, a system of all three.",
        ),
    ] = False,
    fmi: Annotated[
        int,
        typer.Option(
            "--fmi",
            min=2,
            max=3,
            help="Version of FMI; 3 is ClubBallImpact.fmi3.fmu, with Model Exchange.",
        ),
    ] = 2,
    standalone: Annotated[
        bool,
        typer.Option(
            "--standalone",
            help="ClubBallImpact.standalone.fmu, with a Python of its own: for hosts without one.",
        ),
    ] = False,
) -> None:
    """Build ClubBallImpact.fmu from its sources."""
    from golf_scenarios.fmu.archive import check_temporary_folder
    from golf_scenarios.fmu.file import build_fmu
    from golf_scenarios.fmu.system import build_system
    from golf_scenarios.stopping import held

    check_temporary_folder()
    if fmi == 3 and system:
        raise UserError("--system is refused with --fmi 3: the system's FMUs are of FMI 2.0")
    # All of the files, or none.
    with held():
        files = [build_fmu(out, fmi, standalone)]
        if system:
            files += build_system(files[0].parent, files[0], standalone)
    print(*files, sep="\n")
