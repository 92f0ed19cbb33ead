"""Damaged and foreign .fmu files: an error in one line, exit code 2, no file left."""

import os
import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest
import pythonfmu
from command import golf, refused
from conftest import build_plain_fmu
from reference_results import FOLDER

from golf_build.archive import SUMS, checksums, unpack, write_archive
from golf_build.packaging import _read, guid_in
from golf_impact import fmu
from golf_impact.doctor import check_fmu, find_flaw
from golf_impact.errors import UserError
from golf_impact.fmu import builder_of
from golf_impact.peers import empty_fmu


@pytest.fixture(scope="module")
def files(fmu_path):
    """The FMU's files by name."""
    return unpack(fmu_path)


# Messages of the command, for one of each kind


def truncated(tmp_path, files, fmu):
    data = fmu.read_bytes()
    (tmp_path / "half.fmu").write_bytes(data[: len(data) // 2])
    return tmp_path / "half.fmu"


def another_guid(tmp_path, files, fmu):
    text = files["modelDescription.xml"].decode()
    guid = guid_in(fmu)
    assert guid in text
    other = text.replace(guid, "11111111-2222-3333-4444-555555555555")
    return write_archive(tmp_path / "x.fmu", files | {"modelDescription.xml": other.encode()})


def foreign(tmp_path, files, fmu):
    return build_plain_fmu(Path(empty_fmu.__file__), tmp_path / "built")


def without_a_module(tmp_path, files, fmu):
    """pythonfmu's library would crash the process."""
    kept = {n: c for n, c in files.items() if not n.endswith("/impact.py") and n != SUMS}
    return write_archive(tmp_path / "x.fmu", kept)


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (truncated, ("half.fmu", "not a readable FMU", "golf-impact build")),
        pytest.param(another_guid, ("changed since it was built",), marks=pytest.mark.ci),
        pytest.param(foreign, ("is another FMU (Empty)",), marks=pytest.mark.ci),
        (without_a_module, ("x.fmu can't be run here", "golf-impact build")),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_the_command(tmp_path, files, fmu_path, made, words):
    """One line on stderr with these words, exit code 2, and no file written."""
    temporary, cwd = tmp_path / "temporary", tmp_path / "cwd"
    temporary.mkdir()
    cwd.mkdir()
    command = ("run", "laws", "--fmu", made(tmp_path, files, fmu_path), "--out", "out")
    refused(golf(*command, cwd=cwd, env={"TMPDIR": str(temporary)}), *words)
    assert list(temporary.iterdir()) == list(cwd.iterdir()) == []


# The archive


@pytest.mark.parametrize("listed", [True, False])
def test_names_that_lead_out_of_the_folder(tmp_path, files, monkeypatch, listed):
    """Refused beside a list of the files; without one, extracted inside the folder and run.

    Modules in the working folder are not imported in place of the package's.
    """
    for name in ("golf_impact", "fmpy", "numpy"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError")
    monkeypatch.chdir(tmp_path)
    temporary = tmp_path / "one" / "temporary"
    temporary.mkdir(parents=True)
    monkeypatch.setenv("TMPDIR", str(temporary))
    kept = {name: content for name, content in files.items() if listed or name != SUMS}
    fmu = write_archive(tmp_path / "x.fmu", kept | {"../../outside.txt": b"here"})
    if listed:
        with pytest.raises(UserError, match="changed since it was built"):
            check_fmu(fmu)
    else:
        assert check_fmu(fmu) == fmu
    assert not list(tmp_path.rglob("outside.txt"))


def test_no_fmu_at_all(tmp_path, fmu_path):
    data, path, pipe = fmu_path.read_bytes(), tmp_path / "x.fmu", tmp_path / "pipe.fmu"
    for content in (*(data[:n] for n in range(0, len(data), len(data) // 40)), b"<text/>"):
        path.write_bytes(content)
        assert "not a readable FMU" in find_flaw(path)
    assert "modelDescription.xml is missing" in find_flaw(
        write_archive(tmp_path / "nothing.fmu", {})
    )
    os.mkfifo(pipe)
    for file in (tmp_path, pipe, tmp_path / "none.fmu", path / "below.fmu", Path("x" * 300)):
        assert "there is no FMU file" in find_flaw(file)


# What is inside


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("</fmiModelDescription>", "", "not a readable FMU"),
        ('fmiVersion="2.0"', 'fmiVersion="7.0"', "not a readable FMU"),
        ('"smash_factor"', '"smash"', "another FMU .*: it lacks smash_factor"),
    ],
)
def test_another_description(tmp_path, files, old, new, words):
    text = files["modelDescription.xml"].decode()
    assert old in text
    kept = {name: content for name, content in files.items() if name != SUMS}
    kept["modelDescription.xml"] = text.replace(old, new).encode()
    with pytest.raises(UserError, match=words):
        check_fmu(write_archive(tmp_path / "x.fmu", kept))


def test_an_fmu_for_fmi_3(tmp_path):
    fmu = builder_of(fmi=3).build(tmp_path / "x.fmu")
    assert find_flaw(fmu) is None
    with pytest.raises(UserError, match=r"not an FMI 2\.0 co-simulation FMU"):
        check_fmu(fmu)


# The built FMU


def test_a_damaged_build_is_rebuilt(tmp_path, fmu_path, files, monkeypatch, capsys):
    built = tmp_path / "ClubBallImpact.fmu"
    monkeypatch.setattr(fmu, "default_path", lambda builder: built)

    def message():
        assert fmu.current_fmu() == built
        return capsys.readouterr().err

    assert message() == f"Built {built}: it was missing.\n"
    assert message() == ""
    whole = built.read_bytes()
    assert whole == fmu_path.read_bytes()
    without = {name: content for name, content in files.items() if "power_law" not in name}
    for damaged in (whole[:-100], b"", write_archive(tmp_path / "y", without).read_bytes()):
        built.write_bytes(damaged)
        assert message() == f"Built {built}: it was damaged.\n"
        assert built.read_bytes() == whole
    fmu.builder_of("Launch").build(built)
    assert message() == f"Built {built}: its sources have changed.\n"


@pytest.mark.parametrize("damage", [None, b"", b"\0"])
def test_the_system_is_current_or_rebuilt(tmp_path, monkeypatch, capsys, damage):
    built = tmp_path / "GolfSwing.ssp"
    monkeypatch.setattr(fmu, "default_path", lambda builder: built)
    assert fmu.current_system() == built
    capsys.readouterr()
    if damage is not None:
        built.write_bytes(built.read_bytes()[:-1000] + damage)
    fmu.current_system()
    assert ("it was damaged" in capsys.readouterr().err) == (damage is not None)


def test_the_list_of_files(tmp_path, fmu_path, files):
    """It has all files, with their digests; those of pythonfmu are unchanged."""
    module = f"resources/{files['resources/slavemodule.txt'].decode().strip()}.py"
    package = module.removesuffix(".py").replace("club_ball_impact", "golf_physics")
    pages = {"index.html", "force.png", "model.png", "licenses/license.txt"}
    assert {f"documentation/{name}" for name in pages} | {"model.png", SUMS, module} <= set(files)
    assert {
        f"{package}/{name}" for name in (*_read(("golf_physics", "host")), "club_ball_impact.py")
    } <= set(files)
    reference = {f"extra/org.golf-impact.reference/{file.name}" for file in FOLDER.iterdir()}
    assert {"documentation/externalDependencies.txt", *reference} <= set(files)
    installed = Path(pythonfmu.__file__).parent / "resources"
    for name, original in (
        ("binaries/linux64/ClubBallImpact.so", "binaries/linux64/libpythonfmu-export.so"),
        ("binaries/win64/ClubBallImpact.dll", "binaries/win64/pythonfmu-export.dll"),
    ):
        assert files[name] == (installed / original).read_bytes(), name
    assert files[SUMS] == checksums({n: content for n, content in files.items() if n != SUMS})
    if shutil.which("sha256sum"):
        with zipfile.ZipFile(fmu_path) as archive:
            archive.extractall(tmp_path)
        subprocess.run(["sha256sum", "--quiet", "-c", SUMS], cwd=tmp_path, check=True)
