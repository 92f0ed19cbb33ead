"""`golf-impact run`: scenarios, their report, cases of one's own, balls and units."""

import html
import io
import json
import re
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest
from command import golf_case, golf_here, refused, run
from html5 import check_page
from PIL import Image

import golf_impact
from golf_impact.data import document
from golf_impact.data.balls import BALLS
from golf_impact.data.quantities import derived, describe
from golf_impact.report import scripts
from golf_impact.report.results import _with_minus, narrow_png, plotting

MPH = 0.44704


@pytest.fixture(scope="module")
def impact():
    with golf_impact.Impact() as impact:
        yield impact


@pytest.fixture(scope="module")
def results(impact):
    return {name: scripts.run_script(scripts.path_of(name), impact) for name in scripts.SCENARIOS}


# Scenarios


@pytest.mark.parametrize("name", scripts.SCENARIOS)
def test_a_scenario(results, name):
    """Its claims hold; every table names law, stiffness and damping."""
    result = results[name]
    assert result.failed == []
    assert len(result.claims) >= 2
    for case, metrics in result.cases.items():
        assert all(type(value) is float for value in metrics.values()), case
    for title, columns, rows in result.tables:
        text = " ".join([title, *columns, *(cell for row in rows for cell in row)])
        assert all(re.search(word, text) for word in (r"law \d", r"\bk\b", r"\bb\b")), title
        assert all(len(row) == len(columns) for row in rows)
        assert not re.search(r"(?<![\d.])-0\.0*(?![\d])", text), title


def test_the_documents_cases(results):
    """Its eight cases with their printed numbers; what its scheme doesn't give is stated."""
    scheme = results["finite_difference"]
    assert len(document.NOT_REPRODUCED) == 3
    assert "67 of 70 printed numbers" in scheme.words
    assert len(scheme.cases) == 16


@pytest.mark.parametrize(("text", "holds"), [("1.57", True), ("1.59", False)])
def test_a_printed_number_that_deviates_fails(impact, monkeypatch, text, holds):
    values, printed = document.CASES["50 m/s"]
    one = {**printed, "smash_factor": document.Printed(text)}
    monkeypatch.setitem(document.CASES, "50 m/s", document.Case(values, one))
    result = scripts.run_script(scripts.path_of("club_speed"), impact)
    assert (result.failed == []) == holds


#: A scenario without a trajectory, one of whose claims fails.
FALSE = """
from golf_impact.scenario import Result
def run(impact):
    return Result("t", {"a": impact(k=8e5)}, claims={"<1> is false": False, "as ever": True})
"""


def test_the_report(results, tmp_path):
    """Self-contained; a figure and the main results first, what the document says last."""
    (tmp_path / "false.py").write_text(FALSE)
    command = "run", "baseline", "laws", "false.py", "--out", "out"
    done = golf_here(*command, cwd=tmp_path, code=1)
    assert "✗ <1> is false" in done.stdout
    assert "✓ as ever" in done.stdout
    out = tmp_path / "out"
    page = (out / "report.html").read_text("utf-8")
    check_page(page)
    assert not re.search(r"https?:|url\(|@import|fetch\(|<link|<iframe|<object|<script", page)
    assert not re.search(r'src="(?!data:image/png;base64,)', page)
    texts = "113 mph (TrackMan", "1.4779", "1.5641", "<img", 'id="laws"', 'id="document"'
    places = [page.index(text) for text in texts]
    assert places == sorted(places)
    assert "✗ &lt;1&gt; is false" in page
    assert page.count("<img") == page.count("<source") == 4
    # A sign is a minus sign; what has the form of a name stays.
    text = re.sub(r"<[^>]*>", " ", page.partition("<body>")[2])
    assert "−0.14" in text
    assert not re.search(r"(?<![\w.)-])-\.?\d", text)
    for _, columns, rows in document.tables():
        texts = {
            html.escape(_with_minus(cell)).replace("&#x27;", "&#39;") for r in rows for cell in r
        }
        assert all(text in page for text in texts)
        assert all(f'<th scope="col">{column}' in page for column in columns)
    cases = json.loads((out / "results.json").read_text())
    # The same numbers in another run, to the last bit.
    assert cases["baseline"] == results["baseline"].cases
    assert cases["laws"] == results["laws"].cases
    assert [*cases] == ["baseline", "laws", "false"]
    path = np.genfromtxt(out / "baseline.csv", delimiter=",", names=True)
    assert path["force"].max() == pytest.approx(6785.6, rel=1e-5)
    figures = {"drive_force.png", "baseline_force.png", "baseline_motion.png", "laws.png"}
    assert figures | {"law_1.csv"} <= {file.name for file in out.iterdir()}


@pytest.mark.parametrize(
    ("text", "shown"),
    [("-0.14", "−0.14"), ("3.4 (-2 %)", "3.4 (−2 %)"), ("1.4e-05", "1.4e−05"), ("-.5", "−.5"),
     ("30-60", "30-60"), ("law-1", "law-1"), ("k 2 - 3", "k 2 - 3"), ("86-110+", "86-110+")],
)  # fmt: skip
def test_minus_signs(text, shown):
    assert _with_minus(text) == shown


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


def test_a_scenario_by_name_has_a_folder_of_its_own(tmp_path):
    for folder in ("one", "two"):
        golf_here("run", "shaft", "--no-figures", "--out", folder, cwd=tmp_path, code=0)
    golf_here("run", "shaft", "--no-figures", cwd=tmp_path, code=0)
    files = [*tmp_path.rglob("results.json")]
    assert {str(file.parent.relative_to(tmp_path)) for file in files} == {
        "one", "two", "golf-impact-results/shaft"
    }  # fmt: skip
    assert len({file.read_bytes() for file in files}) == 1


def test_nothing_is_built_beside_a_given_fmu(fmu_path, tmp_path):
    """Scenarios that need further files are left out with a line."""
    fmu, out = tmp_path / "ClubBallImpact.fmu", tmp_path / "out"
    fmu.write_bytes(fmu_path.read_bytes())
    done = golf_here("run", "laws", "loft", "system", "--fmu", fmu, "--out", out, code=0)
    for name, file in (("loft", "Launch.fmu"), ("system", "GolfSwing.ssp")):
        assert f"{name} is left out: there is no {file} beside" in done.stderr
    assert list(json.loads((out / "results.json").read_text())) == ["laws"]
    done = golf_here("run", "loft", "--fmu", fmu, "--out", out, code=2)
    assert "there is nothing to run" in done.stderr
    assert {file.name for file in tmp_path.iterdir()} == {"ClubBallImpact.fmu", "out"}


#: The scenario in their README.
README = (scripts.FOLDER / "README.md").read_text("utf-8")
MINE = re.search(r"```python\n(.*?)```", README, re.DOTALL)[1]


@pytest.mark.parametrize("alone", [False, pytest.param(True, marks=pytest.mark.ci)])
def test_a_scenario_of_ones_own(tmp_path, alone):
    script, out = tmp_path / "my scenario.py", tmp_path / "out"
    script.write_text(MINE, "utf-8")
    if alone:
        done = run(sys.executable, script, "--out", out, cwd=tmp_path)
    else:
        done = golf_here("run", script, "laws", "--out", out, code=0)
    assert "contact time decreases with stiffness" in done.stdout
    results = json.loads((out / "results.json").read_text())
    assert list(results) == ["my scenario", *["laws"] * (not alone)]
    assert list(results["my scenario"]) == ["k = 500000", "k = 1e+06", "k = 2e+06"]
    assert (out / "stiffer_force.png").read_bytes().startswith(b"\x89PNG")


def test_two_scenarios_of_one_name(tmp_path):
    (tmp_path / "laws.py").write_text(MINE, "utf-8")
    assert "same name" in golf_here("run", "laws", "laws.py", cwd=tmp_path, code=2).stderr


# Cases of one's own


def test_a_case_of_ones_own(tmp_path):
    """It replaces nothing of a run of scenarios into the same folder; law 1 is named as such."""
    out = tmp_path / "out"
    golf_here("run", "laws", "--no-figures", "--out", out, code=0)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    done = golf_here("run", "--set", "club_speed=95mph", "--out", out, code=0)
    after = {path.name: path.read_bytes() for path in out.iterdir()}
    assert after.items() >= before.items()
    ends = ("trajectory.csv", "force.png", "report.html", "results.json")
    assert set(after) - set(before) == {f"club_speed=42.4688_{end}" for end in ends}
    name = "club_speed=42.4688"
    case = json.loads(after[f"{name}_results.json"])[name][name]
    assert case["smash_factor"] * 42.4688 == pytest.approx(case["ball_velocity"], rel=1e-15)
    words = " ".join(done.stdout.split())
    assert "law 1, k = 1 MN/m, b = 9 N·s/m" in words
    assert "This is law 1" in words
    assert "--ball roh-lee for a real ball" in words
    page = after[f"{name}_report.html"].decode()
    assert page.index("1.5641") < page.index("<img") < page.index("<table")


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


@pytest.mark.parametrize(
    ("given", "words", "missing"),
    [
        ("b=2000", "no separation", {"contact_time", "coefficient_of_restitution"}),
        ("club_speed=-3", "no contact", {"contact_time", "touch_time", "smash_factor"}),
        # ζ = 2.58: under law 1 the bodies separate below 2.91.
        ("b=1000", None, set()),
        ("k=0.1", None, set()),
    ],
)
def test_results_without_a_contact_or_a_separation(tmp_path, given, words, missing):
    law = () if words else ("--set", "law=2") * given.startswith("k")
    done, case = golf_case(tmp_path, "--set", given, *law)
    assert missing <= {name for name, value in case.items() if value is None}
    assert isinstance(case["max_force"], float)
    if words is None:
        assert None not in case.values()
        assert "no separation" not in done.stdout
    else:
        (line,) = (line for line in done.stdout.splitlines() if "contact time" in line)
        assert words in line
        (report,) = tmp_path.glob("*_report.html")
        assert f"<td>{words}</td>" in report.read_text("utf-8")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        # On both sides of a border; not about 0.
        ("run --set club_speed=70.05", "write --set club_speed=31.3152 for 70.05 mph or --set"),
        ("run --set club_speed=70", ""),
        ("run --set m_club=10.005", "for 10.005 g"),
        ("run --set m_club=10", ""),
        ("run --set k=770", "--set k=770 is taken in N/m: write --set k=770000 for 770 N/mm"),
        ("run --set k=1e4", ""),
        ("run --set ball_diameter=42.67", "ball_diameter=0.04267 for 42.67 mm"),
        ("run --set ball_diameter=1", ""),
        ("run --set law=2 --set b=0.03", "taken in N·s/m: golf balls have"),
        ("run --set b=0.1", ""),
        ("run --set b=0", ""),
        ("run --ball soft.toml", "soft.toml: k = 770 is taken in N/m: write k = 770000 for"),
        ("run --ball roh-lee --set club_speed=29.9", "roh-lee holds for 30 to 50 m/s, not for 29"),
        ("run --ball roh-lee --set club_speed=30", ""),
        # The approach speed counts.
        ("run --ball roh-lee --set ball_speed=-5 --set club_speed=46", "not for 51"),
        ("run --ball roh-lee --set club_speed=50", ""),
        ("run --ball roh-lee --set club_speed=50.1", "roh-lee holds for 30 to 50 m/s, not for 50"),
        ("sweep --set club_speed=90,95", "--set club_speed=42.4688 for 95 mph"),
        ("sweep --set club_speed=normal:95:2 --samples 3", "--set club_speed=42.4688 for 95 mph"),
        ("sweep --set ball=soft.toml", "soft.toml: k = 770 is taken in N/m: write k = 770000 for"),
    ],
)
def test_remarks(tmp_path, line, words):
    """Once a command: about numbers that look like those of another unit, and a ball's range."""
    (tmp_path / "soft.toml").write_text("law = 2\nk = 770\n")
    out = "x.csv" if line.startswith("sweep") else "out"
    done = golf_here(*line.split(), "--no-figures", "--out", out, cwd=tmp_path, code=0)
    assert words in done.stderr
    assert done.stderr.count(words) == 1 if words else done.stderr == ""


def test_scenarios_keep_their_values(tmp_path):
    command = "run", "laws", "--set", "k=8e5", "--no-figures", "--out", tmp_path
    done = golf_here(*command, code=0)
    assert "a case of your own; they don't change laws" in done.stdout


def test_files_of_a_case_are_its_own(tmp_path):
    """No case replaces another one's: its name has its balls and values, or is given."""
    many = [f"--set={n}=0.{'1234567890' * 2}" for n in ("club_speed", "gap", "b", "m_club", "k")]
    for n, (more, name) in enumerate(
        [(("--set=k=8e5",), "k=800000"), (("--set=k=800.1 N/mm",), "k=800100"),
         (("--set=k=800.1N/mm", "--set=b=8"), "k=800100_b=8"), (("--ball=roh-lee",), "roh-lee"),
         (("--ball=roh-lee", "--set=k=8e5"), "roh-lee_k=800000"), (many, "club_speed=0.123456"),
         ((*many, "--set=law=2"), "club_speed=0.123456"),
         (("--ball=roh-lee", "--set=k=8e5", "--name=stiff"), "stiff")], 1
    ):  # fmt: skip
        before = {file: file.read_bytes() for file in tmp_path.iterdir()}
        golf_here("run", *more, "--out", tmp_path, code=0)
        after = {file: file.read_bytes() for file in tmp_path.iterdir()}
        assert after.items() >= before.items()
        assert len(after) == 4 * n
        assert {file.name.startswith(name) for file in after.keys() - before} == {True}
    case = json.loads((tmp_path / "stiff_results.json").read_text())["stiff"]
    assert [*case] == ["roh-lee"]
    assert '<th scope="col">roh-lee' in (tmp_path / "roh-lee_report.html").read_text("utf-8")
    refused(golf_here("run", "--set=k=8e5", "--name=a/b", "--out", tmp_path), "leave out")
    refused(golf_here("run", "laws", "--name=a", "--out", tmp_path), "--set or --ball")
    assert len([*tmp_path.iterdir()]) == 32


# Balls


def test_several_balls(tmp_path):
    """In their order; --set overrides their values."""
    command = "run", "--ball", "tour", "--ball", "penner", "--no-figures", "--out", tmp_path
    golf_here(*command, "--set", "club_speed=50", code=0)
    name = "tour_penner_club_speed=50"
    cases = json.loads((tmp_path / f"{name}_results.json").read_text())[name]
    assert list(cases) == ["tour", "penner"]
    for name, case in cases.items():
        force = golf_impact.run_impact(**{**BALLS[name].values, "club_speed": 50.0})["max_force"]
        assert case["max_force"] == pytest.approx(force, rel=1e-13)


def test_a_ball_from_a_file(tmp_path):
    """Values in units, with conditions of the measurement, which hold unless they are set."""
    (tmp_path / "mine.toml").write_text(
        'law = 2\nk = "770 N/mm"\nb = 30\nball_diameter = "42.67mm"\n'
        '[conditions]\nclub_speed = "144 km/h"\n'
    )
    for more, speed in (((), 40.0), (("--set", "club_speed=95mph"), 95 * MPH)):
        done, case = golf_case(tmp_path, "--ball", "mine.toml", *more, cwd=tmp_path)
        direct = golf_impact.run_impact(law=2, k=7.7e5, b=30.0, club_speed=speed)
        assert case["max_force"] == direct["max_force"]
        assert ("club_speed=40" in done.stdout) == (not more)


def test_intervals_of_a_ball(tmp_path):
    """Without damping contact time is π √(μ/k): 0.2 % of k are 0.1 % of it."""
    file = tmp_path / "mine.toml"
    uncertainty = '[uncertainty]\nparameters = ["k"]\ncovariance = [[1.6e6]]\n'
    file.write_text(f"law = 2\nk = 8e5\nb = 0\n{uncertainty}")
    command = "run", "--ball", file, "--ball", "document", "--out", tmp_path, "--no-figures"
    done = golf_here(*command, code=0)
    time = golf_impact.run_impact(law=2, k=8e5, b=0.0)["contact_time"] * 1e6
    assert f"{time:.1f} ± {1.96 * 0.5 * 1.2649e3 / 8e5 * time:.1f}" in done.stdout
    assert "Intervals are 95 %" in done.stdout
    # COR doesn't depend on k, and what is set besides is exact.
    done, _ = golf_case(tmp_path / "k", "--ball", file, "--set", "k=9e5")
    assert "±" not in done.stdout
    assert "Intervals" not in done.stdout
