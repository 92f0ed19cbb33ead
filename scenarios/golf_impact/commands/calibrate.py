from pathlib import Path
from typing import Annotated

from typer import Option

from golf_impact.commands.bench import Out
from golf_impact.commands.console import RESULTS, out, print_table, progress, say
from golf_impact.commands.options import pairs_of

EPILOG = (
    "Examples: golf-impact calibrate --curve force.csv@95mph --m-club 200g · golf-impact "
    "calibrate --shots shots.csv --m-club 200g --save mine.toml · golf-impact calibrate --measured "
    "cor=0.743 --measured contact_time=600us"
)

_CURVE = (
    "A measured force curve: time,force or time,force,sigma; units in its header (s, N), any zero "
    "of time. Repeatable, each with its speed: FILE.csv@40."
)
_COLUMNS = (
    "Columns of the file by name or number, with units or a sensor's sensitivity: 't [ms],F [kN]', "
    "'TIME [s],CH2 [2 kN/V]'."
)
_SPEEDS = "COR at several speeds: approach_speed,cor or approach_speed,cor,sigma; fits a line."
_MEASURED = (
    "A measured output of the FMU, and its standard deviation (1 % if omitted): "
    "max_force=6.6±0.1kN, also with +-; repeatable."
)
_SHOTS = "Club and ball speed of shots, a CSV file of a launch monitor: COR over speed."
_WINDOW = "Instants between which the rows of curves count, by their clock: 0:2ms."
_BASELINE = "The sensor's offset, or drift too; rows outside contact decide, if omitted."
_FIX = "A parameter that isn't fitted: n=1.5; repeatable."
_PRIOR = "A parameter of law or impact that is known beforehand: m_club=0.2±0.002; repeatable."
_SAVE = "Save the ball as FILE.toml, for --ball FILE.toml."
_SPEED = "At touch; needed with --curve, else 35."
_CLUB = "Club head; needed with --curve, else 0.210."

_File = Path | None
_Value = str | None
_Values = list[str] | None

#: Options that were, and what takes their place.
FORMER = {
    "--cor": "give --measured cor=…",
    "--contact-time": "give --measured contact_time=…",
    "--ball-speed": "give --measured ball_speed=…",
    "--club-speed-after": "give --measured club_speed_after=…",
    "--max-force": "give --measured max_force=…",
    "--time-of-max-force": "give --measured time_of_max_force=…",
    "--csv": "give --measured NAME=VALUE±σ for each value",
    "--law": "law 2 (relative) is fitted, which conserves momentum",
    "--club-force": "a head is free while it meets the ball",
    "--reference-compression": "k and b hold at 0.005 m",
    "--predict": "30, 40 and 50 m/s are printed; other speeds by golf-impact run --ball FILE",
    "--profile": "intervals of few rows follow from the rise of χ² without an option",
}


def calibrate(
    curve: Annotated[_Values, Option(metavar="FILE.csv[@SPEED]", help=_CURVE)] = None,
    columns: Annotated[str, Option(metavar="T,F", help=_COLUMNS)] = "",
    cor_speeds: Annotated[_File, Option(metavar="FILE.csv", help=_SPEEDS)] = None,
    measured: Annotated[_Values, Option(metavar="NAME=VALUE[±σ]", help=_MEASURED)] = None,
    shots: Annotated[_File, Option(metavar="FILE.csv", help=_SHOTS)] = None,
    window: Annotated[_Value, Option(metavar="T0:T1", help=_WINDOW)] = None,
    club_speed: Annotated[_Value, Option(metavar="m/s", help=_SPEED)] = None,
    m_club: Annotated[_Value, Option(metavar="kg", help=_CLUB)] = None,
    m_ball: Annotated[_Value, Option(metavar="kg", help="Ball; 0.04593 if omitted.")] = None,
    exponent: Annotated[str, Option(metavar="N|free", help="n of law 2; free fits it, too.")] = "1",
    baseline: Annotated[str, Option(metavar="zero|constant|linear", help=_BASELINE)] = "",
    fix: Annotated[_Values, Option(metavar="NAME=VALUE", help=_FIX)] = None,
    prior: Annotated[_Values, Option(metavar="NAME=VALUE±σ", help=_PRIOR)] = None,
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
    from golf_impact.data.files import as_json, check, write
    from golf_impact.report.results import png
    from golf_impact.studies.calibrate.calibration import calibrate as fit

    for name in ("save", "folder", "figures", "measured"):
        del values[name]
    values |= _pairs(measured, "measured", "cor=0.743±0.005")
    values |= {"fix": _pairs(fix, "fix", "n=1.5"), "prior": _pairs(prior, "prior", "k=8e5±1e4")}
    data, picture = folder / "calibrate.json", folder / "calibrate.png"
    for path in filter(None, (data, picture if figures else None, save)):
        check(path)
    with progress("calibrating", 1):
        calibration = fit(**values)
        written = [write(data, as_json(calibration.as_json()))]
        written += [write(picture, png(calibration.draw()))] if figures else []
        written += [calibration.save(save)] if save else []
    for table in calibration.tables():
        print_table(*table)
    for words in calibration.words:
        out.print(words, highlight=False)
    say(f"\n{', '.join(map(str, written))}")
    say("Run it:", "bold")
    # Plain, so that it can be copied: no wrapping, no mark-up.
    print(f"golf-impact run --ball {save}" if save else calibration.command)


def _pairs(texts: list[str] | None, option: str, example: str) -> dict[str, str]:
    """Values by name, as keyword arguments and as options are written, of NAME=VALUE."""
    pairs = pairs_of(texts or [], f"NAME=VALUE, e.g. --{option} {example}", f"--{option}")
    return {name.replace("-", "_"): value for name, value in pairs.items()}
