"""Every scenario runs, its checks pass, and a check that should fail does."""

import json
import re
from itertools import pairwise

import pytest

from golf_scenarios.commands.scripts import FOLDER, names, scenario, scenarios
from golf_scenarios.facts import document
from golf_scenarios.peers.document_scheme import document_fmu
from golf_scenarios.report.page import write_outcomes
from golf_scenarios.report.report import Report


@pytest.mark.parametrize("name", names())
def test_scenario(fmu, name):
    outcome = scenario(name).run(fmu)
    assert [check for check in outcome.checks if not check.passed] == []
    assert outcome.tables or outcome.figures
    for metrics in outcome.cases.values():
        assert all(isinstance(value, float) for value in metrics.values())


def test_figures_and_report(fmu, tmp_path):
    outcomes = {name: scenario(name).run(fmu) for name in ("diagram", "baseline", "laws")}
    files = write_outcomes(tmp_path, outcomes, "guid", with_figures=True)
    assert all(file.stat().st_size > 0 for file in files)
    assert {"diagram.png", "baseline_force.png", "laws.png"} <= {file.name for file in files}
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/png;base64,") == 5
    assert "http" not in page.replace("http-equiv", "")
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["baseline"]["baseline"]["smash_factor"] == pytest.approx(1.5641431548673967)


def test_the_scenario_in_the_readme(fmu, tmp_path):
    text = (FOLDER / "README.md").read_text("utf-8")
    script = tmp_path / "stiffer.py"
    script.write_text(re.search(r"```python\n(.*?)```", text, re.DOTALL)[1], "utf-8")
    outcome = scenario(str(script)).run(fmu)
    assert all(check.passed for check in outcome.checks)
    assert list(outcome.figures) == ["stiffer_force"]


def test_the_report_begins_with_the_first_chapter():
    chapters = [script.CHAPTER for script in scenarios().values()]
    assert chapters == list(range(1, len(names()) + 1))
    assert next(iter(scenarios())) == "diagram"


def test_one_step_for_metrics(fmu, monkeypatch):
    """A metrics-only case takes one communication step and one read of Real variables."""
    counts = {"doStep": 0, "getReal": 0}
    for name in counts:
        call = getattr(fmu.slave, name)

        def counted(*args, name=name, call=call):
            counts[name] += 1
            return call(*args)

        monkeypatch.setattr(fmu.slave, name, counted)
    fmu.impact(k=8e5)
    assert counts == {"doStep": 1, "getReal": 1}


def test_a_wrong_printed_number_fails(fmu):
    report = Report("", fmu)
    report.impact("case", {"smash_factor": document.Printed("1.59")})
    assert [check.passed for check in report.checks].count(False) == 1


def test_the_documents_scheme_is_of_first_order(fmu):
    exact = fmu.impact(("ball_velocity", "contact_time"))
    with document_fmu() as scheme:
        errors = [
            abs(scheme.impact(dt)["ball_velocity"] - exact["ball_velocity"])
            for dt in (2e-6, 1e-6, 0.5e-6)
        ]
    for coarse, fine in pairwise(errors):
        # A factor of 2 to the first order; the contact's end on a grid adds a per cent.
        assert coarse / fine == pytest.approx(2.0, rel=0.03)
