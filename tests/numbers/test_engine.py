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
from golf_impact.data.runs import METRICS, MOMENTARY, PATH


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


def test_only_what_is_read_is_computed():
    """Of all outputs the engine reads those that are asked for."""
    golf_impact.run_impacts(["impulse", "separated"], k=[1e6, 2e6])
    space = engine._idle[-1].space
    assert space["read"][: space["outputs"]].tolist() == [32, 22]


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


# Trajectories


@pytest.mark.parametrize("exponent", [1.0, 1.0 + 1e-9, 4.0])
def test_contacts_that_last_for_seconds(impact, exponent):
    values = {"law": 2, "k": 0.1, "exponent": exponent, "reference_compression": 100.0, "b": 0.0}
    found = golf_impact.run_impact(**values)
    assert found["contact_time"] > 1.5
    assert found == pytest.approx(impact(**values), rel=1e-13)


def test_instants_in_any_order():
    path = golf_impact.run_trajectory(80, law=2, gap=1e-3)
    order = np.random.default_rng(1).permutation(80).reshape(4, 20)
    got = golf_impact.run_trajectory(times=path["time"][order], law=2, gap=1e-3)
    for name, values in path.items():
        np.testing.assert_allclose(got[name], values[order], atol=1e-13 * np.abs(values).max())
    # More than a call of the engine takes.
    many = golf_impact.run_trajectory(10_001, ["impulse"], law=2, gap=1e-3)
    assert (np.diff(many["impulse"]) >= 0.0).all()


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
