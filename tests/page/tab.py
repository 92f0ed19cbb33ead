"""The page of `golf-impact explore` for tests: its physics in node, a browser that opens it."""

import base64
import json
import re
import shutil
from pathlib import Path

import pytest
from command import run
from selenium import webdriver
from selenium.webdriver import Keys
from selenium.webdriver.support.ui import Select, WebDriverWait

from golf_impact.explore.page import write_page

#: In node, without a document: results and paths of cases, or why they are refused.
_NODE = """
const [html, cases] = process.argv.slice(1).map((file) => require("fs").readFileSync(file, "utf8"))
const part = (id) => html.match(new RegExp(`id="${id}">(.*?)</script>`, "s"))[1]
const facts = JSON.parse(part("facts")), start = {}
for (const name in facts.inputs) start[name] = facts.inputs[name].start
const script = html.match(/<script type="module">(.*?)const get = /s)[1]
const Physics = new Function(`${script}; return Physics`)()
const module = new WebAssembly.Module(Buffer.from(part("physics"), "base64"))
const physics = new Physics(new WebAssembly.Instance(module).exports, facts)
console.log(JSON.stringify(JSON.parse(cases).map(({drawn, ...given}) => {
  const values = {...start, ...given}
  try {
    const result = physics.impact(values)
    return {...result, path: drawn && physics.path(values, result)}
  } catch (error) {
    return {refused: error.message, about: error.about}
  }
})))"""


_SHOWN = Path(__file__).with_name("shown.js").read_text("utf-8")


def by_wasm(cases, folder):
    """What the page computes of these cases: `metrics`, `path` if `drawn`; or `refused`."""
    if shutil.which("node") is None:
        pytest.skip("node, which runs the page's WebAssembly, isn't installed here")
    page_file, cases_file = write_page(folder / "page.html", {}), folder / "cases.json"
    cases_file.write_text(json.dumps(cases))
    return json.loads(run("node", "-e", _NODE, page_file, cases_file).stdout)


def facts(text):
    """What a page has from the project's tables."""
    return json.loads(re.search(r'id="facts">(.*?)</script>', text)[1])


def chrome():
    """Chromium without a network; it logs what the page does."""
    chromium, helper = shutil.which("chromium"), shutil.which("chromedriver")
    if not (chromium and helper):
        pytest.skip("chromium and chromedriver aren't installed here")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for argument in ("headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage"):
        options.add_argument(f"--{argument}")
    options.add_argument("--host-resolver-rules=MAP * ~NOTFOUND")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    return webdriver.Chrome(options=options, service=webdriver.ChromeService(helper))


class Tab:
    """The page of a file in a browser; elements by id, or another CSS selector."""

    def __init__(self, browser, file):
        self.browser, self.file, self.saved = browser, file, {}
        self.media(prefers_color_scheme="light").screen(1366, 768)

    def open(self, address=""):
        self.browser.get("about:blank")
        self.browser.get(self.file.as_uri() + address)
        self.until(lambda: self.js("return document.body?.dataset.ready") == "yes")
        return self

    def js(self, code, *arguments):
        return self.browser.execute_script(code, *arguments)

    def each(self, css, what):
        """A JavaScript expression of each element `x`."""
        return self.js(
            f"return [...document.querySelectorAll(arguments[0])].map((x) => {what})", css
        )

    def cdp(self, command, **arguments):
        return self.browser.execute_cdp_cmd(command, arguments)

    def screen(self, width, height, phone=False):
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone}
        self.cdp("Emulation.setDeviceMetricsOverride", **size)
        return self

    def media(self, **features):
        """As a user's system asks for: prefers_color_scheme="dark", prefers_reduced_motion …"""
        named = [{"name": n.replace("_", "-"), "value": value} for n, value in features.items()]
        self.cdp("Emulation.setEmulatedMedia", features=named)
        return self

    def until(self, condition):
        return WebDriverWait(self.browser, 20.0, 0.05).until(lambda _: condition())

    def get(self, place):
        css = f"#{place}" if place.isidentifier() else place
        return self.browser.find_element("css selector", css)

    def value(self, place):
        return self.get(place).get_property("value")

    def text(self, place):
        return self.get(place).get_property("textContent").strip()

    def type(self, place, text):
        self.get(place).send_keys(Keys.CONTROL, "a")
        self.get(place).send_keys(text, Keys.TAB)
        return self

    def go(self, address):
        """To another address of the same page."""
        self.js("location.hash = arguments[0]", address)
        return self.until(lambda: self.value("address").endswith(address)) and self

    def slide(self, name, *values):
        """As a mouse moves a slider, and leaves it."""
        moves = """
            const slider = document.getElementById(`${arguments[0]}_slider`)
            const send = (type) => slider.dispatchEvent(new Event(type, {bubbles: true}))
            for (const value of arguments[1]) { slider.value = value; send("input") }
            send("change")"""
        self.js(moves, name, values)
        return self

    def click(self, css):
        self.get(css).click()
        return self

    def press(self, label):
        self.browser.find_element("xpath", f"//button[normalize-space()='{label}']").click()
        return self

    def select(self, place, value):
        Select(self.get(place)).select_by_value(value)
        return self

    def point(self, name, x, y):
        """Point at a place in a picture, in units of its box."""
        move = """
            const svg = document.querySelector(`#${arguments[0]}_figure svg`)
            const {left, top, width} = svg.getBoundingClientRect(), size = width / 360
            const at = {clientX: left + arguments[1] * size, clientY: top + arguments[2] * size}
            svg.dispatchEvent(new PointerEvent("pointermove", at))"""
        self.js(move, name, float(x), float(y))
        return self

    def download(self, name):
        """A file: how many lines it has, and some of them."""
        file = self.file.with_name(f"golf-impact-{name}")
        self.cdp("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(file.parent))
        self.select("download", name).until(file.exists)
        text = re.sub(r"(?<=\.\d{9})\d+", "…", file.read_text("utf-8"))
        lines = re.sub(r"<style>.*</style>", "…", text, flags=re.DOTALL).splitlines()
        some = lines[0][:300], lines[len(lines) // 2][:300]
        self.saved = {("file", name): "; ".join([str(len(lines)), *some])}
        return self

    def shown(self):
        """By part and name, what is visible (see shown.js), and what has been saved."""
        return {(part, name): text for part, name, text in self.js(_SHOWN)} | self.saved

    def sheets(self, width, height):
        """The number of printed sheets of this size, inches."""
        printed = self.cdp("Page.printToPDF", paperWidth=width, paperHeight=height)
        return len(re.findall(rb"/Type /Page\b", base64.b64decode(printed["data"])))
