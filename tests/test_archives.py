"""Damaged, foreign and malicious .fmu files: an error in one line, exit code 2, no file left."""

import hashlib
import os
import shutil
import stat
import subprocess
import zipfile
from pathlib import Path

import pytest
from command import golf, golf_here, refused

from golf_build.packaging import bundled, guid_of
from golf_impact.errors import UserError
from golf_impact.fmu.archive import find_flaw
from golf_impact.fmu.file import BUILDERS, build_plain_fmu, check_fmu
from golf_impact.fmu.impact_fmu import ImpactFmu

SUMS = "documentation/SHA256SUMS"
LIBRARY = "binaries/linux64/ClubBallImpact.so"


@pytest.fixture(scope="module")
def files(fmu_path):
    """The FMU's files by name."""
    return unpacked(fmu_path)


def unpacked(fmu):
    with zipfile.ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def packed(path, files):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def with_more(tmp_path, files, *more):
    """An FMU with additional members, given by name or ZipInfo and content."""
    path = packed(tmp_path / "more.fmu", files)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        for name, content in more:
            archive.writestr(name, content)
    return path


def refused_run(fmu, *words, tmp_path):
    """One line on stderr with these words, exit code 2, and no file written."""
    temporary, cwd = tmp_path / "temporary", tmp_path / "cwd"
    temporary.mkdir()
    cwd.mkdir()
    command = ("run", "table1", "--fmu", fmu, "--out", "out")
    refused(golf(*command, cwd=cwd, env={"TMPDIR": str(temporary)}), *words)
    assert list(temporary.iterdir()) == list(cwd.iterdir()) == []


# What the command says, for one of each kind


def truncated(tmp_path, files, fmu):
    data = fmu.read_bytes()
    (tmp_path / "half.fmu").write_bytes(data[: len(data) // 2])
    return tmp_path / "half.fmu"


def zip_slip(tmp_path, files, fmu):
    return with_more(tmp_path, files, ("../outside.txt", b"here"))


def another_guid(tmp_path, files, fmu):
    text = files["modelDescription.xml"].decode()
    guid = guid_of(fmu)
    assert guid in text
    other = text.replace(guid, "11111111-2222-3333-4444-555555555555")
    return packed(tmp_path / "x.fmu", files | {"modelDescription.xml": other.encode()})


def foreign(tmp_path, files, fmu):
    script = tmp_path / "stranger.py"
    script.write_text(
        "from pythonfmu import Fmi2Slave, Real, Fmi2Causality\n"
        "class Stranger(Fmi2Slave):\n"
        "    def __init__(self, **kwargs):\n"
        "        super().__init__(**kwargs)\n"
        "        self.out = 1.0\n"
        "        self.register_variable(Real('out', causality=Fmi2Causality.output))\n"
        "    def do_step(self, current_time, step_size):\n"
        "        return True\n"
    )
    return build_plain_fmu(script, tmp_path / "built")


def without_a_module(tmp_path, files, fmu):
    """pythonfmu's library would crash the process."""
    kept = {n: c for n, c in files.items() if not n.endswith("/impact.py") and n != SUMS}
    return packed(tmp_path / "x.fmu", kept)


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (truncated, ("half.fmu", "not a readable FMU", "golf-impact build")),
        (zip_slip, ("'../outside.txt'", "golf-impact build")),
        pytest.param(
            another_guid,
            ("modelDescription.xml has been changed since it was built",),
            marks=pytest.mark.ci,
        ),
        pytest.param(foreign, ("Stranger.fmu is another FMU (Stranger)",), marks=pytest.mark.ci),
        (without_a_module, ("x.fmu can't be run here", "golf-impact build")),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_the_command(tmp_path, files, fmu_path, made, words):
    refused_run(made(tmp_path, files, fmu_path), *words, tmp_path=tmp_path)


def test_a_sweep_rejects_them_as_well(tmp_path, files, fmu_path):
    fmu = zip_slip(tmp_path, files, fmu_path)
    command = ("sweep", "--set", "k=1e6,2e6", "--no-figures", "--fmu", fmu)
    refused(golf_here(*command, "--out", tmp_path / "x.csv"), "'../outside.txt'")
    assert not (tmp_path / "x.csv").exists()


def test_doctor_checks_the_file_before_it_runs(tmp_path, files, fmu_path):
    done = golf_here("doctor", zip_slip(tmp_path, files, fmu_path))
    assert done.returncode == 1
    problems = [line for line in done.stdout.splitlines() if line.startswith("problem")]
    assert len(problems) == 1
    assert "'../outside.txt'" in problems[0]


# The archive


OUTSIDE = ("../x", "resources/../../x", "/etc/x", "//host/x", "C:/x", "C:x", "..\\x")


@pytest.mark.parametrize("name", [*OUTSIDE, "a\\..\\..\\x", "a/..", "line\nbreak"])
def test_names_that_lead_out_of_the_folder(tmp_path, files, name):
    path = with_more(tmp_path, files, (zipfile.ZipInfo(name), b"here"))
    why = find_flaw(path)
    assert "leads out of the folder" in why
    assert len(why.splitlines()) == 1
    with pytest.raises(UserError, match="leads out of the folder"):
        ImpactFmu(path)


def test_links(tmp_path, files):
    link = zipfile.ZipInfo("resources/link")
    link.create_system = 3
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    assert "is a link" in find_flaw(with_more(tmp_path, files, (link, b"/etc")))


def test_a_name_twice(tmp_path, files):
    with pytest.warns(UserWarning, match="Duplicate"):
        path = with_more(tmp_path, files, ("modelDescription.xml", b"<other/>"))
    assert "twice" in find_flaw(path)


def test_too_large(tmp_path, files):
    path = tmp_path / "bomb.fmu"
    packed(path, files)
    with (
        zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive,
        archive.open("resources/zeros", "w") as member,
    ):
        for _ in range(65):
            member.write(bytes(2**20))
    assert path.stat().st_size < 2**20
    assert "66 MB" in find_flaw(path)


def test_a_wrong_size(tmp_path, files):
    """The directory has 10 bytes: no more are unpacked, and their CRC is wrong."""
    path = tmp_path / "liar.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", bytes(2**22))
        archive.infolist()[0].file_size = 10
    assert "not a readable FMU" in find_flaw(path)


def test_every_truncation(tmp_path, fmu_path):
    data, path = fmu_path.read_bytes(), tmp_path / "x.fmu"
    for n in range(0, len(data), len(data) // 40):
        path.write_bytes(data[:n])
        assert "not a readable FMU" in find_flaw(path)
    path.write_bytes(data)
    assert find_flaw(path) is None


@pytest.mark.ci
def test_a_damaged_byte_anywhere(tmp_path, fmu_path):
    """A change of any byte that matters is noticed, and the build isn't current."""
    data, path = bytearray(fmu_path.read_bytes()), tmp_path / "x.fmu"
    seen = 0
    for n in range(7, len(data), len(data) // 60):
        data[n] ^= 0xFF
        path.write_bytes(data)
        try:
            same = unpacked(path) == unpacked(fmu_path)
        except Exception:
            same = False
        if not same:
            seen += 1
            assert find_flaw(path) is not None
            assert not BUILDERS[2].is_current(path)
        data[n] ^= 0xFF
    assert seen > 50


@pytest.mark.parametrize("name", ["modelDescription.xml", "resources/slavemodule.txt"])
def test_a_missing_member(tmp_path, files, name):
    assert f"{name} is missing" in find_flaw(
        packed(tmp_path / "x.fmu", {n: c for n, c in files.items() if n != name})
    )


def test_no_archive_at_all(tmp_path):
    empty, text, pipe = (tmp_path / f"{name}.fmu" for name in ("empty", "text", "pipe"))
    empty.write_bytes(b"")
    text.write_text("<fmiModelDescription/>")
    os.mkfifo(pipe)
    assert "not a readable FMU" in find_flaw(empty)
    assert "not a readable FMU" in find_flaw(text)
    assert "modelDescription.xml is missing" in find_flaw(packed(tmp_path / "nothing.fmu", {}))
    assert "is a folder" in find_flaw(tmp_path)
    assert "is not a regular file" in find_flaw(pipe)
    assert "there is no FMU" in find_flaw(tmp_path / "none.fmu")
    assert "can't read" in find_flaw(empty / "below.fmu")
    assert "can't read" in find_flaw(Path("x" * 300))


def test_encrypted_members_and_unsupported_compression(tmp_path, files):
    path = packed(tmp_path / "x.fmu", files)
    data = bytearray(path.read_bytes())
    entry = data.index(b"PK\x01\x02")
    data[entry + 8] |= 1
    path.write_bytes(data)
    assert "encrypted" in find_flaw(path)
    data[entry + 8] &= ~1
    data[entry + 10] = 99
    path.write_bytes(data)
    assert "not a readable FMU" in find_flaw(path)


# What is inside


def described(tmp_path, files, *replacements):
    """The FMU with another modelDescription.xml, without the list of its files."""
    text = files["modelDescription.xml"].decode()
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    kept = {name: content for name, content in files.items() if name != SUMS}
    return packed(tmp_path / "x.fmu", kept | {"modelDescription.xml": text.encode()})


@pytest.mark.parametrize(
    ("replacements", "words"),
    [
        ([("</fmiModelDescription>", "")], "not a readable FMU"),
        ([('fmiVersion="2.0"', 'fmiVersion="7.0"')], "not a readable FMU"),
        ([('"smash_factor"', '"smash"')], "another FMU"),
        ([('"exponent"', '"exp"')], "lacks exponent"),
    ],
)
def test_another_description(tmp_path, files, replacements, words):
    with pytest.raises(UserError, match=words):
        ImpactFmu(described(tmp_path, files, *replacements))


def test_an_fmu_for_fmi_3(tmp_path):
    fmu = BUILDERS[3].build(tmp_path / "x.fmu")
    assert find_flaw(fmu) is None
    with pytest.raises(UserError, match=r"not an FMI 2\.0 co-simulation FMU"):
        ImpactFmu(fmu)


def test_an_fmu_without_co_simulation(tmp_path, files):
    text = files["modelDescription.xml"].decode()
    begin = text.index("<CoSimulation")
    end = text.index("/>", begin) + 2
    if "</CoSimulation>" in text:
        end = text.index("</CoSimulation>") + len("</CoSimulation>")
    exchange = '<ModelExchange modelIdentifier="ClubBallImpact"/>'
    path = described(tmp_path, files, (text[begin:end], exchange))
    with pytest.raises(UserError, match=r"not an FMI 2\.0 co-simulation FMU"):
        ImpactFmu(path)


def entry_point(files):
    return f"resources/{files['resources/slavemodule.txt'].decode().strip()}.py"


@pytest.mark.ci
@pytest.mark.parametrize(
    "damage",
    [
        lambda files: {entry_point(files): b"this is no Python"},
        lambda files: {entry_point(files): b"raise RuntimeError"},
        lambda files: {entry_point(files): b"import os; os.abort()"},
        lambda files: {LIBRARY: b"no library"},
        lambda files: {LIBRARY: files[LIBRARY][:9999]},
        lambda files: {"resources/slavemodule.txt": b"another_module"},
    ],
    ids=["syntax", "exception", "abort", "library", "half library", "other module"],
)
def test_contents_that_crash_a_process(tmp_path, files, damage):
    """Run in a separate process, since without a list of files nothing else shows the damage."""
    kept = {name: content for name, content in files.items() if name != SUMS}
    path = packed(tmp_path / "x.fmu", kept | damage(files))
    assert find_flaw(path) is None
    with pytest.raises(UserError, match="can't be run here") as error:
        check_fmu(path)
    assert len(str(error.value).splitlines()) == 1


def test_a_repacked_fmu_is_accepted(tmp_path, files, monkeypatch):
    """Modules in the working folder are not imported in place of the package's."""
    for name in ("golf_impact", "fmpy", "numpy"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError")
    monkeypatch.chdir(tmp_path)
    kept = {name: content for name, content in files.items() if name != SUMS}
    path = packed(tmp_path / "x.fmu", kept)
    assert check_fmu(path) == path


# The built FMU


def test_a_damaged_build_is_rebuilt(tmp_path, fmu_path, files, monkeypatch):
    from golf_impact.fmu import file as fmu_file

    built = tmp_path / "ClubBallImpact.fmu"
    monkeypatch.setattr(fmu_file, "default_path", lambda build: built)
    assert fmu_file.current_fmu() == (built, "it was missing")
    assert fmu_file.current_fmu() == (built, None)
    whole = built.read_bytes()
    assert whole == fmu_path.read_bytes()
    without = {name: content for name, content in files.items() if "power_law" not in name}
    for damaged in (whole[:-100], b"", packed(tmp_path / "y", without).read_bytes()):
        built.write_bytes(damaged)
        assert fmu_file.current_fmu() == (built, "it was damaged")
        assert built.read_bytes() == whole


def test_the_list_of_files(tmp_path, fmu_path, files):
    """It has all files, with their digests."""
    import importlib.metadata

    names = set(files)
    module = entry_point(files)
    package = module.removesuffix(".py").replace("club_ball_impact", "golf_physics")
    ours = {
        *("modelDescription.xml", "model.png", SUMS, "resources/slavemodule.txt", module),
        *(f"documentation/{name}" for name in ("index.html", "force.png", "model.png")),
        *(f"documentation/licenses/{name}.txt" for name in ("license", "pythonfmu")),
        f"{package}/club_ball_impact.py",
    }
    ours |= {f"{package}/{name}" for name in bundled()}
    theirs = {
        LIBRARY: "resources/binaries/linux64/libpythonfmu-export.so",
        "binaries/win64/ClubBallImpact.dll": "resources/binaries/win64/pythonfmu-export.dll",
    }
    theirs |= {
        name: name.removeprefix("resources/pythonfmu/")
        for name in names
        if name.startswith("resources/pythonfmu/")
    }
    assert names == ours | set(theirs)
    installed = {str(f): f for f in importlib.metadata.files("pythonfmu")}
    for name, original in theirs.items():
        assert files[name] == installed[f"pythonfmu/{original}"].read_binary(), name
    with zipfile.ZipFile(fmu_path) as archive:
        archive.extractall(tmp_path)
    listed = (tmp_path / SUMS).read_text().splitlines()
    assert [line.split("  ")[1] for line in listed] == sorted(names - {SUMS})
    for line in listed:
        expected, _, name = line.partition("  ")
        assert hashlib.sha256(files[name]).hexdigest() == expected
    if shutil.which("sha256sum"):
        subprocess.run(["sha256sum", "--quiet", "-c", SUMS], cwd=tmp_path, check=True)
