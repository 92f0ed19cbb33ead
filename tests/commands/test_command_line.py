"""The command line as such: help, files in the way, damaged FMUs, folders, streams, signals.

What it prints and refuses is in transcripts/.
"""

import os
import random
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from command import (
    COMMAND,
    check_refused,
    checkout,
    contents,
    golf,
    golf_here,
    interruptible,
    refused,
    run_python,
)
from conftest import repeated

from golf_build.archive import SUMS, unpack, write_archive
from golf_impact.commands.app import app
from golf_impact.fmu import current_fmu

posix = pytest.mark.skipif(sys.platform == "win32", reason="POSIX's pipes and signals")


def names(folder):
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("command", [one.callback.__module__ for one in app.registered_commands])
def test_help(monkeypatch, command):
    """It fits 80 columns, and arguments have no types."""
    monkeypatch.setenv("COLUMNS", "80")
    text = golf_here(command.rpartition(".")[2], "-h", code=0).stdout
    assert " <" not in text
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize(("screen", "works"), [("", True), (":0", True), (":0", False)])
def test_explore_opens_its_page(tmp_path, monkeypatch, screen, works):
    opened = []
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("DISPLAY", screen)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or works)
    done = golf_here("explore", cwd=tmp_path, code=0)
    page = tmp_path / "golf-impact-results" / "explore.html"
    assert opened == [page.as_uri()] * bool(screen)
    assert done.stdout == f"{page}\n"
    assert ("No browser can be opened" in done.stderr) == (not opened or not works)


# Files in the way

#: A file that each command writes.
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


@posix
@pytest.mark.parametrize("line", WRITTEN)
def test_what_is_no_plain_file_is_kept(tmp_path, line):
    """It is noticed before anything is computed."""
    kinds = {"pipe": os.mkfifo, "folder": os.mkdir}
    if os.geteuid() == 0:
        os.mknod(tmp_path / "null", 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        kinds["device"] = lambda path: path.symlink_to("../null")
    for kind, make in kinds.items():
        (tmp_path / kind).mkdir()
        make(tmp_path / kind / WRITTEN[line])
        words = "folder" if kind == "folder" else "device or a pipe"
        path = f"{kind}/{WRITTEN[line]}"
        check_refused(tmp_path, line.format(kind), f"can't write {path}: it is a {words}")


# FMUs that are damaged or others

BINARIES = SUMS, ".so", ".dll"

#: A text of the description and another one; ends of names of files that are missing; more files;
#: words.
DAMAGES = {
    "another GUID": ('guid="', 'guid="1', (), {}, "changed since it was built"),
    "one file more": ("", "", (), {"../../outside.txt": b"here"}, "changed since it was built"),
    "half a description": ("</fmiModelDescription>", "", SUMS, {}, "not a readable FMU"),
    "FMI 7.0": ('fmiVersion="2.0"', 'fmiVersion="7.0"', SUMS, {}, "not a readable FMU"),
    "none of its files": ("", "", "", {"other.txt": b""}, "modelDescription.xml is missing"),
    "an SSP": ("", "", "", {"SystemStructure.ssd": b""}, "is an SSP, not an FMU"),
    "another FMU": ('"smash_factor"', '"smash"', SUMS, {}, "another FMU (ClubBallImpact)"),
    "no binary": ("", "", BINARIES, {}, "has no binary for this machine"),
    "another machine": ("", "", BINARIES, {"binaries/riscv64/x.so": b""}, "for riscv64:"),
    # pythonfmu's library would crash the process.
    "without a module": ("", "", (SUMS, "/impact.py"), {}, "x.fmu can't be run here"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_or_foreign_fmu(tmp_path, fmu_path, damage):
    old, new, missing, more, words = DAMAGES[damage]
    files, description = unpack(fmu_path), "modelDescription.xml"
    assert old.encode() in files[description]
    files[description] = files[description].replace(old.encode(), new.encode())
    kept = {name: files[name] for name in files if not name.endswith(missing)}
    write_archive(tmp_path / "x.fmu", kept | more)
    check_refused(tmp_path, "run laws --fmu x.fmu --out out", words)


def test_a_cut_fmu_and_another_kind(tmp_path, fmu_path, native_fmi3_path):
    data, path = fmu_path.read_bytes(), tmp_path / "x.fmu"
    for end in range(0, len(data), len(data) // 6):
        path.write_bytes(data[:end])
        check_refused(tmp_path, "run laws --fmu x.fmu", "not a readable FMU", "golf-impact build")
    shutil.copy(native_fmi3_path, path)
    check_refused(tmp_path, "run laws --fmu x.fmu", "not an FMI 2.0 co-simulation FMU")


def test_names_that_lead_out_of_the_folder(tmp_path, fmu_path, monkeypatch):
    """Without a list of files they are extracted inside the folder, and the FMU is run.

    Modules in the working folder are not imported in place of the package's.
    """
    (temporary := tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    for name in ("golf_impact", "fmpy", "numpy"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError")
    made = unpack(fmu_path) | {"../../outside.txt": b"here"}
    del made[SUMS]
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


def test_the_cache_of_an_installed_copy(tmp_path, monkeypatch, capsys):
    """It keeps the FMU there; the error says what to do instead."""
    monkeypatch.setattr("golf_impact.fmu.current.CHECKOUT", None)
    monkeypatch.setattr("platformdirs.user_cache_path", lambda *_: tmp_path / "cache" / "below")
    # Even root can't make a folder in place of a file.
    (tmp_path / "cache").write_text("")
    check_refused(tmp_path, "run laws", "can't write", "golf-impact build --out FILE")
    (tmp_path / "cache").unlink()
    done = golf_here("run", "--set", "k=1e6", "--no-figures", cwd=tmp_path, code=0)
    assert done.stderr.endswith(": it was missing.\n")
    assert [*(tmp_path / "cache").rglob("*.fmu")] == [current_fmu()]
    assert capsys.readouterr().err == ""


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
    assert golf("run", "laws", "--out", tmp_path, env=env, code=0).stderr == ""
    assert (tmp_path / "laws.png").is_file()


def test_a_case_without_figures_needs_no_matplotlib(tmp_path, fmu_path):
    program = (
        "import sys; from golf_impact.commands import app\n"
        "assert app.one_line(sys.argv[1:]) == 0\n"
        "assert 'matplotlib' not in sys.modules"
    )
    options = "--set", "k=1e6", "--fmu", fmu_path, "--out", tmp_path, "--no-figures"
    assert "54.745" in run_python(program, "run", *options).stdout


# Signals: exit code 130 and one line, files are whole

STOPPED = "Stopped; nothing half-written is left."


@posix
@pytest.mark.parametrize("times", repeated(1, 3, 200))
def test_a_run_stopped_while_it_writes(tmp_path, times):
    """Each of its files is whole, of this run or of an earlier one."""
    rng, codes = random.Random(1), []
    for n in range(times):
        there = names(tmp_path)
        command = COMMAND, "run", "--set", f"k={5e5 + 1e3 * n}", "--out", tmp_path
        process = subprocess.Popen(
            command, stderr=subprocess.PIPE, text=True, preexec_fn=interruptible
        )
        while names(tmp_path) == there and process.poll() is None:
            time.sleep(1e-3)
        time.sleep(rng.uniform(0.0, 0.4) if n else 0.0)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        codes.append(process.returncode)
        assert (process.returncode, errors) in ((130, f"{STOPPED}\n"), (0, ""))
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
    done = run_python(code, preexec_fn=interruptible)
    assert done.stdout == "interrupted 1.5641431548673965\n"
