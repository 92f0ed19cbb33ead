"""`import golf_impact`: its functions, and lazy imports."""

import doctest

import pytest

import golf_impact
from golf_impact import api


def test_public_names():
    assert golf_impact.__all__ == sorted(golf_impact.__all__)
    assert set(golf_impact.__all__) <= set(dir(golf_impact))
    for name in golf_impact.__all__:
        assert getattr(golf_impact, name) is getattr(api, name)
    with pytest.raises(AttributeError, match="no attribute 'golf'"):
        golf_impact.golf  # noqa: B018


def test_the_example_in_the_docstring(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = doctest.testmod(golf_impact)
    assert result.attempted >= 8
    assert result.failed == 0
    assert [path.name for path in tmp_path.iterdir()] == ["k_b.csv"]


def test_the_functions(fmu):
    values = {"law": 2, "club_speed": 40.0}
    assert golf_impact.run_impact(**values) == fmu.impact(**values)
    path, expected = (
        golf_impact.run_trajectory(7, ("force",), **values),
        fmu.trajectory(7, ("force",), **values),
    )
    assert list(path) == list(expected)
    assert all((path[name] == expected[name]).all() for name in path)
    with pytest.raises(golf_impact.UserError, match=r"k = -1\.0"):
        golf_impact.run_impact(k=-1.0)
