"""The page of `golf-impact explore` in Chromium, opened as a file, without a network."""

import hashlib
import itertools
import json
import re
import shlex
import shutil
import subprocess
import tarfile
from urllib.parse import parse_qsl

import pytest
from command import ROOT
from selenium.webdriver import ActionChains, Keys
from tab import Tab, chrome

import golf_impact
from golf_impact.explore.page import write_page

AXE, SHA512 = "axe-core@4.14.1", (
    "1477dafa598d8d065f273d6af302aa203c02e83131707b7fa648cd41bd3d6b73"
    "4f8c22a0dab86ee6a6f64b8afbe804b214d36db85a2826965edfb3a0b9d546b5"
)  # fmt: skip

SNAPSHOT = ROOT / "tests" / "snapshots" / "page.txt"
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


def agrees(tab):
    """The numbers are those of the physics for the case of the address."""
    given = dict(parse_qsl(tab.value("address").partition("#")[2]))
    values = {name: float(text) for name, text in given.items() if name not in ("level", "unit")}
    expected = golf_impact.run_impact(**values)
    for name, value in tab.each("data", "[x.id, x.value]"):
        if value and name in expected:
            assert float(value) == pytest.approx(expected[name], rel=1e-12, abs=1e-12), name


def test_what_it_shows(tab, pytestconfig):
    """After steps, what differs from what stands above: read the diff of what --update writes."""
    head, *lines = re.split(r"^> ", SNAPSHOT.read_text("utf-8"), flags=re.MULTILINE)
    written, known = [head.strip("\n")], {}
    tab.media(prefers_reduced_motion="reduce")
    for line in (line.partition("\n")[0] for line in lines):
        steps, _, parts = line.partition(" -> ")
        for step in steps.split("; "):
            verb, *arguments = shlex.split(step)
            getattr(tab, verb)(*arguments)
        agrees(tab)
        shown = {
            name: text
            for (part, name), text in tab.shown().items()
            if not parts or {part, name} & {*parts.split()}
        }
        written += [f"> {line}", *(f"{n}: {t}" for n, t in shown.items() if known.get(n, "") != t)]
        known |= shown
    found = "\n".join([*written, ""])
    if pytestconfig.getoption("--update"):
        SNAPSHOT.write_text(found, "utf-8")
    assert found == SNAPSHOT.read_text("utf-8"), "pytest -m browser --update tests/page"


def test_the_case_of_its_file(tab, tmp_path):
    """At All if Simple can't show it; the address overrides it, and `#` overrides `?`."""
    tab.file = write_page(tmp_path / "law 1.html", {"k": 9e5})
    assert tab.open().value("address").endswith("#k=900000")
    tab.file = write_page(tmp_path / "mine.html", {"law": 2, "b": 20.0})
    assert tab.open().value("address").endswith("#b=20&law=2&level=simple")
    assert tab.open("?k=2e6#law=2&k=5e5").value("address").endswith("#k=500000&law=2")


def test_keys_and_the_address(tab):
    def case():
        return tab.value("address").partition("#")[2]

    # To the first control.
    tab.open("#law=2")
    ActionChains(tab.browser).send_keys(Keys.TAB, Keys.ENTER, Keys.TAB, Keys.ARROW_UP).perform()
    assert case() == "k=1010000&law=2"
    # What is being typed stays.
    tab.open("#law=2").get("club_speed").send_keys(Keys.END, ".50")
    assert tab.slide("k", 900).value("club_speed") == "35.50"
    # A slider's way is one step.
    tab.open("#law=2").slide("b", 10, 15, 20).slide("k", 900)
    tab.until(lambda: tab.js("return location.hash") == "#k=900000&b=20&law=2")
    ActionChains(tab.browser).key_down(Keys.CONTROL).send_keys("z").key_up(Keys.CONTROL).perform()
    assert case() == "b=20&law=2"
    assert (tab.press("Undo").get("undo").is_enabled(), case()) == (False, "law=2")


def test_the_ball_moves_once(tab):
    opened = tab.open("#law=2").value("scrub")
    at = [tab.open().value("scrub")]
    tab.until(lambda: at.append(tab.value("scrub")) or tab.text("play") == "▶ Play")
    moved = [float(value) for value in at if value != opened]
    assert (tab.value("scrub"), moved, len(moved) > 9) == (opened, sorted(moved), True)
    # What the user does ends it.
    tab.open().type("b", "20")
    assert tab.get("play").get_attribute("aria-pressed") == "false"
    tab.media(prefers_reduced_motion="reduce").open()
    assert tab.get("play").get_attribute("aria-pressed") == "false"


def test_play_and_a_mouse(tab):
    tab.open("#law=2")
    for name in ("force", "loop"):
        before, picture = tab.text("cursor"), tab.get(f"{name}_figure")
        ActionChains(tab.browser).move_to_element_with_offset(picture, 40, -10).perform()
        tab.until(lambda before=before: tab.text("cursor") != before)
    tab.press("▶ Play")
    dots, seen = "#force_figure circle", set()
    tab.until(lambda: seen.update(tab.each(dots, "x.getAttribute('cx')")) or len(seen) > 5)
    stopped = tab.press("⏸ Pause").value("scrub")
    assert stopped == tab.value("scrub")
    # A mouse has no effect as long as it plays (here without another frame).
    frozen = tab.press("▶ Play").js("window.requestAnimationFrame = () => 0") or tab.value("scrub")
    assert tab.point("force", 340, 100).value("scrub") == frozen


def test_tasks_and_sheets(tab):
    assert tab.open().click("#tasks a").js("return scrollY") == 0
    tab.open("#level=all").press("Roh & Lee").js("window.print = () => 0")
    assert {*tab.each("#worksheet td", "x.textContent")} == {""}
    for sheet, size in itertools.product(("", "worksheet", "key"), ((8.27, 11.69), (8.5, 11.0))):
        if sheet:
            tab.js("document.querySelector(`#${arguments[0]} details`).open = true", sheet)
            tab.click(f"#{sheet} button")
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
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_accessibility(tab, axe, screen, scheme):
    tab.screen(*screen).media(prefers_color_scheme=scheme)
    for where in ("", "#law=1&exponent=1.5", "#law=2&level=simple"):
        tab.open(where).press("Pin").each("details", "x.open = true")
        tab.cdp("Runtime.evaluate", expression=axe)
        found = tab.browser.execute_async_script("axe.run().then(arguments[0])")
        assert [(one["id"], one["nodes"]) for one in found["violations"]] == []
        assert len(found["passes"]) > 20
