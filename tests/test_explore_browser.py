"""The page of `golf-impact explore` in Chromium, opened as a file, without a network."""

import csv
import hashlib
import itertools
import json
import re
import shutil
import subprocess
import tarfile
import time

import pytest
from page import Tab, chrome
from selenium.webdriver import ActionChains, Keys

import golf_impact
from golf_impact.ball import BALLS
from golf_impact.explore.page import write_page
from golf_impact.quantities import QUANTITIES

AXE = "axe-core@4.14.1"
AXE_SHA512 = "1477dafa598d8d065f273d6af302aa203c02e83131707b7fa648cd41bd3d6b734f8c22a0dab86ee6a6f64b8afbe804b214d36db85a2826965edfb3a0b9d546b5"

SIZES = [(1366, 768, False), (390, 844, True)]


@pytest.fixture(scope="module")
def browser():
    with chrome() as opened:
        yield opened


@pytest.fixture
def tab(browser, tmp_path):
    """The page with no case of its own; afterwards: no error, no request but for files."""
    yield Tab(browser, write_page(tmp_path / "a page.html", {}))
    found = [one for one in browser.get_log("browser") if one["level"] in ("SEVERE", "WARNING")]
    for entry in browser.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            url = message["params"]["request"]["url"]
            found += [url] * (not url.startswith(("file:", "data:", "blob:", "about:", "chrome:")))
    assert found == []


def check(tab, **values):
    """The page shows the numbers of the physics, to the printed digits and beyond them."""
    expected = golf_impact.run_impact(**values)
    texts, numbers = tab.results()
    assert "smash_factor" in texts
    for name in texts.keys() & expected.keys():
        assert numbers[name] == pytest.approx(expected[name], rel=1e-12, abs=1e-12), name
        if name in QUANTITIES:
            assert texts[name] == QUANTITIES[name].format_value(expected[name]).replace("-", "−"), (
                name
            )


def address(tab, **values):
    """Wait until the address is that of these values."""
    wanted = "#" + "&".join(f"{name}={value}" for name, value in values.items())
    tab.until(lambda: tab.js("return location.hash") == wanted)


@pytest.mark.parametrize(("width", "height", "phone"), SIZES)
def test_ready_with_the_case_asked_for(tab, tmp_path, width, height, phone):
    tab.screen(width, height, phone)
    check(tab.open(), **BALLS["roh-lee"].values)
    assert tab.value("ball") == "roh-lee"
    check(tab.open("#law=2&k=900000"), law=2, k=9e5)
    check(tab.open("?law=1&club_speed=95mph"), club_speed=42.4688)
    # The case of the file; the address overrides it; one that is refused leaves a case.
    tab.file = write_page(tmp_path / "mine.html", {"law": 2, "b": 20.0})
    check(tab.open(), law=2, b=20.0)
    check(tab.open("?k=2e6#law=2&k=5e5"), law=2, k=5e5)
    check(tab.open("#law=2&k=-1"), **BALLS["roh-lee"].values)
    assert (
        tab.text("k_refused")
        == tab.text("announced")
        == "k = -1.0 N/m is refused: it must be a finite number > 0"
    )
    # Of older pages.
    tab.open("?law=2&dynamic_loft=0.2&friction=0.3&level=simple")
    check(tab, law=2)
    assert tab.text("hint").startswith("Ignored in the address: dynamic_loft, friction.")
    assert tab.js("return document.documentElement.scrollWidth") <= width


def test_presets_and_examples(tab):
    tab.open("#law=1")
    for name, ball in BALLS.items():
        check(tab.select("ball", name), **ball.values)
        assert ball.source in tab.text("source")
    check(tab.type("club_speed", "60"), **BALLS[name].values, club_speed=60)
    assert "holds for 30 to 50 m/s, not for 60" in tab.text("source")
    for label, values in {
        "Document": {},
        "Elastic": {"b": 0.0},
        "Old ball": {"k": 5e5, "b": 12.0},
        "Law 1 | law 2": {"law": 2},
    }.items():
        check(tab.press(label), **values)
    assert [
        one.get_property("value")
        for one in tab.browser.find_elements("css selector", "#pins input")
    ] == ["Law 1"]
    assert "document: 1.57" in tab.press("Document").text("readouts")


def test_fields_take_units_and_refusals_are_announced(tab):
    tab.open("#law=2")
    for name, text, value in (
        ("club_speed", "95 mph", 42.4688),
        ("k", "770N/mm", 7.7e5),
        ("m_ball", "46,2", 0.0462),
        ("b", "0,2", 0.2),
        ("gap", "1e-3 m", 1e-3),
    ):
        tab.type(name, text)
        assert float(re.search(rf"{name}=([^&]*)", tab.value("address"))[1]) == value
    check(tab, law=2, club_speed=42.4688, k=7.7e5, m_ball=0.0462, b=0.2, gap=1e-3)
    for name, text, why in (
        ("k", "-5", "k = -5000.0 N/m is refused"),
        ("k", "770lb", "'lb' isn't a unit"),
        ("k", "1,000", "write 1000 or 1.000"),
        ("k", "1,000,000", "write 1000000"),
        ("b", "x", "no number"),
    ):
        before = tab.results()
        tab.type(name, text)
        assert why in tab.text(f"{name}_refused")
        assert tab.text("announced") == tab.text(f"{name}_refused")
        assert tab.get(name).get_attribute("aria-invalid") == "true"
        assert tab.results() == before
        tab.type(name, "500")
        assert tab.text(f"{name}_refused") + tab.text("announced") == ""
        assert tab.get(name).get_attribute("aria-invalid") == "false"
    # Together; another control mends it.
    tab.open("#law=2&exponent=1.6").get("input[name=law][value='1']").click()
    assert "set exponent = 1, or law = 2" in tab.text("exponent_refused")
    check(tab.type("exponent", "1"))
    # Numbers that look like another unit's, in every unit.
    for unit, text, words in (
        ("m/s", "95", "95 m/s is more than golf has (70 m/s). Write 95 mph or 95 km/h"),
        ("km/h", "300", "300 km/h is more than golf has (252 km/h)."),
        ("mph", "110", ""),
    ):
        tab.select("unit", unit).type("club_speed", text)
        assert tab.text("club_speed_idle").startswith(words)
        assert bool(words) == bool(tab.text("club_speed_idle"))
    assert tab.value("club_speed_slider") == "110"
    assert tab.get("club_speed_slider").get_attribute("aria-valuetext") == "110 mph"


def test_sliders_undo_reset_levels(tab):
    tab.open("#law=2").slide("b", 10, 15, 20).slide("k", 900)
    check(tab, law=2, b=20, k=9e5)
    address(tab, k=900000, b=20, law=2)
    assert tab.value("command") == "golf-impact run --set k=900000 --set b=20 --set law=2"
    # A slider's way is one step; keys, beside the button.
    ActionChains(tab.browser).key_down(Keys.CONTROL).send_keys("z").key_up(Keys.CONTROL).perform()
    check(tab, law=2, b=20)
    check(tab.press("Undo"), law=2)
    assert not tab.get("undo").is_enabled()
    tab.get("b").send_keys(Keys.ARROW_UP * 3, Keys.ARROW_DOWN)
    check(tab, law=2, b=10)
    # The simple level keeps what it can show, and starts with a legal ball.
    check(tab.select("ball", "penner"), **BALLS["penner"].values)
    assert not tab.get("b").is_enabled()
    assert "the COR line determines the damping" in tab.text("b_idle")
    check(tab.select("level", "simple"), law=2, k=BALLS["penner"].values["k"])
    assert tab.visible("#controls input[type=text]") == ["k", "b", "club_speed", "m_club", "m_ball"]
    assert tab.visible("figure") == [
        "force_figure",
        "energies_figure",
        "momenta_figure",
        "velocities_figure",
    ]
    check(tab.press("Undo"), **BALLS["penner"].values)
    tab.press("Reset")
    check(tab, law=2, b=30.0)
    assert tab.results()[1]["coefficient_of_restitution"] == pytest.approx(0.8, abs=0.01)
    check(tab.select("level", "all").press("Reset"), **BALLS["roh-lee"].values)
    tab.open("#law=1")
    assert not any(
        tab.get(name).is_enabled()
        for name in ("exponent", "restitution_at_rest", "reference_compression")
    )
    # No contact, no separation: no results that don't exist.
    tab.type("club_speed", "-3")
    assert tab.text("state").startswith("No contact")
    tab.open("#b=5000")
    assert tab.text("state").startswith("No separation")
    assert {name for name, x in tab.results()[1].items() if x is not None} == {
        "max_force",
        "max_compression",
    }


def test_cursor_animation_and_curves(tab):
    tab.open("#law=2")
    places = [
        tab.js(f"return document.querySelector('#{name}_figure svg circle').getAttribute('cx')")
        for name in ("force", "momenta", "positions")
    ]
    assert len(set(places)) == 1
    tab.js("scrub.value = 0.3; scrub.dispatchEvent(new Event('input'))")
    for name in ("force", "loop"):
        before = tab.text("cursor")
        ActionChains(tab.browser).move_to_element_with_offset(
            tab.get(f"{name}_figure"), 40, -10
        ).perform()
        tab.until(lambda before=before: tab.text("cursor") != before)
    tab.press("▶ Play")
    seen = set()
    tab.until(lambda: seen.add(tab.value("scrub")) or len(seen) > 5)
    tab.press("⏸ Pause")
    time.sleep(0.1)
    now = tab.value("scrub")
    time.sleep(0.2)
    assert tab.value("scrub") == now
    # The point of the sweep is the case.
    tab.select("over", "k")
    tab.until(
        lambda: (
            "here S 1.5842, COR 0.9307" in tab.get("#sweep_figure svg").get_attribute("aria-label")
        )
    )


def test_pins_and_downloads(tab, tmp_path):
    tab.cdp("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    tab.open("#law=2")
    for n in range(9):
        tab.slide("b", 5 * n)
        if n < 8:
            tab.press("Pin")
    assert not tab.get("pin").is_enabled()
    assert len(tab.browser.find_elements("css selector", "#force_figure .pinned")) == 8
    for choice in ("path.csv", "pins.csv", "energies.svg"):
        tab.select("download", choice)
        tab.until((tmp_path / f"golf-impact-{choice}").exists)
    head, *rows = csv.reader((tmp_path / "golf-impact-pins.csv").read_text().splitlines())
    assert head[:4] == ["name", "query", "club_velocity (m/s)", "ball_velocity (m/s)"]
    assert float(rows[2][head.index("smash_factor")]) == pytest.approx(
        golf_impact.run_impact(law=2, b=10)["smash_factor"], rel=1e-14
    )
    head, *rows = (tmp_path / "golf-impact-path.csv").read_text().splitlines()
    assert head.startswith("time (s),force (N),club_position (m)")
    assert "lost_energy (J)" in head
    assert len(rows) > 120
    picture = (tmp_path / "golf-impact-energies.svg").read_text()
    assert {*re.findall(r"<svg|<style|hatch_lost|xmlns=", picture)} == {
        "<svg",
        "<style",
        "hatch_lost",
        "xmlns=",
    }
    tab.press("Remove")
    assert tab.get("pin").is_enabled()
    tab.press("Reopen")
    check(tab, law=2, b=5)


def test_tasks_and_sheets(tab):
    tab.open()
    links = tab.browser.find_elements("css selector", "#tasks a")
    assert [link.get_attribute("href").split("?")[1] for link in links] == [
        "law=2&b=30&level=simple"
    ] * 3
    links[0].click()
    check(tab, law=2, b=30.0)
    check(tab.type("k", "500"), law=2, b=30.0, k=5e5)
    # The answers are the page's own.
    key = tab.js(
        "return [...document.querySelectorAll('#key table')[0].rows].map((row) => row.cells[2].textContent)"
    )
    assert key[1:3] == [
        tab.results()[0]["smash_factor"],
        tab.results()[0]["coefficient_of_restitution"],
    ]
    assert (
        "".join(
            tab.js(
                "return [...document.querySelectorAll('#worksheet td')].map((x) => x.textContent)"
            )
        )
        == ""
    )
    tab.select("level", "all").press("Roh & Lee")
    for sheet, (width, height) in itertools.product(
        (None, "worksheet", "key"), ((8.27, 11.69), (8.5, 11.0))
    ):
        tab.js("window.print = () => 0")
        if sheet:
            tab.js("document.querySelector(`#${arguments[0]} details`).open = true", sheet)
            tab.get(f"#{sheet} button").click()
        assert tab.pdf(width, height) == 1, (sheet, width)


@pytest.mark.parametrize(("width", "height", "phone"), SIZES)
def test_layout(tab, width, height, phone):
    tab.screen(width, height, phone).open("#law=2")
    wrong = """
        const box = (one) => one.getBoundingClientRect(), visible = (css) => [...document.querySelectorAll(css)].filter((x) => x.checkVisibility())
        const parts = visible("button, select, input, figure, #readouts tr, label").filter((one) => !one.closest(".scroll, #controls"))
        const shared = (a, b, start, end) => Math.min(a[end], b[end]) - Math.max(a[start], b[start])
        const overlap = (one, other) => !one.contains(other) && !other.contains(one)
          && shared(box(one), box(other), "left", "right") > 1 && shared(box(one), box(other), "top", "bottom") > 1
        return parts.filter((one) => box(one).left < 0 || box(one).right > innerWidth + 0.5 || parts.some((other) => overlap(one, other))).map((one) => one.outerHTML)"""
    for level in ("all", "simple"):
        assert tab.select("level", level).js(wrong) == []
        assert tab.js("return document.documentElement.scrollWidth") <= width
    if not phone:
        assert (
            tab.js(
                "return document.querySelector('#velocities_figure').getBoundingClientRect().bottom"
            )
            <= height
        )
        return
    # The result and a picture are beside each slider.
    for name in ("k", "b", "club_speed", "m_club", "m_ball"):
        tab.js(
            "document.getElementById(arguments[0]).scrollIntoView({block: 'center'})",
            f"{name}_slider",
        )
        tops = tab.js(
            "return ['#summary', 'figure.chosen', arguments[0]].map((css) => document.querySelector(css).getBoundingClientRect().top)",
            f"#{name}_slider",
        )
        assert 0 <= tops[0] < tops[1] < tops[2] - 150, name
    assert tab.text("#summary output").startswith("S 1.5842  COR 0.9307  55.449 m/s")


@pytest.fixture(scope="module")
def axe(tmp_path_factory):
    folder = tmp_path_factory.mktemp("axe")
    if shutil.which("npm") is None:
        pytest.skip(f"npm, which gets {AXE}, isn't installed here")
    done = subprocess.run(
        ["npm", "pack", AXE, "--silent"], cwd=folder, capture_output=True, text=True
    )
    if done.returncode:
        pytest.skip(f"npm can't get {AXE}: {done.stderr.strip()[-200:]}")
    (file,) = folder.glob("*.tgz")
    assert hashlib.sha512(file.read_bytes()).hexdigest() == AXE_SHA512
    with tarfile.open(file) as archive:
        return archive.extractfile("package/axe.min.js").read().decode()


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize(("width", "height", "phone"), SIZES)
def test_accessibility(tab, axe, width, height, phone, dark):
    tab.screen(width, height, phone).dark(dark)
    for where in ("", "#law=1&exponent=1.5", "#law=2&level=simple"):
        tab.open(where).press("Pin").js(
            "for (const one of document.querySelectorAll('details')) one.open = true"
        )
        tab.cdp("Runtime.evaluate", expression=axe)
        found = tab.browser.execute_async_script("axe.run().then(arguments[0])")
        assert [
            (one["id"], [node["html"] for node in one["nodes"]]) for one in found["violations"]
        ] == []
        assert len(found["passes"]) > 20
