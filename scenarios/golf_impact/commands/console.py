"""Output of the commands: lines, tables and progress bars."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.table import Table

#: The default folder of results.
RESULTS = Path("golf-impact-results")

# Without markup: text from the user is printed verbatim.
out = Console(markup=False, emoji=False)
err = Console(stderr=True, markup=False, emoji=False)


def say(words: object, style: str | None = None, console: Console = out) -> None:
    """Print a line, without wrapping."""
    console.print(str(words), style=style, soft_wrap=True, highlight=False)


def warn(words: object, style: str | None = None) -> None:
    """Print a line on stderr, without wrapping."""
    say(words, style, err)


def print_table(
    title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], texts: int = 1
) -> None:
    """Print a table; numbers, in all columns after the first `texts`, are aligned to the right."""
    table = Table(title=title or None, title_justify="left", title_style="bold")
    for n, column in enumerate(columns):
        table.add_column(column, justify="right" if n >= texts else "left", overflow="fold")
    for row in rows:
        table.add_row(*row)
    out.print(table)


def print_list(rows: Iterable[tuple[str, str]]) -> None:
    """Print names, each with a text beside it."""
    table = Table.grid(padding=(0, 2))
    for row in rows:
        table.add_row(*row)
    out.print(table, highlight=False)


@contextmanager
def progress(name: str, total: int) -> Iterator[Callable[..., None]]:
    """A progress bar on stderr, if that is a terminal; yields a function that moves it to a number.

    Its second argument, if there is one, is a new name.
    """
    from rich.progress import MofNCompleteColumn, Progress

    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bars:
        task = bars.add_task(name, total=total)
        yield lambda to, name=None: bars.update(task, completed=to, description=name)
