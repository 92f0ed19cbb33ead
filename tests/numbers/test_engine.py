"""Rows and instants by the engine; its results beside the other ways: test_impacts.py."""

import os
import sys

import numpy as np
import pytest
from cases import DEFAULTS, KINDS
from command import run as run_process
from command import run_python

import golf_impact
from golf_impact import engine
from golf_impact.data.runs import FLAGS, METRICS, MOMENTARY, PATH


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_same_bits_for_any_number_of_threads_in_any_order(threads):
    rng, rows = np.random.default_rng(37), [DEFAULTS | kind for kind in KINDS.values()]
    columns = {name: np.resize([row[name] for row in rows], 3000) for name in DEFAULTS}
    columns["club_speed"] = rng.uniform(20.0, 60.0, 3000)
    expected, order = golf_impact.run_impacts(threads=1, **columns), rng.permutation(3000)
    mixed = {name: column[order] for name, column in columns.items()}
    found = golf_impact.run_impacts(threads=threads, **mixed)
    for name in METRICS:
        assert found[name].tobytes() == expected[name][order].tobytes()
    one = golf_impact.run_impact(**{name: column[7] for name, column in columns.items()})
    assert [one[name] for name in METRICS] == [expected[name][7] for name in METRICS]


def test_the_number_of_threads(monkeypatch):
    monkeypatch.setenv("GOLF_IMPACT_THREADS", "3")
    assert (engine.number_of_threads(), engine.number_of_threads(2)) == (3, 2)
    monkeypatch.setenv("GOLF_IMPACT_THREADS", "many")
    with pytest.raises(golf_impact.UserError, match="GOLF_IMPACT_THREADS = many is refused"):
        golf_impact.run_impacts(k=[1e6])
    monkeypatch.delenv("GOLF_IMPACT_THREADS")
    assert engine.number_of_threads() >= 1


def test_only_what_is_read_is_computed(monkeypatch):
    """Of all outputs the engine reads those that are asked for."""
    read = []
    run = engine._Engine.run

    def spied(self, columns, part):
        read.append(self.space["read"][: self.space["outputs"]].tolist())
        return run(self, columns, part)

    monkeypatch.setattr(engine._Engine, "run", spied)
    golf_impact.run_impacts(["impulse", "separated"], k=[1e6, 2e6])
    assert read == [[32, 22]]


@pytest.mark.parametrize(
    "values",
    [
        *KINDS.values(),
        {"law": 2, "club_speed": -1.0},
        {"law": "2", "club_force": 300.0, "gap": "1 cm", "k": "800 N/mm", "club_speed": "95mph"},
    ],
)
def test_momentary_outputs_and_trajectories_are_those_of_the_fmu(impact, values):
    outputs = (*PATH, "mean_force", "max_force", "impulse")
    found = (
        golf_impact.run_impact(MOMENTARY, **values),
        golf_impact.run_trajectory(40, outputs, **values),
    )
    expected = impact(MOMENTARY, **values), impact.trajectory(40, outputs, **values)
    for one, other in zip(found, expected):
        assert list(one) == list(other)
        for name, value in other.items():
            atol = 1e-13 * np.abs(value).max() + 1e-16
            np.testing.assert_allclose(one[name], value, rtol=0.0, atol=atol)


def test_shapes_and_cases_without_a_contact():
    k, speed = np.array([5e5, 1e6, 2e6, 4e6]), np.array([[20.0], [40.0], [-1.0]])
    outputs = ("smash_factor", "contact_time", "touched", "separated")
    got = golf_impact.run_impacts(outputs, law=2, k=k, club_speed=speed)
    shapes = [(name, value.shape, value.dtype) for name, value in got.items()]
    assert shapes == [(name, (3, 4), bool if name in FLAGS else float) for name in outputs]
    assert got["touched"].tolist() == got["separated"].tolist() == [[True] * 4] * 2 + [[False] * 4]
    assert np.isnan(got["smash_factor"]).tolist() == (~got["touched"]).tolist()
    assert got.refused.tolist() == [[False] * 4] * 3
    one = golf_impact.run_impacts(law=2)
    assert [value.shape for value in one.values()] == [()] * len(METRICS)
    assert golf_impact.run_impacts(["impulse"], k=np.empty((0, 2)))["impulse"].shape == (0, 2)
    with pytest.raises(golf_impact.UserError, match=r"k \(2,\), b \(3,\)"):
        golf_impact.run_impacts(k=[1, 2], b=[1] * 3)


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        # What is masked is missing.
        ({"k": np.ma.array([1e6, 2e6, np.nan], mask=[False, True, False])}, "k = nan N/m"),
        ({"k": [1e6, -1.0, 1e6], "b": [9.0, -2.0, -1.0]}, "k = -1 N/m"),
        ({"law": [2, 1.5, 99]}, "law = 1.5 "),
        ({"law": 2, "restitution_at_rest": [0.9, 0.1, 0.2], "restitution_slope": 0.01}, "touch"),
    ],
)
def test_refused_cases_and_the_first_reason(values, reason):
    got = golf_impact.run_impacts(["impulse", "touched"], **values)
    assert got.refused.tolist() == np.isnan(got["impulse"]).tolist() == [False, True, True]
    assert got["touched"].tolist() == (~got.refused).tolist()
    assert reason in got.reason


def test_values_with_units():
    text = {"law": "2", "k": ["800 N/mm", "1e6"], "club_speed": "95mph", "m_club": "200 g"}
    numbers = {"law": 2, "k": [8e5, 1e6], "club_speed": 42.4688, "m_club": 0.2}
    found, expected = (golf_impact.run_impacts(["impulse"], **one) for one in (text, numbers))
    assert found["impulse"].tolist() == expected["impulse"].tolist()
    one = golf_impact.run_impact(["impulse"], **text | {"k": text["k"][0]})
    assert one["impulse"] == expected["impulse"][0]


# Trajectories


def test_instants_in_any_order():
    path = golf_impact.run_trajectory(80, law=2, gap=1e-3)
    order = np.random.default_rng(1).permutation(80).reshape(4, 20)
    got = golf_impact.run_trajectory(times=path["time"][order], law=2, gap=1e-3)
    for name, values in path.items():
        np.testing.assert_allclose(got[name], values[order], atol=1e-13 * np.abs(values).max())
    assert golf_impact.run_trajectory(times=[])["force"].shape == (0,)
    assert golf_impact.run_trajectory(points=2)["time"].shape == (2,)
    # More than a call of the engine takes.
    many = golf_impact.run_trajectory(10_001, ["impulse"], law=2, gap=1e-3)
    assert (np.diff(many["impulse"]) >= 0.0).all()


rows, trajectory = golf_impact.run_impacts, golf_impact.run_trajectory
LINE = {"law": 2, "restitution_at_rest": 0.1, "restitution_slope": 1.0}
REFUSED = [
    (rows, {"k": [1j]}, "a number"),
    *((rows, {"threads": n}, f"threads = {n} is refused") for n in (0, -1, 1.5)),
    *((trajectory, {"points": n}, rf"^points = {n} .* at least 2") for n in (1, 2.5)),
    (trajectory, {"times": [-1e-9]}, "^times = -1e-09 .* each must be a number of 0 to 1e"),
    (trajectory, {"times": [1.0000001e100]}, "0 to 1e"),
    (trajectory, {"times": "soon"}, "times = 'soon' is refused"),
    (trajectory, {"times": [0.0], "outputs": ["mean_force"]}, "use points"),
    (trajectory, {"times": [1.0], **LINE}, "touch"),
]


@pytest.mark.parametrize(("function", "arguments", "message"), REFUSED)
def test_arguments_that_are_refused(function, arguments, message):
    with pytest.raises(golf_impact.UserError, match=message) as caught:
        function(**arguments)
    assert caught.value.reason
    assert caught.value.variable


# The module, and wasmtime


def test_wasm_of_other_sources_is_refused(monkeypatch):
    monkeypatch.setattr(engine, "digest", lambda: "another")
    with pytest.raises(golf_impact.UserError, match=r"run `python -m golf_build\.wasm`"):
        engine._Engine()


_WITHOUT_CACHE = "import golf_impact; print(golf_impact.run_impact(['impulse'])['impulse'])"


def test_a_cache_that_cant_be_written(tmp_path):
    (tmp_path / "file").touch()
    places = dict.fromkeys(("HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME"), str(tmp_path / "file"))
    assert run_python(_WITHOUT_CACHE, env=os.environ | places).stdout.startswith("2.67")


#: A package that can't be loaded, as wasmtime's wheel for any platform.
_BROKEN = "raise OSError('no library for this platform')\n"


@pytest.mark.ci
def test_without_wasmtime_the_fmu_runs(tmp_path):
    """And what needs the engine says so in one line."""
    (tmp_path / "wasmtime.py").write_text(_BROKEN)
    env = os.environ | {"PYTHONPATH": str(tmp_path)}

    def command(*words, code=0):
        words = sys.executable, "-m", "golf_impact", *words
        return run_process(*words, env=env, cwd=tmp_path, code=code)

    mine = "law = 2\nk = 9e5\nb = 30.0\n[uncertainty]\nparameters = ['k']\ncovariance = [[1e6]]\n"
    (tmp_path / "mine.toml").write_text(mine)
    done = command("run", "--ball", "mine.toml", "--no-figures")
    sentence = "wasmtime, which can't be loaded (no library for this platform)"
    assert "smash factor" in done.stdout.lower()
    assert f"are left out: this needs {sentence}" in " ".join(done.stderr.split())
    command("explore", "--no-browser")
    done = command("sweep", "--set", "k=1e6,2e6", "--out", "x.csv", code=2)
    assert sentence in " ".join(done.stderr.split())
