"""The page of `golf-impact explore` in Chromium, opened as a file, without a network."""

import csv
import hashlib
import itertools
import json
import re
import shutil
import subprocess
import tarfile

import pytest
from selenium.webdriver import ActionChains, Keys
from tab import Tab, chrome

import golf_impact
from golf_impact.data.balls import BALLS
from golf_impact.data.quantities import QUANTITIES
from golf_impact.explore.page import write_page

AXE, SHA512 = "axe-core@4.14.1", (
    "1477dafa598d8d065f273d6af302aa203c02e83131707b7fa648cd41bd3d6b73"
    "4f8c22a0dab86ee6a6f64b8afbe804b214d36db85a2826965edfb3a0b9d546b5"
)  # fmt: skip

OPENING, PENNER = BALLS["roh-lee"].values, BALLS["penner"].values
screens = pytest.mark.parametrize("screen", [(1366, 768, False), (390, 844, True)])


@pytest.fixture(scope="module")
def browser():
    with chrome() as opened:
        yield opened


@pytest.fixture
def tab(browser, tmp_path):
    """The page without a case of its own; afterwards: no error, no request but for files."""
    yield Tab(browser, write_page(tmp_path / "a page.html", {}))
    found = [one for one in browser.get_log("browser") if one["level"] in ("SEVERE", "WARNING")]
    for entry in browser.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            url = message["params"]["request"]["url"]
            found += [url] * (not url.startswith(("file:", "data:", "blob:", "about:", "chrome:")))
    assert found == []


def results(tab):
    """Printed texts and numbers (SI units; None where there is none) by output."""
    rows = tab.each("data", "[x.id, x.textContent, x.value]")
    return {name: (text, float(value) if value else None) for name, text, value in rows}


def check(tab, **values):
    """The page shows the numbers of the physics, to the printed digits and beyond them."""
    expected, found = golf_impact.run_impact(**values), results(tab)
    for name in found.keys() & expected.keys():
        assert found[name][1] == pytest.approx(expected[name], rel=1e-12, abs=1e-12), name
        if name != "max_compression":
            assert found[name][0] == QUANTITIES[name].format_value(expected[name]).replace("-", "−")
    assert len(found.keys() & expected.keys()) == 9


#: By address: the case, the level, and what isn't an input; of older pages, or of JavaScript.
ADDRESSES = {
    "": ({"law": 2, "b": 30.0}, "simple", ""),
    "?level=all": (OPENING, "all", ""),
    "#law=2&k=900000": ({"law": 2, "k": 9e5}, "all", ""),
    "?law=1&club_speed=95mph": ({"club_speed": 42.4688}, "all", ""),
    "?law=2&friction=0.3&level=simple": ({"law": 2}, "simple", "friction"),
    "#constructor=5&__proto__=5": ({"law": 2, "b": 30.0}, "simple", "constructor, __proto__"),
}


def test_it_opens_with_the_case_asked_for(tab, tmp_path):
    for address, (values, level, ignored) in ADDRESSES.items():
        check(tab.open(address), **values)
        assert tab.value("level") == level, address
        assert tab.text("hint").startswith(f"Ignored in the address: {ignored}." * bool(ignored))
    # What is refused at its control, whatever is ignored; the simple level stays.
    check(tab.open("#k=1e6&club_speed=abc&foo=3&level=simple"), law=2, b=30.0)
    why = "club_speed=abc is refused: 'abc' is not a number (e.g. 1.5)"
    assert (tab.text("club_speed_refused"), tab.text("k_refused")) == (why, "")
    assert tab.get("club_speed").get_attribute("aria-invalid") == "true"
    assert tab.text("hint").startswith("Ignored in the address: foo.")
    assert tab.text("hint").endswith(f"{why}. The pictures show the last accepted case.")
    check(tab.open("#law=2&k=-1"), **OPENING)
    assert tab.text("k_refused") == "k = -1 N/m is refused: it must be between 0.001 and 1e+15"
    # The case of the file, at All if Simple can't show it; the address overrides it.
    tab.file = write_page(tmp_path / "law 1.html", {"k": 9e5})
    check(tab.open(), k=9e5)
    assert tab.value("level") == "all"
    tab.file = write_page(tmp_path / "mine.html", {"law": 2, "b": 20.0})
    check(tab.open(), law=2, b=20.0)
    check(tab.open("?k=2e6#law=2&k=5e5"), law=2, k=5e5)


def test_presets_and_examples(tab):
    # The address of the start values isn't empty, which would be the opening.
    assert tab.open("#law=1").value("address").endswith("#law=1")
    for name, ball in BALLS.items():
        check(tab.select("ball", name), **ball.values)
        assert ball.source in tab.text("source")
    check(tab.type("club_speed", "60"), **BALLS[name].values, club_speed=60)
    assert "For 30 to 50 m/s, not for 60." in tab.text("source")
    check(tab.press("Old ball"), k=5e5, b=12.0)
    check(tab.press("Law 1 | law 2"), law=2)
    assert tab.each("#pins input", "x.value") == ["Law 1"]
    assert "document: 1.57" in tab.press("Document").text("readouts")


def test_fields_take_units_and_refusals_are_announced(tab):
    tab.open("#law=2").type("club_speed", "95 mph").type("k", "770N/mm").type("m_ball", "46,2")
    values = {"law": 2, "club_speed": 42.4688, "k": 7.7e5, "m_ball": 0.0462, "b": 0.2}
    tab.type("b", "0,2")
    for name, text, why, right in (
        ("k", "-5", "k = -5000 N/m is refused", "770"), ("k", "770lb", "'lb' isn't a", "770"),
        ("k", "5 constructor", "isn't a unit", "770"),
        ("b", "1,000", "write 1000 or 1.000", "0.2"), ("b", "1,000,000", "write 1000000", "0.2"),
    ):  # fmt: skip
        tab.type(name, text)
        assert why in tab.text(f"{name}_refused")
        assert tab.text("hint").startswith(tab.text(f"{name}_refused"))
        check(tab, **values)
        assert tab.type(name, right).text(f"{name}_refused") == ""
        assert "refused" not in tab.text("hint")
        assert tab.get(name).get_attribute("aria-invalid") == "false"
    # Refused together: another control mends it.
    tab.open("#law=2&exponent=1.6").get("input[name=law][value='1']").click()
    assert "set exponent = 1, or law = 2" in tab.text("exponent_refused")
    check(tab.type("exponent", "1"))
    # Numbers that look like another unit's, in every unit.
    words = "95 m/s is more than golf has (70 m/s). Write 95 mph or 95 km/h if you mean that."
    assert tab.type("club_speed", "95").text("club_speed_idle") == words
    tab.select("unit", "km/h").type("club_speed", "300")
    assert tab.text("club_speed_idle") == "300 km/h is more than golf has (252 km/h)."
    # Another unit forgets what is refused; a slider has its range before its value.
    tab.type("club_speed", "x").select("unit", "mph")
    assert (tab.value("club_speed"), tab.text("club_speed_refused")) == ("186.411", "")
    tab.open("#club_speed=50&unit=mph")
    assert (tab.value("club_speed"), tab.value("club_speed_slider")) == ("111.847", "112")
    text, ball = results(tab)["ball_velocity"]
    assert float(text) == pytest.approx(ball / 0.44704, abs=5e-4)
    assert tab.type("club_speed", "110").text("club_speed_idle") == ""
    assert tab.get("club_speed_slider").get_attribute("aria-valuetext") == "110 mph"
    # What is being typed stays.
    tab.open("#law=2").get("club_speed").send_keys(Keys.END, ".50")
    check(tab.slide("k", 900), law=2, k=9e5)
    assert tab.value("club_speed") == "35.50"


def test_sliders_undo_and_levels(tab):
    curves = "#force_figure path.line, #loop_figure path.line"
    before = tab.open("#law=2").each(curves, "x.getAttribute('d')")
    check(tab.slide("b", 10, 15, 20).slide("k", 900), law=2, b=20, k=9e5)
    after = tab.each(curves, "x.getAttribute('d')")
    assert len(before) >= 2
    assert not {*before} & {*after}
    tab.until(lambda: tab.js("return location.hash") == "#k=900000&b=20&law=2")
    assert tab.value("command") == "golf-impact run --set k=900000 --set b=20 --set law=2"
    # A slider's way is one step.
    ActionChains(tab.browser).key_down(Keys.CONTROL).send_keys("z").key_up(Keys.CONTROL).perform()
    check(tab, law=2, b=20)
    check(tab.press("Undo"), law=2)
    assert not tab.get("undo").is_enabled()
    tab.get("b_slider").send_keys(Keys.ARROW_UP * 3, Keys.ARROW_DOWN)
    check(tab, law=2, b=10)
    check(tab.select("ball", "penner"), **PENNER)
    assert not tab.get("b").is_enabled()
    assert "the COR line determines the damping" in tab.text("b_idle")
    # The simple level keeps what it can show, and has a ball that is legal.
    check(tab.select("level", "simple"), law=2, k=PENNER["k"])
    shown = "[...document.querySelectorAll(arguments[0])].filter((x) => x.checkVisibility())"
    fields = tab.js(f"return {shown}.map((x) => x.name)", "#controls input[type=text]")
    assert fields == ["k", "b", "club_speed", "m_club", "m_ball"]
    assert tab.js(f"return {shown}.length", "figure") == 4
    check(tab.press("Undo"), **PENNER)
    check(tab.press("Reset"), law=2, b=30.0)
    assert tab.text("headline") == "S = 1.4715   ball 51.503 m/s"
    assert results(tab)["coefficient_of_restitution"][1] == pytest.approx(0.8, abs=0.01)
    # By keyboard to the first control.
    tab.open("#law=2")
    ActionChains(tab.browser).send_keys(Keys.TAB, Keys.ENTER, Keys.TAB, Keys.ARROW_UP).perform()
    check(tab, law=2, k=1.01e6)
    # No contact, no separation: no results that don't exist.
    assert tab.open("#club_speed=-3").text("state").startswith("No contact")
    assert tab.open("#b=5000").text("state").startswith("No separation")
    there = {name for name, (_, value) in results(tab).items() if value is not None}
    assert there == {"max_force", "max_compression"}


def test_the_ball_moves_once(tab):
    opened = tab.open("#law=2").value("scrub")
    at = [tab.open().value("scrub")]
    tab.until(lambda: float(at[-1]) < float(tab.value("scrub")))
    tab.until(lambda: tab.get("play").get_attribute("aria-pressed") == "false")
    assert tab.value("scrub") == opened
    # What the user does ends it.
    tab.open().type("b", "20")
    assert tab.get("play").get_attribute("aria-pressed") == "false"
    features = [{"name": "prefers-reduced-motion", "value": "reduce"}]
    tab.cdp("Emulation.setEmulatedMedia", features=features)
    assert tab.open().get("play").get_attribute("aria-pressed") == "false"


def test_cursor_animation_pins_and_downloads(tab, tmp_path):
    tab.cdp("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    tab.open("#law=2")
    dots = "#force_figure circle, #momenta_figure circle, #positions_figure circle"
    assert len(set(tab.each(dots, "x.getAttribute('cx')"))) == 1
    for name in ("force", "loop"):
        before, picture = tab.text("cursor"), tab.get(f"{name}_figure")
        ActionChains(tab.browser).move_to_element_with_offset(picture, 40, -10).perform()
        tab.until(lambda before=before: tab.text("cursor") != before)
    tab.press("▶ Play")
    seen = set()
    tab.until(lambda: seen.add(tab.value("scrub")) or len(seen) > 5)
    tab.press("⏸ Pause").select("over", "k")
    words = "here S 1.5842, COR 0.9307"
    tab.until(lambda: words in tab.get("#sweep_figure svg").get_attribute("aria-label"))
    # Lines are as wide as the grid.
    ends = "(({left, right}) => [left, right])(x.getBoundingClientRect())"
    (grid,), lines = (tab.each(f"#sweep_figure path.{kind}", ends) for kind in ("axis", "line"))
    assert lines == [grid, grid]
    for n in range(8):
        tab.slide("b", 5 * n).press("Pin")
    assert not tab.get("pin").is_enabled()
    assert len(tab.each("#force_figure .pinned", "0")) == 8
    files = [tmp_path / f"golf-impact-{name}" for name in ("path.csv", "pins.csv", "loop.svg")]
    for file in files:
        tab.select("download", file.name.removeprefix("golf-impact-")).until(file.exists)
    path, pins, picture = (file.read_text() for file in files)
    pinned = [*csv.DictReader(pins.splitlines())][2]
    expected = golf_impact.run_impact(law=2, b=10)["ball_velocity"]
    assert float(pinned["ball_velocity (m/s)"]) == pytest.approx(expected, rel=1e-14)
    assert (path.startswith("time (s),force (N),"), path.count("\n")) == (True, 128)
    assert re.match(r"<svg [^>]*xmlns=.*<style", picture)
    check(tab.press("Remove").press("Reopen"), law=2, b=5)


def test_tasks_and_sheets(tab):
    tab.open().get("#tasks a").click()
    check(tab, law=2, b=30.0)
    check(tab.type("k", "500"), law=2, b=30.0, k=5e5)
    # The answers are the page's own.
    answers = tab.each("#key table:first-of-type tr", "x.cells[2].textContent")
    assert answers[1] == results(tab)["smash_factor"][0]
    assert set(tab.each("#worksheet td", "x.textContent")) == {""}
    tab.js("window.print = () => 0")
    tab.select("level", "all").press("Roh & Lee")
    sizes = (8.27, 11.69), (8.5, 11.0)
    for sheet, size in itertools.product(("", "worksheet", "key"), sizes):
        if sheet:
            tab.js("document.querySelector(`#${arguments[0]} details`).open = true", sheet)
            tab.get(f"#{sheet} button").click()
        assert tab.sheets(*size) == 1, (sheet, size)


@screens
def test_layout(tab, screen):
    width, height, phone = screen
    tab.screen(*screen).open("#law=2")
    for level in ("all", "simple"):
        assert tab.select("level", level).js("return document.body.scrollWidth") <= width
        ends = tab.each("figure svg", "x.getBoundingClientRect().bottom")
        assert phone or max(ends) <= height
        # Text of at least 11 px, as it is scaled.
        style = "getComputedStyle(x.querySelector('text'))"
        size = f"x.clientWidth / 360 * parseFloat({style}.fontSize)"
        assert min(one for one in tab.each("figure svg", size) if one) >= 10.95
        assert tab.each("#headline", "parseFloat(getComputedStyle(x).fontSize)")[0] >= 18
    # On a phone the results and a picture are beside each slider.
    for name in ("k", "b", "club_speed", "m_club", "m_ball") if phone else ():
        tab.js("document.getElementById(arguments[0]).scrollIntoView({block: 'center'})", name)
        top = "x.getBoundingClientRect().top"
        (line,), (picture,) = tab.each("#headline", top), tab.each("#force_figure", top)
        assert 0 <= line < picture < tab.each(f"#{name}_slider", top)[0] - 150, name


@pytest.fixture(scope="module")
def axe(tmp_path_factory):
    folder = tmp_path_factory.mktemp("axe")
    if shutil.which("npm") is None:
        pytest.skip(f"npm, which gets {AXE}, isn't installed here")
    command = ["npm", "pack", AXE, "--silent"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"npm can't get {AXE}: {done.stderr.strip()[-200:]}")
    (file,) = folder.glob("*.tgz")
    assert hashlib.sha512(file.read_bytes()).hexdigest() == SHA512
    with tarfile.open(file) as archive:
        return archive.extractfile("package/axe.min.js").read().decode()


@screens
@pytest.mark.parametrize("dark", [False, True])
def test_accessibility(tab, axe, screen, dark):
    tab.screen(*screen).dark(dark)
    for where in ("", "#law=1&exponent=1.5", "#law=2&level=simple"):
        tab.open(where).press("Pin").each("details", "x.open = true")
        tab.cdp("Runtime.evaluate", expression=axe)
        found = tab.browser.execute_async_script("axe.run().then(arguments[0])")
        assert [(one["id"], one["nodes"]) for one in found["violations"]] == []
        assert len(found["passes"]) > 20
