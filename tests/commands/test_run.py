"""`golf-impact run`: scenarios, their report, cases of one's own; see transcripts/run.md, too."""

import io
import json
import re
import shutil
import sys
from itertools import accumulate, chain, repeat
from operator import mul

import matplotlib.pyplot as plt
import numpy as np
import pytest
from command import golf_here, run
from html5 import check_page
from PIL import Image
from shown import check_snapshot, result_lines

import golf_impact
from golf_impact.commands.run import name_of_case
from golf_impact.data.balls import BALLS
from golf_impact.data.quantities import START, derived, describe
from golf_impact.report import scripts
from golf_impact.report.results import _with_minus, narrow_png, plotting


@pytest.fixture(scope="module")
def impact():
    with golf_impact.Impact() as impact:
        yield impact


def run_scenario(name, impact):
    return scripts.run_script(scripts.path_of(name), impact)


# Scenarios


def test_what_reports_show(impact, pytestconfig):
    """All claims hold; numbers are Python's, for results.json."""
    results = [run_scenario(name, impact) for name in scripts.SCENARIOS]
    cases = chain(*(result.cases.values() for result in results))
    assert {type(number) for case in cases for number in case.values()} == {float}
    lines = (line for result in results for line in result_lines(result))
    # What rounding may change: the last digits, and differences of nothing else.
    lines = (re.sub(r"(?<=\.\d{9})\d+|\d(?=e-1\d)", "…", line) for line in lines)
    check_snapshot(pytestconfig, "scenarios.md", ["# What scenarios show", *lines])


class Drifting:
    """An `Impact` whose results grow from call to call, and the more the later in their order."""

    def __init__(self, impact, growth):
        self.impact, self.factors = impact, accumulate(repeat(1.0 + growth), mul)

    def __getattr__(self, name):
        return getattr(self.impact, name)

    def __call__(self, *outputs, **values):
        factor, found = next(self.factors), self.impact(*outputs, **values)
        return {name: x * factor**n for n, (name, x) in enumerate(found.items(), 1)}

    def simulate(self, *arguments, **options):
        factor, rows = next(self.factors), self.impact.simulate(*arguments, **options)
        for n, name in enumerate(rows.dtype.names[1:], 1):
            rows[name] *= factor**n
        return rows


def test_claims_fail(impact, pytestconfig):
    """Which, by how much results grow from call to call: each is one that can fail."""
    lines = ["# Claims that fail as results grow from call to call"]
    for growth in (-1e-2, 1e-12, 4e-3):
        lines.append(f"\n## {growth:g}\n")
        for name in (*scripts.SCENARIOS[:6], "speed_dependence", "rating"):
            failed = run_scenario(name, Drifting(impact, growth)).failed
            lines += [f"- {name}: {claim}" for claim in failed]
            plt.close("all")
    check_snapshot(pytestconfig, "claims.md", lines)


#: A scenario without a trajectory, one of whose claims fails.
FALSE = """
from golf_impact.scenario import Result
def run(impact):
    return Result("t", {"a": impact(k=8e5)}, claims={"<1> is false": False, "as ever": True})
"""


def test_the_report(impact, tmp_path, pytestconfig):
    """Self-contained; a figure and the main results first, what the document says last."""
    (tmp_path / "false.py").write_text(FALSE)
    done = golf_here("run", "baseline", "false.py", "--out", "out", cwd=tmp_path, code=1)
    assert "✗ <1> is false" in done.stdout
    assert "✓ as ever" in done.stdout
    out = tmp_path / "out"
    page = (out / "report.html").read_text("utf-8")
    check_page(page)
    assert not re.search(r"https?:|url\(|@import|fetch\(|<link|<iframe|<object|<script", page)
    assert not re.search(r'src="(?!data:image/png;base64,)', page)
    body = re.sub(r"base64,[^\"]*|(?<=GUID )[^<]*", "…", page.partition("<body>")[2])
    check_snapshot(pytestconfig, "report.html", body.splitlines())
    # A sign is a minus sign; what has the form of a name stays.
    assert not re.search(r"(?<![\w.)-])-\.?\d", re.sub(r"<[^>]*>", " ", body))
    cases = json.loads((out / "results.json").read_text())
    # The same numbers in another run, to the last bit.
    assert cases["baseline"] == run_scenario("baseline", impact).cases
    assert [*cases] == ["baseline", "false"]
    path = np.genfromtxt(out / "baseline.csv", delimiter=",", names=True)
    assert path["force"].max() == pytest.approx(6785.6, rel=1e-5)
    figures = {"drive_force.png", "baseline_force.png", "baseline_motion.png"}
    assert figures <= {file.name for file in out.iterdir()}


def test_minus_signs():
    numbers, others = "-0.14 3.4 (-2 %) 1.4e-05 -.5", "30-60 law-1 k 2 - 3 86-110+"
    assert _with_minus(numbers) == "−0.14 3.4 (−2 %) 1.4e−05 −.5"
    assert _with_minus(others) == others


def test_narrow_figures():
    """A row of panels is a column, as wide as text of 9 px on a screen of 390 px allows."""
    with plotting():
        figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), sharey=True)
        left.set_title("A title that is far too long for a picture which is half as wide")
        left.plot([1, 2], label="a line")
        left.legend()
    size = Image.open(io.BytesIO(narrow_png(figure))).size
    assert size == (676, pytest.approx(130 * 6.6, abs=1))
    assert left.get_position().y0 > right.get_position().y1
    assert left.get_title("left").count("\n") == 1
    assert not plt.get_fignums()


@pytest.mark.ci
def test_a_script_run_by_python(tmp_path):
    """One of ours, of a name with a space; the READMEs have one that `golf-impact run` runs."""
    script = shutil.copy(scripts.path_of("laws"), tmp_path / "my scenario.py")
    done = run(sys.executable, script, "--out", tmp_path / "out", cwd=tmp_path)
    assert "✓ law 2 conserves momentum" in done.stdout
    assert [*json.loads((tmp_path / "out/results.json").read_text())] == ["my scenario"]
    assert (tmp_path / "out/laws.png").read_bytes().startswith(b"\x89PNG")


# Cases of one's own


def test_numbers_beside_the_outputs():
    """By hand, of velocities."""
    given = {"m_club": 0.2, "m_ball": 0.05, "club_speed": 30.0, "ball_speed": -10.0}
    outputs = {"club_velocity": 18.0, "ball_velocity": 40.0, "contact_displacement": 0.01}
    assert derived(outputs, {**given, "ball_diameter": 0.04}) == pytest.approx(
        outputs
        | {"momentum_gain_ball": 2.5, "momentum_initial": 5.5, "kinetic_energy_initial": 92.5}
        | {"contact_displacement_over_diameter": 0.25}
    )
    tour = {"law": 2, "exponent": 1.5, "restitution_at_rest": 0.86, "restitution_slope": 0.003}
    assert describe({"k": 2e6}) == "law 1, k = 2 MN/m, b = 9 N·s/m"
    assert describe(tour) == "law 2, k = 1 MN/m, n = 1.5, b by COR = 0.86 − 0.003 s/m · v"


def test_names_of_cases():
    """Of balls and values in SI units; another case has another one, also if both are long."""
    many = dict.fromkeys(START, 0.12345678901234566)
    cases = [
        ({"k": 8e5}, "k=800000"),
        ({"k": 800100.0, "b": 8.0}, "k=800100_b=8"),
        ({}, "roh-lee"),
        ({"k": 8e5}, "roh-lee_k=800000"),
        (many, "k=0.123456"),
        (many | {"law": 2}, "k=0.123456"),
    ]
    found = [name_of_case(v, [BALLS["roh-lee"]] * ("roh" in name)) for v, name in cases]
    assert len({*found}) == len(cases)
    for name, (_, start) in zip(found, cases):
        assert name.startswith(start)
        assert len(f"{name}_trajectory_0123456789.csv") < 255
