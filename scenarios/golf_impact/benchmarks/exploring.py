"""What a slider's step costs the server of `golf-impact explore`, and what tabs leave behind.

A step is timed from the request to the JSON that goes to the browser, in processor time, which
other work of the machine doesn't change.
"""

import json
import subprocess
import sys
from http.client import HTTPConnection
from statistics import median
from time import process_time
from typing import Any
from urllib.parse import urlsplit

from golf_impact.errors import UserError
from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.timing import resident_bytes

#: Values of the cases that are measured, by name; k changes at every step.
CASES = {
    "law 1": {"law": 1.0},
    "law 2": {"law": 2.0},
    "exponent 1.6": {"law": 2.0, "b": 39.0, "exponent": 1.6},
}

#: ms that a step may take.
LIMIT = 50.0

TABS = 200


def slider_steps(quick: bool) -> dict[str, dict[str, Any]]:
    """Medians of many steps of the slider of k, or of fewer if `quick`.

    Returns:
        By case, ms: the whole step; S and COR over a variable (`sweep`); and whether the slider
        moves as smoothly as it should (`passed`).
    """
    from golf_impact.explore.answers import Answers
    from golf_impact.explore.cases import facts_of

    rows: dict[str, dict[str, Any]] = {}
    with ImpactFmu(current_fmu()[0]) as fmu:
        answers = Answers(fmu, UserError, facts_of(fmu))
        for case, values in CASES.items():
            times: dict[str, list[float]] = {"step": [], "sweep": []}
            for n in range(20 if quick else 100):
                request = {"values": {**values, "k": 1e6 + 1e3 * n}}
                for name, more in (("step", {}), ("sweep", {"over": "club_speed"})):
                    begin = process_time()
                    json.dumps(answers({**request, **more}))
                    times[name].append(1e3 * (process_time() - begin))
            medians = {name: median(ms) for name, ms in times.items()}
            rows[case] = {"case": case, **medians, "passed": medians["step"] <= LIMIT}
    return rows


def memory_of_tabs() -> dict[str, float]:
    """The server's memory, MB, after one tab and after many more: each loads the page and a case.

    Raises:
        UserError: the server didn't start.
    """
    command = "from golf_impact.__main__ import main; main()"
    arguments = [sys.executable, "-c", command, "explore", "--no-browser", "--port", "0"]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            address = server.stdout.readline().strip()
            if not address:
                raise UserError("the server of golf-impact explore didn't start")
            _tab(address)
            before = _megabytes(server.pid)
            for _ in range(TABS):
                _tab(address)
            after = _megabytes(server.pid)
        finally:
            server.terminate()
    return {"tabs": TABS, "server_mb": before, "after_mb": after}


def _tab(address: str) -> None:
    body = json.dumps({"values": {"law": 2}})
    for method, path in (("GET", "/"), ("GET", "/bokeh.min.js"), ("POST", "/impact")):
        connection = HTTPConnection(urlsplit(address).netloc)
        connection.request(method, path, body if method == "POST" else None)
        connection.getresponse().read()
        connection.close()


def _megabytes(process: int) -> float:
    size = resident_bytes(process)
    return float("nan") if size is None else size / 1e6
