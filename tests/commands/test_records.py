"""Records of labs and oscilloscopes, measured numbers, and what isn't one of an impact."""

import math

import numpy as np
import pytest
from command import golf_here, refused
from test_calibrate import AT, record

from golf_impact.calibration.measurements import measured, measurements, number
from golf_impact.calibration.records import read_table
from golf_impact.errors import UserError

SERIES = (("time", "force", "sigma"), ("s", "N", "N"))
TEKTRONIX = "Model,MSO54\nLabel,CH1,CH2\nVertical Offset,0,0\nVertical Scale,1,1\n\nTIME,CH1,CH2\n"
BESIDE = "Record Length,2.5e3,,0,0.5,\nTrigger Point,1,,1,1,\nSource,CH1,,2,1.5,\n,,,3,2,\n"
LECROY = "LECROYWS434,1,Waveform\nSegments,1,SegmentSize,2\n#1,24-Nov-2020,0\nTime,Ampl\n"
TABLES = {
    "plain": ("time,force\n0,1\n1,2\n", "", [[0, 1], [1, 2]]),
    "units": ("time [ms],force (kN)\n0,1\n1,2\n", "", [[0, 1e-3], [1e3, 2e3]]),
    "tabs": ("t_us\tF/kN\n0\t1\n1\t2\n", "", [[0, 1e-6], [1e3, 2e3]]),
    "commas": ("Zeit [µs];Kraft [kN]\n0,5;1,25\n\n1,5;2\n", "", [[5e-7, 1.5e-6], [1250, 2e3]]),
    "units below": (
        "# x\nTime,A,B\n(us),(V),(kN)\n\n0,9,1\n1,9,2\n", "Time,B", [[0, 1e-6], [1e3, 2e3]]
    ),
    "numbers": ("0,9,1\n1,9,2\n", "1 [ms],3", [[0, 1e-3], [1, 2]]),
    "spaces": ("0 1\n1 2\n", "", [[0, 1], [1, 2]]),
    "quoted": ('"time","force"\n"0","1" # first\n"1","2"\n', "", [[0, 1], [1, 2]]),
    "comment": ("# time,force\n# May,1\n0,1\n1,2\n", "", [[0, 1], [1, 2]]),
    "rate": ("Hz,1e6\n0,1\n1,2\n", "1 [ms],2", [[0, 1e-3], [1, 2]]),
    "order": ("scope\nforce,time\n1,0\n2,1\n", "", [[0, 1], [1, 2]]),
    "empty": ("time,force\n", "", [[], []]),
    "sigma": ("time,force,sigma\n0,1,5\n1,2,5\n", "", [[0, 1], [1, 2], [5, 5]]),
    "text": ("clock,time,force,status\n12:01,0,1,OK\n12:01,1,2,clip\n", "", [[0, 1], [1, 2]]),
    "Tektronix": (TEKTRONIX + "0,9,0.5\n1,9,1\n", "TIME [s],CH2 [2 kN/V]", [[0, 1], [1e3, 2e3]]),
    "by number": (TEKTRONIX + "0,9,0.5\n1,9,1\n", "1,3 [10 mV/N]", [[0, 1], [50, 100]]),
    "beside": (BESIDE, "4 [s],5 [2kN/V]", [[0, 1, 2, 3], [1e3, 2e3, 3e3, 4e3]]),
    "Keysight": (
        "x-axis,1,2\nsecond,mV,Volt\n0,500,9\n1,1e3,9\n", "x-axis,1 [2 kN/V]", [[0, 1], [1e3, 2e3]]
    ),
    "LeCroy": (LECROY + "0,0.5\n1,1\n", "Time,Ampl [100 N/V]", [[0, 1], [50, 100]]),
}  # fmt: skip


@pytest.mark.parametrize("encoding", ["utf-8-sig", "cp1252"])
@pytest.mark.parametrize("name", TABLES)
def test_tables_of_labs_and_scopes(tmp_path, name, encoding):
    text, chosen, expected = TABLES[name]
    file = tmp_path / "record.csv"
    file.write_bytes(text.encode(encoding))
    columns, _ = read_table(file, *SERIES, chosen)
    assert np.array(columns) == pytest.approx(np.array(expected))


CURVE, LINE, CSV = "--curve bad.csv@40 --m-club 0.2", "--cor-speeds bad.csv", "--csv bad.csv"

#: Options, what is in bad.csv, and words of the error.
REFUSED = [
    (CURVE, "Time,CH1,CH2\n0,1,2\n", "its header is 'Time,CH1,CH2'", "--columns"),
    (CURVE, "x-axis,1\nsecond,Volt\n0,1\n", "its header is 'x-axis,1 / second,Volt'"),
    (CURVE, "time,force [V]\n0,1\n", "unit 'V' of force", "2 kN/V", "'time,force [V]'"),
    (CURVE, "time,force\n0,1\n\n1,oops\n", "line 4, column 2 (force): 'oops'", "a number"),
    (CURVE, "time,force\n0,1\n1\n", "line 3, column 2 (force): ''"),
    (CURVE, "time;force\n0,5;1\n1.000,5;1\n", "line 3, column 1 (time): '1.000,5'"),
    (CURVE, "time,force,time\n0,1,2\n", "2 columns", "time"),
    (CURVE, "hello\nworld\n", "its header is 'world'", "expected time,force"),
    (CURVE, "", "no header"),
    (CURVE, f"time,force\n{'0' * 131_073},1\n", "a line has more than 131072 characters"),
    (LINE, "approach_speed,cor\n30,0.8\n\n40,0\n", "row 2 (line 4)", "above 0"),
    (LINE, "approach_speed,cor\n30,0.8\n30,0.7\n", "two speeds"),
    (LINE, "approach_speed,cor\n30,0.8\n40,0.7\n", "sigma"),
    (LINE, "approach_speed,cor,sigma\n30,0.8,0.1\n40,0.7,0\n", "row 2 (line 3)", "sigma = 0"),
    (CSV, "target\n", "first line must be target,value"),
    (CSV, "target,value,sigma\nspin,3000,1\n", "row 1 (line 2): there is no target 'spin'"),
    (CSV, "target,value,sigma\ncor,high,\n", "row 1 (line 2): cor = 'high'"),
    (CSV, "target,value,sigma\ncor,0.7,\ncor,0.8,\n", "row 2 (line 3): cor is given twice"),
    (CSV, "target,value,sigma\ncor,0.7,0.1,4\n", "more cells"),
    (CSV, "target,value,sigma\nm_ball,0.046,0.1\n", "m_ball takes no sigma: --prior"),
    ("--cor 1", "", "cor = 1 is refused"),
    ("--cor 0.7 --contact-time 600", "", "600e-6 for 600 µs"),
    ("--cor 0.7 --max-force 6.6", "", "6600 for 6.6 kN"),
    ("--cor 0.7±0 --contact-time 6e-4", "", "sigma_cor = 0"),
    ("--max-force 6e3 --measured max-force=6e3", "", "max_force is given twice"),
    ("--measured spin=3", "", "no target 'spin'"),
    ("--measured cor", "", "write NAME=VALUE"),
    ("--ball-speed 50 --club-speed-after 24 --cor 0.74", "", "count once"),
    ("--cor 0.7 --contact-time 6e-4 --exponent free", "", "3 are needed"),
    ("", "", "--cor 0.743 --contact-time 600e-6"),
    ("--cor 0.7 --contact-time 6e-4 --m-club 210", "", "0.21 for 210 g"),
    ("--law 1 --exponent 1.5", "", "exponent = 1.5 is refused: law = 1"),
    ("--law 1 --exponent free", "", "exponent = free is refused: law = 1"),
    ("--reference-compression 0", "", "reference_compression = 0"),
    ("--law 3", "", "1 (absolute)"),
    ("--csv none.csv", "", "none.csv"),
    ("--fix m_club=1", "", "fix m_club is refused"),
    ("--fix k=8e5 --fix b=3 --cor 0.7 --contact-time 6e-4", "", "nothing is left"),
    ("--prior k=8e5", "", "without its σ"),
    ("--baseline sloped", "", "zero, constant, linear"),
    ("--curve bad.csv", "", "needs club_speed and m_club"),
    ("--curve bad.csv@40", "", "needs m_club"),
    (f"{CURVE} --prior club_speed=40±1", "", "of their own"),
]


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: case[2][:30])
def test_what_is_refused(tmp_path, case):
    options, text, *words = case
    (tmp_path / "bad.csv").write_text(text)
    words += ["bad.csv"] if text else []
    refused(golf_here("calibrate", *options.split(), "--out", "out", cwd=tmp_path), *words)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("cor", 0.01, 1.0), ("exponent", 0.999999, 12.000001), ("max_force", 20.0, math.inf),
     ("contact_time", 0.0, 0.1), ("m_ball", 0.0, 10.0), ("club_speed", 0.0, math.inf)],
)  # fmt: skip
def test_ranges_from_both_sides(name, low, high):
    inside = [low * (1.0 + 1e-9) or 1e-9, high * (1.0 - 1e-9) if high < math.inf else 1e9]
    assert [number(value, name) for value in inside] == inside
    for value in (low, high, math.nan):
        with pytest.raises(UserError, match="is refused"):
            number(value, name)


@pytest.mark.parametrize("text", ["600us±6us", "600±6us", "600us +- 6", "0.6ms+/-6us", "6e-4±6e-6"])
def test_a_number_with_its_sigma(text):
    assert measured(text, "contact_time") == pytest.approx((6e-4, 6e-6, True))


def curve(rows=260, lead=100):
    """The half sine of an undamped contact: 6 kN, 628 µs, 2.4 N·s; one row in 5 µs."""
    time = 5e-6 * np.arange(rows)
    since = time - lead * 5e-6
    inside = (since > 0.0) & (since < math.pi / 5e3)
    return time, np.where(inside, 6e3 * np.sin(5e3 * since), 0.0)


def conditioned(*columns, **options):
    """The curve as it is fitted."""
    given = {"club_speed": 30.0, "m_club": 0.2, "m_ball": 0.05} | options
    return measurements(given, curve=columns).curves["curve"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, f: (t[:0], f[:0]), "it has no rows of time, force"),
        (lambda t, f: (t[[0, 1, 2, 4, 3, 5]], f[:6]), "row 5: time = 1.5e-05 s isn't after 2e-05"),
        (lambda t, f: (t, np.where(t == t[9], np.nan, f)), "row 10: force = nan"),
        (lambda t, f: (t, 0.0 * f), "row 1: .* no touch"),
        (lambda t, f: (t, np.where(t == t[150], 6e3, 0.0)), "of only 1 row in contact"),
        (lambda t, f: (t[170:], f[170:]), "the first: the record was triggered too late"),
        (lambda t, f: (t * 1e3, f), "contact of 0.5.* s, not of 600e-6: for ms write"),
        (lambda t, f: (t, 1e3 * np.sin(t / 5e-6)), "no more than the rest"),
        (lambda t, f: (t, f * 1e-3), "force looks like kN"),
        (lambda t, f: (t, 0.35 * f), "mph.* 10.5 to 21 m/s, or --m-club from 0.0194 to 0.0636"),
        (lambda t, f: (t, 3.0 * f), "is 6 times .* it fits club speeds of 90 to 180 m/s"),
        (lambda t, f: (t[:, None], f), "arrays of one length"),
    ],
)  # fmt: skip
def test_curves_that_are_refused(change, words):
    with pytest.raises(UserError, match=words):
        conditioned(*change(*curve()))


@pytest.mark.parametrize(("rows", "kind"), [(9, 0), (10, 1)])
def test_a_baseline_needs_ten_rows(rows, kind):
    """Of rows at least a quarter of the contact before it."""
    time, force = curve(220)
    contact = np.flatnonzero(force > 0.25 * 6e3)
    quarter = 0.25 * (time[contact[-1]] - time[contact[0]])
    first = np.flatnonzero(time < time[contact[0]] - quarter)[-1] + 1 - rows
    assert len(conditioned(time[first:], force[first:] + 50.0).baseline) == kind


@pytest.mark.parametrize("step", [50.0, 200.0, 500.0])
@pytest.mark.parametrize("limit", [math.inf, 7000.0])
def test_quantization_is_not_clipping(step, limit):
    """Rows at the largest value are a parabola's, or as many as are left out at a limit."""
    time, force = record(lead=0.15, trail=0.25, step=step, limit=limit, sign=-1.0)
    sigma, clipped = np.linspace(10.0, 20.0, 551), (force == force.min()) & (limit < math.inf)
    series = conditioned(time, force, sigma, **AT, m_ball=0.04593)
    words = f"{clipped.sum()} rows at the largest force are left out: clipped"
    turned = "the force is negative; its sign was changed"
    assert [*series.notes] == [turned, *[words] * bool(clipped.any())]
    assert series.sigma.tolist() == sigma[~clipped].tolist()


def test_targets_from_a_file(tmp_path):
    file = tmp_path / "shot.csv"
    file.write_text("target,value,sigma\nball-velocity,50,0.5\ncor,0.74,\n\nclub_speed,36,\n")
    found = measurements({"cor": "0.75±0.02", "m_club": 0.21}, file)
    assert (found.impact["club_speed"], found.impact["m_club"]) == (36.0, 0.21)
    assert found.targets.measured == {"ball_speed": (50.0, 0.5, True), "cor": (0.75, 0.02, True)}
    file.write_text("target,value\ncor,74 %\n")
    assert measurements({}, file).targets.measured == {"cor": (0.74, 0.0074, False)}
