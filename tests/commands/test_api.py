"""`import golf_impact`: its functions, and lazy imports."""

import doctest
import sys
from functools import partial

import pytest
from command import run as run_process
from command import run_python

import golf_impact


def test_public_names():
    assert golf_impact.__all__ == sorted(golf_impact.__all__)
    assert set(golf_impact.__all__) <= set(dir(golf_impact))
    assert all(callable(getattr(golf_impact, name)) for name in golf_impact.__all__)
    with pytest.raises(AttributeError, match="no attribute 'golf'"):
        golf_impact.golf  # noqa: B018


def test_the_example_in_the_docstring(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = doctest.testmod(golf_impact)
    assert result.attempted >= 8
    assert result.failed == 0


def test_the_functions(fmu_path):
    values = {"law": 2, "club_speed": 40.0}
    path = golf_impact.run_trajectory(7, ("force",), **values)
    with golf_impact.Impact(fmu_path) as impact:
        assert golf_impact.run_impact(**values) == impact(**values)
        expected = impact.trajectory(7, ("force",), **values)
    assert list(path) == list(expected)
    assert all((path[name] == expected[name]).all() for name in path)
    with pytest.raises(golf_impact.UserError, match=r"k = -1\.0"):
        golf_impact.run_impact(k=-1.0)


@pytest.mark.ci
def test_public_names_have_types(tmp_path):
    (tmp_path / "user.py").write_text(
        "import golf_impact\n"
        "speed: float = golf_impact.run_impact(law=2)['ball_velocity']\n"
        "refused = golf_impact.run_impacts(['smash_factor'], k=[1e6]).refused\n"
        "table = golf_impact.sweep({'k': [1e6, 2e6]}).refused\n"
        "try:\n    golf_impact.sensitivities(wrt=['k'])\n"
        "except golf_impact.UserError as error:\n    print(error.variable)\n"
    )
    words = "-m", "mypy", "--strict", "--no-incremental", "--config-file=", "user.py"
    run_process(sys.executable, *words, cwd=tmp_path)


def sweep(outputs=("impulse",), **values):
    return golf_impact.sweep({"k": 1e6, **values}, outputs)


RUNS = {
    "impact": golf_impact.run_impact,
    "impacts": golf_impact.run_impacts,
    "trajectory": golf_impact.run_trajectory,
    "times": partial(golf_impact.run_trajectory, times=[1e-4]),
    "sensitivities": golf_impact.sensitivities,
    "sweep": sweep,
}


@pytest.mark.parametrize("run", RUNS.values(), ids=RUNS)
def test_names(run):
    """One name, or any iterable; the error for another one names it and a similar one."""
    for outputs in ("impulse", iter(["impulse"])):
        assert "impulse" in run(outputs=outputs)
    for given, name, similar in (
        ({"outputs": ["force", "impluse"]}, "impluse", "impulse"),
        ({"clubspeed": 40.0}, "clubspeed", "club_speed"),
    ):
        with pytest.raises(
            golf_impact.UserError, match=f"'{name}' .did you mean {similar}"
        ) as caught:
            run(**given)
        assert caught.value.variable == name
        assert caught.value.reason.startswith("choose from ")


@pytest.mark.parametrize("run", [golf_impact.run_impact, golf_impact.run_trajectory])
def test_flags_are_no_numbers(run):
    with pytest.raises(golf_impact.UserError, match="no output 'touched' of type Real: choose"):
        run(outputs=["touched"])


_WITHOUT_FMU = """
import sys
def opened(event, arguments):
    if event == "open" and str(arguments[0]).endswith((".fmu", ".toml", ".so")):
        print("opened", arguments[0])
import golf_impact, golf_impact.api
sys.addaudithook(opened)
golf_impact.run_impact(law=2)
golf_impact.run_impacts(k=[8e5, 1e6])
golf_impact.run_trajectory(times=[1e-4], outputs=["force"])
golf_impact.sensitivities(law=2)
print(*{"fmpy", "pythonfmu", "matplotlib"} & {*sys.modules})
"""


def test_no_fmu_is_loaded_for_an_impact():
    assert run_python(_WITHOUT_FMU).stdout == "\n"
