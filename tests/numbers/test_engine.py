"""Rows of impacts by the engine; its numbers beside the other ways: test_impacts.py."""

import os
import sys

import numpy as np
import pytest
from cases import KINDS
from command import run as run_process
from command import run_python

import golf_impact
from golf_impact import engine
from golf_impact.data.runs import FLAGS, METRICS, MOMENTARY


def spread(number, **values):
    """Ordinary impacts of all kinds."""
    rng, kinds = np.random.default_rng(37), [*KINDS.values()]
    names = {name for kind in kinds for name in kind}
    columns = {
        name: np.array(
            [
                kinds[n % len(kinds)].get(name, golf_impact.data.quantities.START[name])
                for n in range(number)
            ],
            float,
        )
        for name in names
    }
    return columns | {"club_speed": rng.uniform(20.0, 60.0, number)} | values


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_same_bits_for_any_number_of_threads_in_any_order(threads):
    columns = spread(3000)
    expected = golf_impact.run_impacts(threads=1, **columns)
    order = np.random.default_rng(1).permutation(3000)
    found = golf_impact.run_impacts(
        threads=threads, **{name: column[order] for name, column in columns.items()}
    )
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
    for threads in (0, -1, 1.5):
        with pytest.raises(golf_impact.UserError, match=f"threads = {threads} is refused"):
            golf_impact.run_impacts(threads=threads)


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


def test_momentary_outputs_are_those_of_the_fmu(way_of):
    with_force = {"law": 2, "club_force": 300.0, "gap": 0.01}
    for values in ({}, {"law": 2, "club_speed": -1.0}, with_force):
        found = golf_impact.run_impact(MOMENTARY, **values)
        expected = way_of("Impact").function(MOMENTARY, **values)
        for name in MOMENTARY:
            assert found[name] == pytest.approx(expected[name], rel=1e-13, abs=1e-16)


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


def test_refused_cases_and_the_first_reason():
    values = {
        "b": np.array([9.0, -1.0, 9.0, np.nan, 9.0, np.inf, 9.0, 9.0]),
        "k": np.array([1e6, -1.0, -1.0, 1e6, 1e6, 1e6, 1e6, 1e6]),
        "law": np.array([2, 2, 2, 2, 1.5, 2, 1, 99]),
        "exponent": np.array([1, 1, 1, 1, 1, 1, 1.5, 1]),
    }
    got = golf_impact.run_impacts(**values)
    assert got.refused.tolist() == [False] + [True] * 7
    assert np.isnan(got["impulse"]).tolist() == got.refused.tolist()
    for n in range(1, 8):
        with pytest.raises(golf_impact.UserError) as caught:
            golf_impact.run_impact(**{name: value[n] for name, value in values.items()})
        assert n > 1 or got.reason == str(caught.value)
        assert caught.value.reason
    line = golf_impact.run_impacts(law=2, restitution_at_rest=[0.9, 0.1], restitution_slope=0.003)
    assert line.refused.tolist() == [False, True]
    assert "at touch" in line.reason
    masked = np.ma.array([1e6, 2e6], mask=[False, True])
    assert golf_impact.run_impacts(k=masked).refused.tolist() == [False, True]


@pytest.mark.parametrize(
    ("values", "variable"),
    [
        ({"b": -1.0}, "b"),
        ({"exponent": 2.0}, "exponent"),
        ({"restitution_at_rest": 0.5}, "restitution_at_rest"),
        ({"law": 2, "restitution_at_rest": 0.1, "restitution_slope": 1.0}, "club_speed"),
        ({"law": 3}, "law"),
    ],
)
def test_the_variable_to_be_corrected(values, variable):
    with pytest.raises(golf_impact.UserError) as caught:
        golf_impact.run_impact(**values)
    assert caught.value.variable == variable
    assert ("plain FMU (golf-impact run --set law=3" in str(caught.value)) == (variable == "law")


@pytest.mark.parametrize("run", [golf_impact.run_impact, golf_impact.run_impacts])
def test_values_with_units(run):
    given = run(["impulse"], law="2", k="800 N/mm", club_speed="95mph", m_club="200 g")
    assert (
        given["impulse"]
        == run(["impulse"], law=2, k=8e5, club_speed=42.4688, m_club=0.2)["impulse"]
    )
    for k, why in ((None, "it must be a number"), ("8 lb", "isn't a unit it may have: N/m")):
        with pytest.raises(golf_impact.UserError, match=why) as caught:
            run(k=k)
        assert caught.value.variable == "k"
    several = golf_impact.run_impacts(["impulse"], k=["800 N/mm", "1e6"])["impulse"]
    assert (several == golf_impact.run_impacts(["impulse"], k=[8e5, 1e6])["impulse"]).all()


def test_values_that_are_refused():
    for values, message in (
        ({"k": 1j}, "k is refused: it must be a number"),
        ({"k": [1e6, 2e6], "b": [1, 2, 3]}, r"k \(2,\), b \(3,\)"),
    ):
        with pytest.raises(golf_impact.UserError, match=message):
            golf_impact.run_impacts(**values)


# Trajectories


def test_instants_in_any_order():
    path = golf_impact.run_trajectory(80, law=2, gap=1e-3)
    order = np.random.default_rng(1).permutation(80).reshape(4, 20)
    got = golf_impact.run_trajectory(times=path["time"][order], law=2, gap=1e-3)
    for name, values in path.items():
        np.testing.assert_allclose(got[name], values[order], atol=1e-13 * np.abs(values).max())
    # More than a call of the engine takes.
    many = golf_impact.run_trajectory(10_001, ["impulse"], law=2, gap=1e-3)
    assert (np.diff(many["impulse"]) >= 0.0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_a_trajectory_is_that_of_the_fmu(way_of, kind):
    outputs = ("force", "club_position", "ball_velocity", "mean_force", "max_force", "impulse")
    found = golf_impact.run_trajectory(40, outputs, **KINDS[kind])
    expected = way_of("Impact").function.trajectory(40, outputs, **KINDS[kind])
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, rtol=0, atol=1e-13 * np.abs(values).max())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"times": [-1e-9]}, "times = -1e-09 is refused: each must be a number of 0 to 1e"),
        ({"times": [1.0000001e100]}, "0 to 1e"),
        *(({"points": n}, rf"points = {n} is refused: .* at least 2") for n in (1, 2.5)),
        ({"times": "soon"}, "times = 'soon' is refused"),
        ({"times": [0.0], "outputs": ["mean_force"]}, "use points"),
        ({"times": [0.0], "k": -1.0}, r"k = -1 "),
        ({"times": [1.0], "law": 2, "restitution_at_rest": 0.1, "restitution_slope": 1.0}, "touch"),
    ],
)
def test_trajectories_that_are_refused(arguments, message):
    with pytest.raises(golf_impact.UserError, match=message) as caught:
        golf_impact.run_trajectory(**arguments)
    assert caught.value.reason
    assert caught.value.variable
    assert len(golf_impact.run_trajectory(points=2)["time"]) == 2


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
