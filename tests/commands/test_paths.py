"""Folders that are full, missing, not to be written or have unusual names, and concurrent runs."""

import json
import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from command import COMMAND, checkout, golf, golf_here, refused, run_python

ODD = "ü # 100% (ß) & 'x'"


def names(folder):
    return {path.name for path in folder.iterdir()}


def installed(folder):
    """The same with the layout of a wheel."""
    checkout(folder / "checkout")
    for package in ("scenarios/golf_impact", "build/golf_build", "fmu_src/golf_physics"):
        (folder / "checkout" / package).rename(folder / Path(package).name)
    (folder / "checkout" / "LICENSE").rename(folder / "golf_build" / "LICENSE")
    (folder / "checkout" / "fmu_src").rename(folder / "golf_build" / "adapters")
    (folder / "checkout" / "scenarios").rename(folder / "golf_impact" / "scripts")
    shutil.rmtree(folder / "checkout")
    return {"PYTHONPATH": str(folder)}


MODULE = (sys.executable, "-m", "golf_impact")


def test_a_cache_that_cannot_be_written(tmp_path):
    """An installed copy keeps the FMU in the user's cache; the error says what to do instead."""
    # With no right to make one, even for root: a file stands where the cache would be.
    (tmp_path / "blocked").write_text("")
    start = (
        "import os, platformdirs, pathlib; from golf_impact.__main__ import main\n"
        "platformdirs.user_cache_path = lambda *_: pathlib.Path(os.environ['CACHE'])\n"
        "main()"
    )
    env = {**os.environ, **installed(tmp_path / "site")}
    env["CACHE"] = str(tmp_path / "blocked/golf-impact")
    (cwd := tmp_path / "cwd").mkdir()
    done = run_python(start, "run", "laws", "--out", "out", cwd=cwd, env=env, code=2)
    refused(done, "can't write", "golf-impact build --out FILE")
    assert names(cwd) == set()


@pytest.mark.ci
def test_the_cache_of_an_installed_copy(tmp_path):
    cache = dict.fromkeys(("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA"), str(tmp_path / "cache"))
    env = installed(tmp_path / "site") | cache
    for message in ("it was missing", ""):
        done = golf("run", "laws", "--out", "out", cwd=tmp_path, env=env, program=MODULE, code=0)
        assert message in done.stderr
        assert bool(done.stderr) == bool(message)
    assert len(list((tmp_path / "cache").rglob("ClubBallImpact.fmu"))) == 1


# Names


@pytest.mark.ci
def test_unusual_names_of_all_folders_but_the_temporary_one(tmp_path):
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


@pytest.mark.parametrize("command", [("run", "laws"), ("build", "--out", "x.fmu")])
def test_an_unusual_name_of_the_temporary_folder(tmp_path, command):
    """pythonfmu would crash the process."""
    odd = tmp_path / ODD
    odd.mkdir()
    done = golf(*command, cwd=tmp_path, env={"TMPDIR": str(odd)})
    refused(done, "set TMPDIR")
    assert names(tmp_path) == {ODD}
    assert names(odd) == set()


def test_files_in_place_of_folders_and_vice_versa(tmp_path):
    file = tmp_path / "file"
    file.write_text("mine")
    for out in (file, file / "below"):
        refused(golf_here("run", "laws", "--out", out, cwd=tmp_path), "is no folder; choose")
    refused(golf_here("build", "--out", file / "below" / "x.fmu"), "x.fmu")
    refused(golf_here("build", "--out", tmp_path), "folder")
    assert file.read_text() == "mine"
    (tmp_path / "out" / "report.html").mkdir(parents=True)
    refused(golf_here("run", "laws", "--out", "out", cwd=tmp_path), "report.html", "folder")
    assert names(tmp_path / "out") == {"report.html"}


def test_links_remain(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "results.json").symlink_to(tmp_path / "mine.json")
    golf_here("run", "laws", "--out", "out", cwd=tmp_path, code=0)
    assert (tmp_path / "out" / "results.json").is_symlink()
    assert "laws" in json.loads((tmp_path / "mine.json").read_text())


COMMANDS_THAT_WRITE = {
    "run": ("run", "laws", "--out", ".", "results.json"),
    "bench": ("bench", "--quick", "--out", ".", "bench.json"),
    "stress": ("stress", "--quick", "--out", ".", "stress.json"),
    "calibrate": ("calibrate", "--cor", 0.7, "--contact-time", 6e-4, "--out", ".", "calibrate.png"),
    "sweep": ("sweep", "--set", "k=1e6", "--out", "x.csv", "x.csv"),
    "sweep's picture": ("sweep", "--set", "k=1e6:2e6:3", "--out", "x.csv", "x.png"),
    "build": ("build", "--out", "x.fmu", "x.fmu"),
}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX's pipes")
@pytest.mark.parametrize("command", COMMANDS_THAT_WRITE)
@pytest.mark.parametrize("kind", ["pipe", "link to a device"])
def test_devices_and_pipes_are_not_replaced(tmp_path, command, kind):
    """As root they could be."""
    *arguments, name = COMMANDS_THAT_WRITE[command]
    target = tmp_path / name
    if kind == "pipe":
        os.mkfifo(target)
    else:
        try:
            os.mknod(tmp_path / "device", 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        except OSError:
            pytest.skip("devices can't be made here")
        target.symlink_to("device")
    before = names(tmp_path)
    refused(golf_here(*arguments, cwd=tmp_path), f"can't write {name}: it is a device or a pipe")
    assert names(tmp_path) == before
    assert not stat.S_ISREG(target.stat().st_mode)


@pytest.mark.skipif(os.name != "posix", reason="links, and /proc")
def test_a_folder_that_cannot_be_made(tmp_path):
    """Noticed before anything runs, even before the FMU is checked."""
    (tmp_path / "link").symlink_to("nowhere")
    for out in ("link", "link/below", "/proc/golf"):
        done = golf_here("run", "laws", "--fmu", "none.fmu", "--out", out, cwd=tmp_path)
        refused(done, f"can't write {out}", "choose another")
    assert names(tmp_path) == {"link"}


# Space


@pytest.fixture
def small(tmp_path):
    """A function that runs the command with a small file system (kB) at tmp_path/small."""
    folder = tmp_path / "small"
    folder.mkdir()
    after = 'code=$?; find small -mindepth 1 >&2; exit "$code"'
    script = f'mount -t tmpfs -o size="$0" none small && {{ "$@"; {after}; }}'
    mounted = ("unshare", "-m", "sh", "-c", script)

    def small(size, *arguments, program=COMMAND, **options):
        return golf(*arguments, cwd=tmp_path, program=(*mounted, size, program), **options)

    if not shutil.which("unshare") or small("4k", program="true").returncode:
        pytest.skip("file systems can't be mounted here")
    return small


@pytest.mark.ci
def test_a_full_disk(small, tmp_path):
    """An error in one line, and no part of a file left."""
    full = "No space left on device"
    refused(small("16k", "run", "--set", "k=1e6", "--out", "small"), "can't write small", full)
    refused(small("256k", "build", "--out", "small/x.fmu"), "small/x.fmu", full)
    env = {"TMPDIR": str(tmp_path / "small")}
    refused(small("256k", "run", "laws", "--out", "out", env=env), full, "set TMPDIR")
    refused(small("256k", "build", "--out", "x.fmu", env=env), full)
    assert names(tmp_path) == {"small"}


@pytest.mark.ci
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_standard_output_that_is_full_or_closed(tmp_path):
    for end, code, words in (
        (">/dev/full", 2, "No space left on device"),
        (">&-", 0, ""),
        ("| head -n 1", 0, ""),
    ):
        line = f'"{COMMAND}" run laws --out out {end}'
        done = subprocess.run(["sh", "-c", line], capture_output=True, text=True, cwd=tmp_path)
        assert done.returncode == code
        assert words in done.stderr
        assert len(done.stderr.splitlines()) == bool(words)
