"""The page of `golf-impact explore` in a real browser, served on this machine and exported."""

import base64
import functools
import http.server
import json
import re
import shutil
import subprocess
import threading
import time
from urllib.parse import urlsplit

import numpy as np
import pytest
from command import COMMAND
from page import query

from golf_impact.explore.cases import CLUBS, EXAMPLES, OPENING, QUANTITIES
from golf_impact.facts.balls import BALLS

pytestmark = pytest.mark.plain


class Tab:
    """The page in a tab."""

    def __init__(self, browser, address, new=True, ready="yes"):
        self.browser = browser
        if new:
            browser.switch_to.new_window("tab")
        self.handle = browser.current_window_handle
        browser.get(address)
        self.until(lambda: self.js("return document.body.dataset.ready") == ready)

    def js(self, code, *arguments):
        return self.browser.execute_script(code, *arguments)

    def until(self, condition, seconds=90.0):
        end = time.monotonic() + seconds
        while not (found := condition()):
            assert time.monotonic() < end, "it didn't come about in time"
            time.sleep(0.05)
        return found

    def close(self):
        self.browser.switch_to.window(self.handle)
        self.browser.close()
        self.browser.switch_to.window(self.browser.window_handles[0])

    def get(self, id_):
        return self.browser.find_element("id", id_)

    def value(self, id_):
        return self.get(id_).get_property("value")

    def text(self, id_):
        return self.get(id_).get_property("textContent").strip()

    def data(self, name):
        return self.js("return Object.fromEntries(Object.entries(model(arguments[0]).data))", name)

    def pins(self):
        return self.js("return pins")

    def type(self, id_, text):
        from selenium.webdriver.common.keys import Keys

        self.get(id_).send_keys(Keys.CONTROL, "a")
        self.get(id_).send_keys(text, Keys.TAB)

    def press(self, label):
        self.browser.find_element("xpath", f"//button[normalize-space()='{label}']").click()

    def select(self, id_, value):
        from selenium.webdriver.support.ui import Select

        Select(self.get(id_)).select_by_value(value)

    def shows(self, **values):
        """Wait until the page shows the case with these values that aren't start values."""
        wanted = {name: float(value) for name, value in (values or {"law": 1}).items()}
        level = {"all": "", "simple": "&level=simple"}[self.value("level")]

        def there():
            question = urlsplit(self.browser.current_url).query
            if not (question and question.endswith(level)):
                return False
            question = question.removesuffix(level)
            pairs = (pair.split("=") for pair in question.split("&"))
            return {name: float(text) for name, text in pairs} == wanted

        self.until(there)
        return self

    def readout(self, metric):
        css = f"#{metric} td"
        return self.js("return document.querySelector(arguments[0]).innerText", css)


@pytest.fixture(scope="module", params=["local", "exported"])
def address(request):
    if request.param == "local":
        yield request.getfixturevalue("local")
        return
    folder = request.getfixturevalue("exported")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *args):
            pass

    # In a sub-path of the server.
    handler = functools.partial(Quiet, directory=folder.parent)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/{folder.name}/"
        server.shutdown()


@pytest.fixture(scope="module")
def browser():
    chromium, helper = shutil.which("chromium"), shutil.which("chromedriver")
    if not (chromium and helper):
        pytest.skip("chromium and chromedriver aren't installed here")
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for argument in (
        *("--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1400,900"),
        *("--disable-background-networking", "--disable-dev-shm-usage"),
        # No other machine is found: requests to one fail.
        "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    ):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    service = webdriver.ChromeService(helper)
    chrome = webdriver.Chrome(options=options, service=service)
    try:
        yield chrome
    finally:
        chrome.quit()
        service.stop()


@pytest.fixture
def tab(browser, address):
    one = Tab(browser, f"{address}?law=1")
    yield one
    one.close()


@pytest.fixture(autouse=True)
def _no_error_and_no_request_outside(request):
    yield
    if not {"browser", "address"} <= set(request.fixturenames):
        return
    browser, address = (request.getfixturevalue(name) for name in ("browser", "address"))
    entries = browser.get_log("browser")
    assert [one for one in entries if one["level"] in ("SEVERE", "WARNING")] == []
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    requests = [one["params"] for one in messages if one["method"] == "Network.requestWillBeSent"]
    own = (address, "data:", "blob:", "chrome:")
    assert [
        one["request"]["url"] for one in requests if not one["request"]["url"].startswith(own)
    ] == []


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
        if row["metric"] in hidden:
            continue
        assert tab.readout(row["metric"]).split("\n")[0] == row["value"]


def test_the_page_opens_with_a_ball_that_uses_every_slider(browser, address, evaluator):
    tab = Tab(browser, address)
    assert tab.js("return document.querySelectorAll('input[type=range]:disabled').length") == 0
    tab.shows(**{n: v for n, v in BALLS[OPENING].values.items() if v != evaluator.defaults[n]})
    check_page(tab, evaluator, **BALLS[OPENING].values)
    assert tab.value("ball") == OPENING
    tab.press("Document")
    tab.shows()
    check_page(tab, evaluator)
    assert "document: 1.57" in tab.readout("smash_factor")
    assert browser.title == "Golf impact"
    # An exported page has a line on its check already.
    tab.press("Check")
    tab.until(lambda: "248 numbers agree with the FMUs' within" in tab.text("runtime"))
    assert "don't rely" not in tab.text("runtime")
    tab.close()


@pytest.mark.parametrize("values", [{"law": 2.0}, dict(BALLS["roh-lee"].values)])
def test_a_slider_moved_by_keys(browser, address, evaluator, values):
    from selenium.webdriver.common.keys import Keys

    tab = Tab(browser, f"{address}?{query(values)}")
    tab.get("club_speed_slider").send_keys(Keys.ARROW_RIGHT * 3)
    wanted = {**values, "club_speed": 36.5}
    tab.shows(**{n: v for n, v in wanted.items() if v != evaluator.defaults[n]})
    check_page(tab, evaluator, **wanted)
    assert tab.value("club_speed") == "36.5"
    # S and COR over the club speed follow.
    swept = evaluator({"values": wanted, "over": "club_speed"})["swept"]
    tab.until(
        lambda: tab.data("swept")["smash_factor"] == pytest.approx(swept["smash_factor"], rel=1e-12)
    )
    tab.close()


def test_requests_are_never_queued(tab, evaluator):
    """Of a burst of a slider's events the newest is shown; few of the others are computed."""
    tab.js("""
        window.seen = 0
        model("path").properties.data.change.connect(() => { window.seen += 1 })
        const slider = get("k_slider")
        for (let n = 0; n < 100; n++) {
          slider.value = 1200 + 10 * n
          slider.dispatchEvent(new Event("input", {bubbles: true}))
        }
    """)
    tab.shows(k=2_190_000.0)
    check_page(tab, evaluator, k=2_190_000.0)
    assert tab.js("return window.seen") <= 3


def test_refusal_and_recovery(tab, evaluator):
    before = tab.data("path")
    tab.type("k", "-5")
    tab.until(lambda: tab.text("k_refused"))
    assert tab.text("k_refused") == "k = -5000.0 N/m is refused: it must be a finite number > 0"
    assert tab.data("path") == before
    tab.shows()
    tab.type("k", "900")
    tab.shows(k=900_000.0)
    assert tab.text("k_refused") == ""
    check_page(tab, evaluator, k=900_000.0)
    # What another control mends.
    tab.type("exponent", "1.6")
    tab.until(lambda: tab.text("exponent_refused"))
    tab.browser.find_element("css selector", "input[name=law][value='2']").click()
    tab.shows(k=900_000.0, law=2, exponent=1.6)
    assert tab.text("exponent_refused") == ""
    # Beyond the slider.
    tab.type("club_speed", "120")
    tab.shows(k=900_000.0, law=2, exponent=1.6, club_speed=120)
    assert tab.value("club_speed_slider") == "80"


def test_units_of_everything(tab, evaluator):
    tab.press("Pin")
    tab.select("unit", "mph")
    tab.until(lambda: tab.readout("ball_velocity").startswith("122.46 mph"))
    assert "document: 122.67 mph" in tab.readout("ball_velocity")
    assert float(tab.value("club_speed")) == pytest.approx(78.292770, abs=1e-6)
    tab.until(lambda: "122.46 mph" in tab.text("pins"))
    assert "mph" in tab.text("cursor")
    path = tab.data("path")
    assert path["ball_shown"][-1] == pytest.approx(path["ball_velocity"][-1] / 0.44704, rel=1e-12)
    assert tab.data("pinned")["ball_shown"][0] == pytest.approx(path["ball_shown"])
    tab.type("club_speed", "100")
    tab.shows(club_speed=44.704)
    tab.type("m_ball", "45.94")
    tab.shows(club_speed=44.704, m_ball=0.04594)
    tab.select("unit", "m/s")
    tab.until(lambda: tab.readout("ball_velocity").split("\n")[0].endswith(" m/s"))
    check_page(tab, evaluator, club_speed=44.704, m_ball=0.04594)


def test_examples_and_balls_are_one_click(tab, evaluator):
    for example in EXAMPLES:
        tab.press(example.name)
        tab.shows(**{n: v for n, v in example.values.items() if v != evaluator.defaults[n]})
        tab.until(lambda example=example: tab.text("hint") == example.hint)
        check_page(tab, evaluator, **example.values)
        for metric in ("smash_factor", "max_force", "contact_time"):
            assert example.printed.get(metric, "") in tab.readout(metric)
    assert [one["name"] for one in tab.pins()] == ["Law 1"]
    tab.type("m_club", "200")
    tab.select("ball", "penner")
    values = {n: v for n, v in BALLS["penner"].values.items() if v != evaluator.defaults[n]}
    tab.shows(m_club=0.2, **values)
    assert "Penner" in tab.text("source")
    tab.type("k", "500")
    tab.shows(**{"m_club": 0.2, **values, "k": 5e5})
    assert tab.value("ball") == ""


def test_pins(tab, evaluator):
    from selenium.webdriver.common.keys import Keys

    stiffness = [1e6, *(1e3 * (500 + n) for n in range(7))]
    for n, k in enumerate(stiffness):
        tab.type("k", f"{k / 1e3:g}")
        tab.shows(**({"k": k} if k != 1e6 else {}))
        tab.press("Pin")
        tab.until(lambda n=n: len(tab.pins()) == n + 1)
    pins = tab.pins()
    assert len({one["color"] for one in pins}) == 8
    assert [pins[0]["name"], pins[1]["name"]] == ["document", "k = 500000"]
    for one, k in zip(pins, stiffness, strict=True):
        expected = evaluator({"values": {"k": k}})
        assert one["metrics"]["max_force"] == pytest.approx(expected["metrics"]["max_force"])
        assert one["path"]["force"] == pytest.approx(expected["path"]["force"], rel=1e-12)
    # Eight at most.
    assert not tab.get("pin").is_enabled()
    field = tab.browser.find_element("css selector", "[aria-label='Name of pin 2']")
    field.send_keys(Keys.CONTROL, "a")
    field.send_keys("second", Keys.TAB)
    tab.until(lambda: tab.pins()[1]["name"] == "second")
    assert field.get_property("value") == "second"
    css = "[aria-label='{} pin 2']"
    tab.browser.find_element("css selector", css.format("Reopen")).click()
    tab.shows(k=5e5)
    tab.browser.find_element("css selector", css.format("Remove")).click()
    tab.until(lambda: len(tab.pins()) == 7)
    assert len(tab.data("pinned")["force"]) == 7


@pytest.mark.parametrize(
    ("question", "place", "words"),
    [
        ("k=-1", "k_refused", "k = -1.0 N/m is refused"),
        ("k=hard", "k_refused", "k = 'hard' is not a number"),
        ("nothing=1", "hint", "There is no input or parameter nothing"),
    ],
)
def test_an_address_that_is_refused(browser, address, evaluator, question, place, words):
    tab = Tab(browser, f"{address}?{question}")
    assert words in tab.text(place)
    check_page(tab, evaluator, **BALLS[OPENING].values)
    tab.close()


def test_the_command_runs(tab, tmp_path):
    tab.type("k", "812.5")
    tab.shows(k=812_500.0)
    tab.js("document.oncopy = () => { window.copied = String(getSelection()) }")
    tab.press("Copy command")
    line = tab.until(lambda: tab.js("return window.copied"))
    assert line == tab.value("command") == "golf-impact run --set k=812500"
    done = subprocess.run(
        [COMMAND, *line.split()[1:], "--no-figures", "--out", tmp_path], capture_output=True
    )
    assert done.returncode == 0
    (file,) = tmp_path.glob("*_results.json")
    metrics = json.loads(file.read_text())["custom"]["custom"]
    assert tab.readout("smash_factor") == f"{metrics['smash_factor']:.4f}"


def test_downloads(tab, tmp_path):
    tab.browser.execute_cdp_cmd(
        "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)}
    )

    def got(choice):
        file = tmp_path / f"golf-impact-{choice}"
        tab.select("download", choice)
        tab.until(lambda: file.exists() and file.stat().st_size)
        assert tab.value("download") == ""
        return file.read_bytes()

    tab.press("Pin")
    header, *rows = [line.split(",") for line in got("path.csv").decode().splitlines()]
    assert header[:3] == ["time (s)", "force (N)", "club_position (m)"]
    held = tab.data("path")
    for n, name in enumerate(header):
        assert name.endswith(")")
        assert [float(row[n]) for row in rows] == held[name.split()[0]]
    assert len(rows) == len(held["time"])
    header, row = got("pins.csv").decode().splitlines()
    assert header.startswith(
        "name,query,club_velocity (m/s),ball_velocity (m/s),touch_time (s),smash"
    )
    assert row.startswith('"document","law=1",21.52')
    for figure in ("force", "sweep"):
        # Chromium takes ten files from a page without a prompt.
        assert got(f"{figure}.png").startswith(b"\x89PNG")
        svg = got(f"{figure}.svg").decode()
        assert svg.startswith("<svg")
        # Drawn, not a picture of pixels.
        assert "<path" in svg


def test_the_cursor_plays_and_follows_pointer_and_finger(tab, evaluator):
    from selenium.webdriver import ActionChains

    before = tab.value("scrub")
    tab.get("play").click()
    places = {tab.until(lambda: (x := tab.value("scrub")) != before and x)}
    tab.until(lambda: places.add(tab.value("scrub")) or len(places) > 5)
    tab.get("play").click()
    stopped = tab.value("scrub")
    time.sleep(0.2)
    assert tab.value("scrub") == stopped
    # The cursor is the sample at that time, and the ball is compressed to scale.
    tab.js('get("scrub").value = 0.44; get("scrub").dispatchEvent(new Event("input"))')
    cursor, path = tab.data("cursor"), tab.data("path")
    n = path["time"].index(cursor["time"][0])
    assert {k: [column[n]] for k, column in path.items()} == cursor
    assert cursor["compression"][0] > 5e-3
    diameter = evaluator.defaults["ball_diameter"]
    compressed = diameter - cursor["compression"][0]
    assert cursor["ball_width"][0] * diameter == pytest.approx(compressed, rel=1e-12)
    assert f"{cursor['force'][0]:.0f} N" in tab.text("cursor")
    for figure in ("force", "loop"):
        old = tab.data("cursor")["time"]
        picture = tab.get(f"picture_{figure}")
        ActionChains(tab.browser).move_to_element_with_offset(picture, 40, -10).perform()
        tab.until(lambda old=old: tab.data("cursor")["time"] != old)


@pytest.mark.parametrize("width", [390, 640, 800, 1400])
def test_layout(browser, address, width):
    """Nothing is wider than the screen, and no two pictures or controls overlap."""
    phone = width < 700
    screen = {"width": width, "height": 850, "deviceScaleFactor": 1, "mobile": phone}
    browser.switch_to.new_window("tab")
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    touch = {"enabled": phone, "maxTouchPoints": 1}
    browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", touch)
    tab = Tab(browser, f"{address}?club_speed=-3", new=False)
    try:
        assert tab.text("state").startswith("No contact")
        assert tab.js("return document.documentElement.scrollWidth") <= width
        bad = """
            const names = "button, select, input, .picture, #cursor, #readouts tr, label"
            // What has scrolled out of the controls isn't seen.
            const end = get("controls").getBoundingClientRect().bottom
            const all = [...document.querySelectorAll(names)]
              .filter((one) => one.checkVisibility() && one.closest(".scroll") == null
                && one.type != "radio"
                && !(get("controls").contains(one) && one.getBoundingClientRect().bottom > end))
            const boxes = all.map((one) => [one, one.getBoundingClientRect(), one.id])
            const out = []
            for (const [one, a, id] of boxes) {
              if (a.left < 0 || a.right > innerWidth + 0.5) out.push(["cut", id])
              for (const [other, b, otherId] of boxes)
                if (!one.contains(other) && !other.contains(one)
                    && Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1
                    && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1)
                  out.push(["overlap", id, otherId])
            }
            for (const figure of Bokeh.documents[0].roots()) {
              const {name} = figure, {el} = Bokeh.index.find_one(figure)
              const {width, height} = el.getBoundingClientRect()
              const least = name == "animation" ? 45 : 150
              if (innerWidth < 760 && name != "animation" && name != "force") continue
              if (width < 150 || height < least) out.push([name, width, height])
            }
            return out"""
        assert tab.js(bad) == []
        if phone:
            # A swipe over a picture scrolls; a tap moves the cursor.
            tab.js('get("picture_force").scrollIntoView({block: "center"})')
            middle = """
                const {x, y, width, height} = get("picture_force").getBoundingClientRect()
                return [scrollY, x + width / 2, y + height / 2]"""
            top, x, y = tab.js(middle)
            browser.execute_cdp_cmd(
                "Input.synthesizeScrollGesture", {"x": x, "y": y, "yDistance": -200}
            )
            assert tab.js("return scrollY") > top + 100
            _, x, y = tab.js(middle)
            before = tab.data("cursor")["time"]
            browser.execute_cdp_cmd("Input.synthesizeTapGesture", {"x": x + 60, "y": y})
            tab.until(lambda: tab.data("cursor")["time"] != before)
    finally:
        tab.close()


def test_the_keyboard_reaches_every_control_and_leaves(tab):
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.keys import Keys

    tab.press("Pin")
    # From the top of the page.
    tab.js('const top = document.querySelector("h1"); top.tabIndex = -1; top.focus()')
    controls = """
        return [...document.querySelectorAll("button, select, input")].filter((one) =>
          !one.disabled && one.checkVisibility() && (one.type != "radio" || one.checked)).length"""
    active = """
        const one = document.activeElement
        window.passed ??= new Set()
        if (one != document.body) passed.add(one)
        return [passed.size, one == document.body,
          [...passed].filter((x) => ["BUTTON", "SELECT", "INPUT"].includes(x.tagName)).length]"""
    for _ in range(120):
        ActionChains(tab.browser).send_keys(Keys.TAB).perform()
        _, out, reached = tab.js(active)
        if out:
            break
    assert out
    assert reached == tab.js(controls)
    # Nothing without a name has a tab stop.
    known = """
        return [...passed].filter((one) => !one.ariaLabel
          && !["BUTTON", "SELECT", "INPUT", "A", "SUMMARY"].includes(one.tagName))
          .map((one) => one.outerHTML)"""
    assert tab.js(known) == []


def test_controls_have_names(tab):
    """By the browser's own tree for screen readers."""
    nodes = tab.browser.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
    named = {}
    for node in nodes:
        role, name = (node.get(key, {}).get("value", "") for key in ("role", "name"))
        named.setdefault(role, []).append(name)
    assert "Stiffness k, slider" in named["slider"]
    assert "Stiffness k (N/mm)" in named["spinbutton"]
    assert {"Ball", "Download", "Unit of speeds", "S and COR over"} <= set(named["combobox"])
    for role in ("slider", "spinbutton", "combobox", "button", "radio", "textbox"):
        assert all(named[role]), named[role]


def test_club_and_ball_are_two_choices(tab, evaluator):
    tab.select("club", "driver")
    tab.until(lambda: tab.value("club") == "driver")
    tab.select("ball", "tour")
    club = next(one for one in CLUBS if one.name == "driver")
    values = {**BALLS["tour"].values, **club.values}
    tab.shows(**{n: v for n, v in values.items() if v != evaluator.defaults[n]})
    assert (tab.value("club"), tab.value("ball")) == ("driver", "tour")
    assert "TrackMan: 10.9°" in tab.readout("launch_angle")
    assert "ball tour instead of penner" in tab.text("hint")
    check_page(tab, evaluator, **values)
    tab.type("m_club", "210")
    tab.until(lambda: tab.value("club") == "")
    assert "TrackMan" not in tab.readout("launch_angle")
    assert tab.value("ball") == "tour"


def test_controls_without_effect_are_disabled(tab, evaluator):
    tab.select("over", "b")
    tab.select("ball", "penner")
    tab.until(lambda: not tab.get("b").is_enabled())
    assert not tab.get("b_slider").is_enabled()
    assert "the COR line determines the damping" in tab.text("b_idle")
    assert tab.get("restitution_slope").is_enabled()
    assert tab.value("over") == "club_speed"
    assert tab.js("return get('over').querySelector('[value=b]').disabled")
    tab.select("ball", "roh-lee-linear")
    tab.until(lambda: tab.get("b").is_enabled())
    assert tab.text("b_idle") == ""
    for name in ("restitution_slope", "reference_compression"):
        assert not tab.get(name).is_enabled()
        assert "no effect while" in tab.text(f"{name}_idle")
    # They have none, and those that stay enabled have one.
    base = evaluator({"values": {"law": 2}})
    for name, value in {"restitution_slope": 0.001, "reference_compression": 3e-3}.items():
        assert evaluator({"values": {"law": 2, name: value}})["metrics"] == base["metrics"]
    line = dict(BALLS["penner"].values)
    assert evaluator({"values": line})["path"] == evaluator({"values": {**line, "b": 50}})["path"]
    for one in QUANTITIES:
        if one["name"] not in ("restitution_slope", "reference_compression"):
            start = base["values"][one["name"]]
            other = {"law": 2, one["name"]: 0.8 * start or one.get("high", 1.0) * one["scale"] / 5}
            other |= {"exponent": 1.2} if one["name"] == "exponent" else {}
            changed = evaluator({"values": other})
            assert changed["readouts"] != base["readouts"], one


def test_levels(browser, address, evaluator):
    tab = Tab(browser, f"{address}?level=simple")
    tab.shows(law=2)
    check_page(tab, evaluator, law=2)

    def visible(css):
        script = "return [...document.querySelectorAll(arguments[0])].filter((x) =>"
        return tab.js(f"{script} x.checkVisibility()).map((x) => x.id)", css)

    names = ["k", "b", "club_speed", "m_club", "m_ball"]
    assert visible("#controls input[type=number]") == names
    assert visible(".picture") == [
        f"picture_{name}" for name in ("force", "energies", "momenta", "velocities")
    ]
    assert {"smash_factor", "energy_efficiency", "max_force"} <= set(visible("#readouts tr"))
    assert "carry" not in visible("#readouts tr")
    tab.select("level", "all")
    tab.until(lambda: len(visible(".picture")) == 8)
    tab.shows(law=2)
    assert "–" not in tab.readout("carry")
    # What the simple level hasn't is left: the ball is law 2's, and undo brings the other back.
    tab.select("ball", "penner")
    values = {n: v for n, v in BALLS["penner"].values.items() if v != evaluator.defaults[n]}
    tab.shows(**values)
    tab.select("level", "simple")
    tab.shows(law=2)
    tab.press("Undo")
    tab.shows(**values)
    assert not tab.get("b").is_enabled()
    tab.press("Reset")
    tab.shows(law=2)
    tab.close()


def test_tasks(tab, evaluator):
    tab.select("level", "simple")
    tab.shows(law=2)
    tab.js("get('tasks').open = true")
    links = tab.browser.find_elements("css selector", "#tasks div > a")
    assert [link.text for link in links] == [one["name"] for one in evaluator.facts["tasks"]]
    links[0].click()
    tab.until(lambda: len(tab.pins()) == 1)
    tab.type("k", "500")
    tab.shows(law=2, k=5e5)
    check_page(tab, evaluator, law=2, k=5e5)
    assert tab.pins()[0]["name"] == "Stiffness"
    # Another beginning with the same case has no second pin.
    links[1].click()
    tab.shows(law=2)
    assert len(tab.pins()) == 1
    # In a tab of its own a link opens the same case.
    question = links[0].get_attribute("href").split("?")[1]
    assert question == "law=2&level=simple"


def test_undo_and_reset(tab, evaluator):
    assert not tab.get("undo").is_enabled()
    slide = """
        const slider = get("b_slider")
        for (const value of arguments[0]) {
          slider.value = value
          slider.dispatchEvent(new Event("input", {bubbles: true}))
        }
        slider.dispatchEvent(new Event("change", {bubbles: true}))"""
    tab.js(slide, [10, 15, 20])
    tab.shows(b=20)
    tab.js(slide, [25, 30])
    tab.shows(b=30)
    tab.type("k", "900")
    tab.shows(b=30, k=9e5)
    # A refused value is no step.
    tab.type("k", "-5")
    tab.until(lambda: tab.text("k_refused"))
    tab.press("Undo")
    tab.shows(b=30)
    assert tab.text("k_refused") == ""
    # A slider's way is one step.
    tab.press("Undo")
    tab.shows(b=20)
    tab.press("Undo")
    tab.shows()
    assert not tab.get("undo").is_enabled()
    tab.type("k", "900")
    tab.shows(k=9e5)
    tab.press("Reset")
    values = {n: v for n, v in BALLS[OPENING].values.items() if v != evaluator.defaults[n]}
    tab.shows(**values)
    tab.press("Undo")
    tab.shows(k=9e5)


def test_equations(tab):
    tab.select("ball", "penner")
    tab.until(lambda: "(d/d_r)ⁿ" in tab.text("equations"))
    assert "COR = 0.86 − 0.0029 s/m · 35 m/s" in tab.text("equations")
    tab.press("Document")
    tab.until(lambda: "b x_C′" in tab.text("equations"))


def test_a_case_with_loft_is_a_link(tab):
    tab.type("dynamic_loft", "20")
    tab.until(lambda: tab.value("command").startswith("http"))
    tab.shows(law=1, dynamic_loft=float(f"{np.radians(20.0):.15g}"))
    assert tab.value("command") == tab.browser.current_url
    assert "golf-impact run has no loft, attack angle and friction" in tab.text("same")
    assert tab.text("copy") == "Copy link"


def test_refusals_are_announced(tab):
    tab.type("k", "-5")
    tab.until(lambda: tab.text("announced"))
    assert tab.text("announced") == tab.text("k_refused")
    assert tab.get("announced").get_attribute("role") == "alert"
    # A control that is folded away is opened.
    tab.js("for (const one of document.querySelectorAll('#controls details')) one.open = false")
    tab.type("k", "1000")
    tab.until(lambda: tab.text("announced") == "")
    tab.js("requestImpact({exponent: 0.5})")
    tab.until(lambda: tab.get("exponent_refused").is_displayed())


@pytest.mark.parametrize("level", ["all", "simple"])
def test_on_a_phone_the_result_is_beside_the_slider(browser, address, level):
    screen = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    browser.switch_to.new_window("tab")
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    tab = Tab(browser, f"{address}?law=2&level={level}", new=False)
    seen = """
        const picture = document.querySelector(".picture.chosen").getBoundingClientRect()
        const line = get("summary").getBoundingClientRect()
        const slider = get(arguments[0]).getBoundingClientRect()
        return line.top >= 0 && line.bottom <= picture.top + 1 && picture.bottom <= slider.top
          && picture.height > 150 && slider.bottom <= innerHeight"""
    try:
        for name in ("k", "b", "club_speed", "m_club", "m_ball"):
            tab.js("get(arguments[0]).scrollIntoView({block: 'center'})", f"{name}_slider")
            assert tab.js(seen, f"{name}_slider"), name
        assert tab.text("summary").startswith("S 1.5842  COR 0.9307  55.45 m/s")
        tab.select("picture", "momenta")
        assert tab.get("picture_momenta").is_displayed()
        assert not tab.get("picture_force").is_displayed()
        assert tab.js("return document.documentElement.scrollHeight") < 2600
    finally:
        tab.close()


INK = """
    const ink = (canvas) => {
      const {width, height} = canvas, copy = document.createElement("canvas")
      Object.assign(copy, {width, height})
      const context = copy.getContext("2d", {willReadFrequently: true})
      context.drawImage(canvas, 0, 0)
      const {data} = context.getImageData(0, 0, width, height)
      return data.filter((value, n) => n % 4 == 3 && value).length
    }
    const painted = () => figures().filter(({name}) => name != "animation")
      .map((one) => ink(Bokeh.index.find_one(one).canvas_view.primary.canvas))"""


def test_pictures_out_of_sight_are_painted(browser, address):
    """For a screenshot of the full page: at rest, and when the width changes."""
    browser.switch_to.new_window("tab")
    screen = {"width": 800, "height": 500, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    tab = Tab(browser, f"{address}?law=2", new=False)
    try:
        for width in (800, 900):
            size = {**screen, "width": width}
            browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            tab.until(lambda: min(tab.js(f"{INK}; return painted()")) > 500)
        tab.type("k", "500")
        tab.shows(law=2, k=5e5)
        # On paper.
        tab.js("setDark(true); dispatchEvent(new Event('beforeprint'))")
        copies = f'{INK}; return [...document.querySelectorAll("canvas.copy")].map(ink)'
        assert len(tab.js(copies)) == 9
        assert min(tab.js(copies)) > 500
        assert tab.js("return document.documentElement.dataset.theme") == "light"
        tab.js("dispatchEvent(new Event('afterprint'))")
        assert tab.js(copies) == []
        assert tab.js("return document.documentElement.dataset.theme") == "dark"
    finally:
        tab.close()


@pytest.mark.parametrize("sheet", [(8.27, 11.69), (8.5, 11.0)], ids=["A4", "Letter"])
def test_the_worksheet_is_one_page(browser, address, sheet):
    browser.switch_to.new_window("tab")
    browser.get(f"{address}worksheet.html")
    paper = dict(zip(("paperWidth", "paperHeight"), sheet))
    printed = browser.execute_cdp_cmd("Page.printToPDF", paper)
    assert len(re.findall(rb"/Type /Page\b", base64.b64decode(printed["data"]))) == 1
    links = [one.get_attribute("href") for one in browser.find_elements("css selector", "h2 a")]
    assert links == [f"{address}index.html?law=2&level=simple"] * 3
    browser.get(links[0])
    Tab(browser, links[0], new=False).shows(law=2).close()


def test_less_motion(browser, address):
    browser.switch_to.new_window("tab")
    media = {"features": [{"name": "prefers-reduced-motion", "value": "reduce"}]}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
    tab = Tab(browser, address, new=False)
    tab.get("play").click()
    places = set()
    end = time.monotonic() + 1.5
    while time.monotonic() < end:
        places.add(round(12.0 * float(tab.value("scrub")), 2))
    # 1.5 s of 6 s: stills of half a second each, and the place where it began.
    assert len(places) <= 5
    tab.close()


@pytest.mark.parametrize("address", ["exported"], indirect=True)
def test_controls_wait_for_python(browser, address):
    browser.switch_to.new_window("tab")
    browser.get(f"{address}?law=2&b=20")
    enabled = """
        return document.body?.dataset.ready ? null
          : [...document.querySelectorAll("header button, header select, #controls input")]
            .filter((one) => one.matches(":enabled")).length"""
    counts = []
    while (count := browser.execute_script(enabled)) is not None:
        counts.append(count)
    # Loading takes seconds: it was looked at.
    assert len(counts) > 3
    assert set(counts) == {0}
    Tab(browser, f"{address}?law=2&b=20", new=False).shows(law=2, b=20).close()


def test_light_and_dark(tab):
    background = "return getComputedStyle(document.body).backgroundColor"
    light = tab.js(background)
    tab.press("Dark")
    assert tab.js(background) != light
    tab.press("Light")
    assert tab.js(background) == light


@pytest.mark.parametrize("address", ["exported"], indirect=True)
def test_a_runtime_that_is_late_is_reported(browser, address):
    """The page's minute lasts a tenth of a second here."""
    browser.switch_to.new_window("tab")
    source = "const wait = setTimeout; setTimeout = (f, ms) => wait(f, ms == 60000 ? 100 : ms)"
    browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": source})
    browser.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 4})
    tab = Tab(browser, address, new=False, ready=None)
    tab.until(lambda: "has not started within 60 s" in tab.text("runtime"))
    browser.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 1})
    # It may come all the same.
    tab.until(lambda: "numbers agree" in tab.text("runtime"))
    tab.close()


@pytest.mark.parametrize(
    "missing", ["pyodide/pyodide.asm.wasm", "pyodide/pyodide.mjs", "physics.zip"]
)
def test_a_missing_runtime_is_reported(browser, exported, tmp_path, missing):
    shutil.copytree(exported, tmp_path / "page")
    (tmp_path / "page" / missing).unlink()
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=tmp_path)
    handler.func.log_message = lambda *args: None
    browser.switch_to.new_window("tab")
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        browser.get(f"http://127.0.0.1:{server.server_port}/page/")
        end = time.monotonic() + 60.0
        script = "return document.getElementById('runtime').textContent"
        while "don't work" not in (words := browser.execute_script(script)):
            assert time.monotonic() < end, words
            time.sleep(0.1)
        assert browser.execute_script("return document.body.dataset.ready") is None
        # Pictures are there all the same.
        assert browser.execute_script("return model('path').data.force.length") > 100
        server.shutdown()
    browser.get_log("browser"), browser.get_log("performance")
