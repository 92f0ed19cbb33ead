"""`golf-impact build`: files and their contents, what is out of date, extras, installations."""

import hashlib
import importlib.metadata
import os
import re
import shlex
import shutil
import sys
import venv
import zipfile
from pathlib import Path

import pytest
import pythonfmu
from command import ROOT, checkout, golf_here, run
from conftest import some
from packaging.requirements import Requirement

from golf_build import extras, packaging
from golf_build.archive import SUMS, checksums, pack, unpack, write_archive
from golf_build.fmi2 import BUILDER
from golf_build.system import SYSTEM
from golf_impact import fmu
from golf_impact.data.files import read_toml

PROJECT = read_toml(ROOT / "pyproject.toml")["project"]
EXTRAS = ("calibrate", "sweep", "cluster", "interop", "native", "bench")


@pytest.mark.ci
def test_an_output_without_a_function(tmp_path):
    """A build stops with its name: of the plain FMU in Python, of the native one in C."""
    env = os.environ | checkout(tmp_path)
    table, functions = (tmp_path / "fmu_src/golf_physics" / name for name in (
        "variables.py", "component/outputs.py"
    ))  # fmt: skip
    (row,) = (r for r in table.read_text("utf-8").splitlines() if '"kinetic_energy",' in r)
    new = row.replace('34, "kinetic_energy"', '77, "double_energy"')
    table.write_text(table.read_text("utf-8").replace(row, f"{row}\n{new}"), "utf-8")
    build = sys.executable, "-m", "golf_impact", "build", "--out", tmp_path / "x.fmu"
    assert "double_energy" in run(*build, env=env, code=2).stderr
    text = functions.read_text("utf-8")
    added = text.replace(
        '    "momentum": ', '    "double_energy": _kinetic_energy,\n    "momentum": '
    )
    functions.write_text(added, "utf-8")
    assert "the output double_energy, which" in run(*build, "--native", env=env, code=2).stderr
    assert not (tmp_path / "x.fmu").exists()
    run(*build, env=env)


@pytest.mark.ci
def test_the_system_beside_it(tmp_path, files):
    """The same sources give the same bytes."""
    done = golf_here("build", "--system", "--out", tmp_path / "x.fmu", code=0)
    names = {"x.fmu", *(file.name for file in files)}
    assert {Path(line).name for line in done.stdout.split()} == names
    assert {path.name for path in tmp_path.iterdir()} == names
    for file in files:
        assert (tmp_path / file.name).read_bytes() == file.read_bytes()


def test_contents(tmp_path, fmu_path):
    """pythonfmu's binaries as they are, and digests; snapshots have the names."""
    files = unpack(fmu_path)
    binaries = Path(pythonfmu.__file__).parent / "resources" / "binaries"
    for name, original in (
        ("linux64/ClubBallImpact.so", "linux64/libpythonfmu-export.so"),
        ("win64/ClubBallImpact.dll", "win64/pythonfmu-export.dll"),
    ):
        assert files[f"binaries/{name}"] == (binaries / original).read_bytes(), name
    listed = dict(line.split("  ")[::-1] for line in files.pop(SUMS).decode().splitlines())
    assert listed == {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}


@pytest.mark.plain
def test_a_file_without_an_installation(tmp_path, fmu_path):
    """By build_fmu.py: the same bytes."""
    file, script = tmp_path / "a folder" / "mine.fmu", ROOT / "build" / "build_fmu.py"
    assert run(sys.executable, script, file, cwd=tmp_path).stdout.strip() == str(file)
    assert file.read_bytes() == fmu_path.read_bytes()


def test_an_archive_is_the_same_everywhere():
    """Order, times, attributes: the bytes of one that isn't compressed."""
    files = {"a": b"1", "modelDescription.xml": b"2", "binaries/linux64/x.so": b"3"}
    digest = hashlib.sha256(pack(files, zipfile.ZIP_STORED)).hexdigest()
    assert digest == "7a98654cdbd7c1bcffd72f34657d14d8f8edd941cc5dd3da77cc7ab84720fe13"


def test_a_build_that_is_missing_damaged_or_out_of_date(tmp_path, fmu_path, monkeypatch, capsys):
    built = tmp_path / "ClubBallImpact.fmu"
    monkeypatch.setattr("golf_impact.fmu.current.default_path", lambda builder: built)

    def message():
        assert fmu.current_fmu() == built
        assert built.read_bytes() == whole
        return capsys.readouterr().err

    whole = fmu_path.read_bytes()
    assert message() == f"Built {built}: it was missing.\n"
    assert message() == ""
    files = unpack(fmu_path)
    without = {name: content for name, content in files.items() if "power_law" not in name}
    older = files["modelDescription.xml"].replace(BUILDER.guid().encode(), b"an older one")
    listed = files | {"modelDescription.xml": older}
    del listed[SUMS]
    for other in (without, listed | {SUMS: checksums(listed)}):
        assert not BUILDER.is_current(write_archive(built, other))
    for damaged in (whole[:-100], b""):
        built.write_bytes(damaged)
        assert not BUILDER.is_current(built)
    assert message() == f"Built {built}: it was out of date or damaged.\n"


def test_a_native_fmu_that_is_current(native_path, monkeypatch, capsys):
    monkeypatch.setattr("golf_impact.fmu.current.default_path", lambda builder: native_path)
    assert fmu.current_native() == native_path
    assert capsys.readouterr().err == ""


def test_what_makes_a_build_out_of_date(tmp_path, monkeypatch):
    """Also the runtime's version, and each file that is copied into FMUs."""
    digests = [BUILDER.digest()]
    with monkeypatch.context() as other:
        other.setattr("importlib.metadata.version", lambda name: "0.7.99")
        digests.append(BUILDER.digest())
    shutil.copytree(packaging._CONTENTS, tmp_path / "contents")
    monkeypatch.setattr(packaging, "_CONTENTS", tmp_path / "contents")
    assert BUILDER.digest() == digests[0]
    for file in (path for path in packaging._CONTENTS.rglob("*") if path.is_file()):
        file.write_bytes(file.read_bytes() + b" ")
        digests.append(BUILDER.digest())
    assert len({*digests}) == len(digests) > 5


def test_a_changed_or_damaged_system(tmp_path, ssp, fmu_path):
    assert SYSTEM.is_current(ssp)
    built = tmp_path / "x.ssp"
    built.write_bytes(ssp.read_bytes()[:-1000])
    assert not SYSTEM.is_current(built)
    files = unpack(ssp)
    structure = files["SystemStructure.ssd"].replace(b'"impulse"', b'"force"')
    for changed in (
        {"SystemStructure.ssd": structure},
        {"resources/ClubBallImpact.fmu": fmu_path.read_bytes()},  # of other start values
    ):
        assert changed.items() - files.items()
        assert not SYSTEM.is_current(write_archive(built, files | changed))


@pytest.mark.parametrize("extra", some(1, EXTRAS))
def test_the_command_that_installs_an_extra(monkeypatch, extra):
    """In a checkout the checkout with the extra; beside a wheel the packages of the extra."""
    command = sys.executable, "-m", "pip", "install", "-e", f"{ROOT}[{extra}]"
    assert shlex.split(extras.install_command(extra)) == [*command]
    # As without a checkout.
    monkeypatch.setattr(extras, "CHECKOUT", None)
    packages = shlex.split(extras.install_command(extra))[4:]
    declared = PROJECT["optional-dependencies"][extra]
    assert {*map(Requirement, packages)} == {*map(Requirement, declared)}


# Nightly: as a user does it, with a package index


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Wheel and source distribution, made by `python -m build` in the root of a checkout."""
    folder = tmp_path_factory.mktemp("checkout")
    tools = environment(tmp_path_factory.mktemp("tools"))
    if pip(tools, "build", code=None).returncode:
        pytest.skip("there is no package index here")
    checkout(folder)
    for name in ("tests", ".github"):
        shutil.copytree(ROOT / name, folder / name)
    for name in ("pyproject.toml", "README.md", "CHANGELOG.md"):
        shutil.copy(ROOT / name, folder)
    # The folder build/ of the working folder doesn't hide the module.
    run(tools, "-m", "build", cwd=folder, timeout=None)
    return {path.suffix: path for path in (folder / "dist").iterdir()}


def environment(folder):
    """A fresh virtual environment's Python."""
    venv.create(folder, with_pip=True)
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def pip(python, *packages, code=0):
    return run(python, "-m", "pip", "install", "--quiet", *packages, code=code, timeout=None)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", [".whl", ".gz"])
def test_an_installed_copy(tmp_path, made, fmu_path, kind):
    python = environment(tmp_path / "environment")
    pip(python, made[kind])
    outside = tmp_path / "outside"
    outside.mkdir()
    hidden = ("PYTHONPATH", "PYTHONHOME")
    env = {key: value for key, value in os.environ.items() if key not in hidden}
    env |= {"XDG_CACHE_HOME": str(tmp_path / "cache"), "LOCALAPPDATA": str(tmp_path / "cache")}

    def golf(*arguments, code=0):
        command = python.with_name("golf-impact"), *arguments
        return run(*command, code=code, cwd=outside, env=env, timeout=None)

    assert "54.745" in golf("run", "baseline", "--no-figures").stdout
    built = list((tmp_path / "cache").rglob("*.fmu"))
    assert len(built) == 1
    for command in (("list",), ("doctor",), ("run",), ("build", "--system", "--out", "x.fmu")):
        golf(*command)
    calibrate = ("calibrate", "--measured", "cor=0.743", "--measured", "contact_time=600e-6")
    pip_line = re.search("`(.+)`", golf(*calibrate, code=2).stderr)[1]
    run(*shlex.split(pip_line), cwd=outside, timeout=None)
    golf(*calibrate)
    version = "import importlib.metadata as m; print(m.version('pythonfmu'))"
    theirs = run(python, "-c", version).stdout.strip()
    if theirs == importlib.metadata.version("pythonfmu"):
        assert built[0].read_bytes() == fmu_path.read_bytes()
