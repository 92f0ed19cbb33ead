"""All scenarios run, their checks pass, and checks can fail; reports, tables and figures."""

import html
import io
import json
import math
import re
from unittest.mock import Mock

import pytest
from cases import DEFAULTS
from cases import exact as exact_case
from quadrature import PowerLawContact
from rich.console import Console

from golf_impact import document
from golf_impact.ball import BALLS
from golf_impact.commands import console
from golf_impact.commands.scripts import list_names, load_scenario
from golf_impact.report.page import document_tables, render_page, write_reports
from golf_impact.report.report import Report

LONG = ("system", "loft", "outside", "model_exchange")


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.ci] * (n in LONG)) for n in list_names()]
)
def test_scenario(fmu, name, monkeypatch):
    outcome = load_scenario(name).run(fmu)
    assert [check for check in outcome.checks if not check.passed] == []
    assert outcome.tables or outcome.figures
    for metrics in outcome.cases.values():
        assert all(isinstance(value, float) for value in metrics.values())
    for table in outcome.tables:
        assert_words_are_whole(table, monkeypatch)


def test_density_of_the_air():
    """ISO 2533's table; moist air by OIML R 111-1 (2004), equation E.3-1, a fit to CIPM's."""
    density = load_scenario("outside").air_density
    assert density(0.0, 15.0) == pytest.approx(1.2250, abs=5e-5)
    # At a geopotential altitude of 5000 m: 540.20 hPa, 255.65 K.
    assert density(5000.0, -17.5) == pytest.approx(54020.0 / (287.05 * 255.65), abs=5e-5)
    for t, percent in ((25.0, 0.0), (25.0, 50.0), (35.0, 90.0)):
        fit = (0.34848 * 1013.25 - 0.009 * percent * math.exp(0.061 * t)) / (273.15 + t)
        # An ideal gas: its compressibility is 3e-4 to 1e-3 here.
        assert density(0.0, t, percent / 100.0) == pytest.approx(fit, rel=1e-3)


def test_figures_and_report(fmu, tmp_path):
    outcomes = {name: load_scenario(name).run(fmu) for name in ("diagram", "baseline", "laws")}
    write_reports(tmp_path, outcomes, "guid", with_figures=True, tick=(tick := Mock()))
    sizes = {file.name: file.stat().st_size for file in tmp_path.iterdir()}
    assert {"diagram.png", "baseline_force.png", "laws.png"} <= set(sizes)
    assert all(size > 0 for size in sizes.values())
    page = (tmp_path / "report.html").read_text("utf-8")
    # It is self-contained.
    assert not re.search(r"https?:|url\(|@import|fetch\(|<link|<iframe|<object", page)
    assert not re.search(r'src(set)?="(?!data:image/png;base64,)', page)
    targets = re.findall(r'href="([^"]*)"', page)
    assert targets == ["#document", "#diagram", "#baseline", "#laws"]
    assert all(f'id="{target[1:]}"' in page for target in targets)
    images = re.findall(r"<img [^>]*>", page)
    assert len(images) == 5
    # Of two pairs of axes, another one for narrow screens.
    assert page.count("<source media") == 2
    for image in images:
        width, height = (
            int(re.search(rf'{name}="(\d+)"', image)[1]) for name in ("width", "height")
        )
        assert width > height > 0
        assert re.search('alt="[^"]', image)
    captions = [text for one in outcomes.values() for text in one.captions.values()]
    assert [html.unescape(text) for text in re.findall('alt="(.*?)"', page)] == captions
    assert tick.call_count == len(captions)
    # The command that opens a case in explore.
    assert "golf-impact explore --set law=1" in page
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["baseline"]["baseline"]["smash_factor"] == pytest.approx(1.5641431548673967)


def test_references_of_model_exchange():
    reference = load_scenario("model_exchange")._REFERENCE
    ball = PowerLawContact(**DEFAULTS | BALLS["roh-lee"].values).outputs()
    for name, exact in {
        "law 1": exact_case("law 1"),
        "law 2": exact_case("law 2"),
        "power law": ball,
    }.items():
        expected = float(exact["ball_velocity"]), float(exact["contact_time"])
        assert reference[name] == pytest.approx(expected, rel=1e-15)


def test_a_failed_check_is_outside_the_details(fmu):
    report = Report("<One>", fmu)
    report.check("that 1 < 0", False, "it isn't")
    text = render_page({"one": report}, {}, "guid").decode()
    assert text.index("✗ that 1 &lt; 0") < text.index("<details")
    assert "✗ 0 of 1 checks passed: statements 0 of 1" in text
    assert "<One>" not in text


def assert_words_are_whole(table, monkeypatch):
    monkeypatch.setattr(console, "out", Console(width=80, file=io.StringIO()))
    console.print_table(table)
    text = console.out.file.getvalue()
    words = {word for row in (table.columns, *table.rows) for cell in row for word in cell.split()}
    assert words <= set(text.split())
    assert max(map(len, text.splitlines())) <= 80


def test_the_report_has_the_documents_statements(fmu):
    outcomes = {name: load_scenario(name).run(fmu) for name in ("baseline", "finite_difference")}
    text = render_page(outcomes, {}, "guid").decode()
    introduction = text[: text.index('<section id="baseline">')]
    for table in document_tables():
        for cell in (cell for row in table.rows for cell in row):
            assert html.escape(cell).replace("&#x27;", "&#39;") in introduction
    scheme = outcomes["finite_difference"]
    assert len(scheme.deviations) == len(document.NOT_REPRODUCED) == 3
    assert "67 of 70 printed numbers" in scheme.verdict


def test_a_printed_number_that_deviates_otherwise_fails(fmu, monkeypatch):
    """Listed with another number than the scheme gives, or not listed."""
    for change in ("54.85", None):
        known = dict(document.NOT_REPRODUCED)
        one = known.pop(("k = 1e6", "ball_velocity"))
        if change:
            known["k = 1e6", "ball_velocity"] = one._replace(scheme=change)
        monkeypatch.setattr(document, "NOT_REPRODUCED", known)
        outcome = load_scenario("finite_difference").run(fmu)
        (failed,) = (check for check in outcome.checks if not check.passed)
        assert "ball velocity v_B (m/s) agrees with the printed 54.9" in failed.claim


def test_one_step_for_metrics(fmu, monkeypatch):
    """An impact without a trajectory takes one communication step and one call of getReal."""
    calls = {name: Mock(wraps=getattr(fmu.slave, name)) for name in ("doStep", "getReal")}
    for name, call in calls.items():
        monkeypatch.setattr(fmu.slave, name, call)
    fmu.impact(k=8e5)
    assert [call.call_count for call in calls.values()] == [1, 1]
