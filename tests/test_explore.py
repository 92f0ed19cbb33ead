"""`golf-impact explore` without a browser: what it computes, its server, its exported files."""

import http.client
import itertools
import json
import os
import re
import shutil
import signal
import socket
import sys
from contextlib import closing
from urllib.parse import urlsplit

import numpy as np
import pytest
from command import ROOT, golf_here, refused, run, run_python
from compare import assert_close
from endurance import resident_bytes
from page import serving

import golf_impact
from golf_impact.ball import BALLS
from golf_impact.commands.options import values_of
from golf_impact.errors import UserError
from golf_impact.explore import export as exporting
from golf_impact.explore.cases import CLUB_BALL, CLUBS, EXAMPLES, QUANTITIES, metrics_by_fmus
from golf_impact.explore.evaluator import LOFT, SWEPT
from golf_impact.fmu import Fmu, Impact
from golf_impact.shots import shot

pytestmark = pytest.mark.plain

CASES = {
    "law 1": {},
    "law 2": {"law": 2},
    "moving ball": {"law": 2, "ball_speed": 3.0, "club_speed": 50.0},
    "with a gap": {"gap": 0.01},
    "pushed head": {"law": 2, "ball_speed": 3.0, "gap": 0.01, "club_force": 500.0},
    "power law": {"law": 2, "b": 39.0, "exponent": 1.6},
    "penner": dict(BALLS["penner"].values),
}


@pytest.mark.parametrize("name", CASES)
def test_curves_are_those_of_the_physics(evaluator, name):
    """Against another run, without an approach and sampled otherwise."""
    values = {**evaluator.defaults, **CASES[name]}
    result = evaluator({"values": values})
    values = {name: x for name, x in values.items() if name not in LOFT} | {"gap": 0.0}
    metrics = golf_impact.run_impact(**values)
    for metric, value in metrics.items():
        if metric != "touch_time":
            assert result["metrics"][metric] == pytest.approx(value, rel=1e-12, abs=1e-12), metric
    contact, path = metrics["contact_time"], {k: np.array(v) for k, v in result["path"].items()}
    times = path["time"]
    assert times[0] < 0.0 < contact < times[-1]
    assert (np.diff(times) > 0.0).all()
    # The peak and the end of contact are samples.
    assert path["force"].max() == pytest.approx(metrics["max_force"], rel=1e-12)
    assert np.abs(times - contact).min() <= 1e-12 * contact
    speed = abs(values["club_speed"]) + abs(values["ball_speed"])
    scales = {"force": metrics["max_force"], "compression": metrics["max_compression"]}
    for body in ("club", "ball"):
        scales |= {f"{body}_velocity": speed, f"{body}_position": speed * contact}
    since = times > 0.0
    right = golf_impact.run_trajectory(outputs=list(scales), times=times[since], **values)
    del right["time"]
    assert_close({name: path[name][since] for name in right}, right, scales, 1e-12)


@pytest.mark.parametrize("name", CASES)
def test_energies_momenta_and_the_scene(evaluator, name):
    result = evaluator({"values": CASES[name]})
    metrics, path = result["metrics"], {k: np.array(v) for k, v in result["path"].items()}
    start, total = metrics["kinetic_energy_initial"], path["total_momentum"]
    # The force on the head acts from touch on.
    force, since = result["values"]["club_force"], np.maximum(path["time"], 0.0)
    work = force * np.maximum(path["club_position"], 0.0)
    lost = start + metrics["work_on_club"] - metrics["kinetic_energy_final"]
    parts = sum(path[f"{part}_energy"] for part in ("club", "ball", "spring", "lost"))
    assert parts == pytest.approx(start + work, rel=1e-12)
    # Lost energy doesn't come back.
    assert (np.diff(path["lost_energy"]) > -1e-12 * start).all()
    assert path["lost_energy"][0] == pytest.approx(0.0, abs=1e-12 * start)
    shares = metrics["ball_share"] + metrics["club_share"]
    assert shares == pytest.approx(metrics["energy_efficiency"], rel=1e-12)
    assert total[0] == pytest.approx(metrics["momentum_initial"], rel=1e-12)
    area = np.trapezoid(path["force"], path["compression"])
    if result["values"]["law"] == 2:
        # The loop's area, up to what straight lines between samples cut off.
        assert area == pytest.approx(lost, rel=2e-3)
        assert total == pytest.approx(total[0] + force * since, rel=1e-12)
    else:
        # Force and compression are proportional: no loop, whatever the drag takes.
        assert area == pytest.approx(0.0, abs=1e-9 * start)
        assert lost > 1.0
        assert total[-1] < 0.97 * total[0]
    # The ball keeps its volume; the scene is in diameters.
    width, compressed = path["ball_width"], path["compression"] > 0.0
    diameters = path["compression"] / result["values"]["ball_diameter"]
    assert width == pytest.approx(1.0 - diameters, rel=1e-12)
    assert width * path["ball_height"] ** 2 == pytest.approx(1.0, rel=1e-12)
    face = (path["ball_middle"] - 0.5 * width)[compressed]
    assert face == pytest.approx(path["club_face"][compressed], abs=1e-12)
    # Above the data a seventh of the height is for legends and labels.
    for name, column in {"force": "force", "momentum": "total_momentum", "energy": ""}.items():
        low, high = result["ranges"][name]
        assert (path[column].max() if column else start) - low <= 0.86 * (high - low)


def test_no_contact_and_no_separation(evaluator):
    never = evaluator({"values": {"club_speed": -3.0}})
    assert never["state"].startswith("No contact")
    assert max(never["path"]["force"]) == 0.0
    stuck = evaluator({"values": {"b": 5000.0}})
    assert stuck["state"].startswith("No separation")
    # No value at an end that there isn't; maxima are values.
    for result, metrics in ((never, set()), (stuck, {"max_force", "compression_over_diameter"})):
        assert {one["metric"] for one in result["readouts"] if one["value"] != "–"} == metrics
    assert max(stuck["path"]["force"]) > 0.0
    assert evaluator({})["state"] == ""


@pytest.mark.parametrize(
    ("request_", "about", "words"),
    [
        ({"values": {"k": -5}}, "k", "k = -5.0 N/m is refused: it must be a finite number > 0"),
        ({"values": {"k": None}}, "k", "k=None is refused: 'None' is no number"),
        ({"values": {"k": "nan"}}, "k", "k = nan N/m is refused"),
        ({"values": {"law": 1.5}}, "law", "law = 1.5 is refused"),
        ({"values": {"nothing": 1}}, "", "There is no input or parameter nothing: choose from k"),
        ({"values": {"exponent": 1.6}}, "exponent", "exponent = 1.6"),
        *(({"over": x}, "", f"There is no slider {x!r}: choose from k") for x in ("gap", 7, ["k"])),
    ],
)
def test_refused(evaluator, request_, about, words):
    refused = evaluator(request_)
    assert (refused["about"], words in refused["refused"]) == (about, True), refused


def typed(text, unit):
    """Of a field."""
    return {"text": text, "unit": unit}


def test_values_as_text(evaluator):
    """In the unit of their field, or in their own: as the command line takes them."""
    texts = {"club_speed": "95mph", "ball_diameter": "42.67mm", "dynamic_loft": "45 deg"}
    values = {"club_speed": 42.4688, "ball_diameter": 0.04267, "dynamic_loft": 0.785398163397448}
    assert evaluator({"values": texts})["values"].items() >= values.items()
    assert values_of(["=".join(one) for one in texts.items()]) == values
    fields = {"club_speed": typed("95", "mph"), "ball_diameter": typed("0.04267 m", "mm")}
    fields |= {"dynamic_loft": typed("45", "°"), "b": typed("12.5", "N·s/m")}
    fields |= {"m_ball": typed("45.94", "g"), "exponent": typed("1.0e0", "")}
    values |= {"b": 12.5, "m_ball": 0.04594, "exponent": 1.0}
    assert evaluator({"values": fields})["values"].items() >= values.items()


@pytest.mark.parametrize("text", ["770lb", "9,5", "hard", "95 mph"])
def test_what_is_no_value(evaluator, text):
    """The sentence is the command line's."""
    reply = evaluator({"values": {"k": typed(text, "N/mm")}})
    with pytest.raises(UserError, match=re.escape(f"--set {reply['refused']}")):
        values_of([f"k={text}"])
    assert (reply["about"], reply["unread"]) == ("k", True)
    assert not evaluator({"values": {"k": -5}})["unread"]


def test_remarks_on_values(evaluator):
    """On those that are written in SI units, the command line's."""
    for given in ("95", typed("95", "m/s"), "35", 95, "95 m/s", typed("200", "mph")):
        remark = evaluator({"values": {"club_speed": given}})["remarks"].get("club_speed", "")
        expected = given in ("95", typed("95", "m/s"))
        assert ("write club_speed=42.4688 for 95 mph" in remark) == bool(remark) == expected


def test_s_and_cor_over_a_variable(fmu, evaluator):
    values = {"law": 2}
    swept = evaluator({"values": values, "over": "b"})["swept"]
    assert len(swept["x"]) == SWEPT
    expected = [fmu.impact(**values, b=b) for b in swept["x"]]
    for metric in ("smash_factor", "coefficient_of_restitution"):
        assert swept[metric] == [one[metric] for one in expected]
    never = evaluator({"values": {"ball_speed": 40.0}, "over": "club_speed"})["swept"]
    # Where the bodies separate.
    assert min(never["x"]) > 40.0
    assert min(never["smash_factor"]) > 0.0


def test_what_sliders_and_fields_do(evaluator):
    """Values of sliders are allowed. What the page disables has no effect, all others have one."""
    assert {one["name"] for one in QUANTITIES} | {"law"} == set(evaluator.defaults)
    base = evaluator({"values": {"law": 2}})
    for one in QUANTITIES:
        name, scale = one["name"], one["scale"]
        for limit in ("low", "high") if "step" in one else ():
            values = {"law": 2, "club_speed": 81.0, name: one[limit] * scale}
            assert evaluator({"values": values})["state"] == "", one
        other = {"law": 2, name: 0.8 * base["values"][name] or one.get("high", 1.0) * scale / 5}
        other |= {"exponent": 1.2} if name == "exponent" else {}
        idle = name in ("restitution_slope", "reference_compression")
        assert (evaluator({"values": other})["readouts"] == base["readouts"]) == idle, one
    line = dict(BALLS["penner"].values)
    assert evaluator({"values": line})["path"] == evaluator({"values": {**line, "b": 50}})["path"]


@pytest.mark.parametrize("club", CLUBS, ids=lambda one: one.name)
def test_shots_of_clubs(evaluator, fmu_path, files, club):
    """Against the FMUs: launch as measured, and the flight in two steps."""
    result = evaluator({"values": {**BALLS[CLUB_BALL].values, **club.values}})
    metrics, flight = result["metrics"], result["flight"]
    measured = np.radians(float(club.printed["launch_angle"]))
    assert metrics["launch_angle"] == pytest.approx(measured, abs=np.radians(0.002))
    assert result["club"] == club.name
    head = (club.values[name] for name in ("dynamic_loft", "attack_angle"))
    with Impact(fmu_path) as impact, Fmu(files[1]) as launch, Fmu(files[2]) as ball:
        given = metrics["head_speed"], *head, CLUB_BALL, club.values["m_club"]
        hit = shot(impact, launch, *given)
        start = {name: hit[name] for name in ("launch_angle", "backspin")}
        ball.start(ball_velocity=hit["ball_speed"], separated=True, **start)
        ball.step(0.0, 1e-3)
        hit |= ball.read(("carry", "apex", "flight_time"))
        ball.step(1e-3, 0.5 * metrics["flight_time"] - 1e-3)
        for name, value in ball.read(("distance", "height")).items():
            assert flight[name][len(flight[name]) // 2] == pytest.approx(value, rel=1e-9)
    for name in hit.keys() & metrics.keys():
        assert metrics[name] == pytest.approx(hit[name], rel=1e-12), name
    assert (flight["height"][0], flight["height"][-1]) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert flight["distance"][-1] == pytest.approx(metrics["carry"], rel=1e-12)
    assert max(flight["height"]) <= metrics["apex"]


@pytest.mark.parametrize(
    ("changes", "other"),
    [
        (BALLS[CLUB_BALL].values, ""),
        (BALLS["tour"].values, "ball tour instead of penner"),
        ({"law": 2, "k": 9e5}, "k, exponent, restitution_at_rest"),
        ({**BALLS["roh-lee"].values, "friction": 0.2}, "ball roh-lee instead of penner, friction"),
    ],
)
def test_a_club_keeps_its_numbers_with_any_ball(evaluator, changes, other):
    """What differs from the case in which its loft was fitted is named."""
    club = CLUBS[0]
    result = evaluator({"values": {**changes, **club.values}})
    assert {"TrackMan: 10.9°"} <= {row["printed"] for row in result["readouts"]}
    names = result["hint"].removeprefix(club.hint).removeprefix(" Other than in the fit: ")
    assert names.startswith(other)
    assert bool(names) == bool(other)
    for name in club.values:
        moved = {**changes, **club.values, name: 0.9 * club.values[name]}
        assert evaluator({"values": moved})["club"] == ""


def test_equations_with_numbers(evaluator):
    """The last line is the ball speed of the results; what a law hasn't isn't among its lines."""
    for name in ("law 2", "moving ball", "penner"):
        result = evaluator({"values": CASES[name]})
        speed = result["metrics"]["ball_velocity"]
        assert result["equations"][-1].split() == ["=", f"{speed:.2f}", "m/s"]
        formula = result["equations"][-2].strip(" =").replace("·", "*")
        assert eval(formula) == pytest.approx(speed, rel=1e-3)
    lines = [" ".join(evaluator({"values": one})["equations"]) for one in (CASES["penner"], {})]
    assert "(d/d_r)ⁿ" in lines[0]
    assert "b x_C′" in lines[1]
    assert "1000 N/mm" in lines[1]
    never = evaluator({"values": {"law": 2, "club_speed": -3.0}})["equations"]
    assert not any(line.strip().startswith("= 0 +") for line in never)


def test_lessons_of_the_tasks(evaluator):
    """Their numbers."""
    start, soft, none, more, heavy, fast = (
        evaluator({"values": {"law": 2, **values}})["metrics"]
        for values in ({}, {"k": 5e5}, {"b": 0}, {"b": 36}, {"m_club": 0.42}, {"club_speed": 70})
    )
    stiffness, damping, mass = (one["lesson"] for one in evaluator.facts["tasks"])
    for one in (start, soft):
        assert f"{one['smash_factor']:.3f}" in stiffness
        assert f"{one['contact_time'] * 1e6:.0f}" in stiffness
    assert soft["max_force"] / start["max_force"] == pytest.approx(0.5**0.5, rel=0.02)
    assert none["coefficient_of_restitution"] == none["energy_efficiency"] == 1.0
    assert f"COR is {more['coefficient_of_restitution']:.2f}" in damping
    assert f"{100.0 * (1.0 - more['energy_efficiency']):.1f} %" in damping
    assert f"{more['momentum']:.2f} N·s" in damping
    assert f"{heavy['smash_factor']:.3f} instead of {start['smash_factor']:.3f}" in mass
    for metric in ("smash_factor", "coefficient_of_restitution", "contact_time"):
        assert fast[metric] == pytest.approx(start[metric], rel=1e-12)
    assert fast["max_force"] == pytest.approx(2.0 * start["max_force"], rel=1e-12)


def test_a_case_with_loft_has_no_command(evaluator):
    """`run` would compute another one."""
    for name in LOFT:
        result = evaluator({"values": {name: 0.3}})
        assert (result["command"], result["query"]) == ("", f"law=1&{name}=0.3")
        refused(golf_here("run", "--set", f"{name}=0.3"), name)


def test_a_shot_that_is_refused_leaves_the_impact(evaluator):
    result = evaluator({"values": {"dynamic_loft": 1.4, "attack_angle": -0.5}})
    assert result["state"].startswith("No flight: attack_angle = -0.5 is refused")
    assert result["flight"] == {"distance": [], "height": []}
    assert result["metrics"].items() <= evaluator({})["metrics"].items()
    assert [one["value"] for one in result["readouts"][-3:]] == ["–"] * 3


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda one: one.name)
def test_a_case_as_link_and_as_command(evaluator, example):
    result = evaluator({"values": example.values})
    start = evaluator.defaults
    changed = {n: float(v) for n, v in example.values.items() if v != start[n]} or {"law": 1.0}
    program, command, *options = result["command"].split()
    assert [program, command, *options[::2]] == ["golf-impact", "run", *["--set"] * len(changed)]
    for pairs in (result["query"].split("&"), options[1::2]):
        given = dict(pair.split("=") for pair in pairs)
        assert {name: float(text) for name, text in given.items()} == changed
    assert result["hint"] == example.hint


def test_bokeh_is_pinned():
    """To the minor version of which page.js replaces methods."""
    project = (ROOT / "pyproject.toml").read_text("utf-8")
    assert re.findall(r'"bokeh([<>=][^"]*)"', project) == [">=3.9,<3.10"] * 2


def test_the_page_opens_without_an_fmu():
    program = """
import sys
sys.modules.update(dict.fromkeys(["fmpy", "pythonfmu", "pythonfmu3"]))
from golf_impact.explore import cases, page, server
print("index.html" in page.page_files(cases.make_evaluator()))
"""
    assert run_python(program).stdout == "True\n"


def test_the_check_notices_another_number(evaluator, fmu_path):
    expected = metrics_by_fmus(fmu_path, evaluator.facts)
    evaluator.facts["expected"] = expected
    check = evaluator.check()
    assert check["count"] == sum(map(len, expected)) > 200
    assert check["worst"] == 0.0
    expected[3]["max_force"] *= 1.0 + 1e-9
    assert evaluator.check()["worst"] == pytest.approx(1e-9, rel=1e-3)


#: What Python's own server ends with a traceback.
BAD = [(413, {"Content-Length": "9" * 5000}), (404, {"method": "GET", "path": "/%00"})]


def send(address, method="POST", path="/impact", body=b"{}", **headers):
    """Status and body of one request."""
    with closing(http.client.HTTPConnection(urlsplit(address).netloc, timeout=60)) as connection:
        connection.request(method, path, body if method == "POST" else None, headers)
        response = connection.getresponse()
        return response.status, response.read()


REQUESTS = [
    *((403, {"Host": host}) for host in ("evil.example", "127.0.0.1.evil.example", "a@evil", "")),
    *((403, {"Origin": origin}) for origin in ("http://evil.example", "null")),
    (403, {"Host": "evil.example", "method": "GET", "path": "/"}),
    (200, {"Host": "localhost:5006", "Origin": "http://localhost:5006"}),
    (200, {"Host": "[::1]:5006", "method": "GET", "path": "/"}),
    *((400, {"body": body}) for body in (b"{", b"[1]", b'{"values": 7}', b'{"unit": "knots"}')),
    (400, {"body": b'{"values": {"k": {"text": "1"}}}'}),
    (413, {"body": b" " * 70000}),
    *BAD,
    (404, {"path": "/elsewhere"}),
    (404, {"method": "GET", "path": "/../pyproject.toml"}),
]


@pytest.mark.parametrize(("status", "request_"), REQUESTS)
def test_only_this_page_of_this_machine_is_served(local, evaluator, status, request_):
    assert send(local, **request_)[0] == status
    # As before.
    proper = {"values": {"k": 8e5, "law": 2}, "unit": "km/h"}
    reply = json.dumps(evaluator(proper)).encode()
    assert send(local, body=json.dumps(proper)) == (200, reply)


def test_refused_commands(monkeypatch, tmp_path):
    def explore(*arguments):
        return golf_here("explore", "--no-browser", *arguments)

    refused(explore("--set", "k=-1"), "k = -1.0 N/m is refused")
    refused(explore("--set", "nothing=1"), "nothing")
    refused(explore("--ball", "x"), "there is no ball 'x'")
    refused(explore("--port", 70000), "--port")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        refused(explore("--port", port), f"port {port} can't be used")
    page, empty, file = tmp_path / "page", tmp_path / "empty", tmp_path / "file"
    empty.mkdir()
    file.touch()
    refused(explore("--export", page, "--pyodide", empty), "has no pyodide.mjs that can be read")
    refused(explore("--export", page, "--set", "k=1"), "takes no --ball or --set")
    refused(explore("--pyodide", empty), "--export FOLDER")
    refused(explore("--export", file), f"can't write {file}")
    monkeypatch.setenv("PATH", str(empty))
    refused(explore("--export", page), "npm isn't there: install npm, or")
    assert not page.exists()
    monkeypatch.setitem(sys.modules, "bokeh", None)
    refused(explore(), '".[explore]"')


def test_another_pyodide_than_expected_is_refused(monkeypatch, tmp_path):
    npm = tmp_path / "npm"
    npm.write_text('#!/bin/sh\necho changed > "$5/pyodide.tgz"\n')
    npm.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    with pytest.raises(UserError, match="another checksum"):
        exporting.from_npm()


def test_the_server_stays_small_and_quiet_until_ctrl_c(tmp_path):
    options = ("--no-browser",) if sys.platform != "linux" else ()
    env = {"TMPDIR": str(tmp_path), "DISPLAY": "", "WAYLAND_DISPLAY": ""}
    with serving("--ball", "penner", options=options, env=env) as (process, address):
        assert re.match("http://127.0.0.1:.*restitution_at_rest=0.86", address)
        sizes = []
        for tabs in (10, 100):
            for _ in range(tabs):
                for method, path in (("GET", "/"), ("GET", "/bokeh.min.js"), ("POST", "/impact")):
                    assert send(address, method, path)[0] == 200
            sizes.append((resident_bytes(process.pid) or 0) / 1e6)
        # Measured: 0.02.
        assert sizes[1] - sizes[0] < 2.0
        for status, request in (*BAD, (200, {"body": b'{"over": "x"}'})):
            assert send(address, **request)[0] == status
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
        assert process.returncode == 130
        assert options or "No browser can be opened here" in errors
        assert not re.search("Traceback|Exception", errors)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.ci  # pyodide comes from npm
def test_an_exported_page_asks_for_nothing_elsewhere(exported):
    sizes = [file.stat().st_size for file in exported.rglob("*") if file.is_file()]
    assert sum(sizes) < 16e6
    for name in ("index.html", "worksheet.html", "page.js", "page.css", "worker.js"):
        text = (exported / name).read_text("utf-8")
        assert not re.search(r"""(src|href)="/|(fetch|import|url)\(["']?(/|http)""", text)
    names = [file.name for file in exported.rglob("*")]
    # Jekyll, of GitHub Pages, leaves out those that begin with a dot or an underscore.
    assert not [name for name in names if name[0] in "._#" or ".tmp" in name]


@pytest.mark.parametrize("values", [{"law": 2}, {"law": 2, "club_force": 2000.0}, {"law": 1}])
def test_the_energy_lost(evaluator, values):
    """Beside its picture: that of the path's end, with the work of a force on the head."""
    reply = evaluator({"values": values})
    (lost,) = map(float, re.findall(r"(\S+) J", reply["area"]))
    assert lost == pytest.approx(reply["path"]["lost_energy"][-1], abs=0.006)


_IN_NODE = """
import {loadPyodide} from "./pyodide/pyodide.mjs"
import {readFileSync} from "node:fs"
const python = await loadPyodide()
python.unpackArchive(new Uint8Array(readFileSync("physics.zip")), "zip")
const evaluate = python.pyimport("golf_impact.explore.evaluator").make_evaluator()
const metrics = (request) => JSON.parse(evaluate(JSON.stringify(request))).metrics
console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf-8")).map(metrics)))
"""


@pytest.mark.ci
def test_the_evaluator_in_webassembly(exported, evaluator):
    """In node's Pyodide, where libm differs in last bits, against the one here."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node isn't installed here")
    laws = [{}, {"law": 2}, {"law": 2, "exponent": 1.6}]
    values = {"k": (1e2, 1e6, 1e10), "b": (0.0, 9.0, 90.0), "club_speed": (1e-3, 35.0, 1e3)}
    cases = itertools.product(laws, *values.values())
    requests = [{"values": law | dict(zip(values, case))} for law, *case in cases]
    command = [node, "--input-type=module", "-e", _IN_NODE]
    replies = json.loads(run(*command, input=json.dumps(requests), cwd=exported).stdout)
    for request, there in zip(requests, replies, strict=True):
        for name, value in evaluator(request)["metrics"].items():
            # The worst seen is 1.9e-15.
            assert there[name] == pytest.approx(value, rel=1e-13, abs=1e-300), (request, name)
