"""The command `golf-impact`. Commands import heavy modules when they run."""

import contextlib
import io
import os
import sys
from typing import Annotated, NoReturn

import typer

from golf_build import VERSION
from golf_impact.commands import bench, build, calibrate, doctor, explore, run, stress, sweep
from golf_impact.commands import list as list_
from golf_impact.commands.console import warn
from golf_impact.data.errors import UserError

app = typer.Typer(
    help="Impact of a golf club on a ball: build the co-simulation FMU, run and check scenarios.",
    epilog="Example: golf-impact run baseline laws --out results",
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # its help truncates names of options at 80 columns
)


def _version(show: bool) -> None:
    if show:
        print(f"golf-impact {VERSION}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


for module in (build, doctor, list_, run, explore, bench, stress, calibrate, sweep):
    name = module.__name__.rpartition(".")[2]
    # One example per line: paragraphs after \b are not wrapped.
    examples = "\b\n  " + module.EPILOG.replace(": ", ":\n  ", 1).replace(" · ", "\n  ")
    # A function can't have the name of a built-in one.
    app.command(name, epilog=examples)(vars(module).get(name, list_.list_))


def one_line(arguments: list[str]) -> int:
    """Run a command; errors that a user can correct become one line on stderr, exit code 2."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        code = app(arguments or ["--help"], prog_name="golf-impact", standalone_mode=False)
        if code == 130:
            # Typer has caught the KeyboardInterrupt.
            raise KeyboardInterrupt
        if sys.stdout is not None:
            # The last chance to notice a full disk.
            sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except KeyboardInterrupt:
        warn("Stopped; nothing half-written is left.")
        return 130
    except Exception as error:
        if isinstance(error, MemoryError):
            words = f"there isn't enough memory ({error or 'none is left'})"
        elif isinstance(error, OSError) and error.strerror:
            words = f"{error.strerror}: {error.filename}" if error.filename else error.strerror
        elif isinstance(error, (UserError, OSError)):
            words = str(error)
        elif hasattr(error, "format_message"):
            # Errors of the parser, in click or in typer's copy of it.
            words = error.format_message().rstrip(".")
            if context := getattr(error, "ctx", None):
                words += f" (see {context.command_path} --help)"
                former = calibrate.FORMER if context.info_name == "calibrate" else {}
                if (option := getattr(error, "option_name", "")) in former:
                    words = f"{option} is gone: {former[option]}"
        else:
            raise
        warn(f"Error: {' '.join(words.split())}", style="red")
        return 2


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the command (by default that of the command line) and end the process.

    Without the interpreter's shutdown: pythonfmu's library, in an FMU packaged unchanged, would
    access freed memory and abort once in some hundred times (see host.at_exit in fmu_src).
    """
    # No figure is shown; matplotlib isn't imported with a backend that it doesn't have.
    os.environ["MPLBACKEND"] = "Agg"
    code = one_line(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code)
