"""`import golf_impact`: names, documentation with examples, arguments, errors, lazy imports."""

import doctest
import inspect
import math
import sys
from decimal import Decimal
from fractions import Fraction
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from command import run as run_process
from command import run_python

import golf_impact
from golf_impact import Impact, UserError

PUBLIC = (
    "Ball", "Calibration", "Impact", "UserError", "balls", "calibrate", "drive", "read_ball",
    "run_impact", "run_impacts", "run_trajectory", "sensitivities", "sweep",
)  # fmt: skip


# Names and documentation


def test_public_names():
    assert golf_impact.__all__ == [*PUBLIC]
    assert {*PUBLIC, "__version__"} <= set(dir(golf_impact))
    with pytest.raises(AttributeError, match="no attribute 'golf'"):
        golf_impact.golf  # noqa: B018
    for module, names in {
        "golf_impact.scenario": ("Result", "main"),
        "golf_impact.fmu": ("current_fmu", "current_system"),
        "golf_impact.evidence.reference": ("Reference",),
    }.items():
        assert all(callable(getattr(import_module(module), name)) for name in names)


#: What has examples in its documentation.
EXAMPLES = {
    "Impact", "calibrate", "drive", "run_impact", "run_impacts", "run_trajectory",
    "sensitivities", "sweep",
}  # fmt: skip

#: Public functions and methods by name.
FUNCTIONS = {
    name: member
    for public in PUBLIC
    for name, member in [
        (public, getattr(golf_impact, public)),
        *(
            (f"{public}.{name}", member)
            for name, member in inspect.getmembers(getattr(golf_impact, public))
            if not name.startswith("_") and inspect.isfunction(member)
        ),
    ]
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_documentation(name):
    """It has a summary and describes each argument by name; what raises UserError says so."""
    function = FUNCTIONS[name]
    text = inspect.getdoc(function) or ""
    assert text.partition("\n")[0].rstrip().endswith((".", ":", ";", ",")) or "\n" in text
    if inspect.isclass(function):
        return
    arguments = inspect.signature(function).parameters.values()
    described = [p.name for p in arguments if p.kind is not p.VAR_KEYWORD and p.name != "self"]
    if len(described) > 2:
        assert "Args:" in text
        assert [one for one in described if f"{one}: " not in text] == []
    if "raise UserError" in inspect.getsource(function):
        assert "UserError" in text
    if name in EXAMPLES:
        assert "SI units" in text
        assert name in ("calibrate", "drive", "run_impact") or "shape" in text


@pytest.mark.parametrize("name", PUBLIC)
def test_examples_in_the_documentation(name, tmp_path, monkeypatch):
    """They run."""
    monkeypatch.chdir(tmp_path)
    thing = getattr(golf_impact, name)
    runner = doctest.DocTestRunner()
    names = {"golf_impact": golf_impact, **{one: getattr(golf_impact, one) for one in PUBLIC}}
    for example in doctest.DocTestFinder(recurse=False).find(thing, name, globs=names):
        runner.run(example)
    assert runner.failures == 0
    assert runner.tries > 0 or name not in EXAMPLES


def test_the_example_of_the_module(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = doctest.testmod(golf_impact)
    assert result.attempted >= 8
    assert result.failed == 0


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


# Arguments of functions, and of the FMU through `Impact`


@pytest.fixture(scope="module")
def impact(fmu_path):
    with Impact(fmu_path) as impact:
        yield impact


def sweep(outputs=("impulse",), **values):
    return golf_impact.sweep({"k": 1e6, **values}, outputs)


RUNS = {
    "impact": golf_impact.run_impact,
    "impacts": golf_impact.run_impacts,
    "trajectory": golf_impact.run_trajectory,
    "times": partial(golf_impact.run_trajectory, times=[1e-4]),
    "sensitivities": golf_impact.sensitivities,
    "sweep": sweep,
    "FMU": None,
}


@pytest.mark.parametrize("name", RUNS)
def test_names(name, impact):
    """One name, or any iterable; the error for another one names it and a similar one."""
    run = RUNS[name] or impact
    for outputs in ("impulse", iter(["impulse"]))[name == "FMU" :]:
        assert "impulse" in run(outputs=[*outputs] if name == "FMU" else outputs)
    for given, name, similar in (
        ({"outputs": ["force", "impluse"]}, "impluse", "impulse"),
        ({"clubspeed": 40.0}, "clubspeed", "club_speed"),
    ):
        with pytest.raises(UserError, match=f"'{name}' .did you mean {similar}") as caught:
            run(**given)
        assert caught.value.variable == name
        assert caught.value.reason.startswith("choose from ")


def test_in_this_process_are_the_numbers_of_the_fmu(impact):
    values = {"law": 2, "club_speed": "95mph"}
    assert golf_impact.run_impact(**values) == pytest.approx(impact(**values), rel=1e-13, abs=0)
    path = golf_impact.run_trajectory(7, ("force",), **values)
    expected = impact.trajectory(7, ("force",), **values)
    assert list(path) == list(expected)
    for name, column in expected.items():
        assert path[name] == pytest.approx(column, rel=0, abs=1e-13 * column.max())


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"k": -1.0, "b": -2.0}, r"k = -1(\.0)? .*"),
        ({"law": 1.5}, "law = 1.5"),
        ({"exponent": 2.0}, "exponent = 2"),
        ({"force": 1.0}, "no input or parameter 'force'"),
    ],
)
def test_a_value_that_is_refused(impact, values, words):
    """simulate_fmu itself returns the rows before a refused step."""
    for run in (
        golf_impact.run_impact,
        golf_impact.run_trajectory,
        impact,
        lambda **values: impact.simulate(start_values=values),
    ):
        with pytest.raises(UserError, match=words):
            run(**values)
    assert impact()["smash_factor"] == 1.5641431548673965


def test_the_error_has_the_first_of_several_refusals(impact):
    for run in (golf_impact.run_impact, impact):
        with pytest.raises(UserError) as caught:
            run(k=-1.0, b=-2.0)
        error = caught.value
        assert (error.variable, error.value) == ("k", -1.0)
        assert error.reason == "it must be between 0.001 and 1e+15"


_CLOSED = """
from golf_impact import Impact, UserError
with Impact() as impact, impact:
    pass
for call in (impact, impact.simulate, lambda: impact.step(0.0, 1.0)):
    try:
        call()
    except UserError as error:
        print(error)
print(impact.folder)
print(Impact().folder)
"""


def test_a_closed_impact():
    """A call of a freed instance would end Python; no folder is left, without `with` either."""
    *sentences, closed, left = run_python(_CLOSED).stdout.splitlines()
    assert sentences == ["this FMU is closed, at the end of its `with` block: open another one"] * 3
    assert not Path(closed).exists()
    assert not Path(left).exists()


def test_messages_reach_their_own_instance(impact):
    """Also after another instance has come and gone."""
    with Impact(impact.path) as other, pytest.raises(UserError, match="b = -1"):
        other.start(b=-1.0)
    with pytest.raises(UserError, match="k = -1"):
        impact(k=-1.0)


def test_one_step_and_one_read_for_metrics(impact, monkeypatch):
    """An impact without a trajectory takes one communication step and one call of getReal."""
    calls = []
    for name in ("doStep", "getReal"):
        call = getattr(impact.instance, name)
        monkeypatch.setattr(
            impact.instance, name, lambda *a, name=name, call=call: calls.append(name) or call(*a)
        )
    impact(k=8e5)
    assert calls == ["doStep", "getReal"]


@pytest.mark.parametrize("name", ["impact", "trajectory", "FMU"])
def test_what_is_no_number(name, impact):
    run = RUNS[name] or impact
    with pytest.raises(UserError, match=r"Real.*: choose from force"):
        run(outputs=["touched"])
    for value in ("two", None, [2], [[1], [1, 2]], math.nan):
        with pytest.raises(UserError, match="law = "):
            run(law=value)


@pytest.mark.parametrize("k", [10**15, Decimal("8e5"), Fraction(5e6) / 3, np.float32(8e5)])
def test_any_real_number(k):
    expected = golf_impact.run_impact(["contact_time"], k=float(k))
    assert golf_impact.run_impact(["contact_time"], k=k) == expected
    found = golf_impact.run_impacts(["contact_time"], k=[k, k])["contact_time"]
    assert found == pytest.approx(expected["contact_time"], rel=1e-13)
