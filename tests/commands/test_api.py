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


#: What has examples in its documentation; of functions also what arrays are of a shape.
EXAMPLES = {"Impact", "balls", "calibrate", "drive", "run_impact"}
ARRAYS = {"run_impacts", "run_trajectory", "sensitivities", "sweep"}


@pytest.mark.parametrize("name", ["golf_impact", *PUBLIC])
def test_documentation(name, tmp_path, monkeypatch):
    """Its examples run; arguments are described as ruff's D417 demands."""
    monkeypatch.chdir(tmp_path)
    names = {"golf_impact": golf_impact, **{one: getattr(golf_impact, one) for one in PUBLIC}}
    runner = doctest.DocTestRunner()
    for example in doctest.DocTestFinder(recurse=False).find(names[name], name, globs=names):
        runner.run(example)
    assert runner.failures == 0
    assert runner.tries > 0 or name not in EXAMPLES | ARRAYS
    text = inspect.getdoc(names[name])
    words = ("Args:", "SI units", "shape", "UserError") if name in ARRAYS else ()
    assert [word for word in words if word not in text] == []


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


#: Functions with outputs and values as arguments, and those of an FMU.
FMU = ("FMU", "FMU, trajectory", "FMU, simulate")
RUNS = {
    "impact": golf_impact.run_impact,
    "impacts": golf_impact.run_impacts,
    "trajectory": golf_impact.run_trajectory,
    "times": partial(golf_impact.run_trajectory, times=[1e-4]),
    "sensitivities": golf_impact.sensitivities,
    "sweep": lambda outputs=("impulse",), **sets: golf_impact.sweep({"k": 1e6, **sets}, outputs),
}


@pytest.fixture
def run(request, impact):
    """One of these."""
    return {
        **RUNS,
        "FMU": impact,
        "FMU, trajectory": impact.trajectory,
        "FMU, simulate": lambda **values: impact.simulate(start_values=values),
    }[request.param]


each = pytest.mark.parametrize("run", [*RUNS, *FMU[:2]], indirect=True)


@each
def test_names(run):
    """One name, or any iterable; the error for another one names it and a similar one."""
    for outputs in ("impulse", ["impulse"], iter(["impulse"])):
        assert "impulse" in run(outputs=outputs)
    for given, name, similar in (
        ({"outputs": ["impulse", "impluse"]}, "impluse", "impulse"),
        ({"outputs": ["COR"]}, "COR", "coefficient_of_restitution"),
        ({"clubspeed": 40.0}, "clubspeed", "club_speed"),
    ):
        with pytest.raises(UserError, match=f"'{name}' .did you mean {similar}") as caught:
            run(**given)
        assert caught.value.variable == name
        assert caught.value.reason.startswith("choose from ")


@each
def test_values_that_are_no_numbers(run):
    for value in ("two", "8 lb", None, {}, [[1], [1, 2]]):
        why = "have: N/m" if value == "8 lb" else "a number"
        with pytest.raises(UserError, match=f"^k.* is refused: .*{why}") as caught:
            run(k=value)
        assert caught.value.variable == "k"


@pytest.mark.parametrize("run", ["impact", "trajectory", "times", *FMU], indirect=True)
def test_an_impact_that_is_refused(run, impact):
    """By the first of its values; simulate_fmu itself returns the rows before a refused step."""
    for values in (
        {"k": -1.0, "b": -2.0}, {"k": math.nan}, {"law": 1.5}, {"law": [2]}, {"exponent": 2.0}
    ):  # fmt: skip
        name, *_ = values
        with pytest.raises(UserError, match=f"^{name} = ") as caught:
            run(**values)
        assert caught.value.variable == name
        assert caught.value.reason
    assert impact()["smash_factor"] == 1.5641431548673965


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


@pytest.mark.parametrize("k", [10**15, Decimal("8e5"), Fraction(5e6) / 3, np.float32(8e5)])
def test_any_real_number(k):
    expected = golf_impact.run_impact(["contact_time"], k=float(k))
    assert golf_impact.run_impact(["contact_time"], k=k) == expected
    found = golf_impact.run_impacts(["contact_time"], k=[k, k])["contact_time"]
    assert found == pytest.approx(expected["contact_time"], rel=1e-13)
