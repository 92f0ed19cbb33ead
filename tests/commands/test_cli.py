"""The command line of golf-impact."""

import json
import re
import sys
import zipfile

import pytest
from command import COMMAND, golf, golf_case, golf_here, refused, run, run_python

from golf_build import VERSION
from golf_impact.scripts import FOLDER


def test_version_help_and_list(monkeypatch):
    """No summary of a command is cut, all help fits 80 columns, and arguments have no types."""
    monkeypatch.setenv("COLUMNS", "80")
    assert golf_here("--version").stdout == f"golf-impact {VERSION}\n"
    assert golf_here("list").stdout.count("finite_difference") == 1
    summaries = golf_here().stdout.partition("Commands:\n")[2].partition("\n\n")[0].splitlines()
    assert len(summaries) == 9
    for line in summaries:
        assert "..." not in line
        done = golf_here(line.split()[0], "-h", code=0)
        assert "Usage" in done.stdout
        assert " <" not in done.stdout
        assert max(map(len, done.stdout.splitlines())) <= 80


def test_a_case_without_figures_needs_no_matplotlib(tmp_path):
    fmu, out = tmp_path / "mine.fmu", tmp_path / "out"
    golf_here("build", "--out", fmu, code=0)
    assert zipfile.is_zipfile(fmu)
    program = (
        "import sys; from golf_impact.commands import app\n"
        "assert app.one_line(sys.argv[1:]) == 0\n"
        "assert 'matplotlib' not in sys.modules"
    )
    options = "--set", "k=1e6", "--fmu", fmu, "--out", out, "--no-figures"
    assert "54.745" in run_python(program, "run", *options).stdout
    names = {path.name for path in out.iterdir()}
    assert names == {"custom_results.json", "custom_custom.csv", "custom_report.html"}


def test_a_case_of_ones_own(tmp_path):
    """It replaces nothing of a run of scenarios into the same folder; law 1 is named as such."""
    out = tmp_path / "out"
    golf_here("run", "laws", "--out", out, code=0)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    done = golf_here("run", "--set", "club_speed=95mph", "--out", out, code=0)
    after = {path.name: path.read_bytes() for path in out.iterdir()}
    assert after.items() >= before.items()
    ends = ("custom.csv", "force.png", "report.html", "results.json")
    assert set(after) - set(before) == {f"custom_{end}" for end in ends}
    case = json.loads(after["custom_results.json"])["custom"]["custom"]
    assert case["smash_factor"] * 42.4688 == pytest.approx(case["ball_velocity"], rel=1e-15)
    words = " ".join(done.stdout.split())
    assert "law 1, k = 1 MN/m, b = 9 N·s/m" in words
    assert "This is law 1" in words
    assert "--ball roh-lee for a real ball" in words
    page = after["custom_report.html"].decode()
    assert page.index("1.5641") < page.index("<img") < page.index("<table")


def test_a_scenario_by_name_has_a_folder_of_its_own(tmp_path):
    for options, folder in (((), "golf-impact-results/laws"), (("--out", "here"), "here")):
        golf_here("run", "laws", "--no-figures", *options, cwd=tmp_path, code=0)
        assert (tmp_path / folder / "results.json").is_file()
    assert {path.name for path in tmp_path.iterdir()} == {"golf-impact-results", "here"}


def test_several_balls(tmp_path):
    golf_here(
        "run", "--ball", "tour", "--ball", "penner", "--no-figures", "--out", tmp_path, code=0
    )
    cases = json.loads((tmp_path / "custom_results.json").read_text())["custom"]
    assert list(cases) == ["tour", "penner"]
    assert cases["tour"]["max_force"] != cases["penner"]["max_force"]


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
        assert f"<td>{words}</td>" in (tmp_path / "custom_report.html").read_text("utf-8")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--set", "m_club=200"), "--set m_club=200 is taken in kg: write --set m_club=0.2 for"),
        (("laws", "--set", "k=8e5"), "a case of your own; they don't change laws"),
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
    command = [sys.executable, script] if alone else [COMMAND, "run", script, "laws"]
    done = run(*command, "--out", out, cwd=tmp_path)
    assert "contact time decreases with stiffness" in done.stdout
    results = json.loads((out / "results.json").read_text())
    assert list(results) == (["my scenario"] if alone else ["my scenario", "laws"])
    assert list(results["my scenario"]) == ["k = 500000", "k = 1e+06", "k = 2e+06"]
    assert (out / "stiffer_force.png").read_bytes().startswith(b"\x89PNG")


RUN = "def run(impact):\n    "


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, ("there is no script", "mine.py")),
        ("def run(", ("mine.py, line 1", "SyntaxError")),
        ("import numpy\n\nnumpy.nothing", ("mine.py, line 3", "AttributeError")),
        ("run = 1", ("mine.py is not a scenario", "run(impact)")),
        ("from golf_impact.scenario import Report", ("line 1", "Report is now Result")),
        ("def run(fmu): pass", ("mine.py is not a scenario (run(fmu)", "run(impact)")),
        (RUN + "pass", ("mine.py", "returns None", "Result")),
        (RUN + "return 1 / 0", ("line 2", "ZeroDivisionError")),
        (RUN + "impact(k=-1.0)", ("line 2: k = -1.0",)),
        (RUN + "impact()['cor']", ("line 2", "'cor'", "smash_factor, coefficient_of_restitution")),
        (RUN + "impact(['cor'])", ("line 2", "no output 'cor'")),
    ],
)
def test_a_script_that_is_no_scenario(tmp_path, text, words):
    script, out = tmp_path / "mine.py", tmp_path / "out"
    if text is not None:
        script.write_text(text)
    refused(golf_here("run", script, "--out", out), *words)
    assert not list(out.glob("*"))


def test_two_scenarios_of_one_name(tmp_path):
    (tmp_path / "laws.py").write_text(MINE, "utf-8")
    refused(golf_here("run", "laws", tmp_path / "laws.py", "--out", tmp_path / "out"), "same name")


def test_a_claim_that_fails(tmp_path):
    body = "return Result('t', claims={'so it is': False, 'as ever': True})"
    text = f"from golf_impact.scenario import Result\n{RUN}{body}"
    (tmp_path / "mine.py").write_text(text)
    done = golf_here("run", tmp_path / "mine.py", "--out", tmp_path, code=1)
    assert "✗ so it is" in done.stdout
    assert "✓ as ever" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "baselin"), ("baselin", "did you mean baseline?")),
        (("run", "--set", "stiffness=1"), ("stiffness", "k, b, club_speed")),
        (("run", "--set", "k=hard"), ("hard", "no number")),
        (("run", "--set", "gap=0,2"), ("write 0.2",)),
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
        (("run", "laws", "--fmu="), ("an argument is empty",)),
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
