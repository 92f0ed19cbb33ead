"""`golf-impact explore` without a browser: its file, its physics, the command."""

import random
import re
from importlib.resources import files
from math import isnan, sqrt

import numpy as np
import pytest
from cases import CASES as SHARED
from cases import DEFAULTS
from command import ROOT, golf_here, refused
from compare import assert_within
from html5 import check_page
from tab import by_wasm, facts

import golf_impact
from golf_impact.ball import BALLS
from golf_impact.explore.page import page
from golf_impact.scales import contact_scales

REFUSED = [{"k": -1.0}, {"law": 1.5}, {"m_ball": 0.0}, {"exponent": 13.0}, {"gap": 1e99}]


def random_case(rng):
    """An impact in golf or far beyond it; some are refused."""
    case = {
        "law": rng.choice([1, 2]),
        "k": 10 ** rng.uniform(3, 9) if rng.random() < 0.3 else rng.uniform(2e5, 3e6),
        "m_club": rng.uniform(0.05, 0.5), "m_ball": rng.uniform(0.02, 0.1),
        "club_speed": rng.uniform(1, 70), "ball_speed": rng.choice([0.0, rng.uniform(-20, 1)]),
        "gap": rng.choice([0.0, rng.uniform(0, 0.01)]),
    }  # fmt: skip
    mu = 1.0 / (1.0 / case["m_club"] + 1.0 / case["m_ball"])
    ratio = rng.choice([0.0, rng.uniform(0, 0.9), 10 ** rng.uniform(-2, 1)])
    case["b"] = 2.0 * ratio * sqrt(case["k"] * mu)
    others = [{}, {}, {"club_force": rng.uniform(-2000, 2000)}]
    if case["law"] == 2:
        others.append({"exponent": rng.uniform(1, 3)})
        others.append({"restitution_at_rest": rng.uniform(0.1, 1), "restitution_slope": 0.003})
    return case | rng.choice(others) | (rng.choice(REFUSED) if rng.random() < 0.1 else {})


def test_the_wasm_is_the_physics(tmp_path):
    """Within 1e-13 in the scales of the tolerances (worst 8.6e-16); the same refusals."""
    rng, count, refusals = random.Random(7), 0, 0
    cases = [case.given for case in SHARED.values() if not case.changes]
    cases += [random_case(rng) for _ in range(4000)]
    for given, found in zip(cases, by_wasm(cases, tmp_path), strict=True):
        expected, error = None, None
        try:
            expected = golf_impact.run_impact(**given)
        except golf_impact.UserError as refusal:
            error = refusal
        if expected is None:
            # A law is a whole number for Python, 1 or 2 for C.
            assert given.get("law") == 1.5 or found["refused"] == str(error)
            assert found["about"] == error.variable
            refusals += 1
            continue
        scales = contact_scales(DEFAULTS | given, expected)
        for name, value in expected.items():
            assert isnan(value) == (found["metrics"][name] is None), (name, given)
            if not isnan(value):
                count += 1
                off = scales.error(name, found["metrics"][name], value)
                assert_within(off, name=name, case=given)
    assert (count > 40_000, 200 < refusals < 800) == (True, True)


STIFFENING = {"law": 2, "b": 0.0, "exponent": 1.6}
PUSHED = {"gap": 0.01, "law": 2, "ball_speed": 3.0, "club_force": 500.0}


@pytest.mark.parametrize("given", [{}, STIFFENING, PUSHED, dict(BALLS["penner"].values)])
def test_curves_energies_and_momenta(given, tmp_path):
    v = DEFAULTS | given | {"gap": 0.0}
    (found,) = by_wasm([{**given, "drawn": 1}], tmp_path)
    path = {name: np.array(column) for name, column in found["path"].items()}
    since, results = path["time"] > 0.0, golf_impact.run_impact(**v)
    right = golf_impact.run_trajectory(times=path["time"][since], **v)
    for name in right.keys() - {"time"}:
        scale = contact_scales(v, results).of(name)
        assert_within(np.abs(path[name][since] - right[name]).max() / scale, 1e-12, name)
    # The peak and the end of contact are samples.
    assert path["force"].max() == pytest.approx(results["max_force"], rel=1e-12)
    assert np.abs(path["time"] / results["contact_time"] - 1.0).min() < 1e-12
    start = 0.5 * (v["m_club"] * v["club_speed"] ** 2 + v["m_ball"] * v["ball_speed"] ** 2)
    work = v["club_force"] * np.where(since, path["club_position"], 0.0)
    energies = sum(path[f"{part}_energy"] for part in ("club", "ball", "spring", "lost"))
    assert energies == pytest.approx(start + work, rel=1e-12)
    lost = path["lost_energy"]
    assert (np.diff(lost) > -1e-12 * start).all()
    assert (lost.max() < 1e-12 * start) == (v["b"] == 0.0)
    push, total = v["club_force"] * np.maximum(path["time"], 0.0), path["total_momentum"]
    assert (total == pytest.approx(total[0] + push, rel=1e-12)) == (v["law"] == 2)


def test_one_file_that_needs_nothing_else():
    text, wasm = page({}), files("golf_impact.explore") / "physics.wasm"
    check_page(text)
    assert len(text.encode()) < 400_000
    assert len(wasm.read_bytes()) <= 130_000
    markup = re.sub(r"<(script|style|pre)\b.*?</\1>", "", text, flags=re.DOTALL)
    assert re.findall(r'\b(?:src|href|action)="(?![#?]|data:)[^"]*"', markup) == []
    script = text[text.index('<script type="module">') :]
    assert re.findall(r"\b(?:import|fetch|XMLHttpRequest|WebSocket)\b", script) == []
    for notice in ("musl as a whole is licensed", "wasi-libc as a whole", "The MIT License"):
        assert notice in text
    assert {name: one["start"] for name, one in facts()["inputs"].items()} == DEFAULTS


@pytest.mark.ci
def test_the_wasm_is_made_from_these_sources():
    """Byte for byte; zig's first run takes a minute."""
    wasm = pytest.importorskip("golf_build.wasm", reason="the sources in C aren't here")
    try:
        made = wasm.build()
    except wasm.WasmError as error:
        pytest.skip(str(error))
    folder = ROOT / "scenarios" / "golf_impact" / "explore"
    for name, data in made.items():
        assert data == (folder / name).read_bytes(), f"run python -m golf_build.wasm: {name}"


def test_the_command(tmp_path):
    done = golf_here("explore", "--no-browser", cwd=tmp_path, code=0)
    default, other = tmp_path / "golf-impact-results" / "explore.html", tmp_path / "other.html"
    assert done.stdout.strip() == str(default)
    assert default.read_text("utf-8") == page({})
    # Another case in the same file, with a ball of one's own and its conditions.
    ball = 'law = 2\nk = "800 N/mm"\nb = 30\n[conditions]\nclub_speed = 41.0\n'
    (tmp_path / "mine.toml").write_text(ball)
    case = "--ball", "mine.toml", "--set", "b=31"
    golf_here("explore", "--no-browser", *case, cwd=tmp_path, code=0)
    written = facts(default.read_text("utf-8"))
    assert written["case"] == DEFAULTS | {"law": 2, "k": 8e5, "b": 31.0, "club_speed": 41.0}
    assert written["balls"][-1]["name"] == "mine.toml"
    golf_here("explore", "--set", "club_speed=95mph", "--export", tmp_path / "a/b.html", code=0)
    assert facts((tmp_path / "a/b.html").read_text())["case"]["club_speed"] == 42.4688
    other.write_text("<p>mine</p>")
    refused(golf_here("explore", "--export", other), "isn't a page of golf-impact explore")
    assert other.read_text() == "<p>mine</p>"
    refused(golf_here("explore", "--export", tmp_path), "can't write")
    refused(golf_here("explore", "--set", "k=-1", cwd=tmp_path), "k = -1.0 N/m is refused")
