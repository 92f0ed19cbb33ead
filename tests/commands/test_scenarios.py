"""Scenario scripts: they run, their claims hold and can fail; results, report and figures."""

import html
import json
import re

import numpy as np
import pytest
from command import golf_here
from html5 import check_page

from golf_impact import document, scripts
from golf_impact.fmu import Impact
from golf_impact.quantities import derived, describe
from golf_impact.results import Result, write_results


@pytest.fixture(scope="module")
def impact():
    with Impact() as impact:
        yield impact


@pytest.fixture(scope="module")
def results(impact):
    return {name: scripts.run_script(scripts.path_of(name), impact) for name in scripts.SCENARIOS}


@pytest.mark.parametrize("name", scripts.SCENARIOS)
def test_claims_hold(results, name):
    result = results[name]
    assert result.failed == []
    assert len(result.claims) >= 2
    for case, metrics in result.cases.items():
        assert all(type(value) is float for value in metrics.values()), case


@pytest.mark.parametrize("name", scripts.SCENARIOS)
def test_every_table_names_law_stiffness_and_damping(results, name):
    for title, columns, rows in results[name].tables:
        text = " ".join([title, *columns, *(cell for row in rows for cell in row)])
        assert re.search(r"law \d", text), title
        assert re.search(r"\bk\b", text), title
        assert re.search(r"\bb\b", text), title
        assert all(len(row) == len(columns) for row in rows)
        assert not re.search(r"(?<![\d.])-0\.0*(?![\d])", text), title


def test_the_documents_cases(results):
    """Its eight cases with their printed numbers; what its scheme doesn't give is stated."""
    scheme = results["finite_difference"]
    assert len(document.NOT_REPRODUCED) == 3
    assert "67 of 70 printed numbers" in scheme.words
    assert len(scheme.cases) == 16


def test_a_printed_number_that_deviates_fails(impact, monkeypatch):
    name = "club_speed"
    values, printed = document.CASES["50 m/s"]
    for text, holds in (("1.57", True), ("1.59", False)):
        one = {**printed, "smash_factor": document.Printed(text)}
        monkeypatch.setitem(document.CASES, "50 m/s", document.Case(values, one))
        result = scripts.run_script(scripts.path_of(name), impact)
        assert (result.failed == []) == holds


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


def test_the_report(results, tmp_path):
    """Self-contained; a figure and the main results first, what the document says last."""
    some = {name: results[name] for name in ("baseline", "laws")}
    some["baseline"].claims["<1> is false"] = False
    try:
        page = write_results(tmp_path, some, "the source").read_text("utf-8")
    finally:
        del some["baseline"].claims["<1> is false"]
    check_page(page)
    assert not re.search(r"https?:|url\(|@import|fetch\(|<link|<iframe|<object|<script", page)
    assert not re.search(r'src="(?!data:image/png;base64,)', page)
    places = [page.index(text) for text in ("1.5641", "<img", 'id="laws"', 'id="document"')]
    assert places == sorted(places)
    assert "✗ &lt;1&gt; is false" in page
    assert page.count("<img") == 3
    for _, columns, rows in document.tables():
        assert all(html.escape(cell).replace("&#x27;", "&#39;") in page for r in rows for cell in r)
        assert all(f'<th scope="col">{column}' in page for column in columns)
    cases = json.loads((tmp_path / "results.json").read_text())
    assert cases["baseline"]["baseline"]["smash_factor"] == 1.5641431548673967
    path = np.genfromtxt(tmp_path / "baseline.csv", delimiter=",", names=True)
    assert path["force"].max() == pytest.approx(6785.6, rel=1e-5)
    names = {file.name for file in tmp_path.iterdir()}
    assert {"baseline_force.png", "baseline_motion.png", "laws.png", "law_1.csv"} <= names


def test_results_have_the_same_bytes_at_every_run(tmp_path):
    for folder in ("one", "two"):
        golf_here("run", "laws", "shaft", "--no-figures", "--out", tmp_path / folder, code=0)
    files = [(tmp_path / folder / "results.json").read_bytes() for folder in ("one", "two")]
    assert files[0] == files[1]


def test_nothing_is_built_beside_a_given_fmu(fmu_path, tmp_path):
    """Scenarios that need further files are left out with a line."""
    fmu = tmp_path / "ClubBallImpact.fmu"
    fmu.write_bytes(fmu_path.read_bytes())
    names, out = ("laws", "loft", "system"), tmp_path / "out"
    done = golf_here("run", *names, "--fmu", fmu, "--out", out, code=0)
    for name, file in (("loft", "Launch.fmu"), ("system", "GolfSwing.ssp")):
        assert f"{name} is left out: there is no {file} beside" in done.stderr
    assert list(json.loads((tmp_path / "out" / "results.json").read_text())) == ["laws"]
    assert {file.name for file in tmp_path.iterdir()} == {"ClubBallImpact.fmu", "out"}


def test_one_step_and_one_read_for_metrics(impact, monkeypatch):
    """An impact without a trajectory takes one communication step and one call of getReal."""
    calls = dict.fromkeys(("doStep", "getReal"), 0)

    def counted(name):
        call = getattr(impact.instance, name)

        def count(*arguments):
            calls[name] += 1
            return call(*arguments)

        return count

    for name in calls:
        monkeypatch.setattr(impact.instance, name, counted(name))
    impact(k=8e5)
    assert calls == {"doStep": 1, "getReal": 1}


def test_refused_values_raise(impact):
    """simulate_fmu itself returns the rows before a refused step."""
    from golf_impact.errors import UserError

    wrong = {"k": -1.0, "law": 1.5, "exponent": 2.0, "stiffness": 1.0, "force": 1.0}
    for values in ({name: value} for name, value in wrong.items()):
        for call in (lambda v: impact(**v), lambda v: impact.simulate(start_values=v)):
            with pytest.raises(UserError, match=next(iter(values))):
                call(values)
    assert impact()["smash_factor"] == 1.5641431548673967


def test_messages_reach_their_own_instance(impact):
    """Also after another instance has come and gone."""
    from golf_impact.errors import UserError
    from golf_impact.fmu import Fmu

    with Fmu(impact.path) as other, pytest.raises(UserError, match="b = -1"):
        other.start(b=-1.0)
    with pytest.raises(UserError, match="k = -1"):
        impact(k=-1.0)


def test_a_result_without_claims_has_none_failed():
    assert Result("t").failed == []
    assert Result("t", claims={"a": True, "b": np.bool_(False)}).failed == ["b"]
