"""The command `golf-impact`. Heavy modules are imported by the commands that need them."""

import contextlib
import io
import os
import sys
from typing import Annotated, NoReturn

import typer

from golf_build import VERSION
from golf_impact import stopping
from golf_impact.commands import bench, build, calibrate, doctor, explore, run, stress, sweep
from golf_impact.commands import list as list_
from golf_impact.commands.console import warn
from golf_impact.errors import UserError

app = typer.Typer(
    help="A golf club hits a ball: build the co-simulation FMU, run and check its scenarios.",
    epilog="Example: golf-impact run baseline elastic --out results",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
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


app.command(epilog=build.EPILOG)(build.build)
app.command(epilog=doctor.EPILOG)(doctor.doctor)
app.command("list", epilog=list_.EPILOG)(list_.list_)
app.command(epilog=run.EPILOG)(run.run)
app.command(epilog=explore.EPILOG)(explore.explore)
app.command(epilog=bench.EPILOG)(bench.bench)
app.command(epilog=stress.EPILOG)(stress.stress)
app.command(epilog=calibrate.EPILOG)(calibrate.calibrate)
app.command(epilog=sweep.EPILOG)(sweep.sweep)


def _refuse_empty(arguments: list[str]) -> None:
    for text in arguments:
        option, equals, value = text.partition("=")
        if not text or (equals and not value and option.startswith("--")):
            raise UserError(
                f"an argument is empty ({option or 'two quotes with nothing in between'}): "
                "write a value, or leave the option out; is a variable of your shell unset?"
            )


def one_line(arguments: list[str]) -> int:
    """Run a command; whatever a user can mend becomes one line on stderr and exit code 2."""
    stopping.listen()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        _refuse_empty(arguments)
        with stopping.scratch_folder():
            code = _code_of(arguments)
        if sys.stdout is not None:
            # A full disk shows here, if not before.
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
        code = app(arguments, standalone_mode=False)
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 1
    except Exception as error:
        # The parser's own errors, from click or from typer's copy of it.
        words = getattr(error, "format_message", None)
        if words is None:
            raise
        if type(error).__name__ == "NoArgsIsHelpError":
            error.show()  # type: ignore[attr-defined]
            return 2
        context = getattr(error, "ctx", None)
        where = f" (see {context.command_path} --help)" if context else ""
        raise UserError(f"{words().rstrip('.')}{where}") from None
    if code == 130:
        warn("Stopped; nothing half-written is left.", style="red")
    return code if isinstance(code, int) else 0


def main(arguments: list[str] | None = None) -> NoReturn:
    """The console script, with the arguments of the command line or these.

    It ends the process here: nothing is open any more. Some commands load FMUs that are packaged
    as pythonfmu does it, whose library touches freed memory at the end of a process (see
    host.at_exit in fmu_src): once in some hundred times it aborted.
    """
    code = one_line(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code)
