"""`golf-impact calibrate`."""

from pathlib import Path
from typing import Annotated

from typer import Option

from golf_impact.commands.console import RESULTS, err, out, print_paragraphs, print_table, say

EPILOG = (
    "Examples: golf-impact calibrate --curve force.csv --exponent free --save mine.toml · "
    "golf-impact calibrate --cor-speeds cor.csv --contact-time 600e-6 · golf-impact calibrate "
    "--cor 0.743 --contact-time 600e-6"
)

_Value = float | None
_File = Path | None
_SIGMA = "Its standard deviation; 1 % of the value if omitted."
_Sigma = Annotated[_Value, Option(metavar="SIGMA", help=_SIGMA)]
_CURVE = "A measured force curve: time,force or time,force,sigma; s and N, any origin of time."
_SPEEDS = "COR at several speeds: approach_speed,cor or approach_speed,cor,sigma; fits a line."
_AFTER = "Club head speed after impact."
_BEFORE = "Club head speed before; 35 if omitted."
_DURATION = "Duration of contact (600e-6 is 600 µs)."
_PEAK = "Instant of the largest force, since first touch."
_CSV = "Scalars with the columns target,value,sigma; names as above. Options override it."
_EXPONENT = "n of law 2's power law; free fits it too."
_LENGTH = "Compression for which k and b are given."
_PREDICT = "Club speed to predict S, COR, ball speed at; repeatable."
_SAVE = "Save the ball as FILE.toml, for --ball FILE.toml."
_FOLDER = "For calibrate.json and calibrate.png."


def calibrate(
    curve: Annotated[_File, Option(metavar="FILE.csv", help=_CURVE)] = None,
    cor_speeds: Annotated[_File, Option(metavar="FILE.csv", help=_SPEEDS)] = None,
    ball_speed: Annotated[_Value, Option(metavar="m/s", help="Ball speed after impact.")] = None,
    sigma_ball_speed: _Sigma = None,
    club_speed_after: Annotated[_Value, Option(metavar="m/s", help=_AFTER)] = None,
    sigma_club_speed_after: _Sigma = None,
    cor: Annotated[_Value, Option(metavar="0..1", help="Coefficient of restitution.")] = None,
    sigma_cor: _Sigma = None,
    contact_time: Annotated[_Value, Option(metavar="s", help=_DURATION)] = None,
    sigma_contact_time: _Sigma = None,
    max_force: Annotated[_Value, Option(metavar="N", help="Largest contact force.")] = None,
    sigma_max_force: _Sigma = None,
    time_of_max_force: Annotated[_Value, Option(metavar="s", help=_PEAK)] = None,
    sigma_time_of_max_force: _Sigma = None,
    club_speed: Annotated[_Value, Option(metavar="m/s", help=_BEFORE)] = None,
    m_club: Annotated[_Value, Option(metavar="kg", help="Of the club; 0.210 if omitted.")] = None,
    m_ball: Annotated[_Value, Option(metavar="kg", help="Of the ball; 0.04593 if omitted.")] = None,
    csv: Annotated[_File, Option("--csv", metavar="FILE.csv", help=_CSV)] = None,
    law: Annotated[int, Option(metavar="1|2", help="1 absolute, 2 relative.")] = 2,
    exponent: Annotated[str, Option(metavar="N|free", help=_EXPONENT)] = "1",
    reference_compression: Annotated[float, Option(metavar="m", help=_LENGTH)] = 0.005,
    predict: Annotated[list[float] | None, Option(metavar="m/s", help=_PREDICT)] = None,
    save: Annotated[_File, Option(metavar="FILE.toml", help=_SAVE)] = None,
    folder: Annotated[Path, Option("--out", metavar="FOLDER", help=_FOLDER)] = RESULTS,
    figures: Annotated[bool, Option(help="Draw the figure.")] = True,
) -> None:
    """From measurements of an impact to the parameters of a ball: SI units, ball at rest before.

    A force curve, COR at several speeds and scalars are fitted together. Scalars alone: two of
    them, three with a free exponent; one without σ gets 1 % of its value.
    """
    arguments = locals()
    for name in ("save", "folder", "figures"):
        del arguments[name]
    from golf_impact.calibration.calibration import calibrate as fit
    from golf_impact.files import as_json, prepare, write_together

    prepare(folder, "calibrate.json", "calibrate.png")
    with err.status("calibrating"):
        calibration = fit(**arguments)
        files = {"calibrate.json": as_json(calibration.as_json())}
        if figures:
            from golf_impact.report.figures import to_png

            files["calibrate.png"] = to_png(calibration.draw())
        written = [calibration.save(save)] if save else []
        written = write_together(folder, files) + written
    for table in calibration.tables():
        print_table(table)
    print_paragraphs(calibration.words)
    say(f"\n{', '.join(str(file) for file in written)}")
    out.print("Run it:", style="bold")
    # Plain, so that it can be copied: no wrapping, no mark-up.
    print(f"golf-impact run --ball {save}" if save else calibration.command)
