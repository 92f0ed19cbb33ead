"""golf-impact as a user meets it: a subprocess."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

COMMAND = Path(sys.executable).with_name("golf-impact")


def golf(*arguments, cwd=None, env=None):
    return subprocess.run(
        [COMMAND, *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, "COLUMNS": "120", **(env or {})},
    )


def refused(done, *words):
    """Exit code 2 and one line on stderr that has these words."""
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    line = done.stderr.strip().splitlines()[-1]
    assert line.startswith("Error: ")
    for word in words:
        assert str(word) in line


def test_version_and_help():
    from golf_impact import __version__

    assert golf("--version").stdout == f"golf-impact {__version__}\n"
    for command in ((), ("run",), ("build",), ("list",), ("calibrate",), ("sweep",)):
        done = golf(*command, "--help")
        assert done.returncode == 0
        assert "Usage" in done.stdout


def test_list():
    done = golf("list")
    assert done.returncode == 0
    for name in ("baseline", "finite_difference", "table1"):
        assert name in done.stdout


def test_build_and_run(tmp_path):
    fmu = tmp_path / "mine.fmu"
    assert golf("build", "--out", fmu).returncode == 0
    assert zipfile.is_zipfile(fmu)
    out = tmp_path / "out"
    done = golf("run", "baseline", "--fmu", fmu, "--out", out, "--no-figures")
    assert done.returncode == 0, done.stderr
    assert "54.745" in done.stdout
    names = {path.name for path in out.iterdir()}
    assert names == {"results.json", "baseline.csv", "report.html"}
    header = (out / "baseline.csv").read_text().splitlines()[0]
    assert header.startswith("time,force,club_position")


def test_no_figures_needs_no_matplotlib(tmp_path):
    code = (
        "import sys; sys.argv = ['golf-impact', 'run', 'baseline', '--no-figures', '--out', "
        f"{str(tmp_path)!r}]\nfrom golf_scenarios.commands import app\n"
        "assert app.one_line(sys.argv[1:]) == 0\n"
        "assert 'matplotlib' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_a_case_of_ones_own(tmp_path):
    done = golf("run", "--set", "k=8e5", "--set", "club_speed=42", "--set", "law=2", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "golf-impact-results"
    case = json.loads((folder / "results.json").read_text())["custom"]["custom"]
    assert case["smash_factor"] * 42.0 == pytest.approx(case["ball_velocity"], rel=1e-15)
    assert (folder / "custom_force.png").stat().st_size > 0


def test_a_scenario_alone(tmp_path):
    script = Path(__file__).parent.parent / "scenarios" / "old_ball.py"
    done = subprocess.run(
        [sys.executable, script, "--out", tmp_path, "--no-figures"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "52.386" in done.stdout


MINE = """
from golf_scenarios.scenario import Report, main

TITLE = "A scenario of my own"


def run(fmu):
    report = Report(TITLE, fmu)
    report.impact("soft", k=5e5)
    report.impact("hard", k=2e6)
    report.falls("a stiffer ball: contact is shorter", "contact_time")
    report.say("So it is.")

    @report.figure("mine")
    def figure(figures):
        return figures.new("Mine")[0]

    return report


if __name__ == "__main__":
    main(__file__)
"""


@pytest.mark.parametrize("alone", [False, True])
def test_a_scenario_of_ones_own(tmp_path, alone):
    script, out = tmp_path / "my scenario.py", tmp_path / "out"
    script.write_text(MINE)
    command = [sys.executable, script] if alone else [COMMAND, "run", script, "table1"]
    done = subprocess.run([*command, "--out", out], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "So it is." in done.stdout
    results = json.loads((out / "results.json").read_text())
    assert list(results) == (["my scenario"] if alone else ["my scenario", "table1"])
    assert list(results["my scenario"]) == ["soft", "hard"]
    assert (out / "mine.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, ("there is no script", "mine.py")),
        ("TITLE = ", ("mine.py, line 1", "SyntaxError")),
        ("import sys\nsys.exit('no')", ("mine.py, line 2", "SystemExit: no")),
        ("import numpy\n\nnumpy.nothing", ("mine.py, line 3", "AttributeError")),
        ("run = print", ("mine.py is no scenario", 'TITLE = "..."')),
        ("TITLE = 'mine'", ("mine.py is no scenario", "run(fmu)")),
        ("TITLE = 'mine'\nrun = print", ("mine.py", "gives None", "Report")),
        ("TITLE = 'mine'\ndef run(fmu):\n    return 1 / 0", ("line 3", "ZeroDivisionError")),
        ("TITLE = 'mine'\ndef run(fmu):\n    fmu.impact(k=-1.0)", ("k = -1.0",)),
    ],
)
def test_a_script_that_is_no_scenario(tmp_path, text, words):
    script, out = tmp_path / "mine.py", tmp_path / "out"
    if text is not None:
        script.write_text(text)
    refused(golf("run", script, "--out", out), *words)
    assert not out.exists()


def test_two_scenarios_of_one_name(tmp_path):
    (tmp_path / "table1.py").write_text(MINE)
    refused(golf("run", "table1", tmp_path / "table1.py", "--out", tmp_path / "out"), "table1")


def test_a_failed_check_exits_1(tmp_path):
    code = (
        "import sys; from golf_scenarios.facts import document\n"
        "document.BASELINE['max_force'] = document.Printed('6600')\n"
        f"sys.argv = ['x', 'run', 'baseline', '--no-figures', '--out', {str(tmp_path)!r}]\n"
        "from golf_scenarios.commands.app import main\nmain()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 1
    assert "Check failed: baseline: max force (N) is the printed 6600" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("baselin",), ("baselin", "baseline, club_speed")),
        (("--set", "stiffness=1"), ("stiffness", "k, b, club_speed")),
        (("--set", "force=1"), ("force", "k, b, club_speed")),
        (("--set", "k=hard"), ("hard", "no number")),
        (("--set", "k"), ("NAME=VALUE",)),
        (("--set", "k=-1"), ("k = -1.0 N/m", "> 0")),
        (("--set", "k=nan"), ("k = nan", "> 0")),
        (("--set", "gap=-1"), ("gap", ">= 0")),
        (("--set", "law=3"), ("law = 3", "1 (absolute) or 2 (relative)")),
        (("--set", "law=1.5"), ("law", "whole number")),
        (("--set", "exponent=1.5"), ("exponent", "law = 1")),
        (("--set", "b=inf"), ("b = inf", ">= 0")),
    ],
)
def test_bad_arguments(tmp_path, arguments, words):
    refused(golf("run", *arguments, "--out", tmp_path), *words)
    assert list(tmp_path.iterdir()) == []


def test_an_output_folder_that_cannot_be_written(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    refused(golf("run", "table1", "--out", file / "below"), file, "--out")
    refused(golf("build", "--out", file / "below" / "x.fmu"), "x.fmu")
    refused(golf("build", "--out", tmp_path), "folder")


def test_a_missing_or_broken_fmu(tmp_path):
    refused(golf("run", "--fmu", tmp_path / "none.fmu", "--out", tmp_path), "none.fmu", "build")
    broken = tmp_path / "broken.fmu"
    assert golf("build", "--out", broken).returncode == 0
    data = broken.read_bytes()
    broken.write_bytes(data[: len(data) // 2])
    refused(golf("run", "--fmu", broken, "--out", tmp_path), "broken.fmu", "golf-impact build")
    assert not (tmp_path / "results.json").exists()


def test_results_of_an_earlier_run_stay_whole(tmp_path):
    assert golf("run", "table1", "--out", tmp_path).returncode == 0
    before = (tmp_path / "results.json").read_bytes()
    refused(golf("run", "table1", "--set", "k=-1", "--out", tmp_path), "k = -1.0")
    assert (tmp_path / "results.json").read_bytes() == before


@pytest.mark.parametrize("value", ["nan", "inf", "4294967298", "1e300"])
def test_a_law_that_is_no_small_number(tmp_path, value):
    refused(golf("run", "--set", f"law={value}", "--out", tmp_path), "law", "whole number")


def test_an_fmu_without_its_module(tmp_path):
    """pythonfmu's library would take the process down."""
    whole, empty = tmp_path / "whole.fmu", tmp_path / "empty.fmu"
    assert golf("build", "--out", whole).returncode == 0
    with zipfile.ZipFile(whole) as source, zipfile.ZipFile(empty, "w") as target:
        for info in source.infolist():
            if not info.filename.startswith("resources/club_ball_impact"):
                target.writestr(info, source.read(info))
    refused(golf("run", "--fmu", empty, "--out", tmp_path), "module", "golf-impact build")


def test_a_temporary_folder_that_pythonfmu_cannot_take(tmp_path):
    odd = tmp_path / "a#b"
    odd.mkdir()
    refused(golf("run", "table1", "--out", tmp_path, env={"TMPDIR": str(odd)}), "TMPDIR")


def test_a_terminal_that_knows_no_greek(tmp_path):
    done = golf("run", "laws", "--out", tmp_path, env={"PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0, done.stderr


def test_a_very_soft_ball_still_parts(tmp_path):
    done = golf("run", "--set", "k=0.1", "--set", "law=2", "--set", "b=0", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    case = json.loads((tmp_path / "results.json").read_text())["custom"]["custom"]
    assert case["coefficient_of_restitution"] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("calibrate", "--core", "0.7"), ("--core", "calibrate --help")),
        (("build", "--fmi", "4"), ("--fmi",)),
        (("nothing",), ("nothing",)),
        (("sweep", "--seed", "abc"), ("--seed",)),
        (("run", ":100:"), (":100:",)),
        (("sweep", "--set", "k=log:-1:1:5", "--out", "x.csv"), ("k=log:-1:1:5",)),
    ],
)
def test_one_line_for_any_mistake(arguments, words, tmp_path):
    done = golf(*arguments, cwd=tmp_path)
    refused(done, *words)
    assert len(done.stderr.strip().splitlines()) == 1


def test_no_arguments_show_help():
    done = golf()
    assert done.returncode == 2
    assert "Usage" in done.stdout + done.stderr
