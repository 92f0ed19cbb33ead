"""The command line as such: help, options, what is refused, unusual folders, streams, signals."""

import contextlib
import json
import os
import random
import shlex
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from command import (
    COMMAND,
    checkout,
    golf,
    golf_here,
    golf_started,
    refused,
    run_python,
)

from golf_build import VERSION
from golf_build.archive import SUMS, unpack, write_archive
from golf_impact.commands.app import app


def names(folder):
    return {path.name for path in folder.iterdir()}


# Help, completion and options

COMMANDS = {one.name: one.callback for one in app.registered_commands}


def test_version_help_and_list(monkeypatch):
    """No summary of a command is cut, all help fits 80 columns, and arguments have no types."""
    monkeypatch.setenv("COLUMNS", "80")
    assert golf_here("--version").stdout == f"golf-impact {VERSION}\n"
    assert golf_here("list").stdout.count("finite_difference") == 1
    help_ = golf_here().stdout
    summaries = help_.partition("Commands:\n")[2].partition("\n\n")[0].splitlines()
    assert [line.split()[0] for line in summaries] == [*COMMANDS]
    for line in summaries:
        assert "..." not in line
        done = golf_here(line.split()[0], "-h", code=0)
        assert "Usage" in done.stdout
        assert " <" not in done.stdout
        assert max(map(len, done.stdout.splitlines())) <= 80


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("run sta", ["stability"]),
        ("run --ball roh", ["roh-lee", "roh-lee-tsuji", "roh-lee-linear"]),
        ("list --balls to", ["tour"]),
        ("explore --set club_s", ["club_speed="]),
        ("sweep --outputs force,im", ["force,impulse"]),
    ],
)
def test_completion(line, names):
    """As bash calls it."""
    words = f"golf-impact {line}"
    env = {"_GOLF_IMPACT_COMPLETE": "complete_bash", "COMP_WORDS": words}
    done = golf(env=env | {"COMP_CWORD": str(words.count(" "))}, code=0)
    assert done.stdout.split() == names


# What is refused: command line and words of the error, in a folder with these

#: Files that a command writes, which are a pipe or a device.
WRITTEN = {
    "run laws --out {}": "results.json",
    "run --set k=1e6 --out {}": "k=1000000_report.html",
    "bench --quick --out {}": "bench.json",
    "stress --quick --out {}": "stress.json",
    "calibrate --measured cor=0.7 --measured contact_time=6e-4 --out {}": "calibrate.png",
    "sweep --set k=1e6 --no-figures --out {}/z.csv": "z.csv",
    "sweep --set k=1e6:2e6:3 --out {}/x.csv": "x.png",
    "sweep --set k=normal:1e6:1 --set b=normal:9:1 --samples 2 --out {}/y.csv": "y.json",
    "build --out {}/x.fmu": "x.fmu",
    "explore --no-browser --export {}/x.html": "x.html",
}

REFUSED = {
    "nothing": "nothing",
    # As from an unset variable of the shell.
    "run ''": "an argument is empty",
    "run laws --fmu=": "an argument is empty",
    "run baselin": "did you mean baseline?",
    "run :100:": ":100:",
    "run --set stiffness=1": "'stiffness': choose from k, b, club_speed",
    "run --set k=hard": "'hard' is not a number",
    "run --set gap=0,2": "write 0.2",
    "run --set k": "NAME=VALUE",
    "run --set b=9 --set gap=-1e-3": "gap = -0.001 m is refused: it must be between 0 and 1e+06",
    "run --set law=relative": "law=relative is refused: law is 1 (absolute) or 2 (relative)",
    "run --set law=4294967298": "law = 4294967298.0 is refused: it must be a whole number",
    "run --set exponent=1.5": "exponent = 1.5 is refused with law = 1",
    "run --set restitution_at_rest=0.9": "law = 1",
    "run --set k=1 --set k=2": "k is given twice",
    "run --set k=770lb": "--set k=770lb is refused: 'lb' isn't a unit it may have: N/m, kN/m, N/mm",
    "run --set loft=10.5": "--set loft=10.5 is refused: ClubBallImpact moves along",
    "run --set m_club=5m": "'m' isn't a unit it may have: kg",
    "run --ball cannon": "choose from document, ",
    "run --ball none.toml": "can't read none.toml",
    "run --ball 40.toml --ball 45.toml": "club_speed = 40 and 45: give --set club_speed=…",
    "run --fmu none.fmu": "there is no FMU file at none.fmu: run `golf-impact build`",
    "run none.py": "there is no script none.py",
    "build --fmi 4": "--fmi 4 is refused: it must be 2 or 3",
    "build --fmi 3 --system": "--system is refused with --fmi 3",
    "build --out x.zip": "x.zip is refused: the file's name must end in .fmu",
    "list --ball": "--ball",
    "bench --seed 1": "bench --help",
    "stress --seed abc": "--seed",
    "explore --no-browser --set k=-1": "k = -1 N",
    "explore --export x.txt": "--export x.txt is refused: its name must end in .html",
    "explore --no-browser --ball cannon": "choose from document, ",
    "calibrate --core 0.7": "calibrate --help",
    "sweep --set k=1e6": "--out FILE.csv",
    "sweep --out x.csv": "nothing is swept",
    "sweep --out . --set k=1e6": "its name must end in .csv or .parquet",
    "sweep --out x.csv --workers 2": "No such option: --workers",
    "sweep --out x.csv --set k=1e6 --fmu x.fmu --scheduler tcp://x": "leave out --fmu",
    "sweep --out x.csv --set k=2e6:1e6:5": "the range begins at 2e+06, above its end 1e+06",
    "sweep --out x.csv --set k=log:0:1e6:5": "a logarithmic range begins above 0",
    "sweep --out x.csv --set k=1:2:0": "the count 0 isn't 1 to 10,000,000",
    "sweep --out x.csv --set k=1:2:1.5": "the count 1.5 isn't 1 to 10,000,000",
    "sweep --out x.csv --set k=1:2": "2 numbers are given, LO:HI:COUNT needs 3; write VALUE",
    "sweep --out x.csv --set k=normal:1:2:3": "3 numbers are given, normal:MEAN:SIGMA needs 2",
    "sweep --out /proc/a.csv --set k=1e6": "can't write /proc/a.csv",
    "sweep --out x.csv --set k=1,inf": "finite",
    "sweep --out x.csv --set k=norm:1:2": "there is no distribution 'norm'; write VALUE",
    "sweep --out x.csv --set k=500:2000lb:4": "'lb' isn't a unit it may have: N/m, kN/m, N/mm",
    "sweep --out x.csv --set k=normal:1:0 --samples 1": "the standard deviation 0 must be > 0",
    "sweep --out x.csv --set law=1,-4294967295": "1 (absolute) or 2",
    "sweep --out x.csv --set law=1.5": "law=1.5 is refused: law is 1",
    "sweep --out x.csv --set law=normal:1:1 --samples 1": "law is 1",
    "sweep --out x.csv --set ball=golf": "choose from",
    "sweep --out x.csv --set stiffness=1": "'stiffness': choose from k, b, club_speed",
    "sweep --out x.csv --set k=normal:1e6:1": "a distribution needs a number of samples",
    "sweep --out x.csv --set k=normal:1e6:1 --samples 0": "it must be at least 1",
    "sweep --out x.csv --set k=1 --samples 5": "there is no distribution to sample",
    "sweep --out x.csv --set k=1 --method halton": "it is random, lhs, sobol",
    "sweep --out x.csv --set k=1 --seed -1": "seed = -1",
    "sweep --out x.csv --set k=1 --outputs force,force": "twice",
    "sweep --out x.csv --set k=1 --outputs k": "no output 'k'",
    "sweep --out x.csv --set k=1:2:100000 --set b=1:2:100000": "10,000,000,000 cases are refused",
    # What stands in place of a folder or a file; noticed before the FMU is checked.
    "run --ball 40.toml --ball reports/../40.toml": "two balls have the same name",
    "run --fmu none.fmu --out file": "file is not a folder; choose another one",
    "run --fmu none.fmu --out file/below": "file is not a folder; choose another one",
    "run laws --fmu none.fmu --out reports": "reports/report.html",
    "run laws --fmu none.fmu --out link": "can't write link",
    "run laws --fmu none.fmu --out link/below": "can't write link",
    "run laws --fmu none.fmu --out /proc/golf": "can't write /proc/golf",
    "run laws --fmu .": "there is no FMU file at .",
    "run laws --fmu pipe/x.fmu": "there is no FMU file at pipe/x.fmu",
    "run laws --fmu file/below.fmu": "there is no FMU file at file/below.fmu",
    f"run laws --fmu {'x' * 300}": "there is no FMU file at xxx",
    "build --out file/below/x.fmu": "can't write file/below/x.fmu",
    "build --out folder.fmu": "can't write folder.fmu",
    "sweep --set k=1e6 --out folder.csv": "can't write folder.csv: it is a folder",
    **{
        line.format(kind): f"can't write {kind}/{name}: it is a device or a pipe"
        for kind in ("pipe", "device")
        for line, name in WRITTEN.items()
    },
}


def prepare(folder):
    (folder / "file").write_text("mine")
    for speed in (40, 45):
        ball = f"k = 1e6\n[conditions]\nclub_speed = {speed}\n"
        (folder / f"{speed}.toml").write_text(ball)
    for name in ("folder.csv", "folder.fmu", "reports/report.html", "pipe", "device"):
        (folder / name).mkdir(parents=True)
    (folder / "link").symlink_to("nowhere")
    for name in WRITTEN.values():
        os.mkfifo(folder / "pipe" / name)
    with contextlib.suppress(OSError):  # with root's rights alone
        os.mknod(folder / "null", 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        for name in WRITTEN.values():
            # As root it could be replaced.
            (folder / "device" / name).symlink_to("../null")


def contents(folder):
    """Kind, size and time of all that is in a folder."""
    found = {path: path.lstat() for path in folder.rglob("*") if path.name != "__pycache__"}
    return {path: (one.st_mode, one.st_size, one.st_mtime_ns) for path, one in found.items()}


def check_refused(folder, line, *words):
    """Assert exit code 2, one line with these words, and that nothing is written."""
    before = contents(folder)
    refused(golf_here(*shlex.split(line), cwd=folder), *words)
    after = contents(folder)
    # The times of folders change with a temporary file.
    assert {p: s[:2] for p, s in after.items()} == {p: s[:2] for p, s in before.items()}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX's pipes and links")
@pytest.mark.parametrize("line", REFUSED)
def test_a_command_that_is_refused(tmp_path, line):
    prepare(tmp_path)
    if "device" in line and not (tmp_path / "null").exists():
        pytest.skip("devices can't be made here")
    check_refused(tmp_path, line, REFUSED[line])


# Files that are refused

UNCERTAIN = 'k = 8e5\nb = 30\n[uncertainty]\nparameters = ["k"]\n'
NAMED = "k = 8e5\n[uncertainty]\ncovariance = [[1]]\nparameters = "

#: Balls; each has words of its error.
BALLS = {
    "": "is not a ball",
    "title = 'x'": "is not a ball",
    "k = ": "not a TOML",
    # On both sides of the border of a number and a unit.
    "law = 2\nk = 800 N/mm  # soft": 'a value with its unit needs quotes: k = "800 N/mm"',
    "m_ball = 45.93g": 'quotes: m_ball = "45.93g"',
    "k = 1.5e6kN/m\nb = 9": 'quotes: k = "1.5e6kN/m"',
    "k = 'stiff'": "k = 'stiff' is refused",
    "k = '8e5 N'": "'N' isn't a unit it may have: N/m, kN/m, N/mm",
    "k = true": "k = True is refused",
    "k = nan": "finite",
    "k = 1e6\nstiffness = 3": "a ball has no stiffness",
    "k = 1e6\nuncertainty = 3": "needs parameters",
    "k = 1e6\nconditions = 3": "conditions takes club_speed, m_club",
    "k = 1e6\n[conditions]\nball_speed = 3": "conditions takes club_speed, m_club",
    "k = 1e6\nspeeds = [30, 20]": "two, in m/s, rising",
    "k = 1e6\nspeeds = ['slow', 30]": "two, in m/s, rising",
    UNCERTAIN: "and covariance",
    UNCERTAIN + "covariance = [[1, 2]]": "p rows of p",
    UNCERTAIN + "covariance = [['x']]": "finite numbers",
    UNCERTAIN.replace('k"', 'k", "b"') + "covariance = [[1, nan], [nan, 1]]": "finite numbers",
    UNCERTAIN + "covariance = [[-1]]": "below 0",
    NAMED + '["b"]': "names of values",
    NAMED + '[["k"]]': "names of values",
}

RUN = "def run(impact):\n    "
RETURN = "from golf_impact.scenario import Result\n" + RUN + "return Result('mine', "

#: Scripts that are no scenarios.
SCRIPTS = {
    "def run(": "mine.py, line 1 can't be run: SyntaxError",
    "import numpy\n\nnumpy.nothing": "mine.py, line 3 can't be run: AttributeError",
    "run = 1": "mine.py is not a scenario: it needs a function run(impact)",
    "def run(fmu): pass": "mine.py is not a scenario: it needs a function run(impact)",
    RUN + "pass": "mine.py: run(impact) returns None; it must return its Result",
    RUN + "return 1 / 0": "line 2 can't be run: ZeroDivisionError",
    RUN + "impact(k=-1.0)": "line 2: k = -1.0",
    RUN + "impact()['cor']": "smash_factor, coefficient_of_restitution",
    RUN + "impact(['cor'])": "no Real output 'cor'",
    "def f():\n    1 / 0\n" + RUN + "f()": "line 2 can't be run: ZeroDivisionError",
    RUN + "raise SystemExit(3)": "line 2 can't be run: SystemExit: 3",
    RETURN + "tables=[('x', ['y'])])": "mine.py: tables[0] has 2 parts",
    RETURN + "tables=[('x', ['y'], [['z', 'z']])])": "tables[0]: ['z', 'z'] has 2 cells",
    RETURN + "tables=[('x', ['y'], [[1.5]])])": "tables[0]: 1.5 is not a text",
    RETURN + "{1.5: {}})": "cases[1.5] = {}",
    RETURN + "{'x': 3})": "cases['x'] = 3",
    RETURN + "figures={'x': 3})": "figures['x'] = 3 is not a figure",
    RETURN + "trajectories={'../x': 3})": "'../x' can't be the name of a file",
    RETURN + "claims={'x': 'y'})": "claims['x'] = 'y' is not True or False",
}

FILES = [
    *(("run --ball mine.toml --out out", *row) for row in BALLS.items()),
    *(("run mine.py --out out", *row) for row in SCRIPTS.items()),
]


@pytest.mark.parametrize(("line", "text", "words"), FILES)
def test_a_file_that_is_refused(tmp_path, line, text, words):
    name = next(word for word in line.split() if word.startswith("mine"))
    (tmp_path / name).write_text(text)
    check_refused(tmp_path, line, name, words)


def without(*ends):
    """A damage: some files are missing."""
    return lambda files: {name: data for name, data in files.items() if not name.endswith(ends)}


def described(old, new, *others):
    """A damage of the description, with or without the list of files."""

    def described(files):
        text = files["modelDescription.xml"].decode()
        assert old in text
        return without(*others)(files) | {"modelDescription.xml": text.replace(old, new).encode()}

    return described


#: Another content of the file, from its files by name; words of the error.
DAMAGES = {
    "a text": (lambda files: b"<text/>", "x.fmu is not a readable FMU"),
    "empty": (lambda files: {}, "modelDescription.xml is missing"),
    "another GUID": (described('guid="', 'guid="1'), "changed since it was built"),
    "a file more": (lambda files: files | {"../../outside": b""}, "changed since it was built"),
    "half a description": (described("</fmiModelDescription>", "", SUMS), "not a readable FMU"),
    "FMI 7.0": (described('fmiVersion="2.0"', 'fmiVersion="7.0"', SUMS), "not a readable FMU"),
    "another FMU": (
        described('"smash_factor"', '"smash"', SUMS),
        "another FMU (ClubBallImpact): it",
    ),
    "other machines": (without(".so", SUMS), "x.fmu has no binary for this machine"),
    "an SSP": (lambda files: {"SystemStructure.ssd": b""}, "x.fmu is an SSP, not an FMU"),
    # pythonfmu's library would crash the process.
    "without a module": (without("/impact.py", SUMS), "x.fmu can't be run here"),
}


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """A temporary folder of this test."""
    (folder := tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_or_foreign_fmu(tmp_path, temporary, fmu_path, damage):
    change, words = DAMAGES[damage]
    made = change(unpack(fmu_path))
    if isinstance(made, bytes):
        (tmp_path / "x.fmu").write_bytes(made)
    else:
        write_archive(tmp_path / "x.fmu", made)
    check_refused(tmp_path, "run laws --fmu x.fmu --out out", words)


def test_a_truncated_fmu_and_one_of_fmi_3(tmp_path, fmu_path, native_fmi3_path):
    data, path = fmu_path.read_bytes(), tmp_path / "x.fmu"
    for end in range(0, len(data), len(data) // 20):
        path.write_bytes(data[:end])
        check_refused(tmp_path, "run laws --fmu x.fmu", "not a readable FMU", "golf-impact build")
    shutil.copy(native_fmi3_path, path)
    check_refused(tmp_path, "run laws --fmu x.fmu", "not an FMI 2.0 co-simulation FMU")


def test_names_that_lead_out_of_the_folder(tmp_path, fmu_path, temporary):
    """Without a list of files they are extracted inside the folder, and the FMU is run.

    Modules in the working folder are not imported in place of the package's.
    """
    for name in ("golf_impact", "fmpy", "numpy"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError")
    made = without(SUMS)(unpack(fmu_path)) | {"../../outside.txt": b"here"}
    write_archive(tmp_path / "x.fmu", made)
    golf_here("run", "laws", "--no-figures", "--fmu", "x.fmu", "--out", "o", cwd=tmp_path, code=0)
    assert not list(tmp_path.rglob("outside.txt"))
    assert names(temporary) == set()


# Folders

ODD = "ü # 100% (ß) & 'x'"
MODULE = (sys.executable, "-m", "golf_impact")


@pytest.mark.parametrize("line", ["run laws", "build --out x.fmu"])
def test_an_unusual_name_of_the_temporary_folder(tmp_path, monkeypatch, line):
    """pythonfmu would crash the process."""
    (tmp_path / ODD).mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / ODD))
    check_refused(tmp_path, line, "set TMPDIR")


@pytest.mark.ci
def test_unusual_names_of_all_other_folders(tmp_path):
    """The checkout, the working folder and --out."""
    folder = tmp_path / ODD
    env = checkout(folder / "checkout")
    for arguments in (
        ("run", "laws", "system", "--out", f"out {ODD}"),
        ("build", "--out", folder / "x.fmu"),
        ("run", "laws", "--fmu", folder / "x.fmu", "--out", "out"),
    ):
        golf(*arguments, cwd=folder, env=env, program=MODULE, code=0)
    assert "system_flight.png" in names(folder / f"out {ODD}")
    built = folder / "checkout" / "build" / "ClubBallImpact.fmu"
    assert (folder / "x.fmu").read_bytes() == built.read_bytes()


def test_links_remain(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "results.json").symlink_to(tmp_path / "mine.json")
    golf_here("run", "laws", "--no-figures", "--out", "out", cwd=tmp_path, code=0)
    assert (tmp_path / "out" / "results.json").is_symlink()
    assert "laws" in json.loads((tmp_path / "mine.json").read_text())


@pytest.mark.parametrize("writable", [True, False])
def test_the_cache_of_an_installed_copy(tmp_path, monkeypatch, writable):
    """It keeps the FMU there; the error says what to do instead."""
    monkeypatch.setattr("golf_impact.fmu.current._CHECKOUT", tmp_path)
    monkeypatch.setattr("platformdirs.user_cache_path", lambda *_: tmp_path / "cache" / "below")
    if writable:
        for message in ("it was missing", ""):
            done = golf_here("run", "laws", "--no-figures", "--out", "out", cwd=tmp_path, code=0)
            assert message in done.stderr
            assert bool(done.stderr) == bool(message)
        assert len(list((tmp_path / "cache").rglob("ClubBallImpact.fmu"))) == 1
    else:
        # Even root can't make a folder in place of a file.
        (tmp_path / "cache").write_text("")
        check_refused(tmp_path, "run laws", "can't write", "golf-impact build --out FILE")


@pytest.mark.ci
def test_a_full_disk(tmp_path):
    """An error in one line, and no part of a file left."""
    (tmp_path / "small").mkdir()
    after = 'code=$?; find small -mindepth 1 >&2; exit "$code"'
    script = f'mount -t tmpfs -o size="$0" none small && {{ "$@"; {after}; }}'

    def small(size, *arguments, program=COMMAND, **options):
        """Run the command with a file system of this size at tmp_path/small."""
        words = ("unshare", "-m", "sh", "-c", script, size, program)
        return golf(*arguments, cwd=tmp_path, program=words, **options)

    if not shutil.which("unshare") or small("4k", program="true").returncode:
        pytest.skip("file systems can't be mounted here")
    full, env = "No space left on device", {"TMPDIR": str(tmp_path / "small")}
    refused(small("16k", "run", "--set", "k=1e6", "--out", "small"), "can't write small", full)
    refused(small("256k", "build", "--out", "small/x.fmu"), "small/x.fmu", full)
    refused(small("256k", "run", "laws", "--out", "out", env=env), full, "set TMPDIR")
    refused(small("256k", "build", "--out", "x.fmu", env=env), full)
    assert names(tmp_path) == {"small"}


# Streams and environments


@pytest.mark.ci
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize(
    ("end", "code", "words"),
    [(">/dev/full", 2, "No space left on device"), (">&-", 0, ""), ("| head -n 1", 0, "")],
)
def test_standard_output_that_is_full_or_closed(tmp_path, end, code, words):
    line = f'"{COMMAND}" run laws --out out {end}'
    done = subprocess.run(["sh", "-c", line], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == code
    assert words in done.stderr
    assert len(done.stderr.splitlines()) == bool(words)


@pytest.mark.ci
@pytest.mark.parametrize("env", [{"MPLBACKEND": "nonsense"}, {"PYTHONIOENCODING": "ascii"}])
def test_environments(tmp_path, env):
    """A backend that matplotlib doesn't have; a terminal without Greek letters."""
    done = golf("run", "laws", "--out", tmp_path, env=env)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "laws.png").is_file()


def test_a_case_without_figures_needs_no_matplotlib(tmp_path, fmu_path):
    program = (
        "import sys; from golf_impact.commands import app\n"
        "assert app.one_line(sys.argv[1:]) == 0\n"
        "assert 'matplotlib' not in sys.modules"
    )
    options = "--set", "k=1e6", "--fmu", fmu_path, "--out", tmp_path, "--no-figures"
    assert "54.745" in run_python(program, "run", *options).stdout
    assert names(tmp_path) == {
        f"k=1000000_{end}" for end in ("results.json", "trajectory.csv", "report.html")
    }


# Signals: exit code 130 and one line, files are whole

STOPPED = "Stopped; nothing half-written is left."
posix = pytest.mark.skipif(sys.platform == "win32", reason="POSIX's signals")


@posix
@pytest.mark.parametrize("times", [2, pytest.param(200, marks=pytest.mark.nightly)])
def test_a_run_stopped_at_any_moment(tmp_path, times):
    """Each of its files is whole, of this run or of an earlier one."""
    rng, codes = random.Random(1), []
    for n in range(times):
        k = 5e5 + 1e3 * n
        process = golf_started("run", "--set", f"k={k}", "--out", tmp_path)
        # Python itself has started then.
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(rng.uniform(0.15, 1.2))
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        codes.append(process.returncode)
        assert process.returncode in (130, 0), errors
        assert (STOPPED in errors) == (process.returncode == 130), errors
        assert "Traceback" not in errors
        ends = {".html": b"</html>\n", ".png": b"IEND\xaeB`\x82", ".csv": b"\n", ".json": b"}\n"}
        for file in tmp_path.iterdir():
            assert file.read_bytes().endswith(ends[file.suffix])
    assert 130 in codes


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ("run --set k=1e6 --no-figures --out .", "os.replace"),
        ("sweep --set k=1e6 --out x.csv", "golf_impact.studies.sweep.sweep.run_impacts"),
        ("sweep --set k=1e6 --out x.parquet", "golf_impact.studies.sweep.sweep.run_impacts"),
        ("build --out x.fmu", "os.replace"),
    ],
)
def test_an_interrupted_command_leaves_the_earlier_files(tmp_path, monkeypatch, line, place):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    for name in ("k=1000000_results.json", "x.csv", "x.parquet", "x.fmu"):
        (tmp_path / name).write_text("earlier")
    before = contents(tmp_path)
    monkeypatch.setattr(place, interrupt)
    assert golf_here(*line.split(), cwd=tmp_path, code=130).stderr == f"{STOPPED}\n"
    after = contents(tmp_path)
    assert {p: after.get(p) for p in before} == before
    assert not [path for path in after if path.name.startswith(".") or path.suffix == ".part"]


@posix
def test_a_signal_inside_the_fmu():
    """The exception is raised in the host: pythonfmu would make it fatal, and the process crash."""
    code = """
import os, signal, sys
from golf_impact import Impact
with Impact() as impact:
    impact.start()
    *_, name = (name for name in sys.modules if name.endswith(".component.component"))
    def interrupt(frame, event, argument):
        if event == "call" and frame.f_globals.get("__name__") == name:
            sys.setprofile(None)
            os.kill(os.getpid(), signal.SIGINT)
    sys.setprofile(interrupt)
    try:
        for _ in range(10_000):
            impact()
    except KeyboardInterrupt:
        print("interrupted", impact()["smash_factor"])
"""
    done = run_python(
        code, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler)
    )
    assert done.stdout == "interrupted 1.5641431548673965\n"
