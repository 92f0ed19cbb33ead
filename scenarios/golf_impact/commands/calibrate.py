from pathlib import Path
from typing import Annotated

from typer import Option

from golf_impact.commands.console import RESULTS, Out, print_paragraphs, print_table, progress, say

EPILOG = (
    "Examples: golf-impact calibrate --curve force.csv@95mph --m-club 200g --save mine.toml · "
    "golf-impact calibrate --cor-speeds cor.csv --contact-time 600us · golf-impact calibrate "
    "--cor 0.743 --contact-time 600us"
)

_CURVE = (
    "A measured force curve: time,force or time,force,sigma; units in its header (s, N), any zero "
    "of time. Repeatable, each with its speed: FILE.csv@40; or a FILE.toml that lists them."
)
_COLUMNS = "Columns of curves and their units, e.g. 't [ms],F [kN]'; names or numbers."
_SPEEDS = "COR at several speeds: approach_speed,cor or approach_speed,cor,sigma; fits a line."
_AFTER = "Measured after the impact."
_CSV = "Scalars as a CSV file: target,value,sigma, with names as above; options override it."
_REFERENCE = "Compression for which k and b are given."
_PREDICT = "Club speed to predict S, COR, ball speed at; repeatable."
_SAVE = "Save the ball as FILE.toml, for --ball FILE.toml."

_File = Path | None
_Value = str | None
_SIGMA = "Its standard deviation; 1 % of the value if omitted."
_Sigma = Annotated[_Value, Option(metavar="SIGMA", help=_SIGMA)]


def calibrate(
    curve: Annotated[list[str] | None, Option(metavar="FILE.csv[@SPEED]", help=_CURVE)] = None,
    columns: Annotated[str, Option(metavar="T,F", help=_COLUMNS)] = "",
    cor_speeds: Annotated[_File, Option(metavar="FILE.csv", help=_SPEEDS)] = None,
    ball_speed: Annotated[_Value, Option(metavar="m/s", help=_AFTER)] = None,
    sigma_ball_speed: _Sigma = None,
    club_speed_after: Annotated[_Value, Option(metavar="m/s", help=_AFTER)] = None,
    sigma_club_speed_after: _Sigma = None,
    cor: Annotated[_Value, Option(metavar="0..1", help="Coefficient of restitution.")] = None,
    sigma_cor: _Sigma = None,
    contact_time: Annotated[_Value, Option(metavar="s", help="Duration; 600e-6 is 600 µs.")] = None,
    sigma_contact_time: _Sigma = None,
    max_force: Annotated[_Value, Option(metavar="N", help="Largest contact force.")] = None,
    sigma_max_force: _Sigma = None,
    time_of_max_force: Annotated[_Value, Option(metavar="s", help="Since first touch.")] = None,
    sigma_time_of_max_force: _Sigma = None,
    club_speed: Annotated[
        _Value, Option(metavar="m/s", help="At touch; needed with --curve, else 35.")
    ] = None,
    m_club: Annotated[
        _Value, Option(metavar="kg", help="Club head; needed with --curve, else 0.210.")
    ] = None,
    m_ball: Annotated[_Value, Option(metavar="kg", help="Ball; 0.04593 if omitted.")] = None,
    club_force: Annotated[_Value, Option(metavar="N", help="On the club head; else 0.")] = None,
    csv: Annotated[_File, Option(metavar="FILE.csv", help=_CSV)] = None,
    law: Annotated[int, Option(metavar="1|2", help="1 absolute, 2 relative.")] = 2,
    exponent: Annotated[str, Option(metavar="N|free", help="n of law 2; free fits it, too.")] = "1",
    reference_compression: Annotated[str, Option(metavar="m", help=_REFERENCE)] = "0.005",
    predict: Annotated[list[str] | None, Option(metavar="m/s", help=_PREDICT)] = None,
    save: Annotated[_File, Option(metavar="FILE.toml", help=_SAVE)] = None,
    folder: Out = RESULTS,
    figures: Annotated[bool, Option(help="Draw the figure.")] = True,
) -> None:
    """Fit the parameters of a ball to measurements of an impact.

    The ball is at rest before. Force curves, COR at several speeds and scalars are fitted together.
    Scalars alone: two of them, three with a free exponent; one without σ gets 1 % of its value.
    Numbers are in SI units or have one of their own: 95mph, 600us, 6.6kN.
    """
    values = {**locals()}
    from golf_impact.calibration.calibration import calibrate as fit
    from golf_impact.files import as_json, prepare, write_together

    prepare(folder, "calibrate.json", "calibrate.png")
    for name in ("save", "folder", "figures"):
        del values[name]
    with progress() as begin:
        advance = begin("calibrating", 100)
        calibration = fit(**values, progress=advance)
        files = {"calibrate.json": as_json(calibration.as_json())}
        if figures:
            from golf_impact.report.figures import to_png

            files["calibrate.png"] = to_png(calibration.draw())
        written = [calibration.save(save)] if save else []
        written = write_together(folder, files) + written
    for table in calibration.tables():
        print_table(table)
    print_paragraphs(calibration.words)
    say(f"\n{', '.join(map(str, written))}")
    say("Run it:", "bold")
    # Plain, so that it can be copied: no wrapping, no mark-up.
    print(f"golf-impact run --ball {save}" if save else calibration.command)
