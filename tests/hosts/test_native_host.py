"""A small C host loads the FMU; test_hosts.py has real ones."""

import os

import fmpy
import pytest
from command import outputs
from compare import assert_close
from conftest import LAW_1
from programs import HOST_TASKS

from golf_impact.commands import doctor
from golf_impact.doctor import check_temporary_folder, run_here
from golf_impact.errors import UserError


@pytest.fixture(scope="module")
def folder(fmu_path, tmp_path_factory):
    # A host that passes the address as it is may even have these: it is escapes that do harm.
    place = tmp_path_factory.mktemp("native host #")
    fmpy.extract(str(fmu_path), str(place))
    return place


@pytest.fixture(scope="module")
def host(compiled, libpython, freed, folder):
    program = compiled("host")
    guid = fmpy.read_model_description(str(folder)).guid

    def host(*task, preload=True, strict=False, **environment):
        if preload:
            environment |= {"LD_PRELOAD": f"{libpython}:{freed}" if strict else str(libpython)}
        return outputs(program, folder, guid, *task, env={"PATH": os.defpath, **environment})

    return host


def same(outputs):
    # Measured: equal to the last bit.
    assert_close(outputs, LAW_1)


@pytest.mark.parametrize("step", ["1e-3", "1e-4", "1e-6"])
def test_impact(host, step):
    same(host("impact", step))


@pytest.mark.parametrize("task", HOST_TASKS, ids=lambda task: task[0])
@pytest.mark.parametrize("strict", [False, pytest.param(True, marks=pytest.mark.ci)])
def test_life_of_an_instance(host, task, strict):
    same(host(*task, strict=strict))


def test_a_host_may_load_libpython_itself(host, libpython):
    same(host("impact", "1e-4", preload=False, LIBPYTHON=str(libpython)))


def test_without_libpython_the_linker_reports_it(host):
    with pytest.raises(AssertionError, match="undefined symbol"):
        host("impact", preload=False)


def test_a_call_makes_no_thread_state(host):
    """Making one at every call would cost ten times the call."""
    assert host("state", "1000") == {
        "states_made_by_steps": 0.0,
        "states_made_by_reads": 0.0,
        "state_at_the_end": 0.0,
    }


def test_the_line_that_doctor_prints_works(host, fmu_path, libpython, capsys):
    assert doctor.doctor([fmu_path]) == 0
    shown = capsys.readouterr().out.splitlines()
    (line,) = (text for text in shown if "native hosts: LD_PRELOAD=" in text)
    settings = dict(part.split("=", 1) for part in line.split() if "=" in part)
    same(host("impact", "1e-3", preload=False, **settings))


def test_doctor_on_files_that_are_no_fmu(tmp_path, capsys):
    damaged = tmp_path / "damaged.fmu"
    damaged.write_bytes(b"PK no zip")
    for file in (damaged, tmp_path / "missing.fmu", tmp_path):
        assert doctor.doctor([file]) == 1
        shown = capsys.readouterr().out.splitlines()
        (line,) = (text for text in shown if text.startswith("problem"))
        assert str(file) in line


@pytest.mark.parametrize(
    ("folder", "odd"),
    [("a space-b_c.d~", ""), ("ü", "ü"), pytest.param("a#+(%41)", "#+(%)", marks=pytest.mark.ci)],
)
def test_folders_that_pythonfmu_crashes_in(folder, odd, fmu_path, tmp_path, monkeypatch):
    place = tmp_path / folder
    place.mkdir()
    monkeypatch.setenv("TMPDIR", str(place))
    monkeypatch.setattr("tempfile.tempdir", None)
    refused = crashed = False
    try:
        check_temporary_folder()
    except UserError as error:
        refused = "set TMPDIR" in str(error)
    try:
        run_here(fmu_path)
    except UserError as error:
        crashed = "can't be run here (signal" in str(error)
    assert refused == crashed == bool(odd)
