"""`import golf_impact`: documentation with examples, errors, lazy imports, the FMU's ways.

Names, values, results and sentences: transcripts/python.md.
"""

import doctest
import inspect
import math
import sys
from functools import partial
from importlib import import_module
from pathlib import Path

import fmpy
import pytest
from command import run as run_process
from command import run_python

import golf_impact
from golf_impact import Impact, UserError

# Names and documentation


def test_names_that_scripts_import():
    for module, names in {
        "golf_impact.scenario": ("Result", "main"),
        "golf_impact.fmu": ("current_fmu", "current_system"),
        "golf_impact.evidence.reference": ("Reference",),
    }.items():
        assert all(callable(getattr(import_module(module), name)) for name in names)


#: What has examples in its documentation; of functions also what arrays are of a shape.
EXAMPLES = {"Impact", "balls", "calibrate", "drive", "run_impact"}
ARRAYS = {"run_impacts", "run_trajectory", "sensitivities", "sweep"}


@pytest.mark.parametrize("name", ["golf_impact", *golf_impact.__all__])
def test_documentation(name, tmp_path, monkeypatch):
    """Its examples run; arguments are described as ruff's D417 demands."""
    monkeypatch.chdir(tmp_path)
    public = {one: getattr(golf_impact, one) for one in golf_impact.__all__}
    names = {"golf_impact": golf_impact, **public}
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


#: What each function and way refuses: its arguments, the variable, words of the sentence.
NAMES = [
    ({"outputs": ["impulse", "impluse"]}, "impluse", "did you mean impulse?): choose from force, "),
    ({"clubspeed": 40.0}, "clubspeed", "did you mean club_speed?): choose from k, b, "),
    *(({"k": value}, "k", "number") for value in ("two", None, {}, [[1], [1, 2]])),
    ({"k": "8 lb"}, "k", "a unit it may have: N/m, "),
]
#: Of one impact that is refused: by the first of its values.
VALUES = [
    ({"k": -1.0, "b": -2.0}, "k", "between"),
    ({"k": math.nan}, "k", "between"),
    ({"law": [2]}, "law", "number"),
    ({"exponent": 2.0}, "exponent", "law = 1"),
]
RUNS = {
    "impact": (golf_impact.run_impact, NAMES + VALUES),
    "impacts": (golf_impact.run_impacts, NAMES),
    "trajectory": (golf_impact.run_trajectory, NAMES + VALUES),
    "times": (partial(golf_impact.run_trajectory, times=[1e-4]), NAMES + VALUES),
    "sensitivities": (golf_impact.sensitivities, NAMES),
    "sweep": (lambda outputs="impulse", **v: golf_impact.sweep(v or {"k": 1}, outputs), NAMES),
    "FMU": (lambda impact, **given: impact(**given), NAMES + VALUES),
    "FMU, trajectory": (lambda impact, **given: impact.trajectory(**given), NAMES + VALUES),
    # simulate_fmu itself returns the rows before a refused step.
    "FMU, simulate": (lambda impact, **given: impact.simulate(start_values=given), VALUES),
}


@pytest.mark.parametrize("name", RUNS)
def test_what_is_refused(name, impact):
    """With the variable in the error; an output is a name or any iterable of names."""
    run, rows = RUNS[name]
    run = partial(run, impact) if "FMU" in name else run
    for given, variable, words in rows:
        with pytest.raises(UserError) as caught:
            run(**given)
        assert caught.value.variable == variable, given
        assert caught.value.reason in str(caught.value)
        assert words in str(caught.value)
    for outputs in ("impulse", ["impulse"], iter(["impulse"])) if rows != VALUES else ():
        assert "impulse" in run(outputs=outputs)
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


def test_what_an_instance_needs_is_extracted(impact):
    """Not documentation, reference results and other platforms' binaries."""
    folder = Path(impact.folder)
    assert {path.name for path in folder.iterdir()} == {
        "modelDescription.xml", "binaries", "resources"
    }  # fmt: skip
    assert [path.name for path in folder.joinpath("binaries").iterdir()] == [fmpy.platform]


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
