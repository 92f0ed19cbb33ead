"""`golf-impact calibrate`."""

from pathlib import Path
from typing import Annotated

from typer import BadParameter, Option

from golf_impact.commands.console import RESULTS, err, out, print_paragraphs, print_table, say, warn
from golf_impact.facts.quantities import LAWS_IN_WORDS

EPILOG = (
    "Examples: golf-impact calibrate --cor 0.743 --contact-time 600e-6 · golf-impact calibrate "
    "--ball-speed 50 --club-speed-after 24 --contact-time 600e-6 --max-force 6600 --exponent free"
)

_Value = float | None
_Sigma = Annotated[_Value, Option(help="Its standard deviation.", show_default="1 %")]
_BALL_SPEED = "Measured ball speed after the impact, m/s."
_CLUB_SPEED_AFTER = "Measured club head speed after the impact, m/s."
_CSV = (
    "Read them from a file with the columns target,value,sigma; names as above. "
    "Options win over it."
)
_EXPONENT = "n of law 2's power law: a number, or free to fit it too."


def _law(given: str | int) -> int:
    if str(given) not in ("1", "2"):
        raise BadParameter(f"{given} is refused: {LAWS_IN_WORDS}")
    return int(given)


def calibrate(
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
        _Value, Option(help="When it was largest, s since first touch.")
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
    law: Annotated[int, Option(parser=_law, metavar="1|2", help="1 absolute, 2 relative.")] = 2,
    exponent: Annotated[str, Option(help=_EXPONENT)] = "1",
    reference_compression: Annotated[
        float, Option(help="Compression at which k and b hold, m.")
    ] = 0.005,
    folder: Annotated[
        Path, Option("--out", help="The folder for calibrate.json and calibrate.png.")
    ] = RESULTS,
    figures: Annotated[bool, Option(help="Draw the figure.")] = True,
) -> None:
    """From measurements of an impact to k and b (and n): SI units, ball at rest before.

    Needs two targets, three with a free exponent. A target without σ gets 1 % of its value.
    """
    # Options are named as what they give.
    values = locals()
    from golf_impact.calibration.calibrate import calibrated
    from golf_impact.calibration.contact_law import asked_for
    from golf_impact.calibration.targets import TARGETS, doubts, given
    from golf_impact.files import as_json, prepare, write_together

    options = {name: (values[name], values[f"sigma_{name}"]) for name in TARGETS}
    conditions = {"club_speed": club_speed, "m_club": m_club, "m_ball": m_ball}
    prepare(folder, "calibrate.json", "calibrate.png")
    measured, targets = given(options, conditions, csv)
    chosen = asked_for(law, exponent, reference_compression)
    for words in doubts(measured, targets):
        warn(words, style="yellow")
    with err.status("calibrating"):
        calibration = calibrated(measured, targets, chosen)
        files = {"calibrate.json": as_json(calibration.as_json())}
        if figures:
            files["calibrate.png"] = calibration.drawn()
        written = write_together(folder, files)
    for table in calibration.tables():
        print_table(table)
    print_paragraphs(calibration.words)
    say(f"\n{', '.join(str(file) for file in written)}")
    out.print("Run it:", style="bold")
    # Plain, so that it can be copied: no wrapping, no mark-up.
    print(calibration.command)
