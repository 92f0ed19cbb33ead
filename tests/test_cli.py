"""The command line of golf-impact."""

import json
import re
import sys
import zipfile

import pytest
from command import COMMAND, golf, golf_case, golf_here, refused, run, run_python

from golf_build import VERSION
from golf_impact.ball import BALLS
from golf_impact.commands.scripts import FOLDER
from golf_impact.report import figures
from golf_impact.report.own_cases import own_cases
from golf_impact.report.styles import STYLES


def test_version_help_and_list(monkeypatch):
    """No summary of a command is cut, all help fits 80 columns, and arguments have no types."""
    monkeypatch.setenv("COLUMNS", "80")
    assert golf_here("--version").stdout == f"golf-impact {VERSION}\n"
    assert golf_here("list").stdout.count("finite_difference") == 1
    summaries = golf_here().stdout.partition("Commands:\n")[2].partition("\n\n")[0].splitlines()
    assert len(summaries) == 9
    for line in summaries:
        assert "..." not in line
        done = golf_here(line.split()[0], "--help", code=0)
        assert "Usage" in done.stdout
        assert " <" not in done.stdout
        assert max(map(len, done.stdout.splitlines())) <= 80


def test_build_and_run(tmp_path):
    """Without figures matplotlib isn't imported."""
    fmu, out = tmp_path / "mine.fmu", tmp_path / "out"
    golf_here("build", "--out", fmu, code=0)
    assert zipfile.is_zipfile(fmu)
    program = (
        "import sys; from golf_impact.commands import app\n"
        "assert app.one_line(sys.argv[1:]) == 0\n"
        "assert 'matplotlib' not in sys.modules"
    )
    done = run_python(program, "run", "baseline", "--fmu", fmu, "--out", out, "--no-figures")
    assert "54.745" in done.stdout
    assert "the drag takes b x_B = " in " ".join(done.stdout.split())
    names = {path.name for path in out.iterdir()}
    assert names == {"results.json", "baseline.csv", "report.html"}
    header = (out / "baseline.csv").read_text().splitlines()[0]
    assert header.startswith("time,force,club_position")


def test_a_case_of_ones_own(tmp_path):
    """It replaces nothing of a run of scenarios into the same folder."""
    folder, stem = tmp_path / "golf-impact-results", "custom_k=800000_club_speed=42_law=2"
    golf_here("run", "table1", "laws", cwd=tmp_path, code=0)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    sets = ("--set", "k=8e5", "--set", "club_speed=42", "--set", "law=2")
    done = golf_here("run", *sets, cwd=tmp_path, code=0)
    after = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert after.items() >= before.items()
    own = {f"{stem}{end}" for end in (".csv", "_force.png", "_report.html", "_results.json")}
    assert set(after) - set(before) == own
    case = json.loads(after[f"{stem}_results.json"])["custom"]["custom"]
    assert case["smash_factor"] * 42.0 == pytest.approx(case["ball_velocity"], rel=1e-15)
    *_, checks, last = done.stdout.splitlines()
    assert checks == (
        "5 of 5 checks passed: closed forms 4, invariants 1; "
        "consistency of the FMU with itself: 3 of 3."
    )
    assert last == f"Results in golf-impact-results/; report: {stem}_report.html"


@pytest.mark.parametrize(
    ("arguments", "words", "missing"),
    [
        (("b=2000",), "no separation", {"contact_time", "coefficient_of_restitution"}),
        (("club_speed=-3",), "no contact", {"contact_time", "touch_time", "smash_factor"}),
        (("b=1000",), None, set()),
        (("k=0.1", "law=2", "b=0"), None, set()),
    ],
)
def test_results_without_a_contact_or_a_separation(tmp_path, arguments, words, missing):
    """ζ = 5.16 and 2.58: under law 1 the bodies separate below 2.91."""
    options = [part for value in arguments for part in ("--set", value)]
    done, case = golf_case(tmp_path, *options)
    assert missing <= {name for name, value in case.items() if value is None}
    assert isinstance(case["max_force"], float)
    if words is None:
        assert None not in case.values()
        assert "no separation" not in done.stdout
    else:
        (line,) = (line for line in done.stdout.splitlines() if "contact time" in line)
        assert words in line
        (page,) = tmp_path.glob("*_report.html")
        assert f"<td>{words}</td>" in page.read_text("utf-8")


def test_own_cases_do_not_overwrite_each_other(tmp_path):
    """Even if their names are too long for a file and have the same beginning."""
    many = [f"--set={name}=0.12345678901234567" for name in ("m_club", "m_ball", "gap", "b")]
    runs = [("--set", "k=8e5"), ("--ball", "tour", "--ball", "document", "--ball", "tour")]
    runs += [(*many, "--set", f"ball_diameter={value}") for value in (0.04, 0.05)]
    for n, arguments in enumerate(runs, 1):
        golf_here("run", *arguments, "--no-figures", "--out", tmp_path, code=0)
        for pattern in ("custom*_results.json", "custom*_report.html"):
            assert len(list(tmp_path.glob(pattern))) == n
    (file,) = tmp_path.glob("*tour*_results.json")
    cases = json.loads(file.read_text())["custom"]
    assert list(cases) == ["tour", "document"]
    assert cases["tour"]["max_force"] != cases["document"]["max_force"]


def test_the_figure_of_an_own_case(fmu):
    _, report = own_cases(fmu, {"club_speed": 42.0, "gap": 0.1}, [BALLS["tour"]])
    (draw,) = report.figures.values()
    (axes,) = draw(figures).axes
    (line,) = axes.lines
    micro, kilonewton = line.get_data()
    peak = report.cases["custom"]
    assert kilonewton.max() == pytest.approx(peak["max_force"] / 1e3, rel=1e-3)
    assert micro[kilonewton.argmax()] == pytest.approx(peak["time_of_max_force"] * 1e6, rel=0.01)
    # The ball has its style, and its parameters are in the title.
    assert STYLES["tour"].line == {"color": line.get_color(), "ls": (0, (6, 2))}
    assert "law 2, k = " in axes.get_title("left")
    # Those of several balls have no place there.
    _, both = own_cases(fmu, {}, [BALLS["tour"], BALLS["penner"]])
    (draw,) = both.figures.values()
    axes = draw(figures).axes[0]
    assert "k = " not in axes.get_title("left")
    assert [line.get_label().partition(":")[0] for line in axes.lines] == ["tour", "penner"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--set", "m_club=200"), "--set m_club=200 is taken in kg: write --set m_club=0.2 for"),
        (("table1", "--set", "k=8e5"), "a case of your own; they don't change table1"),
    ],
)
def test_warnings(tmp_path, arguments, words):
    done = golf_here("run", *arguments, "--no-figures", "--out", tmp_path, code=0)
    assert words in done.stdout + done.stderr


#: The scenario in their README.
MINE = re.search(r"```python\n(.*?)```", (FOLDER / "README.md").read_text("utf-8"), re.DOTALL)[1]


@pytest.mark.parametrize("alone", [False, pytest.param(True, marks=pytest.mark.ci)])
def test_a_scenario_of_ones_own(tmp_path, alone):
    script, out = tmp_path / "my scenario.py", tmp_path / "out"
    script.write_text(MINE, "utf-8")
    command = [sys.executable, script] if alone else [COMMAND, "run", script, "table1"]
    done = run(*command, "--out", out, cwd=tmp_path)
    assert "Contact time over stiffness" in done.stdout
    results = json.loads((out / "results.json").read_text())
    assert list(results) == (["my scenario"] if alone else ["my scenario", "table1"])
    assert list(results["my scenario"]) == ["k = 500000", "k = 1e+06", "k = 2e+06"]
    assert (out / "stiffer_force.png").read_bytes().startswith(b"\x89PNG")


RUN = "TITLE = 'mine'\ndef run(fmu):\n    "


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, ("there is no script", "mine.py")),
        ("TITLE = ", ("mine.py, line 1", "SyntaxError")),
        ("import numpy\n\nnumpy.nothing", ("mine.py, line 3", "AttributeError")),
        ("run = print", ("mine.py is not a scenario", 'TITLE = "..."')),
        ("TITLE = 'mine'", ("mine.py is not a scenario", "run(fmu)")),
        ("TITLE = 'mine'\nrun = print", ("mine.py", "returns None", "Report")),
        (RUN + "return 1 / 0", ("line 3", "ZeroDivisionError")),
        (RUN + "fmu.impact(k=-1.0)", ("line 3: k = -1.0",)),
        (
            RUN + "fmu.impact()['cor']",
            ("line 3", "'cor'", "smash_factor, coefficient_of_restitution"),
        ),
        (RUN + "fmu.impact(['separated'])", ("line 3", "separated is Boolean")),
    ],
)
def test_a_script_that_is_no_scenario(tmp_path, text, words):
    script, out = tmp_path / "mine.py", tmp_path / "out"
    if text is not None:
        script.write_text(text)
    refused(golf_here("run", script, "--out", out), *words)
    assert not out.exists()


def test_two_scenarios_of_one_name(tmp_path):
    (tmp_path / "table1.py").write_text(MINE, "utf-8")
    refused(golf_here("run", "table1", tmp_path / "table1.py", "--out", tmp_path / "out"), "table1")


def test_a_check_that_fails(tmp_path):
    body = "report = Report(TITLE, fmu)\n    report.check('so it is', False)\n    return report"
    (tmp_path / "mine.py").write_text(f"from golf_impact.scenario import Report\n{RUN}{body}")
    done = golf_here("run", tmp_path / "mine.py", "--out", tmp_path)
    assert done.returncode == 1
    assert "Check failed: mine: so it is" in done.stderr
    assert done.stdout.count("0 of 1 checks passed") == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "baselin"), ("baselin", "baseline, club_speed")),
        (("run", "--set", "stiffness=1"), ("stiffness", "k, b, club_speed")),
        (("run", "--set", "k=hard"), ("hard", "no number")),
        (("run", "--set", "k"), ("NAME=VALUE",)),
        (
            ("run", "--set", "b=9", "--set", "gap=-1e-3"),
            ("--set gap=-1e-3: gap = -0.001 m", ">= 0"),
        ),
        (("run", "--set", "law=relative"), ("law=relative", "1 (absolute) or 2 (relative)")),
        (("run", "--set", "law=4294967298"), ("law", "whole number")),
        (("run", "--set", "exponent=1.5"), ("exponent", "law = 1")),
        (("run", "--set", "restitution_at_rest=0.9"), ("restitution_at_rest", "law = 1")),
        (("run", "--set", "k=1", "--set", "k=2"), ("k is given twice",)),
        (("run", ":100:"), (":100:",)),
        (("run", "--ball", "cannon"), ("cannon", "roh-lee, ")),
        (("run", "--ball", "none.toml"), ("can't read", "none.toml")),
        # As from an unset variable of the shell.
        (("run", ""), ("an argument is empty",)),
        (("run", "table1", "--fmu="), ("an argument is empty",)),
        (("calibrate", "--core", "0.7"), ("--core", "calibrate --help")),
        (("build", "--fmi", "4"), ("--fmi",)),
        (("build", "--fmi", "3", "--system"), ("--system",)),
        (("nothing",), ("nothing",)),
        (("sweep", "--seed", "abc"), ("--seed",)),
        (("sweep", "--set", "k=1e6"), ("--out FILE.csv",)),
    ],
)
def test_one_line_for_any_mistake(arguments, words, tmp_path):
    refused(golf_here(*arguments, cwd=tmp_path), *words)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.ci
@pytest.mark.parametrize("env", [{"MPLBACKEND": "nonsense"}, {"PYTHONIOENCODING": "ascii"}])
def test_environments(tmp_path, env):
    """A backend that matplotlib doesn't have; a terminal without Greek letters."""
    done = golf("run", "laws", "--out", tmp_path, env=env)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "laws.png").is_file()
