"""`import golf_impact`: its functions, and lazy imports."""

import doctest
import subprocess
import sys

import pytest

import golf_impact
from golf_impact import api


def test_public_names():
    assert golf_impact.__all__ == api.__all__ == sorted(api.__all__)
    assert set(api.__all__) <= set(dir(golf_impact))
    for name in api.__all__:
        assert getattr(golf_impact, name) is getattr(api, name)
    with pytest.raises(AttributeError, match="no attribute 'golf'"):
        golf_impact.golf  # noqa: B018


def test_the_example_in_the_docstring(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = doctest.testmod(golf_impact)
    assert result.attempted >= 8
    assert result.failed == 0
    assert [path.name for path in tmp_path.iterdir()] == ["k_b.csv"]


def test_the_physics_imports_nothing_else():
    code = "import sys, golf_physics.component; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-I", "-c", code], capture_output=True, text=True)
    tops = {name.split(".")[0] for name in done.stdout.split()}
    assert "golf_physics" in tops
    assert not tops & {"golf_impact", "golf_build", "numpy", "fmpy", "pythonfmu"}


def test_the_functions(fmu):
    values = {"law": 2, "club_speed": 40.0}
    assert golf_impact.run_impact(**values) == fmu.impact(**values)
    path, expected = (
        golf_impact.run_trajectory(7, ("force",), **values),
        fmu.trajectory(7, ("force",), **values),
    )
    assert {name: one.tolist() for name, one in path.items()} == {
        name: one.tolist() for name, one in expected.items()
    }
    with pytest.raises(golf_impact.UserError, match=r"k = -1\.0"):
        golf_impact.run_impact(k=-1.0)


def test_the_fmu_contains_none_of_it(fmu_path):
    import zipfile

    with zipfile.ZipFile(fmu_path) as archive:
        ours = [name for name in archive.namelist() if name.startswith("resources/golf_physics_")]
        (package,) = {name.split("/")[1] for name in ours}
        text = archive.read(f"resources/{package}/__init__.py").decode()
    assert golf_impact.__version__ in text
    assert "golf_impact" not in text
