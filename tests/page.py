"""The page of `golf-impact explore` for tests: its evaluator, served on this machine, exported."""

import contextlib
import functools
import http.server
import os
import threading

import pytest
from command import golf_started

from golf_impact.errors import UserError
from golf_impact.explore.cases import make_evaluator


@pytest.fixture
def evaluator():
    return make_evaluator()


@contextlib.contextmanager
def serving(*arguments, options=("--no-browser",), env=None):
    """The command in a process of its own, and the page's address."""
    arguments = ("explore", *options, "--port", 0, *arguments)
    process = golf_started(*arguments, env={**os.environ, **(env or {})})
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.communicate()


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *args):
        pass


@contextlib.contextmanager
def web_server(folder):
    """The address of an exported page, in a sub-path of a server."""
    handler = functools.partial(_Quiet, directory=folder.parent)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/{folder.name}/"
        server.shutdown()


@pytest.fixture(scope="module")
def local():
    with serving() as (_, address):
        yield address


@pytest.fixture(scope="module")
def exported(once):
    """The folder of an exported page."""
    # With Bokeh, which the other tests don't need.
    from golf_impact.explore import export as exporting

    folder = once("ClubBallImpact.fmu").parent / "page"
    try:
        exporting.export(once("ClubBallImpact.fmu"), folder)
    except UserError as error:
        # Where npm is missing or its registry can't be reached; another checksum is no reason.
        if "npm isn't there" in str(error) or "can't get" in str(error):
            pytest.skip(str(error))
        raise
    return folder
