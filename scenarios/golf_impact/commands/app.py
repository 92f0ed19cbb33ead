"""The command `golf-impact`. Commands import heavy modules when they run."""

import contextlib
import io
import os
import sys
from collections.abc import Callable
from typing import Annotated, NoReturn

import typer

from golf_build import VERSION
from golf_impact import stopping
from golf_impact.commands import bench, build, calibrate, doctor, explore, run, stress, sweep
from golf_impact.commands import list as list_
from golf_impact.commands.console import warn
from golf_impact.errors import UserError

app = typer.Typer(
    help="Impact of a golf club on a ball: build the co-simulation FMU, run and check scenarios.",
    epilog="Example: golf-impact run baseline elastic --out results",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # its help cuts the names of options short at 80 columns
)


def _version(asked: bool) -> None:
    if asked:
        print(f"golf-impact {VERSION}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


def _add(command: Callable[..., object], examples: str, name: str | None = None) -> None:
    """Add a command; its examples stand in lines of their own below its options."""
    first, _, lines = examples.partition(": ")
    # Paragraphs after \b are not wrapped.
    app.command(name, epilog="\n  ".join(("\b", f"{first}:", *lines.split(" · "))))(command)


_add(build.build, build.EPILOG)
_add(doctor.doctor, doctor.EPILOG)
_add(list_.list_, list_.EPILOG, "list")
_add(run.run, run.EPILOG)
_add(explore.explore, explore.EPILOG)
_add(bench.bench, bench.EPILOG)
_add(stress.stress, stress.EPILOG)
_add(calibrate.calibrate, calibrate.EPILOG)
_add(sweep.sweep, sweep.EPILOG)


def _refuse_empty(arguments: list[str]) -> None:
    """Raises a UserError for arguments as of an unset variable of the shell."""
    for text in arguments:
        if not text or (text.startswith("--") and text.endswith("=")):
            raise UserError(
                f"an argument is empty ({text or 'two quotes with nothing in between'}): "
                "write a value, or leave the option out; is a variable of your shell unset?"
            )


def one_line(arguments: list[str]) -> int:
    """Run a command; errors that a user can correct become one line on stderr, exit code 2."""
    stopping.listen()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        _refuse_empty(arguments)
        with stopping.scratch_folder():
            code = _code_of(arguments)
        if sys.stdout is not None:
            # The latest point at which a full disk is noticed.
            sys.stdout.flush()
        return code
    except (UserError, OSError, MemoryError) as error:
        words = str(error)
        if isinstance(error, MemoryError):
            words = f"there isn't enough memory ({error or 'none is left'})"
        elif isinstance(error, OSError) and error.strerror:
            words = f"{error.strerror}: {error.filename}" if error.filename else error.strerror
        warn(f"Error: {' '.join(words.split())}", style="red")
        return 2


def _code_of(arguments: list[str]) -> int:
    try:
        code = app(arguments or ["--help"], standalone_mode=False)
    except Exception as error:
        # Errors of the parser, in click or in typer's copy of it.
        words = getattr(error, "format_message", None)
        if words is None:
            raise
        context = getattr(error, "ctx", None)
        where = f" (see {context.command_path} --help)" if context else ""
        raise UserError(f"{words().rstrip('.')}{where}") from None
    return code if isinstance(code, int) else 0


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the command (by default that of the command line) and end the process.

    It ends here, without the interpreter's shutdown: pythonfmu's library, in an FMU that pythonfmu
    has packaged unchanged, accesses freed memory then and aborts once in some hundred times (see
    host.at_exit in fmu_src).
    """
    code = one_line(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code)
