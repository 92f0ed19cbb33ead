"""Records of labs and oscilloscopes, measured numbers, and what isn't one of an impact."""

import json
import math
from itertools import cycle

import numpy as np
import pytest
from command import golf_here, refused
from test_calibrate import AT, PENNER, record

import golf_impact
from golf_impact.data.errors import UserError
from golf_impact.data.measured import MPH
from golf_impact.studies.calibrate.measurements import measured, measurements, number
from golf_impact.studies.calibrate.records import FORCE, SIGMA, TIME, read_table

SCOPE = "Model,X1\nLabel,CH1,CH2\nVertical Offset,0,0\nVertical Scale,1,1\n\nTIME,CH1,CH2\n"
BESIDE = "Record Length,2.5e3,,0,0.5,\nTrigger Point,1,,1,1,\nSource,CH1,,2,1.5,\n,,,3,2,\n"
SEGMENTS = "SCOPE9,1,Waveform\nSegments,1,SegmentSize,2\n#1,24-Nov-2020,0\nTime,Ampl\n"
HUNDRED = "time,force\n" + "".join(f"{n},{n}\n" for n in range(1, 100))
TABLES = {
    "plain": ("time,force\n0,1\n1,2\n", "", [[0, 1], [1, 2]]),
    "units": ("time [ms],force (kN)\n0,1\n1,2\n", "", [[0, 1e-3], [1e3, 2e3]]),
    "tabs": ("t_us\tF/kN\n0\t1\n1\t2\n", "", [[0, 1e-6], [1e3, 2e3]]),
    "commas": ("Zeit [µs];Kraft [kN]\n0,5;1,25\n\n1,5;2\n", "", [[5e-7, 1.5e-6], [1250, 2e3]]),
    "units below": ("# x\nTime,A,B\n(us),(V),(kN)\n\n0,9,1\n1,9,2\n", "Time,B",
        [[0, 1e-6], [1e3, 2e3]]),
    "numbers": ("0,9,1\n1,9,2\n", "1 [ms],3", [[0, 1e-3], [1, 2]]),
    "spaces": ("0 1\n1 2\n", "", [[0, 1], [1, 2]]),
    "quoted": ('"time","force"\n"0","1" # first\n"1","2"\n', "", [[0, 1], [1, 2]]),
    "comment": ("# Load [lbf]: 9\n# time,force\n# May,1\n0,1\n1,2\n", "", [[0, 1], [1, 2]]),
    "rate": ("Hz,1e6\n0,1\n1,2\n", "1 [ms],2", [[0, 1e-3], [1, 2]]),
    "order": ("scope\nforce,time\n1,0\n2,1\n", "", [[0, 1], [1, 2]]),
    "sigma": ("time,force,sigma\n0,1,5\n1,2,5\n", "", [[0, 1], [1, 2], [5, 5]]),
    "text": ("clock,time,force,status\n12:01,0,1,OK\n12:01,1,2,clip\n", "", [[0, 1], [1, 2]]),
    "settings above": (SCOPE + "0,9,0.5\n1,9,1\n", "TIME [s],CH2 [2 kN/V]", [[0, 1], [1e3, 2e3]]),
    "by number": (SCOPE + "0,9,0.5\n1,9,1\n", "1,3 [10 mV/N]", [[0, 1], [50, 100]]),
    "beside": (BESIDE, "4 [s],5 [2kN/V]", [[0, 1, 2, 3], [1e3, 2e3, 3e3, 4e3]]),
    "units in words": ("x-axis,1,2\nsecond,mV,Volt\n0,500,9\n1,1e3,9\n", "x-axis,1 [2 kN/V]",
        [[0, 1], [1e3, 2e3]]),
    "segment": (SEGMENTS + "0,0.5\n1,1\n", "Time,Ampl [100 N/V]", [[0, 1], [50, 100]]),
    "rows": ("X,CH1,Start,Increment,\nSequence,Volt,-3e-4,1.2e-6,\n0,0.5,,\n1,1,,\n",
        "X,CH1 [2.5 kN/V]", [[-3e-4, -3e-4 + 1.2e-6], [1250, 2500]]),
    "sens head": ("t [1.6 us],F [2.25 mV/N]\n0,1\n1,2\n", "",
        [[0, 1.6e-6], [444.444444, 888.888888]]),
    "sens comma": ("t;F\n,5;1,5\n1;2,0\n", "t [1,6 us],F [.5 kN/V]", [[8e-7, 1.6e-6], [750, 1000]]),
    "sens e": ("t,F\n0,1\n1,2\n", "t [s],F [225e-2 mV/N]", [[0, 1], [444.444444, 888.888888]]),
    "run": ("Time (s) Run #1,Force (N) Run #1\n0,1\n1,2\n", "", [[0, 1], [1, 2]]),
    "sections": ("Logger File\t\nWriter_Version\t2\nDecimal_Separator\t,\n"
        "***End_of_Header***\t\n\nChannels\t1\nDate\t2020/10/10\nTime\t14:22:33,123\n"
        "X_Dimension\tTime\nX0\t0,0E+0\nDelta_X\t1,0E-6\n***End_of_Header***\n"
        "X_Value\tVoltage\tComment\n0,000000\t0,5\t\n1,000E-6\t0,75\t\n",
        "X_Value,Voltage [2 kN/V]", [[0, 1e-6], [1000, 1500]]),
    "sections nox": ("Logger File\t\nX0\t1,0E-3\nDelta_X\t1,0E-6\n***End_of_Header***\n"
        "X_Value\tForce [N]\tComment\n\t0,5\n\t0,75\n", "", [[1e-3, 1.001e-3], [0.5, 0.75]]),
    "words": ("Record Length,Analog:3500\nSample Interval,Analog:2.0E-7\nVertical Units,CH1:V\n"
        "Source,CH1\nSecond,Volt\n0.1,0.5\n0.2,1\n", "Second,Volt [2 kN/V]",
        [[0.1, 0.2], [1000, 2000]]),
    "no times": ('"Model","X2"\n"TraceName","CH1"\n"VUnit","V"\n"SampleRate","1.25e6"\n'
        '"HResolution",8e-7\n"HOffset",-5e-4\n\n,0.5,\n,1.0,\n', "row,2 [2 kN/V]",
        [[-5e-4, -4.992e-4], [1000, 2000]]),
    "rate comma": ("Abtastrate: 250,5 kHz\nKraft [kN]\n1\n2\n", "", [[0, 1 / 250_500], [1e3, 2e3]]),
    "rate, thousands": ("Sample Rate: 500,000 Hz\nF (N)\n1.5\n2\n", "", [[0, 2e-6], [1.5, 2]]),
    "rate quoted": ('Sample Rate,"500,000"\nForce\n1.5\n2\n', "", [[0, 2e-6], [1.5, 2]]),
    "commas alone": ("Interval (ms);4\nF (kN)\n0,1\n0,15\n", "", [[0, 4e-3], [100, 150]]),
    "thousands, quoted": ('t,F\n0,"1,250"\n1,"1,251"\n', "", [[0, 1], [1250, 1251]]),
    "thousands by column": ("time\tforce\n0\t999\n1\t1,250\n", "", [[0, 1], [999, 1250]]),
    "unit lines": ("Time Units,us\nForce unit: kN\nt,F\n0,1\n1,2\n", "", [[0, 1e-6], [1e3, 2e3]]),
    "label beside units": ("time;force\nUnit;ms;kN\n0;1\n1;2\n", "", [[0, 1e-3], [1e3, 2e3]]),
    "label beside heads": (";SampleRate, 400,Hz\n;Headers, time,Ax,Az\n0.1,9,1\n0.2,9,2\n",
        "time,Az [2.5 N]", [[0.1, 0.2], [2.5, 5]]),
    "rate with spaces": ("Sample rate = 200 000 Hz\nForce (N)\n1\n2\n", "", [[0, 5e-6], [1, 2]]),
    "rate, commas": ("Rate: 200,000 Hz\nNo,F [N]\n0,1.5\n1,2\n", "", [[0, 5e-6], [1.5, 2]]),
    "rate, points": ("Abtastrate: 200.000 Hz\nF [N]\n0,5\n1,5\n", "", [[0, 5e-6], [0.5, 1.5]]),
    "no header but commas": ("0,05\n1,25\n", "row [1 us],1 [N]", [[0, 1e-6], [0.05, 1.25]]),
    "rate in k": ("Sample Rate,250 k\nForce (N)\n1\n2\n", "", [[0, 4e-6], [1, 2]]),
    "logger": ("logger\t\nZeit  1 - Standardmessrate\tKraft\ns\tkN\n0,001\t1,5\n0,002\t-2,25\n",
        "", [[1e-3, 2e-3], [1500, -2250]]),
    "thousands": ('time [us],force\n"1,000.5","1,250.25"\n"2,000","999.5"\n', "",
        [[1000.5e-6, 2e-3], [1250.25, 999.5]]),
    "german th": ("Zeit [us];Kraft\n1.000,5;1.250,25\n2000;999,5\n", "",
        [[1000.5e-6, 2e-3], [1250.25, 999.5]]),
    "upper": ("TIME (MS),FORCE (KN)\n0,1\n1,2\n", "", [[0, 1e-3], [1e3, 2e3]]),
    "lbf": ("Time (ms),Load (lbf)\n0,1\n1,2\n", "", [[0, 1e-3], [4.4482216152605, 8.896443230521]]),
    "ws head": ("Time (s)   Force (N)\n 0.0  1.0\n 1.0  2.0\n", "", [[0, 1], [1, 2]]),
    "tinc": ("CH1V, t0 =-5e-2s, tInc = 1e-6,\n0.5\n1.0\n", "1 [2 kN/V]",
        [[-0.05, -0.049999], [1000, 2000]]),
    "units above": ("Horizontal Units,ms,\nVertical Units,mV,mV\nTIME,CH1,CH2\n0,9,1\n1,9,2\n",
        "TIME,CH2 [2 kN/V]", [[0, 1e-3], [2, 4]]),
    "sensors below units": ("Zeit  1\tKraft\t\nKein Sensor\tS9\t\ns\tkN\t\n"
        "Nullwert: 0\tNullwert: 0,1\t\nAbtastrate: 1 Hz\tAbtastrate: 1 Hz\t\n0,001\t1,5\t\n"
        "0,002\t2,5\t\n", "", [[1e-3, 2e-3], [1500, 2500]]),
    "a start that is a clock time": ("Sample Rate (kHz),50\nStart Time,10:00:00\nForce (N)\n1\n"
        "2\n", "", [[0, 2e-5], [1, 2]]),
    "origin": ("Type:,RAW\nXInc:,4e-6\nXOrg:,-1e-4\nData:\n0.5\n1\n", "1 [2 kN/V]",
        [[-1e-4, -9.6e-5], [1000, 2000]]),
    "trace names": ('"TraceName","CH1","CH2"\n"VUnit","V","kN"\n"HResolution",4e-6,4e-6\n'
        '"HOffset",-1e-4,-1e-4\n"HUnit","s","s"\n\n,9,1\n,9,2\n', "row,CH2",
        [[-1e-4, -9.6e-5], [1e3, 2e3]]),
    "in": ("in s,CH1 in V\n0,1\n1,2\n", "1,CH1 [2 kN/V]", [[0, 1], [2e3, 4e3]]),
    "separator": ("sep=;\nt in ms;F in N\n0,5;1.250,5\n1;2\n", "", [[5e-4, 1e-3], [1250.5, 2]]),
    "two rates": ("t 1 [s];F [N];t 2 [s];T [°C]\n0;1;0;20\n1;2;;\n2;3;;\n3;4;;\n", "t 1,F",
        [[0, 1, 2, 3], [1, 2, 3, 4]]),
    "nines": ("time,force\n0,1\n1,99999\n2,3\n", "", [[0, 2], [1, 3]]),
    "few units": ("no,time,force,x\n,ms,kN\n1,0,1,9\n2,1,2,9\n", "", [[0, 1e-3], [1e3, 2e3]]),
    "every tenth row": ("Delta T,2e-6\nIndex,Force (N)\n0,1\n10,2\n", "", [[0, 2e-5], [1, 2]]),
    "an unreadable count": (
        "Sample Interval,2e-6\nIndex,Force (N)\n"
        + "".join(f"{'?' if n == 50 else n},{n}\n" for n in range(100)),
        "", [[2e-6 * n for n in range(100) if n != 50], [n for n in range(100) if n != 50]]),
    "meganewtons": ("time,force [MN]\n0,1\n1,2\n", "", [[0, 1], [1e6, 2e6]]),
    "missing at the end": (HUNDRED + "NaN,100\n", "", [[*range(1, 100)]] * 2),
    "cut at the end": (HUNDRED + "100\n", "", [[*range(1, 100)]] * 2),
    "overflow": ("time,force\n0,1\n1,9.9E+37\n2,3\n", "", [[0, 2], [1, 3]]),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "encoding"), [*zip(TABLES, cycle(["utf-8-sig", "cp1252", "utf-16", "utf-16-le"]))]
)
def test_tables_of_labs_and_scopes(tmp_path, name, encoding):
    text, chosen, expected = TABLES[name]
    file = tmp_path / "record.csv"
    file.write_bytes(text.encode(encoding))
    table = read_table(file, (TIME, FORCE, SIGMA), chosen)
    columns = np.array([*table.columns.values()])
    assert columns == pytest.approx(np.array(expected), rel=1e-6)
    left_out = ("nines", "overflow", "missing at the end", "cut at the end", "an unreadable count")
    assert [note.split()[0] for note in table.notes] == ["1"] * (name in left_out)


CURVE, LINE = "--curve bad.csv@40 --m-club 0.2", "--cor-speeds bad.csv"

#: Options, what is in bad.csv, and words of the error.
REFUSED = [
    (CURVE, "Time,CH1,CH2\n0,1,2\n", "its header is 'Time,CH1,CH2'", "--columns"),
    (CURVE, "x-axis,1\nsecond,Volt\n0,1\n", "its header is 'x-axis,1 / second,Volt'"),
    (CURVE, "time,force [V]\n0,1\n", "unit 'V' of force", "2 kN/V", "'time,force [V]'"),
    (CURVE, "time,force\n0,1\n\n1,oops\n2,3\n", "line 4, column 2 (force): 'oops'", "a number"),
    (CURVE, "time,force\n0,1\n1\n", "line 3, column 2 (force): ''"),
    (CURVE, "0,1,5\n1,2,5\n", "no header", "--columns"),
    (CURVE, "Drop test\n0;1\n1;2\n", "no column time", "no header of 2 columns"),
    (CURVE, "time,force [pC/N]\n0,1\n1,2\n", "the unit 'pC/N'"),
    (CURVE, "Index,Force\n0,5\n10,6\n20,7\n", "'Index' counts rows", "row [1.2 us]"),
    (CURVE, "time,force\n0,1\n1,2\n2,2\n3,2\n\n#2,x\ntime,force\n0,1\n", "line 8", "segment"),
    (CURVE, "time,force\n0,1\n1,2\ntime,force\n2,3\n3,4\n", "line 4", "save one segment"),
    (CURVE, "time\tforce\n0\t1,250\n1\t1,251\n", "'1,250' may be 1250 or 1.25: write"),
    (CURVE, "Sample Rate: 500,000 Hz\nForce\n1\n2\n", "may be 500000 or 500: write"),
    (CURVE, "time,force\n12:01:33.1,1\n12:01:33.2,2\n", "line 2", "a clock time"),
    (CURVE, "time,force\n" + "1,-\n" + "1,1\n" * 98, "line 2, column 2 (force): '-'"),
    (CURVE, "time,force\n0,1\n1,2\n0,1\n1,2\n", "line 4: time", "a further segment"),
    (CURVE, "time,force\n1 us,1\n1 ms,2\n", "line 3, column 1 (time): '1 ms'"),
    (f"{CURVE} --window 2:1", "time,force\n0,1\n1,2\n", "has rows from 0 to 1 s"),
    ("--shots bad.csv", "Club Speed,Ball Speed\n40,60\n45,66\n46,67\n", "m/s or mph"),
    ("--shots bad.csv", "Club Speed,Ball Speed\n-,150\n98,145\n101,151\n", "needs three shots"),
    (CURVE, "time,force,time\n0,1,2\n", "2 columns", "time"),
    (CURVE, "hello\nworld\n", "its header is 'world'", "expected time,force"),
    (CURVE, "", "no header"),
    (CURVE, f"time,force\n{'0' * 131_073},1\n", "a line has more than 131072 characters"),
    (LINE, "approach_speed,cor\n30,0.8\n\n40,0\n", "line 4: cor", "above 0"),
    (LINE, "approach_speed,cor\n30,0.8\n30,0.7\n", "two speeds"),
    (LINE, "approach_speed,cor\n30,0.8\n40,0.7\n", "sigma"),
    (LINE, "approach_speed,cor,sigma\n30,0.8,0.1\n40,0.7,0\n", "line 3: sigma = 0"),
    ("--measured cor=1", "", "cor = 1 is refused"),
    ("--measured cor=0.7 --measured contact_time=600", "", "600e-6 for 600 µs"),
    ("--measured cor=0.7 --measured max_force=6.6", "", "6600 for 6.6 kN"),
    ("--measured cor=0.7±0 --measured contact_time=6e-4", "", "sigma_cor = 0"),
    ("--measured max_force=6e3 --measured max_force=6e3", "", "max_force is given twice"),
    ("--measured spin=3", "", "no target 'spin'"),
    ("--measured cor", "", "write NAME=VALUE"),
    ("--measured ball_speed=50 --measured club_speed_after=24 --measured cor=0.74", "",
        "count once"),
    ("--measured cor=0.7 --measured contact_time=6e-4 --m-club 210", "", "0.21 for 210 g"),
    ("--fix m_club=1", "", "fix m_club is refused"),
    ("--fix k=8e5 --fix b=3 --measured cor=0.7 --measured contact_time=6e-4", "",
        "nothing is left"),
    ("--prior k=8e5", "", "without its σ"),
    ("--baseline sloped", "", "zero, constant, linear"),
    ("--curve bad.csv@40", "", "needs m_club"),
    (f"{CURVE} --prior club_speed=40±1", "", "of their own"),
]  # fmt: skip


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: case[2][:30])
def test_what_is_refused(tmp_path, case):
    options, text, *words = case
    (tmp_path / "bad.csv").write_text(text)
    words += ["bad.csv"] if text and "--window" not in options else []
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


def conditioned(*columns, window=None, **options):
    """The curve as it is fitted."""
    given = {"club_speed": 30.0, "m_club": 0.2, "m_ball": 0.05} | options
    return measurements(given, curve=columns, window=window).curves["curve"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, f: (t[:0], f[:0]), "it has no rows of time, force"),
        (lambda t, f: (t,), "it has no rows of time, force"),
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


def test_what_cor_alone_leaves_open(tmp_path):
    """Shots of a launch monitor: mishits are left out, k stays undetermined for all readers."""
    draw, speeds = np.random.default_rng(1), np.linspace(38.0, 52.0, 40)
    cors = PENNER["restitution_at_rest"] - PENNER["restitution_slope"] * speeds
    smash = (1.0 + cors + draw.normal(0.0, 0.004, 40)) / (1.0 + 0.04593 / 0.2)
    smash[[3, 9]] -= 0.12
    rows = [
        f"{n},{u / MPH:.1f},{u * s / MPH:.1f}" for n, (u, s) in enumerate(zip(speeds, smash), 1)
    ]
    text = "\n".join(["Shot,Club Speed,Ball Speed", ",[mph],[mph]", *rows, "Average,,101,147"])
    (tmp_path / "shots.csv").write_text(text)
    given = "--shots", "shots.csv", "--m-club", "200g", "--save", "m.toml", "--no-figures"
    done = golf_here("calibrate", *given, "--out", ".", cwd=tmp_path, code=0)
    words = " ".join(done.stdout.split())
    assert "of 40 shots are left out" in words
    assert "k is undetermined" in words
    ball = golf_impact.read_ball(tmp_path / "m.toml")
    assert (ball.undetermined, ball.conditions) == (("k",), {"m_club": 0.2})
    assert ball.speeds == pytest.approx((38.0, 52.0), abs=0.1)
    written = json.loads((tmp_path / "calibrate.json").read_text())["parameters"]
    for name, one in written.items():
        assert abs(one["value"] - PENNER[name]) < 4.0 * one["standard_error"]
    done = golf_here("run", "--ball", "m.toml", "--no-figures", cwd=tmp_path, code=0)
    rows = [row for row in done.stdout.splitlines() if "k undetermined" in row]
    assert {row.split("(")[0].strip("│ ") for row in rows[1:]} >= {"contact time", "max force"}
    table = golf_impact.sweep({"ball": f"{tmp_path}/m.toml,penner"}, ["smash_factor", "max_force"])
    assert np.isnan(table["max_force"]).tolist() == [True, False]
    assert not np.isnan(table["smash_factor"]).any()


@pytest.mark.parametrize("unit", [" [m/s]", ""])
def test_a_mishit_is_beside_the_line_of_the_others(tmp_path, unit):
    """COR falls by 0.058 from 30 to 50 m/s; a shot 0.04 below is left out and no other."""
    speeds = np.linspace(30.0, 50.0, 21)
    cors = 0.93 - 0.0029 * speeds
    cors[12] -= 0.04
    rows = [f"7i,{u},{u * (1.0 + cor) / 1.25}" for u, cor in zip(speeds, cors)]
    rows += ["7i,0,60", "Average,40,60"]
    file = tmp_path / "shots.csv"
    file.write_text("\n".join([f"Club,Club Speed [m/s],Ball Speed{unit}", *rows]))
    line = measurements({"m_club": 0.2, "m_ball": 0.05}, shots=file).cor_speeds
    assert line.x == pytest.approx(np.delete(speeds, 12))
    assert line.y == pytest.approx(np.delete(cors, 12))
    assert line.notes[0] == "1 unreadable rows left out, the first in line 23"
    assert "1 of 21 shots are left out" in line.notes[1]
    assert "(line 14)" in line.notes[1]


def test_a_rebound():
    """The first pulse counts if the force is zero between both; otherwise it has to be cut."""
    time, force = curve(300)
    first = conditioned(time, force)
    twice = 5e-6 * np.arange(600), np.concatenate([force, 0.6 * force])
    found = conditioned(*twice)
    assert "a second pulse from 0.00186" in found.notes[0]
    for one in (found, conditioned(*twice, window="0:1.6ms")):
        assert one.signal[one.contact].tolist() == first.signal[first.contact].tolist()
    close = np.concatenate([force[:220], 0.6 * force[105:]])
    with pytest.raises(UserError, match=r"two pulses.*--window 0:2ms"):
        conditioned(5e-6 * np.arange(len(close)), close)
