"""What FMI requires of a file beside its behaviour: descriptions, terminals, references."""

import math
import os
import re
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import pytest
from command import run
from conftest import FILES, holds_c
from fmpy.validation import validate_fmu
from golf_physics.variables import (
    CO_SIMULATION_ONLY,
    DERIVATIVES,
    INDICATORS,
    LAWS,
    MORE_VARIABLES,
    STATES,
    VARIABLES,
)
from html5 import elements
from lxml import etree
from reference_results import FOLDER, reference_results

from golf_build.native_header import NATIVE_LAWS
from golf_impact.fmu.file import run_here


@pytest.fixture(params=FILES)
def fmu(request):
    return request.getfixturevalue(request.param)


@pytest.fixture
def content(fmu):
    with zipfile.ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


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
def test_vdmcheck_finds_no_problem(vdmcheck, request, system_files, fmu_path, tmp_path):
    for file in (*map(request.getfixturevalue, FILES), *system_files()[:3]):
        assert vdmcheck(3 if "fmi3" in file.name else 2, file) == "No errors found.\n", file
    text = zipfile.ZipFile(fmu_path).read("modelDescription.xml")
    damaged = tmp_path / "modelDescription.xml"
    damaged.write_bytes(text.replace(b'unit="N"', b'unit="furlong"', 1))
    assert "Errors found." in vdmcheck(2, damaged, code=1)


def test_its_dependencies_are_named(fmu, content):
    """The native FMU has none; every other library that a plain binary loads is in the text."""
    name = "documentation/externalDependencies.txt"
    assert (name in content) != holds_c(fmu)
    if holds_c(fmu):
        return
    text = content[name].decode()
    binaries = b"".join(data for path, data in content.items() if path.startswith("binaries/"))
    loaded = set(re.findall(rb"\b(?:MSVCP|VCRUNTIME|python|lib(?:stdc\+\+|gcc))[\w.]*\b", binaries))
    libraries = {n.decode() for n in loaded if n.endswith((b".dll", b".so.6", b".so.1"))}
    assert {"python3.dll", "libstdc++.so.6", "libgcc_s.so.1"} <= libraries
    assert [library for library in libraries if library not in text] == []
    assert ("MSVCP140.dll" in text) == ("MSVCP140.dll" in libraries)


def test_our_modules_need_the_standard_library_alone(fmu, content):
    """Beside themselves and pythonfmu, which the plain FMU contains."""
    files = [name for name in content if name.endswith(".py")]
    assert bool(files) != holds_c(fmu)
    if holds_c(fmu):
        return
    modules = {name.split("/")[1].removesuffix(".py") for name in files}
    ours = b"\n".join(content[name] for name in files if "/pythonfmu" not in name).decode()
    imported = set(
        re.findall(r"^ *(?:from|import) (\w+)[\w.]*(?: import .*)?$", ours, re.MULTILINE)
    )
    assert "math" in imported
    assert imported <= {*sys.stdlib_module_names, *modules, "pythonfmu"}


def test_the_description_is_the_table(fmu, content):
    """In FMI 3.0 sources need a buildDescription.xml."""
    about, fmi3 = fmpy.read_model_description(str(fmu)), "fmi3" in fmu.name
    assert ("sources/all.c" in content) == holds_c(fmu)
    assert ("sources/buildDescription.xml" in content) == (holds_c(fmu) and fmi3)
    assert (about.fmiVersion, about.modelName) == ("3.0" if fmi3 else "2.0", "ClubBallImpact")
    assert about.generationTool.startswith("golf-impact " if holds_c(fmu) else "PythonFMU")
    assert about.defaultExperiment.stopTime == "0.001"
    table = VARIABLES + MORE_VARIABLES[not fmi3 :] * holds_c(fmu)
    # libcosim and ecos omit an Enumeration of FMI 2.0; they support an Integer.
    types = {"Real": "Float64"} if fmi3 else {"Enumeration": "Integer"}
    assert [v.name for v in about.modelVariables] == [row.name for row in table]
    for variable, row in zip(about.modelVariables, table, strict=True):
        kind = types.get(row.type, row.type)
        assert (variable.type, variable.causality) == (kind, row.causality)
        assert (variable.unit or "") == row.unit
        assert variable.description.startswith(row.description)
        noted = "NaN in Model Exchange" in variable.description
        assert noted == (holds_c(fmu) and row.name in CO_SIMULATION_ONLY)
        if row.type == "Real" and row.causality != "independent":
            # An order of magnitude: two digits.
            assert 0.0 < float(variable.nominal) == float(f"{row.nominal:.2g}")
        assert row.start is None or float(variable.start) == row.start
    named = {v.name: v for v in about.modelVariables}
    lowest = [float(named[name].min) for name in ("k", "m_club", "reference_compression")]
    assert lowest == [1e-3, 1e-6, 1e-9]
    assert (named["b"].min, named["restitution_at_rest"].max) == ("0.0", "1.0")
    discrete = {v.name for v in about.modelVariables if v.variability == "discrete" and v.unit}
    assert discrete == {"touch_time"}
    units = {unit.name: {d.name for d in unit.displayUnits} for unit in about.unitDefinitions}
    assert {"mph", "km/h"} <= units["m/s"]
    assert about.coSimulation.canHandleVariableCommunicationStepSize
    for interface in filter(None, (about.coSimulation, about.modelExchange)):
        assert interface.canGetAndSetFMUstate
        assert interface.canSerializeFMUstate
    if not fmi3:
        unknowns = {unknown.variable.name: unknown for unknown in about.initialUnknowns}
        outputs = {row.name for row in VARIABLES if row.causality == "output"}
        assert {*unknowns} == outputs | {*DERIVATIVES} if holds_c(fmu) else outputs
        # The club speed follows from it in a swing: OMSimulator would find an algebraic loop.
        assert unknowns["impulse"].dependencies == []
        # In co-simulation alone there is no direct feedthrough.
        through = [unknown for unknown in about.outputs if unknown.dependencies]
        assert bool(through) == holds_c(fmu)


def test_what_model_exchange_describes(fmu, content):
    about, fmi3 = fmpy.read_model_description(str(fmu)), "fmi3" in fmu.name
    assert (about.modelExchange is not None) == holds_c(fmu)
    if not holds_c(fmu):
        return
    # Of Model Exchange alone.
    assert content["modelDescription.xml"].count(b"providesDirectionalDerivative") == 1
    derivatives = [unknown.variable for unknown in about.derivatives]
    assert tuple(v.name for v in derivatives) == DERIVATIVES
    assert tuple(v.derivative.name for v in derivatives) == STATES
    if fmi3:
        assert tuple(unknown.variable.name for unknown in about.eventIndicators) == INDICATORS
    else:
        assert about.numberOfEventIndicators == len(INDICATORS)


def test_what_only_fmi_3_describes(fmu):
    about = fmpy.read_model_description(str(fmu))
    fmi3 = "fmi3" in fmu.name
    if not fmi3:
        return
    (law,) = about.typeDefinitions
    assert law.type == "Enumeration"
    assert {int(item.value): item.name for item in law.items} == {
        n: LAWS[n][0] for n in NATIVE_LAWS
    }
    assert about.coSimulation.hasEventMode
    assert about.coSimulation.mightReturnEarlyFromDoStep


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


# The page in documentation


def check_page(file):
    """The page of an FMU has every variable, and its links lead to files beside it."""
    about = fmpy.read_model_description(str(file))
    with zipfile.ZipFile(file) as archive:
        text, inside = archive.read("documentation/index.html").decode(), archive.namelist()
    seen = elements(text)
    assert {"viewport", "color-scheme"} <= {meta.get("name") for meta in seen["meta"]}
    names = re.findall(r"<th[^>]*><code>(.*?)</code>", text)
    assert names == [v.name for v in about.modelVariables]
    files = {
        one[key] for each in seen.values() for one in each for key in one.keys() & {"href", "src"}
    }
    assert {f"documentation/{name}" for name in files} <= set(inside)
    return text


def test_the_page(fmu, content):
    text = check_page(fmu)
    assert "P &minus; F" in text
    assert ("Model Exchange" in text) == holds_c(fmu)
    folders = {name.split("/")[1] for name in content if name.startswith("binaries/")}
    assert ("macOS x86_64" in text) == bool(folders & {"darwin64", "x86_64-darwin"})
    assert ("Linux aarch64" in text) == ("aarch64-linux" in folders)


def test_companions_have_a_page_and_an_experiment(system_files):
    for file in system_files()[:3]:
        check_page(file)
        assert fmpy.read_model_description(str(file)).defaultExperiment.stepSize


# Reference results


def test_the_reference_results_come_from_the_reference():
    found = {file.name: file.read_text() for file in FOLDER.glob("ClubBallImpact_*")}
    assert found == reference_results(), "python tests/tools/reference_results.py writes them"


def test_the_fmu_has_the_reference_results(fmu):
    _, found = run_here(fmu)
    assert set(found) == {"law1", "law2", "k_changed"}
    # Measured: 5.3e-16.
    assert max(found.values()) <= 1e-14


def test_another_result_is_noticed(fmu_path, tmp_path):
    changed = tmp_path / "changed.fmu"
    with zipfile.ZipFile(fmu_path) as old, zipfile.ZipFile(changed, "w") as new:
        for name in old.namelist():
            # A number of law 2 alone.
            new.writestr(name, old.read(name).replace(b"1.58424971", b"1.58424972", 1))
    _, found = run_here(changed)
    assert found["law2"] == pytest.approx(6e-9, rel=0.1)
    assert found["law1"] <= 1e-14


# Units


def test_display_units_of_the_fmus(fmu_path, system_files):
    """All of them; how many of the unit are an SI unit (one mile: 1609.344 m)."""
    expected = {
        "mm": 1e3, "g": 1e3, "ms": 1e3, "us": 1e6, "mph": 3600 / 1609.344, "km/h": 3.6, "kN": 1e-3,
        "kN/m": 1e-3, "N/mm": 1e-3, "%": 100.0, "deg": 180.0 / math.pi, "rpm": 30.0 / math.pi,
    }  # fmt: skip
    for file in (fmu_path, *system_files()[:-1]):
        for unit in fmpy.read_model_description(str(file)).unitDefinitions:
            for one in unit.displayUnits or ():
                assert one.factor == pytest.approx(expected[one.name], rel=1e-15), one.name
