"""Bokeh's server with the page: on this machine's loopback address alone, with its own files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from bokeh.application import Application
from bokeh.application.handlers import FunctionHandler
from bokeh.document import Document
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.util import bind_sockets
from bokeh.settings import settings
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop

from golf_impact.errors import UserError
from golf_impact.explore.page import show
from golf_impact.fmu.impact_fmu import ImpactFmu

HOST = "127.0.0.1"

#: ms after which a session whose tab is closed, or was reloaded, is freed with its FMU instance.
_UNUSED, _LOOK = 5_000, 1_000


def serve(path: Path, port: int, ready: Callable[[str], None]) -> None:
    """Serve the page until the process is stopped.

    Args:
        path: the .fmu file.
        port: 0 for any that is free.
        ready: called with the page's address when it can be opened.

    Raises:
        UserError: the port can't be had.
    """
    # Scripts and styles come from this server, whatever the environment says.
    settings.resources.set_value("server")

    def open_session(document: Document) -> None:
        fmu = ImpactFmu(path).__enter__()
        document.on_session_destroyed(lambda context: fmu.__exit__(None, None, None))
        assert document.session_context is not None
        show(document, fmu, document.session_context.request.arguments)

    try:
        sockets, port = bind_sockets(HOST, port)
    except (OSError, OverflowError) as error:
        raise UserError(
            f"port {port} can't be had ({getattr(error, 'strerror', None) or error}): choose "
            "another with --port, or --port 0 for any that is free"
        ) from error
    application = BokehTornado(
        {"/": Application(FunctionHandler(open_session))},
        extra_websocket_origins=[f"{HOST}:{port}"],
        check_unused_sessions_milliseconds=_LOOK,
        unused_session_lifetime_milliseconds=_UNUSED,
    )
    http = HTTPServer(application)
    http.add_sockets(sockets)
    server = BaseServer(IOLoop.current(), application, http)
    server.start()
    ready(f"http://{HOST}:{port}/")
    server.io_loop.start()
