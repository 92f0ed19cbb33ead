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
_Sigma = Annotated[_Value, Option(help="Its standard deviation.", show_default="1 %")]
_BALL_SPEED = "Measured ball speed after the impact, m/s."
_CLUB_SPEED_AFTER = "Measured club head speed after the impact, m/s."
_CSV = (
    "Read scalars from a file with the columns target,value,sigma; names as above. "
    "Options win over it."
)
_CURVE = "A measured force curve: time,force or time,force,sigma; s and N, any origin of time."
_SPEEDS = "COR at several speeds: approach_speed,cor or approach_speed,cor,sigma; fits a line."
_SAVE = "Save the ball as FILE.toml, for --ball FILE.toml."


def calibrate(
    curve: Annotated[Path | None, Option(metavar="FILE.csv", help=_CURVE)] = None,
    cor_speeds: Annotated[Path | None, Option(metavar="FILE.csv", help=_SPEEDS)] = None,
    ball_speed: Annotated[_Value, Option(help=_BALL_SPEED)] = None,
    sigma_ball_speed: _Sigma = None,
    club_speed_after: Annotated[_Value, Option(help=_CLUB_SPEED_AFTER)] = None,
    sigma_club_speed_after: _Sigma = None,
    cor: Annotated[_Value, Option(help="Coefficient of restitution, 0 to 1.")] = None,
    sigma_cor: _Sigma = None,
    contact_time: Annotated[
        _Value, Option(help="Duration of contact, s (600e-6 is 600 µs).")
    ] = None,
    sigma_contact_time: _Sigma = None,
    max_force: Annotated[_Value, Option(help="Largest contact force, N.")] = None,
    sigma_max_force: _Sigma = None,
    time_of_max_force: Annotated[
        _Value, Option(help="Instant of the largest force, s since first touch.")
    ] = None,
    sigma_time_of_max_force: _Sigma = None,
    club_speed: Annotated[
        _Value, Option(help="Club head speed before, m/s.", show_default="35")
    ] = None,
    m_club: Annotated[
        _Value, Option(help="Mass of the club head, kg.", show_default="0.210")
    ] = None,
    m_ball: Annotated[_Value, Option(help="Mass of the ball, kg.", show_default="0.04593")] = None,
    csv: Annotated[Path | None, Option("--csv", help=_CSV)] = None,
    law: Annotated[int, Option(metavar="1|2", help="1 absolute, 2 relative.")] = 2,
    exponent: Annotated[
        str, Option(help="n of law 2's power law: a number, or free to fit it too.")
    ] = "1",
    reference_compression: Annotated[
        float, Option(help="Compression at which k and b hold, m.")
    ] = 0.005,
    predict: Annotated[
        list[float] | None,
        Option(metavar="SPEED", help="Club speed to predict S, COR, ball speed at; repeatable."),
    ] = None,
    save: Annotated[Path | None, Option(metavar="FILE.toml", help=_SAVE)] = None,
    folder: Annotated[
        Path, Option("--out", help="The folder for calibrate.json and calibrate.png.")
    ] = RESULTS,
    figures: Annotated[bool, Option(help="Draw the figure.")] = True,
) -> None:
    """From measurements of an impact to the parameters of a ball: SI units, ball at rest before.

    A force curve, COR at several speeds and scalars are fitted together. Scalars alone: two of
    them, three with a free exponent; one without σ gets 1 % of its value.
    """
    values = locals()
    from golf_impact.calibration.calibration import calibrate as fit
    from golf_impact.files import as_json, prepare, write_together

    prepare(folder, "calibrate.json", "calibrate.png")
    not_arguments = ("save", "folder", "figures")
    given = {name: value for name, value in values.items() if name not in not_arguments}
    with err.status("calibrating"):
        calibration = fit(**given)
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
