"""`golf-impact explore` without a browser: its file, its physics beside golf_physics, the command."""

import math
import random
import re
from importlib.resources import files

import numpy as np
import pytest
from cases import CASES as SHARED
from cases import DEFAULTS
from command import ROOT, golf_here, refused, run
from compare import assert_within
from html5 import check_page
from page import by_wasm, facts

import golf_impact
from golf_impact.ball import BALLS
from golf_impact.explore.page import page, write_page
from golf_impact.quantities import QUANTITIES
from golf_impact.scales import contact_scales

#: Names of the page's own quantities.
FROM_VALUES = {"contact_displacement_over_diameter"}


def random_cases(number, seed):
    """Impacts in golf and far beyond it; one in ten is refused."""
    rng, cases = random.Random(seed), []
    for _ in range(number):
        law, wild = rng.choice([1, 2]), rng.random() < 0.3
        case = {
            "law": law, "k": 10 ** rng.uniform(3, 9) if wild else rng.uniform(2e5, 3e6),
            "m_club": rng.uniform(0.05, 0.5), "m_ball": rng.uniform(0.02, 0.1),
            "club_speed": rng.uniform(1, 70), "ball_speed": rng.choice([0.0, rng.uniform(-20, 1)]),
            "gap": rng.choice([0.0, rng.uniform(0, 0.01)]),
        }  # fmt: skip
        mu = 1.0 / (1.0 / case["m_club"] + 1.0 / case["m_ball"])
        ratio = rng.choice([0.0, rng.uniform(0, 0.9), 10 ** rng.uniform(-2, 1)])
        case["b"] = 2.0 * ratio * math.sqrt(case["k"] * mu)
        kind = rng.choice(["", "force", "power", "line"]) if law == 2 else rng.choice(["", "force"])
        if kind == "force":
            case["club_force"] = rng.uniform(-2000, 2000)
        if kind == "power":
            case["exponent"] = rng.uniform(1, 3)
        if kind == "line":
            case |= {
                "restitution_at_rest": rng.uniform(0.1, 1),
                "restitution_slope": rng.uniform(0, 0.02),
            }
        if rng.random() < 0.1:
            case |= rng.choice(
                [{"k": -1.0}, {"law": 1.5}, {"m_ball": 0.0}, {"exponent": 13.0}, {"gap": 1e99}]
            )
        cases.append(case)
    return cases


def test_the_wasm_is_the_physics(tmp_path):
    """Within 1e-13 in the scales of the tolerances; refusals in the same words."""
    shared = [case.given for case in SHARED.values() if not case.changes]
    cases = [*shared, *(dict(ball.values) for ball in BALLS.values()), *random_cases(4000, 7)]
    worst, count, no = 0.0, 0, 0
    for given, found in zip(cases, by_wasm(cases, tmp_path), strict=True):
        try:
            expected = golf_impact.run_impact(**given)
        except golf_impact.UserError as error:
            no += 1
            # A law is 1 or 2 for C, a whole number for Python.
            if given.get("law") != 1.5:
                assert found["refused"] == str(error)
            assert found["about"] == error.variable
            continue
        scales = contact_scales(DEFAULTS | given, expected)
        for name, value in expected.items():
            if math.isnan(value):
                assert not (
                    found["separated"]
                    if name not in ("touch_time", "time_of_max_force")
                    else found["touched"]
                )
                continue
            error = scales.error(name, found["metrics"][name], value)
            assert_within(error, name=name, case=given)
            worst, count = max(worst, error), count + 1
    assert count > 40_000
    assert 200 < no < 800
    print(f"{count} numbers, worst {worst:.1e}")


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"law": 2},
        {"gap": 0.01, "law": 2, "ball_speed": 3.0, "club_force": 500.0},
        dict(BALLS["penner"].values),
    ],
)
def test_curves_energies_and_momenta(given, tmp_path):
    (found,) = by_wasm([{**given, "drawn": 1}], tmp_path)
    path, values = (
        {name: np.array(column) for name, column in found["path"].items()},
        DEFAULTS | given | {"gap": 0.0},
    )
    since, metrics = path["time"] > 0.0, golf_impact.run_impact(**values)
    right = golf_impact.run_trajectory(times=path["time"][since], **values)
    scales = contact_scales(values, metrics)
    for name in right.keys() - {"time"}:
        assert_within(np.abs(path[name][since] - right[name]).max() / scales.of(name), 1e-12, name)
    # The peak and the end of contact are samples.
    assert path["force"].max() == pytest.approx(metrics["max_force"], rel=1e-12)
    assert np.abs(path["time"] - metrics["contact_time"]).min() <= 1e-12 * metrics["contact_time"]
    start = 0.5 * (
        values["m_club"] * values["club_speed"] ** 2 + values["m_ball"] * values["ball_speed"] ** 2
    )
    work = values["club_force"] * np.where(since, path["club_position"], 0.0)
    parts = sum(path[f"{part}_energy"] for part in ("club", "ball", "spring", "lost"))
    assert parts == pytest.approx(start + work, rel=1e-12)
    assert (np.diff(path["lost_energy"]) > -1e-12 * start).all()
    drift = (
        path["total_momentum"]
        - path["total_momentum"][0]
        - values["club_force"] * np.maximum(path["time"], 0.0)
    )
    assert (np.abs(drift).max() < 1e-12 * path["total_momentum"][0]) == (values["law"] == 2)


def test_one_file_that_needs_nothing_else():
    text, wasm = page({}), files("golf_impact.explore") / "physics.wasm"
    check_page(text)
    assert len(text.encode()) < 400_000
    assert len(wasm.read_bytes()) <= 130_000
    markup = re.sub(r"<(script|style|pre)\b.*?</\1>", "", text, flags=re.DOTALL)
    assert re.findall(r'\b(?:src|srcset|href|action|xlink:href)="(?![#?]|data:)[^"]*"', markup) == []
    script = text[text.index('<script type="module">') :]
    assert re.findall(r"\b(?:import|fetch|XMLHttpRequest|eval|WebSocket)\b", script) == []
    for notice in ("musl as a whole is licensed", "wasi-libc as a whole", "The MIT License"):
        assert notice in text
    # The tables of the project are those on the page.
    table = facts()
    assert {name: one["start"] for name, one in table["inputs"].items()} == DEFAULTS
    assert [one["name"] for one in table["balls"]] == [*BALLS]
    for row in table["readouts"]:
        if row["metric"] in QUANTITIES:
            assert (row["decimals"], row["factor"]) == QUANTITIES[row["metric"]][-1:-3:-1]


def test_the_wasm_is_made_from_these_sources():
    wasm = pytest.importorskip("golf_build.wasm", reason="the sources in C aren't here")
    try:
        made = wasm.build()
    except wasm.WasmError as error:
        pytest.skip(str(error))
    folder = ROOT / "scenarios" / "golf_impact" / "explore"
    assert made == {name: (folder / name).read_bytes() for name in made}


def test_the_command(tmp_path):
    done = golf_here("explore", "--no-browser", cwd=tmp_path, code=0)
    default = tmp_path / "golf-impact-results" / "explore.html"
    assert done.stdout.strip() == str(default)
    assert default.read_text("utf-8") == page({})
    # Another case in the same file, with a ball of one's own.
    (tmp_path / "mine.toml").write_text(
        'law = 2\nk = "800 N/mm"\nb = 30\n[conditions]\nclub_speed = 41.0\n'
    )
    golf_here(
        "explore", "--no-browser", "--ball", "mine.toml", "--set", "b=31", cwd=tmp_path, code=0
    )
    text = default.read_text("utf-8")
    assert facts(text)["case"] == DEFAULTS | {"law": 2, "k": 8e5, "b": 31.0, "club_speed": 41.0}
    assert facts(text)["balls"][-1]["name"] == "mine.toml"
    golf_here(
        "explore", "--set", "club_speed=95mph", "--export", "web/golf.html", cwd=tmp_path, code=0
    )
    assert (
        facts((tmp_path / "web" / "golf.html").read_text("utf-8"))["case"]["club_speed"] == 42.4688
    )
    other = tmp_path / "mine.html"
    other.write_text("<p>mine</p>")
    refused(golf_here("explore", "--export", other), "isn't a page of golf-impact explore")
    assert other.read_text() == "<p>mine</p>"
    refused(golf_here("explore", "--export", tmp_path), "can't write")
    refused(golf_here("explore", "--set", "k=-1", cwd=tmp_path), "k = -1.0 N/m is refused")
    refused(golf_here("explore", "--ball", "nobody", cwd=tmp_path), "nobody")
    with pytest.raises(golf_impact.UserError, match="it stays"):
        write_page(other, {})
