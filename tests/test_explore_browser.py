"""The page of `golf-impact explore` in a real browser, served on this machine and exported."""

import base64
import collections
import contextlib
import json
import re
import shutil
import time
from urllib.parse import urlsplit

import numpy as np
import pytest
from page import web_server
from selenium import webdriver
from selenium.common.exceptions import TimeoutException
from selenium.webdriver import ActionChains, Keys
from selenium.webdriver.support.ui import Select, WebDriverWait

from golf_impact.ball import BALLS
from golf_impact.explore.cases import CLUBS, EXAMPLES, OPENING
from golf_impact.measured import MPH

pytestmark = pytest.mark.plain

#: To the state of a page that was just opened with law 1.
RESTART = """
    pins = []
    past.length = 0
    requested = {...facts.defaults}
    for (const group of document.querySelectorAll("#controls details")) group.open = true
    get("undo").disabled = true
    get("unit").value = "m/s"
    setLevel("all")
    return changeUnit()"""


class Tab:
    """The page in a tab."""

    def __init__(self, browser):
        self.browser = browser
        browser.switch_to.new_window("tab")
        self.handle = browser.current_window_handle

    def open(self, address):
        self.browser.get(address)
        self.until(lambda: self.js("return document.body.dataset.ready") == "yes")
        return self

    def close(self):
        self.browser.switch_to.window(self.handle)
        self.browser.close()
        self.browser.switch_to.window(self.browser.window_handles[0])

    def js(self, code, *arguments):
        return self.browser.execute_script(code, *arguments)

    def cdp(self, command, **arguments):
        return self.browser.execute_cdp_cmd(command, arguments)

    def screen(self, width, height, phone=False):
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone}
        self.cdp("Emulation.setDeviceMetricsOverride", **size)

    def until(self, condition, seconds=90.0):
        return WebDriverWait(self.browser, seconds, 0.05).until(lambda _: condition())

    def get(self, place):
        """By id, or another CSS selector."""
        css = f"#{place}" if place.isidentifier() else place
        return self.browser.find_element("css selector", css)

    def value(self, id_):
        return self.get(id_).get_property("value")

    def text(self, id_):
        return self.get(id_).get_property("textContent").strip()

    def data(self, name):
        return self.js("return Object.fromEntries(Object.entries(model(arguments[0]).data))", name)

    def type(self, id_, text):
        self.get(id_).send_keys(Keys.CONTROL, "a")
        self.get(id_).send_keys(text, Keys.TAB)
        return self

    def slide(self, id_, *values):
        """As a mouse moves a slider, and leaves it."""
        moves = """
            const slider = get(arguments[0])
            const send = (type) => slider.dispatchEvent(new Event(type, {bubbles: true}))
            for (const value of arguments[1]) { slider.value = value; send("input") }
            send("change")"""
        self.js(moves, id_, values)
        return self

    def press(self, label):
        self.browser.find_element("xpath", f"//button[normalize-space()='{label}']").click()
        return self

    def select(self, id_, value):
        Select(self.get(id_)).select_by_value(value)
        return self

    def visible(self, css):
        """The ids of those that can be seen."""
        script = "return [...document.querySelectorAll(arguments[0])]"
        return self.js(f"{script}.filter((x) => x.checkVisibility()).map((x) => x.id)", css)

    def shows(self, **values):
        """Wait until the page shows the case with these values, as far as they aren't defaults."""
        start = self.js("return facts.defaults")
        wanted = {name: float(x) for name, x in values.items() if x != start[name]} or {"law": 1}
        level = {"all": "", "simple": "&level=simple"}[self.value("level")]

        def there():
            question = urlsplit(self.browser.current_url).query
            if not (question and question.endswith(level)):
                return False
            pairs = (pair.split("=") for pair in question.removesuffix(level).split("&"))
            return {name: float(text) for name, text in pairs} == wanted

        self.until(there)
        return self

    def readout(self, metric):
        return self.js(f"return document.querySelector('#{metric} td').innerText")


@pytest.fixture(scope="module", params=["local", "exported"])
def address(request):
    if request.param == "local":
        yield request.getfixturevalue("local")
        return
    with web_server(request.getfixturevalue("exported")) as served:
        yield served


@pytest.fixture(scope="module")
def browser():
    chromium, helper = shutil.which("chromium"), shutil.which("chromedriver")
    if not (chromium and helper):
        pytest.skip("chromium and chromedriver aren't installed here")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for argument in (
        *("headless=new", "no-sandbox", "disable-gpu", "window-size=1400,900"),
        *("disable-background-networking", "disable-dev-shm-usage"),
        # No other machine is found: requests to one fail.
        "host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    ):
        options.add_argument(f"--{argument}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    with webdriver.Chrome(options=options, service=webdriver.ChromeService(helper)) as chrome:
        yield chrome


@pytest.fixture(scope="module")
def opened(browser, address):
    with contextlib.closing(Tab(browser)) as one:
        yield one.open(f"{address}?law=1")


@pytest.fixture
def tab(opened):
    """The page of all tests that need no other one, with the case of law 1."""
    opened.browser.switch_to.window(opened.handle)
    opened.js(RESTART)
    return opened.shows()


@pytest.fixture
def new(browser):
    """A tab, in which nothing is opened yet."""
    with contextlib.closing(Tab(browser)) as one:
        yield one


@pytest.fixture(autouse=True)
def _no_error_and_no_request_outside(request):
    yield
    if not {"browser", "address"} <= set(request.fixturenames):
        return
    browser, address = (request.getfixturevalue(name) for name in ("browser", "address"))
    found = [one for one in browser.get_log("browser") if one["level"] in ("SEVERE", "WARNING")]
    for entry in browser.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            url = message["params"]["request"]["url"]
            found += [url] * (not url.startswith((address, "data:", "blob:", "chrome:")))
    assert found == []


def check_page(tab, evaluator, **values):
    """What the page holds is what the FMU gives for these values."""
    expected = evaluator({"values": values})
    held = tab.data("path")
    for name, column in expected["path"].items():
        scale = np.abs(column).max() or 1.0
        if name == "lost_energy":  # without damping it is rounding error
            scale = expected["metrics"]["kinetic_energy_initial"]
        assert np.abs(np.array(held[name]) - column).max() <= 1e-12 * scale, name
    hidden = set() if tab.value("level") == "all" else {"launch_angle", "backspin", "carry"}
    for row in expected["readouts"]:
        if row["metric"] not in hidden:
            assert tab.readout(row["metric"]).split("\n")[0] == row["value"]


def test_the_page_opens_with_a_ball_that_uses_every_slider(new, address, evaluator):
    # It does so, too, if the address is refused.
    for question, words in (("?b=20&k=-1", "k = -1.0 N/m is refused: it must be"), ("", "")):
        tab = new.open(f"{address}{question}")
        assert tab.text("k_refused").startswith(words)
        check_page(tab, evaluator, **BALLS[OPENING].values)
    tab.shows(**BALLS[OPENING].values)
    assert tab.js("return document.querySelectorAll('input[type=range]:disabled').length") == 0
    assert tab.value("ball") == OPENING
    tab.press("Document").shows()
    check_page(tab, evaluator)
    assert "document: 1.57" in tab.readout("smash_factor")
    # An exported page has a line on its check already.
    tab.press("Check")
    tab.until(lambda: "248 numbers agree with the FMUs' within" in tab.text("runtime"))
    assert "don't rely" not in tab.text("runtime")


def test_refusal_and_recovery(tab, evaluator):
    before = tab.data("path")
    tab.type("k", "-5")
    tab.until(lambda: tab.text("k_refused"))
    assert tab.text("k_refused") == "k = -5000.0 N/m is refused: it must be a finite number > 0"
    assert tab.text("announced") == tab.text("k_refused")
    assert tab.get("announced").get_attribute("role") == "alert"
    assert tab.data("path") == before
    tab.shows()
    tab.type("k", "900").shows(k=900_000.0)
    assert tab.text("k_refused") == tab.text("announced") == ""
    check_page(tab, evaluator, k=900_000.0)
    # What another control mends; a control that is folded away is opened.
    tab.type("exponent", "1.6")
    tab.until(lambda: tab.text("exponent_refused"))
    tab.js("for (const one of document.querySelectorAll('#controls details')) one.open = false")
    tab.js("requestImpact({exponent: 1.7})")
    tab.until(lambda: tab.get("exponent_refused").is_displayed())
    tab.get("input[name=law][value='2']").click()
    tab.shows(k=900_000.0, law=2, exponent=1.7)
    assert tab.text("exponent_refused") == ""
    # What no control has.
    tab.js("requestImpact({nothing: 1})")
    tab.until(lambda: "There is no input or parameter nothing" in tab.text("hint"))


def test_values_with_units(tab, evaluator):
    """As on the command line, whatever unit a field has; arrow keys step it."""
    tab.type("club_speed", "95mph").shows(club_speed=42.4688)
    assert (tab.value("club_speed"), tab.value("club_speed_slider")) == ("42.4688", "42.5")
    tab.type("k", "770 N/mm").type("ball_diameter", "42.9mm")
    values = {"club_speed": 42.4688, "k": 7.7e5, "ball_diameter": 0.0429}
    tab.shows(**values)
    check_page(tab, evaluator, **values)
    # A text that is no value leaves all others.
    tab.type("k", "770lb")
    words = "k=770lb is refused: 'lb' isn't a unit it may have: N/m, kN/m, N/mm"
    tab.until(lambda: tab.text("k_refused") == tab.text("announced") == words)
    assert tab.value("k") == "770lb"
    tab.type("b", "12").shows(**values, b=12)
    assert (tab.value("k"), tab.text("k_refused")) == ("770", "")
    tab.get("k").send_keys(Keys.ARROW_UP * 2, Keys.ARROW_DOWN)
    tab.shows(**{**values, "b": 12, "k": 7.8e5})
    assert tab.get("k").get_attribute("aria-valuenow") == "780"
    # What is being typed stays when results arrive.
    tab.get("b").send_keys("5")
    tab.slide("m_ball_slider", 50).shows(**{**values, "b": 12, "k": 7.8e5, "m_ball": 0.05})
    assert tab.value("b") == "125"
    # Beyond the slider, and perhaps not meant.
    tab.type("club_speed", "95")
    tab.until(lambda: "42.4688 for 95 mph" in tab.text("club_speed_idle"))
    assert tab.value("club_speed_slider") == "80"


def test_units_of_speeds(tab, evaluator):
    tab.press("Pin").select("unit", "mph")
    tab.until(lambda: "122.46 mph" in tab.text("pins"))
    assert tab.readout("ball_velocity").split("\n") == ["122.46 mph", "document: 122.67 mph"]
    assert float(tab.value("club_speed")) == pytest.approx(35.0 / MPH, abs=1e-6)
    assert tab.data("path")["club_shown"][0] == pytest.approx(35.0 / MPH, rel=1e-12)
    assert tab.data("pinned")["ball_shown"][0] == tab.data("path")["ball_shown"]
    tab.type("club_speed", "100").shows(club_speed=44.704)
    tab.select("unit", "m/s")
    tab.until(lambda: tab.readout("ball_velocity").split("\n")[0].endswith(" m/s"))
    check_page(tab, evaluator, club_speed=44.704)


def test_examples_balls_and_clubs_are_one_click(tab, evaluator):
    for example in EXAMPLES:
        tab.press(example.name).shows(**example.values)
        tab.until(lambda example=example: tab.text("hint") == example.hint)
        check_page(tab, evaluator, **example.values)
        assert example.printed.get("max_force", "") in tab.readout("max_force")
    assert [one["name"] for one in tab.js("return pins")] == ["Law 1"]
    tab.type("m_club", "200").select("ball", "penner").shows(**BALLS["penner"].values, m_club=0.2)
    assert "Penner" in tab.text("source")
    tab.type("k", "500").shows(**{**BALLS["penner"].values, "m_club": 0.2, "k": 5e5})
    assert tab.value("ball") == ""
    # Club and ball are two choices.
    tab.select("club", "driver")
    tab.until(lambda: tab.value("club") == "driver")
    tab.select("ball", "tour").shows(**BALLS["tour"].values, **CLUBS[0].values)
    assert (tab.value("club"), tab.value("ball")) == ("driver", "tour")
    assert "TrackMan: 10.9°" in tab.readout("launch_angle")
    assert "ball tour instead of penner" in tab.text("hint")
    tab.type("m_club", "210")
    tab.until(lambda: (tab.value("club"), tab.value("ball")) == ("", "tour"))
    assert "TrackMan" not in tab.readout("launch_angle")


def test_pins(tab, evaluator):
    stiffness = [1e6, *(1e3 * (500 + n) for n in range(7))]
    for n, k in enumerate(stiffness):
        tab.type("k", f"{k / 1e3:g}").shows(k=k)
        tab.press("Pin")
        tab.until(lambda n=n: len(tab.js("return pins")) == n + 1)
    pins = tab.js("return pins")
    assert len({one["color"] for one in pins}) == 8
    assert [pins[0]["name"], pins[1]["name"]] == ["document", "k = 500000"]
    expected = evaluator({"values": {"k": stiffness[2]}})
    assert pins[2]["path"]["force"] == pytest.approx(expected["path"]["force"], rel=1e-12)
    # Eight at most.
    assert not tab.get("pin").is_enabled()
    tab.type("[aria-label='Name of pin 2']", "second")
    tab.until(lambda: tab.js("return pins")[1]["name"] == "second")
    tab.get("[aria-label='Reopen pin 2']").click()
    tab.shows(k=5e5)
    tab.get("[aria-label='Remove pin 2']").click()
    tab.until(lambda: len(tab.js("return pins")) == 7)
    assert len(tab.data("pinned")["force"]) == 7


def test_the_command_of_a_case(tab):
    tab.type("k", "812.5").shows(k=812_500.0)
    tab.js("document.oncopy = () => { window.copied = String(getSelection()) }")
    tab.press("Copy command")
    line = tab.until(lambda: tab.js("return window.copied"))
    assert line == tab.value("command") == "golf-impact run --set k=812500"
    # It has no place for a loft.
    tab.type("dynamic_loft", "0.2 rad").shows(k=812_500.0, dynamic_loft=0.2)
    tab.until(lambda: tab.value("command") == tab.browser.current_url)
    assert "golf-impact run has no loft, attack angle and friction" in tab.text("same")
    assert tab.text("copy") == "Copy link"


def test_downloads(tab, tmp_path):
    tab.cdp("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))

    def got(choice):
        file = tmp_path / f"golf-impact-{choice}"
        tab.select("download", choice)
        tab.until(lambda: file.exists() and file.stat().st_size)
        assert tab.value("download") == ""
        return file.read_bytes()

    tab.press("Pin")
    header, *rows = [line.split(",") for line in got("path.csv").decode().splitlines()]
    held = tab.data("path")
    for name, column in zip(header, zip(*rows), strict=True):
        assert name.endswith(")")
        assert list(map(float, column)) == held[name.split()[0]]
    header, row = got("pins.csv").decode().splitlines()
    assert header.startswith("name,query,club_velocity (m/s),ball_velocity (m/s),touch_time (s)")
    assert row.startswith('"document","law=1",21.52')
    for figure in ("force", "sweep"):
        # Chromium takes ten files from a page without a prompt.
        assert got(f"{figure}.png").startswith(b"\x89PNG")
        # Drawn, not a picture of pixels.
        assert re.match(r"<svg.*<path", got(f"{figure}.svg").decode(), re.DOTALL)


def test_the_cursor_plays_and_follows_the_pointer(tab):
    def places(number, seconds):
        """Where it is while it plays, until these are so many."""
        seen = set()
        with contextlib.suppress(TimeoutException):
            tab.until(lambda: seen.add(tab.value("scrub")) or len(seen) > number, seconds)
        return seen

    tab.get("play").click()
    assert len(places(9, 90.0)) == 10
    # Stills of half a second each, and the place where it began.
    media = [{"name": "prefers-reduced-motion", "value": "reduce"}]
    tab.cdp("Emulation.setEmulatedMedia", features=media)
    assert 1 < len(places(9, 1.5)) <= 6
    tab.cdp("Emulation.setEmulatedMedia", features=[])
    tab.get("play").click()
    time.sleep(0.2)
    assert len(places(1, 0.5)) == 1
    # The cursor is the sample at that time.
    tab.js('get("scrub").value = 0.44; get("scrub").dispatchEvent(new Event("input"))')
    cursor, path = tab.data("cursor"), tab.data("path")
    n = path["time"].index(cursor["time"][0])
    assert {k: [column[n]] for k, column in path.items()} == cursor
    assert f"{cursor['force'][0]:.0f} N" in tab.text("cursor")
    for figure in ("force", "loop"):
        old = tab.data("cursor")["time"]
        picture = tab.get(f"picture_{figure}")
        ActionChains(tab.browser).move_to_element_with_offset(picture, 40, -10).perform()
        tab.until(lambda old=old: tab.data("cursor")["time"] != old)


def test_keyboard_and_names(tab):
    """Tab reaches every control, and leaves; all have names for screen readers."""
    tab.press("Pin")
    # From the top of the page.
    tab.js('const top = document.querySelector("h1"); top.tabIndex = -1; top.focus()')
    active = """
        const one = document.activeElement
        window.passed ??= new Set()
        return one == document.body || !passed.add(one)"""
    tab.until(lambda: ActionChains(tab.browser).send_keys(Keys.TAB).perform() or tab.js(active))
    # Controls that it didn't reach, and what it reached without a name.
    missed = """
        const controls = [...document.querySelectorAll("button, select, input")].filter((one) =>
          !one.disabled && one.checkVisibility() && (one.type != "radio" || one.checked))
        const nameless = (one) => !one.matches("[aria-label], button, select, input, a, summary")
        return [...controls.filter((one) => !passed.has(one)), ...[...passed].filter(nameless)]
          .map((one) => one.outerHTML)"""
    assert tab.js(missed) == []
    named = collections.defaultdict(list)
    for node in tab.cdp("Accessibility.getFullAXTree")["nodes"]:
        role, name = (node.get(key, {}).get("value", "") for key in ("role", "name"))
        named[role].append(name)
    assert "Stiffness k, slider" in named["slider"]
    assert "Stiffness k (N/mm)" in named["spinbutton"]
    assert {"Ball", "Download", "Unit of speeds", "S and COR over"} <= set(named["combobox"])
    for role in ("slider", "spinbutton", "combobox", "button", "radio", "textbox"):
        assert all(named[role]), named[role]


def test_controls_without_effect_are_disabled(tab):
    tab.select("over", "b").select("ball", "penner")
    tab.until(lambda: not tab.get("b").is_enabled())
    assert not tab.get("b_slider").is_enabled()
    assert "the COR line determines the damping" in tab.text("b_idle")
    assert tab.get("restitution_slope").is_enabled()
    assert tab.value("over") == "club_speed"
    assert tab.js("return get('over').querySelector('[value=b]').disabled")
    assert "COR = 0.86 − 0.0029 s/m · 35 m/s" in tab.text("equations")
    tab.select("ball", "roh-lee-linear")
    tab.until(lambda: tab.get("b").is_enabled())
    assert tab.text("b_idle") == ""
    for name in ("restitution_slope", "reference_compression"):
        assert not tab.get(name).is_enabled()
        assert "no effect while" in tab.text(f"{name}_idle")


def test_levels(new, address, evaluator):
    # Its law is 2, also where the address doesn't say so.
    tab = new.open(f"{address}?level=simple&club_speed=95mph")
    tab.shows(law=2, club_speed=42.4688)
    check_page(tab, evaluator, law=2, club_speed=42.4688)
    fields = ["k", "b", "club_speed", "m_club", "m_ball"]
    assert tab.visible("#controls input[type=text]") == fields
    pictures = [f"picture_{name}" for name in ("force", "energies", "momenta", "velocities")]
    assert tab.visible(".picture") == pictures
    assert ("max_force" in tab.visible("tr"), "carry" in tab.visible("tr")) == (True, False)
    tab.select("level", "all")
    tab.until(lambda: len(tab.visible(".picture")) == 8)
    tab.until(lambda: "m" in tab.readout("carry"))
    # What the simple level hasn't is left: the ball is law 2's, and undo brings the other back.
    values = {**BALLS["penner"].values, "club_speed": 42.4688}
    tab.select("ball", "penner").shows(**values)
    tab.select("level", "simple").shows(law=2)
    tab.press("Undo").shows(**values)
    assert not tab.get("b").is_enabled()
    tab.press("Reset").shows(law=2)
    # Tasks begin with a pinned case; another one with the same case has no second pin.
    tab.js("get('tasks').open = true")
    links = tab.browser.find_elements("css selector", "#tasks div > a")
    assert [link.text for link in links] == [one["name"] for one in evaluator.facts["tasks"]]
    links[0].click()
    tab.until(lambda: len(tab.js("return pins")) == 1)
    tab.type("k", "500").shows(law=2, k=5e5)
    check_page(tab, evaluator, law=2, k=5e5)
    assert tab.js("return pins")[0]["name"] == "Stiffness"
    links[1].click()
    tab.shows(law=2)
    assert len(tab.js("return pins")) == 1
    assert links[0].get_attribute("href").split("?")[1] == "law=2&level=simple"


#: Both canvases of each figure but the animation's; how many of their pixels are painted.
INK = """
    const layers = ({primary, overlays}) => [primary.canvas, overlays.canvas]
    const canvases = () => figures().filter(({name}) => name != "animation")
      .flatMap((one) => layers(viewOf(one).canvas_view))
    const ink = (canvas) => {
      const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d")
      copy.drawImage(canvas, 0, 0)
      const {data} = copy.getImageData(0, 0, canvas.width, canvas.height)
      return data.filter((value, n) => n % 4 == 3 && value).length
    }"""

#: How many of them would change if all were painted anew, after a slider's event.
STALE = f"""
    {INK}
    const images = () => canvases().map((one) => one.toDataURL())
    const compare = async () => {{
      get("b_slider").value = 40
      get("b_slider").dispatchEvent(new Event("input", {{bubbles: true}}))
      await running
      while (frame) await new Promise(requestAnimationFrame)
      const painted = images()
      for (const one of figures()) {{ viewOf(one).request_repaint(); viewOf(one).paint() }}
      return images().filter((image, n) => painted[n] != image).length
    }}
    return compare()"""


def test_a_slider(tab, evaluator):
    """Of a burst of its events the newest is shown; few of the others are computed."""
    tab.js('window.seen = 0; model("path").properties.data.change.connect(() => { seen += 1 })')
    tab.slide("k_slider", *range(1200, 2200, 10)).shows(k=2_190_000.0)
    check_page(tab, evaluator, k=2_190_000.0)
    assert tab.js("return seen") <= 3
    assert tab.js(STALE) == 0
    # By keys; S and COR over the club speed follow.
    tab.select("ball", "penner").shows(**BALLS["penner"].values)
    tab.get("club_speed_slider").send_keys(Keys.ARROW_RIGHT * 3)
    wanted = {**BALLS["penner"].values, "club_speed": 36.5}
    tab.shows(**wanted)
    check_page(tab, evaluator, **wanted)
    assert tab.value("club_speed") == "36.5"
    smash = evaluator({"values": wanted, "over": "club_speed"})["swept"]["smash_factor"]
    tab.until(lambda: tab.data("swept")["smash_factor"] == pytest.approx(smash, rel=1e-12))


def test_undo_and_reset(tab):
    assert not tab.get("undo").is_enabled()
    tab.slide("b_slider", 10, 15, 20).shows(b=20)
    tab.slide("b_slider", 25, 30).shows(b=30)
    tab.type("k", "900").shows(b=30, k=9e5)
    # A refused value is no step.
    tab.type("k", "-5")
    tab.until(lambda: tab.text("k_refused"))
    tab.press("Undo").shows(b=30)
    assert tab.text("k_refused") == ""
    # A slider's way is one step.
    tab.press("Undo").shows(b=20)
    tab.press("Undo").shows()
    assert not tab.get("undo").is_enabled()
    tab.press("Reset").shows(**BALLS[OPENING].values)
    tab.press("Undo").shows()


#: What is wrong with the layout: parts beyond the screen, or on each other; small figures.
BAD = """
    const box = (one) => one.getBoundingClientRect(), controls = get("controls")
    const visible = (css) => [...document.querySelectorAll(css)].filter((x) => x.checkVisibility())
    // What has scrolled out of the controls isn't seen.
    const parts = visible("button, select, input, .picture, #cursor, #readouts tr, label")
      .filter((one) => !one.closest(".scroll") && one.type != "radio"
        && !(controls.contains(one) && box(one).bottom > box(controls).bottom))
    const shared = (a, b, start, end) => Math.min(a[end], b[end]) - Math.max(a[start], b[start])
    const overlap = (one, other) => !one.contains(other) && !other.contains(one)
      && shared(box(one), box(other), "left", "right") > 1
      && shared(box(one), box(other), "top", "bottom") > 1
    const wrong = parts.filter((one) => box(one).left < 0 || box(one).right > innerWidth + 0.5
      || parts.some((other) => overlap(one, other)))
    const small = visible(".picture, #animation").filter((one) =>
      box(one).width < 150 || box(one).height < (one.id == "animation" ? 45 : 150))
    const wide = document.documentElement.scrollWidth > innerWidth ? [document.body] : []
    return [...wrong, ...small, ...wide].map((one) => one.outerHTML)"""


def test_layout(new, address):
    """On screens; and all pictures are painted, for a screenshot of the full page and on paper."""
    new.screen(800, 500)
    tab = new.open(f"{address}?law=2")
    for width, height in ((800, 500), (900, 500), (1400, 850)):
        new.screen(width, height)
        tab.until(lambda: min(tab.js(f"{INK}; return canvases().map(ink)")) > 300)
        tab.until(lambda: tab.js(BAD) == [])
    tab.type("k", "500").shows(law=2, k=5e5)
    look = """
        const copies = document.querySelectorAll(".copy").length, root = document.documentElement
        return [root.dataset.theme, getComputedStyle(document.body).backgroundColor, copies]"""
    dark = tab.js(f"setDark(true); {look}")
    theme, colour, copies = tab.js(f"dispatchEvent(new Event('beforeprint')); {look}")
    assert (theme, copies) == ("light", 9)
    assert colour != dark[1]
    assert min(tab.js(f"{INK}; return [...document.querySelectorAll('.copy')].map(ink)")) > 500
    assert tab.js(f"dispatchEvent(new Event('afterprint')); {look}") == dark
    tab.press("Light")
    assert tab.js(look) == ["light", colour, 0]


def test_on_a_phone(new, address):
    new.screen(390, 844, phone=True)
    new.cdp("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=1)
    tab = new.open(f"{address}?law=2")
    seen = """
        const [line, picture, slider] = ["#summary", ".picture.chosen", arguments[0]]
          .map((css) => document.querySelector(css).getBoundingClientRect())
        return line.top >= 0 && line.bottom <= picture.top + 1 && picture.bottom <= slider.top
          && picture.height > 150 && slider.bottom <= innerHeight"""
    for level in ("all", "simple"):
        tab.select("level", level).shows(law=2)
        assert tab.js(BAD) == []
        # The result is beside the slider.
        for name in ("k", "b", "club_speed", "m_club", "m_ball"):
            tab.js("get(arguments[0]).scrollIntoView({block: 'center'})", f"{name}_slider")
            assert tab.js(seen, f"#{name}_slider"), name
        assert tab.text("summary").startswith("S 1.5842  COR 0.9307  55.45 m/s")
        assert tab.js("return document.documentElement.scrollHeight") < 2600
    # A swipe over a picture scrolls; a tap moves the cursor.
    tab.js('get("picture_force").scrollIntoView({block: "center"})')
    middle = """
        const {x, y, width, height} = get("picture_force").getBoundingClientRect()
        return [scrollY, x + width / 2, y + height / 2]"""
    top, x, y = tab.js(middle)
    tab.cdp("Input.synthesizeScrollGesture", x=x, y=y, yDistance=-200)
    assert tab.js("return scrollY") > top + 100
    _, x, y = tab.js(middle)
    before = tab.data("cursor")["time"]
    tab.cdp("Input.synthesizeTapGesture", x=x + 60, y=y)
    tab.until(lambda: tab.data("cursor")["time"] != before)
    tab.select("picture", "momenta")
    assert tab.get("picture_momenta").is_displayed()
    assert not tab.get("picture_force").is_displayed()


def test_the_worksheet_is_one_page(new, address):
    new.browser.get(f"{address}worksheet.html")
    for width, height in ((8.27, 11.69), (8.5, 11.0)):
        printed = new.cdp("Page.printToPDF", paperWidth=width, paperHeight=height)
        assert len(re.findall(rb"/Type /Page\b", base64.b64decode(printed["data"]))) == 1
    links = [one.get_attribute("href") for one in new.browser.find_elements("css selector", "h2 a")]
    assert links == [f"{address}index.html?law=2&level=simple"] * 3
    new.open(links[0]).shows(law=2)


@pytest.mark.parametrize("address", ["exported"], indirect=True)
def test_controls_wait_for_python(new, address):
    """A runtime that is late is reported: the page's minute lasts a tenth of a second here."""
    source = "const wait = setTimeout; setTimeout = (f, ms) => wait(f, ms == 60000 ? 100 : ms)"
    new.cdp("Page.addScriptToEvaluateOnNewDocument", source=source)
    new.cdp("Emulation.setCPUThrottlingRate", rate=4)
    new.browser.get(f"{address}?law=2&b=20")
    state = """
        return document.body?.dataset.ready ? null
          : [[...document.querySelectorAll("header button, header select, #controls input")]
            .filter((one) => one.matches(":enabled")).length,
            document.getElementById("runtime")?.textContent.includes("has not started")]"""
    states = []
    while (now := new.js(state)) is not None:
        states.append(tuple(now))
    # Loading takes seconds: it was looked at.
    assert len(states) > 3
    assert {enabled for enabled, _ in states} == {0}
    assert any(late for _, late in states)
    new.cdp("Emulation.setCPUThrottlingRate", rate=1)
    new.shows(law=2, b=20)
    assert "numbers agree" in new.text("runtime")


@pytest.mark.parametrize(
    "missing", ["pyodide/pyodide.asm.wasm", "pyodide/pyodide.mjs", "physics.zip"]
)
def test_a_missing_runtime_is_reported(new, exported, tmp_path, missing):
    shutil.copytree(exported, tmp_path / "page")
    (tmp_path / "page" / missing).unlink()
    with web_server(tmp_path / "page") as served:
        new.browser.get(served)
        new.until(lambda: "don't work" in new.text("runtime"))
        assert new.js("return document.body.dataset.ready") is None
        # Pictures are there all the same.
        assert new.js("return model('path').data.force.length") > 100
    new.browser.get_log("browser"), new.browser.get_log("performance")
