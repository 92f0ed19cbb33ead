"""What FMI 2.0 and 3.0 ask of a file beside its behaviour: descriptions, terminals, references."""

import os
import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import pytest
from command import run
from fmpy.validation import validate_fmu
from lxml import etree
from reference_results import FOLDER, reference_results

from golf_impact.fmu.reference import deviations

FILES = ("fmu_path", "fmi3_path", "standalone_path", "standalone_fmi3_path")


@pytest.fixture(params=FILES)
def fmu(request):
    return request.getfixturevalue(request.param)


@pytest.fixture
def content(fmu):
    with zipfile.ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def is_standalone(fmu):
    return "standalone" in fmu.name


def test_fmpy_finds_no_problem(fmu):
    assert validate_fmu(str(fmu)) == []


@pytest.fixture
def vdmcheck():
    """Runs VDMCheck, the rules of both standards as a formal model: what it prints."""
    folder = os.environ.get("GOLF_IMPACT_VDMCHECK")
    if not folder:
        pytest.skip("GOLF_IMPACT_VDMCHECK isn't set: tests/README.md has what it names")
    return lambda fmi, file, **options: run(f"{folder}/VDMCheck{fmi}.sh", file, **options).stdout


@pytest.mark.ci
def test_vdmcheck_finds_no_problem(vdmcheck, fmu):
    assert vdmcheck(3 if "fmi3" in fmu.name else 2, fmu) == "No errors found.\n"


@pytest.mark.ci
def test_vdmcheck_finds_no_problem_in_the_companions(vdmcheck, system_files, fmu_path, tmp_path):
    for file in system_files()[:3]:
        assert vdmcheck(2, file) == "No errors found.\n"
    text = zipfile.ZipFile(fmu_path).read("modelDescription.xml")
    damaged = tmp_path / "modelDescription.xml"
    damaged.write_bytes(text.replace(b'unit="N"', b'unit="furlong"', 1))
    assert "Errors found." in vdmcheck(2, damaged, code=1)


def test_its_dependencies_are_named(fmu, content):
    """The standalone FMU has none; every other library that a plain binary loads is in the text."""
    name = "documentation/externalDependencies.txt"
    assert (name in content) != is_standalone(fmu)
    if is_standalone(fmu):
        return
    text = content[name].decode()
    binaries = b"".join(data for path, data in content.items() if path.startswith("binaries/"))
    loaded = set(re.findall(rb"\b(?:MSVCP|VCRUNTIME|python|lib(?:stdc\+\+|gcc))[\w.]*\b", binaries))
    libraries = {n.decode() for n in loaded if n.endswith((b".dll", b".so.6", b".so.1"))}
    assert {"python3.dll", "libstdc++.so.6", "libgcc_s.so.1"} <= libraries
    assert [library for library in libraries if library not in text] == []
    assert ("MSVCP140.dll" in text) == ("MSVCP140.dll" in libraries)


def test_what_it_says_of_itself(fmu, content):
    """Sources would need a buildDescription.xml."""
    assert not [name for name in content if name.startswith("sources/")]
    about = fmpy.read_model_description(str(fmu))
    assert about.generationTool.startswith("golf-impact " if is_standalone(fmu) else "PythonFMU")
    discrete = {v.name for v in about.modelVariables if v.variability == "discrete" and v.unit}
    assert discrete == {"touch_time"}


@pytest.mark.parametrize("law", [1, 2])
def test_the_proposed_tolerance_is_enough(fmi3_path, law):
    """Measured: 4e-7 in COR; 2e-5 with fmpy's own, 1e-4."""
    about = fmpy.read_model_description(str(fmi3_path))
    assert float(about.defaultExperiment.tolerance) == 1e-8
    name, expected = "coefficient_of_restitution", {1: 0.9490239649368046, 2: 0.9307477583617195}
    options = {"fmi_type": "ModelExchange", "start_values": {"law": law, "gap": 0.0035}}
    rows = fmpy.simulate_fmu(str(fmi3_path), output=[name], **options)
    assert rows[name][-1] == pytest.approx(expected[law], abs=1e-6)


def test_terminals_and_icon(fmu, content):
    folder = "terminalsAndIcons/"
    icons = {name for name in content if name.startswith((folder, "model.png"))}
    if "fmi3" not in fmu.name:
        assert icons == {"model.png"}
        return
    assert icons == {folder + "icon.png", folder + "terminalsAndIcons.xml"}
    assert content[folder + "icon.png"].startswith(b"\x89PNG")
    document = content[folder + "terminalsAndIcons.xml"]
    schema = Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd"
    etree.XMLSchema(etree.parse(schema)).assertValid(etree.fromstring(document))
    variables = {v.name: v for v in fmpy.read_model_description(str(fmu)).modelVariables}
    found = ElementTree.fromstring(document).iter("Terminal")
    terminals = {one.get("name"): [member.get("variableName") for member in one] for one in found}
    assert terminals["club"] == ["club_speed", "impulse", "club_force"]
    assert set(terminals) == {"club", "launch"}
    assert {variables[name].causality for name in terminals["launch"]} == {"output"}


# Reference results


def test_the_reference_results_come_from_the_reference():
    found = {file.name: file.read_text() for file in FOLDER.glob("ClubBallImpact_*")}
    assert found == reference_results(), "python tests/reference_results.py writes them"


def test_the_fmu_has_the_reference_results(fmu):
    found = deviations(fmu)
    assert set(found) == {"law1", "law2", "k_changed"}
    # Measured: 5.3e-16.
    assert max(found.values()) <= 1e-14


def test_another_result_is_noticed(fmu_path, tmp_path):
    changed = tmp_path / "changed.fmu"
    with zipfile.ZipFile(fmu_path) as old, zipfile.ZipFile(changed, "w") as new:
        for name in old.namelist():
            # A number of law 2 alone.
            new.writestr(name, old.read(name).replace(b"1.58424971", b"1.58424972", 1))
    found = deviations(changed)
    assert found["law2"] == pytest.approx(6e-9, rel=0.1)
    assert found["law1"] <= 1e-14
