"""What FMI requires of a file beside its behaviour: descriptions, terminals, references."""

import re
import shlex
import sys
from dataclasses import replace
from hashlib import sha256
from itertools import product
from pathlib import Path

import fmpy
import pytest
from command import ROOT, run
from conftest import holds_c
from fmpy.validation import validate_fmu
from html5 import elements
from lxml import etree
from reference_results import FOLDER, reference_results
from shown import check_snapshot
from ways import FMUS, fmu_file, marked

import golf_impact
from golf_build import native
from golf_build.archive import SUMS, unpack, write_archive
from golf_build.system import COMPANIONS
from golf_impact.data.errors import UserError
from golf_impact.fmu import doctor
from golf_impact.fmu.doctor import examine
from golf_impact.fmu.file import run_here

DESCRIPTIONS = {
    "modelDescription.xml", "terminalsAndIcons/terminalsAndIcons.xml", "SystemStructure.ssd"
}  # fmt: skip


def archive_of(name, once, system_files):
    if name in FMUS:
        return fmu_file(once, name)
    return next(path for path in system_files() if path.stem == name)


@pytest.fixture(params=marked((*FMUS, *COMPANIONS)))
def fmu(request, once, system_files):
    return archive_of(request.param, once, system_files)


@pytest.fixture
def content(fmu):
    return unpack(fmu)


def test_fmpy_finds_no_problem(fmu):
    assert validate_fmu(str(fmu)) == []


def test_what_it_needs(fmu, content):
    """Native: nothing. In Python: libraries, which are named, and the standard library alone."""
    files = [name for name in content if name.endswith(".py")]
    name = "documentation/externalDependencies.txt"
    assert {bool(files), name in content} == {not holds_c(fmu)}
    if holds_c(fmu):
        return
    text = content[name].decode()
    binaries = b"".join(data for path, data in content.items() if path.startswith("binaries/"))
    loaded = set(re.findall(rb"\b(?:MSVCP|VCRUNTIME|python|lib(?:stdc\+\+|gcc))[\w.]*\b", binaries))
    libraries = {n.decode() for n in loaded if n.endswith((b".dll", b".so.6", b".so.1"))}
    assert {"python3.dll", "libstdc++.so.6", "libgcc_s.so.1"} <= libraries
    assert [library for library in libraries if library not in text] == []
    modules = {name.split("/")[1].removesuffix(".py") for name in files}
    ours = b"\n".join(content[name] for name in files if "/pythonfmu" not in name).decode()
    imported = re.findall(r"(?m)^ *(?:from|import) (\w+)[\w.]*(?: import .*)?$", ours)
    assert {"math"} <= {*imported} <= {*sys.stdlib_module_names, *modules, "pythonfmu"}


# Descriptions and lists of files, as they are stored


def wheel(folder):
    pytest.importorskip("pip", reason="pip isn't installed")
    build = "pip", "wheel", "-q", "--no-deps", "--wheel-dir", folder, ROOT
    run(sys.executable, "-m", *build, timeout=300)
    return next(folder.glob("*.whl"))


def stable(text):
    """Without what changes with every build or release."""
    text = re.sub(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", "…", text)
    text = re.sub(r"_[0-9a-f]{16}\b", "_…", text)
    return re.sub(rf"\b{re.escape(golf_impact.__version__)}\b", "…", text)


@pytest.mark.parametrize(
    "name",
    [*marked((*FMUS, *COMPANIONS, "GolfSwing")), pytest.param("wheel", marks=pytest.mark.ci)],
)
def test_descriptions_and_names(pytestconfig, once, system_files, tmp_path, name):
    """Of binaries those of pythonfmu alone: native ones are of this machine."""
    archive = wheel(tmp_path) if name == "wheel" else archive_of(name, once, system_files)
    folder = name if name == "wheel" else archive.stem
    content = unpack(archive)
    names = [n for n in sorted(content) if not ("native" in name and "binaries/" in n)]
    check_snapshot(pytestconfig, f"{folder}/names.txt", stable("\n".join(names)).splitlines())
    for path in DESCRIPTIONS & {*content}:
        lines = stable(content[path].decode()).splitlines()
        check_snapshot(pytestconfig, f"{folder}/{Path(path).name}", lines)


#: System and processor, as Python names them.
MACHINES = (
    ("Linux", "x86_64"),
    ("Linux", "aarch64"),
    ("Windows", "AMD64"),
    ("Darwin", "arm64"),
    ("Linux", "riscv64"),
)


@pytest.fixture
def native_build(monkeypatch, tmp_path):
    """A function that builds a native FMU but for compiling; returns what it does in lines."""
    commands = []

    def compiled(command, sources, out, what):
        commands.append(shlex.join(command))
        # With the offset of the time in a library for Windows, and the machine in one for Linux.
        image = bytearray((what * 9)[:128].encode())
        image[0x3C:0x40] = b"\x10\0\0\0"
        image[18:20] = b"\xb7\0" if "aarch64" in what else b">\0"
        return bytes(image)

    def native_build(compiler, here, fmi, system, machine):
        monkeypatch.setattr(native, "ziglang", lambda: tmp_path if compiler == "zig" else None)
        monkeypatch.setattr("platform.system", lambda: system)
        monkeypatch.setattr("platform.machine", lambda: machine)
        commands.clear()
        plain = "a" if native.pythonfmu_runs_here() else "no"
        about = f"{native.this_machine()}{' alone' * here} with {plain} binary of pythonfmu"
        yield f"{compiler}, FMI {fmi}.0, {about}"
        try:
            files = replace(native.BUILDERS[fmi], here=here).files()
        except UserError as error:
            yield f"  {error}"
            return
        yield from (f"  {command}" for command in sorted(commands))
        for name, data in files.items():
            if name.startswith(("binaries/", "documentation/licenses")):
                yield f"  {name} {sha256(data).hexdigest()[:8]}"
        yield f"  for {', '.join(sorted(native.binaries_of(files)))}"

    monkeypatch.setattr(native, "compiled", compiled)
    monkeypatch.setenv("CC", "cc")
    monkeypatch.setattr("shutil.which", lambda name: name)
    for file in native._NOTICES.values():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(file)
    return native_build


def test_native_builds(pytestconfig, native_build):
    """By compiler and machine: commands, binaries with digests, refusals. Nothing is compiled."""
    ways = ("zig", False, 1), ("zig", True, 5), ("cc", False, 5)
    lines = [
        line
        for (compiler, here, count), fmi in product(ways, (2, 3))
        for machine in MACHINES[:count]
        for line in native_build(compiler, here, fmi, *machine)
    ]
    text = "\n".join(lines).replace(sys.executable, "python").replace(str(ROOT), "…")
    check_snapshot(pytestconfig, "native.txt", text.splitlines())


def test_terminals(native_fmi3_path):
    """They have the standard's schema and name variables of the FMU."""
    content = unpack(native_fmi3_path)
    assert content["terminalsAndIcons/icon.png"].startswith(b"\x89PNG")
    schema = Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd"
    tree = etree.fromstring(content["terminalsAndIcons/terminalsAndIcons.xml"])
    etree.XMLSchema(etree.parse(schema)).assertValid(tree)
    variables = {v.name for v in fmpy.read_model_description(native_fmi3_path).modelVariables}
    assert {one.get("variableName") for one in tree.iter("TerminalMemberVariable")} <= variables


def test_the_page(fmu, content):
    """In documentation: it has every variable, and its links lead to files beside it."""
    text = content["documentation/index.html"].decode()
    seen, about = elements(text), fmpy.read_model_description(fmu)
    assert {"viewport", "color-scheme"} <= {meta.get("name") for meta in seen["meta"]}
    names = re.findall(r"<th[^>]*><code>(.*?)</code>", text)
    assert names == [v.name for v in about.modelVariables]
    linked = [one.get("href", one.get("src")) for each in seen.values() for one in each]
    assert {f"documentation/{name}" for name in linked if name} <= {*content}
    assert about.defaultExperiment.stepSize
    assert ("Model Exchange" in text) == holds_c(fmu)
    folders = {name.split("/")[1] for name in content if name.startswith("binaries/")}
    assert ("macOS x86_64" in text) == bool(folders & {"darwin64", "x86_64-darwin"})
    assert ("Linux aarch64" in text) == ("aarch64-linux" in folders)


# Reference results


def test_the_reference_results_come_from_the_reference():
    found = {file.name: file.read_text() for file in FOLDER.glob("ClubBallImpact_*")}
    assert found == reference_results(), "python tests/tools/reference_results.py writes them"


@pytest.mark.parametrize("name", marked(FMUS))
def test_the_fmu_has_the_reference_results(once, name):
    _, found = run_here(fmu_file(once, name))
    assert set(found) == {"law1", "law2", "k_changed"}
    # Measured: 5.3e-16.
    assert max(found.values()) <= 1e-14


def test_another_result_is_noticed(fmu_path, tmp_path):
    """By `golf-impact doctor`: a number of law 2 alone."""
    files = unpack(fmu_path)
    digits = b"1.584249713812", b"1.584249713814"
    changed = {name: data.replace(*digits, 1) for name, data in files.items()}
    del changed[SUMS]
    findings = examine(write_archive(tmp_path / "changed.fmu", changed))
    (problem,) = (text for level, text in findings if level == "problem")
    assert problem == "FMU: 3 reference results in it, relative deviation 1.3e-12 at most"


@pytest.mark.plain
@pytest.mark.parametrize(
    ("system", "level", "words"),
    [
        ("win32", "ok", f"set PATH={sys.base_prefix};%PATH%"),
        ("linux", "warning", "native hosts need libpython3."),
    ],
)
def test_what_native_hosts_need(fmu_path, monkeypatch, system, level, words):
    """By `golf-impact doctor`, where this Python has no shared library; else: test_hosts.py."""
    monkeypatch.setattr("sysconfig.get_config_var", lambda name: None)
    monkeypatch.setattr(doctor, "run_here", lambda path: ({}, {}))
    monkeypatch.setattr("sys.platform", system)
    *_, (found, text) = examine(fmu_path)
    assert (found, words in text) == (level, True)
