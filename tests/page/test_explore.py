"""`golf-impact explore` without a browser: its file, the curves it draws, the command.

That its numbers are those of the physics is in tests/numbers: the page is one of the ways.
"""

import json
import re
from importlib.resources import files

import numpy as np
import pytest
from cases import DEFAULTS
from command import ROOT, golf_here
from compare import contact_scales
from html5 import check_page
from shown import check_snapshot
from tab import by_wasm, facts

import golf_impact
from golf_impact.data.balls import BALLS
from golf_impact.explore.page import write_page

STIFFENING = {"law": 2, "b": 0.0, "exponent": 1.6}
SOFT = {"law": 2, "k": 0.1, "b": 0.0}  # a contact of 2 s
PUSHED = {"gap": 0.01, "law": 2, "ball_speed": 3.0, "club_force": 500.0}


@pytest.mark.parametrize("given", [{}, STIFFENING, SOFT, PUSHED, dict(BALLS["penner"].values)])
def test_curves_energies_and_momenta(given, tmp_path):
    v = DEFAULTS | given | {"gap": 0.0}
    (found,) = by_wasm([{**given, "drawn": 1}], tmp_path)
    path = {name: np.array(column) for name, column in found["path"].items()}
    since, results = path["time"] > 0.0, golf_impact.run_impact(**v)
    for name, column in golf_impact.run_trajectory(times=path["time"][since], **v).items():
        if name != "time":
            scale = contact_scales(v, results).of(name)
            np.testing.assert_allclose(path[name][since], column, rtol=0.0, atol=1e-12 * scale)
    # The peak and the end of contact are samples.
    assert path["force"].max() == pytest.approx(results["max_force"], rel=1e-12)
    end = np.abs(path["time"] / results["contact_time"] - 1.0).argmin()
    assert path["time"][end] == pytest.approx(results["contact_time"], rel=1e-12)
    start = 0.5 * (v["m_club"] * v["club_speed"] ** 2 + v["m_ball"] * v["ball_speed"] ** 2)
    work = v["club_force"] * np.where(since, path["club_position"], 0.0)
    energies = sum(path[f"{part}_energy"] for part in ("club", "ball", "spring", "lost"))
    assert energies == pytest.approx(start + work, rel=1e-12)
    assert (np.diff(path["lost_energy"]) > -1e-12 * start).all()
    assert (path["lost_energy"].max() < 1e-12 * start) == (v["b"] == 0.0)
    lost = (path["lost_energy"] + path["spring_energy"])[end]
    assert found["metrics"]["energy_lost"] == pytest.approx(lost, abs=1e-12 * start)
    push, total = v["club_force"] * np.maximum(path["time"], 0.0), path["total_momentum"]
    assert (total == pytest.approx(total[0] + push, rel=1e-12)) == (v["law"] == 2)


def test_bodies_that_stay_together_are_drawn_for_ten_contacts(tmp_path):
    (found,) = by_wasm([{"law": 2, "club_force": 2e4, "b": 2e4, "drawn": 1}], tmp_path)
    (elastic,) = golf_impact.run_impact(["contact_time"], b=0.0).values()
    assert 10.0 * elastic < found["path"]["time"][-1] < 20.0 * elastic


def test_one_file_that_needs_nothing_else(tmp_path):
    text = write_page(tmp_path / "page.html", {}).read_text("utf-8")
    wasm = files("golf_impact.explore") / "physics.wasm"
    check_page(text)
    assert (len(text.encode()) < 400_000, len(wasm.read_bytes()) <= 130_000) == (True, True)
    assert "Answer key" in text
    markup = re.sub(r"<(script|style|pre)\b.*?</\1>", "", text, flags=re.DOTALL)
    assert re.findall(r'\b(?:src|href|action)="(?![#?]|data:)[^"]*"', markup) == []
    script = text[text.index('<script type="module">') :]
    assert re.findall(r"\b(?:import|fetch|XMLHttpRequest|WebSocket)\b", script) == []
    for notice in ("musl as a whole is licensed", "wasi-libc as a whole", "The MIT License"):
        assert notice in text
    assert {name: one["start"] for name, one in facts(text)["inputs"].items()} == DEFAULTS


def test_what_the_scripts_are_given(tmp_path, pytestconfig):
    """From page.toml and the tables: `pytest --update tests/page` writes it, read the diff."""
    given = facts(write_page(tmp_path / "page.html", {}).read_text("utf-8"))
    lines = []
    for part in ("undefined", "remarkable", "laws", "readouts", "examples", "opening"):
        rows = given[part].items() if isinstance(given[part], dict) else enumerate(given[part])
        lines += [f"{part} {n}: {json.dumps(row, ensure_ascii=False)}" for n, row in rows]
    check_snapshot(pytestconfig, "page-facts.txt", lines)


@pytest.mark.ci
def test_the_wasm_is_made_from_these_sources():
    """Byte for byte; zig's first run takes a minute."""
    wasm = pytest.importorskip("golf_build.wasm", reason="the sources in C aren't here")
    try:
        made = wasm.build()
    except golf_impact.UserError as error:
        pytest.skip(str(error))
    for name, data in made.items():
        file = ROOT / "scenarios" / "golf_impact" / "explore" / name
        assert data == file.read_bytes(), f"run python -m golf_build.wasm: {name}"


def test_the_wasm_needs_ziglang(monkeypatch):
    wasm = pytest.importorskip("golf_build.wasm", reason="the sources in C aren't here")
    monkeypatch.setattr(wasm, "ziglang", lambda: None)
    with pytest.raises(golf_impact.UserError, match="WebAssembly needs ziglang"):
        wasm.build()


def test_the_command(tmp_path):
    """With a ball of one's own and its conditions; without the place where its author has it."""
    (tmp_path / "mine.toml").write_text(
        'title = "<b>mine</b>"\nlaw = 2\nb = "30 N·s/m"\n[conditions]\nclub_speed = 41.0\n'
    )
    mine = f"--ball={tmp_path}/mine.toml", "--set=b=31", "--set=k=8e5"
    done = golf_here("explore", "--no-browser", *mine, cwd=tmp_path, code=0)
    default, other = tmp_path / "golf-impact-results" / "explore.html", tmp_path / "a/b.html"
    text = default.read_text("utf-8")
    assert (done.stdout.splitlines()[-1], str(tmp_path) in text) == (str(default), False)
    written = facts(text)
    assert written["case"] == DEFAULTS | {"law": 2, "k": 8e5, "b": 31.0, "club_speed": 41.0}
    mine, others = written["balls"][-1], written["balls"][:-1]
    assert (mine["name"], mine["values"]["exponent"]) == ("mine", 1.0)
    assert mine["limits"].startswith("k is undetermined: force, contact time")
    assert [one["limits"] for one in others] == [ball.limits for ball in BALLS.values()]
    assert ("&lt;b&gt;mine" in text, "<b>mine" in text) == (True, False)
    # For a class: without the answers, which aren't hidden in there either.
    golf_here("explore", "--set=club_speed=95mph", "--export", other, "--no-answers", code=0)
    assert facts(other.read_text())["case"]["club_speed"] == 42.4688
    key = '<section id="key"'
    assert (key in text, key in other.read_text(), "0.847" in other.read_text()) == (1, 0, 0)
    # Task 1's sentence has the numbers of its table.
    assert {"0.725", "0.793", "0.847"} <= {*re.findall(r"<td>(0\.\d{3})\d*</td>", text)}
    assert "m<sub>C</sub> u<sub>C</sub>" in text
