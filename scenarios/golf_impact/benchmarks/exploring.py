"""What a step of a slider costs the server of `golf-impact explore`, and what a tab does.

A step is timed as a session has it: from the new value to Bokeh's models and the message that goes
to the browser, in processor time, which other work of the machine doesn't change. Tabs are real
ones to the server: sessions with a websocket each.
"""

import subprocess
import sys
from statistics import median
from time import process_time
from typing import Any

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

TABS = 20


def slider_steps(quick: bool) -> dict[str, dict[str, Any]]:
    """Medians of many steps of the slider of k, or of fewer if `quick`.

    Returns:
        By case, ms: the whole step, the FMU's part of it, S and COR over a variable (`sweep`); and
        whether the slider moves as smoothly as it should (`passed`).
    """
    from bokeh.document import Document
    from bokeh.protocol import Protocol

    from golf_impact.explore.impact import explored
    from golf_impact.explore.page import Page

    rows: dict[str, dict[str, Any]] = {}
    with ImpactFmu(current_fmu()[0]) as fmu:
        document, protocol = Document(), Protocol()
        page = Page(document, fmu, {})
        events: list = []
        document.on_change(events.append)

        def step() -> None:
            page.update()
            protocol.create("PATCH-DOC", events)

        works = {"fmu": lambda: explored(fmu, page.wish), "step": step, "sweep": page.sweep}
        for case, values in CASES.items():
            times: dict[str, list[float]] = {name: [] for name in works}
            for n in range(20 if quick else 100):
                page.wish = {**page.defaults, **values, "k": 1e6 + 1e3 * n}
                for name, work in works.items():
                    events.clear()
                    begin = process_time()
                    work()
                    times[name].append(1e3 * (process_time() - begin))
            medians = {name: median(times[name]) for name in ("step", "fmu", "sweep")}
            rows[case] = {"case": case, **medians}
            rows[case]["passed"] = rows[case]["step"] <= LIMIT
    return rows


def memory_of_tabs() -> dict[str, float]:
    """Open tabs one after the other, and look at the server's memory, MB.

    Raises:
        UserError: the server didn't start.
    """
    from bokeh.client import pull_session

    command = "from golf_impact.__main__ import main; main()"
    arguments = [sys.executable, "-c", command, "explore", "--no-browser", "--port", "0"]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            address = server.stdout.readline().strip()
            if not address:
                raise UserError("the server of golf-impact explore didn't start")
            sessions, memory = [], [_megabytes(server.pid)]
            for _ in range(TABS):
                sessions.append(pull_session(url=address))
                memory.append(_megabytes(server.pid))
            for session in sessions:
                session.close()
        finally:
            server.terminate()
    return {
        "tabs": TABS,
        "server_mb": memory[0],
        "first_tab_mb": memory[1] - memory[0],
        "each_further_tab_mb": (memory[-1] - memory[1]) / (TABS - 1),
        "all_mb": memory[-1],
    }


def _megabytes(process: int) -> float:
    size = resident_bytes(process)
    return float("nan") if size is None else size / 1e6
