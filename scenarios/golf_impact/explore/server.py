"""The page on this machine: a plain HTTP server on the loopback address, numbers by the FMU."""

import json
import threading
from collections.abc import Callable, Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from mimetypes import guess_type
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from golf_impact.errors import UserError
from golf_impact.explore.cases import companions, facts_of
from golf_impact.explore.evaluator import Evaluator
from golf_impact.explore.page import page_files
from golf_impact.fmu.impact_fmu import ImpactFmu

HOST = "127.0.0.1"

#: Names of this machine in `Host` and `Origin`. Under any other name a page of somebody else's
#: would be served what is meant for this machine alone (DNS rebinding).
NAMES = ("127.0.0.1", "localhost", "::1")

#: Bytes of a request: one has some hundred.
_LARGEST = 65536


def serve(path: Path, port: int, ready: Callable[[str], None]) -> None:
    """Serve the page until the process is stopped.

    Args:
        path: the .fmu file.
        port: 0 for any that is free.
        ready: called with the page's address when it can be opened.

    Raises:
        UserError: the port can't be had.
    """
    with ImpactFmu(path) as fmu, companions(fmu) as (fmus, _):
        evaluator, lock = Evaluator(fmus, UserError, facts_of(fmus)), threading.Lock()

        def answer(request: Mapping[str, Any]) -> dict[str, Any]:
            with lock:
                return evaluator(request)

        files = page_files(evaluator)
        handler = type("Handler", (_Handler,), {"files": files, "answer": staticmethod(answer)})
        try:
            server = ThreadingHTTPServer((HOST, port), handler)
        except (OSError, OverflowError) as error:
            raise UserError(
                f"port {port} can't be had ({getattr(error, 'strerror', None) or error}): choose "
                "another with --port, or --port 0 for any that is free"
            ) from error
        with server:
            ready(f"http://{HOST}:{server.server_port}/")
            server.serve_forever()


class _Handler(BaseHTTPRequestHandler):
    files: Mapping[str, bytes]
    answer: Callable[[Mapping[str, Any]], dict[str, Any]]
    #: s that a connection may be silent: browsers open some in advance.
    timeout = 30

    def do_GET(self) -> None:
        name = urlsplit(self.path).path.removeprefix("/") or "index.html"
        if self._is_local():
            if name in self.files:
                self._send(self.files[name], guess_type(name)[0] or "application/octet-stream")
            else:
                self.send_error(404)

    do_HEAD = do_GET

    def do_POST(self) -> None:
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > _LARGEST:
            self.send_error(413)
            return
        # Read in any case: a connection that is closed before is reset, and the reply with it.
        body = self.rfile.read(int(length))
        if not self._is_local():
            return
        if urlsplit(self.path).path != "/impact":
            self.send_error(404)
        else:
            try:
                answer = self.answer(json.loads(body))
            except (ValueError, TypeError, AttributeError, KeyError, RecursionError):
                self.send_error(400, "The body must be JSON: {values: {name: number}}")
            else:
                self._send(json.dumps(answer).encode(), "application/json")

    def _is_local(self) -> bool:
        """Whether a request is for this machine and of its own page; if not, it is refused."""
        given = [f"//{self.headers.get('Host', '')}"]
        given += [self.headers["Origin"]] if "Origin" in self.headers else []
        if local := all(_hostname(one) in NAMES for one in given):
            return local
        self.send_error(403, "Only pages of this machine are served")
        return False

    def _send(self, body: bytes, kind: str) -> None:
        self.send_response(200)
        self.send_header("Content-Type", kind + ("; charset=utf-8" if "text" in kind else ""))
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def log_message(self, *args: Any) -> None:
        """Nothing is logged."""


def _hostname(address: str) -> str | None:
    try:
        return urlsplit(address).hostname
    except ValueError:
        return None
