"""The page on this machine: a plain HTTP server on the loopback address, with the physics in it."""

import json
import os
import threading
from collections.abc import Callable, Mapping
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import urlsplit

from golf_impact.errors import UserError
from golf_impact.explore.cases import make_evaluator, metrics_by_fmus
from golf_impact.explore.evaluator import Evaluator
from golf_impact.explore.page import page_files

HOST = "127.0.0.1"

#: Names of this machine in `Host` and `Origin`. Under any other name a foreign page could
#: read results of this machine (DNS rebinding).
NAMES = {"127.0.0.1", "localhost", "::1"}

#: Bytes of a request: one has some hundred.
_LARGEST = 65536


def serve(port: int, values: Mapping[str, float], ready: Callable[[str], None]) -> None:
    """Serve the page until the process is stopped.

    Args:
        port: 0 for any that is free.
        values: inputs and parameters of the case to begin with; none for that of the page.
        ready: called with the page's address when it can be opened.

    Raises:
        UserError: a value is refused, or the port can't be used.
    """
    evaluator = make_evaluator()
    case = evaluator({"values": values})
    if "refused" in case:
        raise UserError(case["refused"])
    with TemporaryDirectory(prefix="golf-impact-") as page:
        for name, data in page_files(evaluator).items():
            Path(page, name).write_bytes(data)
        handler = partial(_Handler, evaluator, directory=page)
        try:
            server = _Server((HOST, port), handler)
        except OSError as error:
            raise UserError(
                f"port {port} can't be used ({error.strerror}): choose another with --port, or "
                "--port 0 for any that is free"
            ) from error
        with server:
            query = f"?{case['query']}" if values else ""
            ready(f"http://{HOST}:{server.server_port}/{query}")
            server.serve_forever()


class _Server(ThreadingHTTPServer):
    #: On Windows it would let two processes have one port.
    allow_reuse_address = os.name == "posix"


class _Handler(SimpleHTTPRequestHandler):
    #: s that a connection may be silent: browsers open some in advance.
    timeout = 30
    #: The instances take one request at a time.
    _lock = threading.Lock()

    def __init__(self, evaluator: Evaluator, *args: Any, **options: Any) -> None:
        self._evaluator = evaluator
        super().__init__(*args, **options)

    def send_head(self) -> Any:
        """Of GET and HEAD."""
        try:
            return super().send_head() if self._is_local() else None
        except ValueError:  # a path with a null character
            return self.send_error(404)

    def do_POST(self) -> None:
        length = self.headers.get("Content-Length", "")
        # Python converts 4300 digits at most.
        if not length.isdecimal() or len(length) > 9 or int(length) > _LARGEST:
            self.send_error(413)
            return
        # Read in any case: a connection that is closed before is reset, and the reply with it.
        body = self.rfile.read(int(length))
        if not self._is_local():
            return
        if self.path != "/impact":
            self.send_error(404)
            return
        try:
            request = json.loads(body)
            with self._lock:
                if "check" in request:
                    self._expect_fmu_metrics()
                reply = json.dumps(self._evaluator(request)).encode()
        except UserError as error:
            self.send_error(500, explain=str(error))
            return
        except (ValueError, TypeError, AttributeError, KeyError, RecursionError):
            self.send_error(400, "The body must be JSON: {values: {name: number}}")
            return
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(reply)))
        self.end_headers()
        self.wfile.write(reply)

    def _expect_fmu_metrics(self) -> None:
        """Give the evaluator the FMUs' numbers, which it lacks until a check is requested."""
        from golf_impact.fmu import current_fmu

        facts = self._evaluator.facts
        if "expected" not in facts:
            expected = metrics_by_fmus(current_fmu(), facts)
            self._evaluator.facts = {**facts, "expected": expected}

    def _is_local(self) -> bool:
        """Whether a request is for this machine and of its own page; if not, it is refused."""
        addresses = f"//{self.headers.get('Host', '')}", self.headers.get("Origin", f"//{HOST}")
        try:
            if local := {urlsplit(address).hostname for address in addresses} <= NAMES:
                return local
        except ValueError:
            pass  # no address
        self.send_error(403, "Only pages of this machine are served")
        return False

    def end_headers(self) -> None:
        """Nothing is cached: the next version has the same address."""
        self.send_header("Cache-Control", "no-store")
        super().end_headers()

    def log_message(self, *args: Any) -> None:
        """Nothing is logged."""
