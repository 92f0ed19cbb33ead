"""What commands say, and what their options have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

if TYPE_CHECKING:
    from rich.table import Table as RichTable

    from golf_impact.report.outcome import Table

#: Where results go unless --out says otherwise.
RESULTS = Path("golf-impact-results")

# What users typed is shown as they typed it.
out = Console(markup=False, emoji=False)
err = Console(stderr=True, markup=False, emoji=False)


def say(words: object, style: str | None = None) -> None:
    """A line, however long."""
    out.print(str(words), style=style, soft_wrap=True, highlight=False)


def warn(words: object, style: str | None = None) -> None:
    """A line on stderr, however long."""
    err.print(str(words), style=style, soft_wrap=True, highlight=False)


def paragraphs(words: Iterable[str]) -> None:
    """Sentences as they were written, wrapped."""
    for one in words:
        out.print(one, highlight=False)


def print_table(table: Table, numbers: bool = True) -> None:
    """A table of the report; its columns but the first to the right if they hold numbers."""
    rich = rich_table(table.title, *table.columns, numbers=numbers)
    for row in table.rows:
        rich.add_row(*row)
    out.print(rich)


def rich_table(title: str, *columns: str, numbers: bool = True) -> RichTable:
    """An empty table for the terminal."""
    from rich.table import Table as RichTable

    rich = RichTable(title=title, title_justify="left", title_style="bold")
    for n, column in enumerate(columns):
        rich.add_column(column, justify="right" if n and numbers else "left", overflow="fold")
    return rich


@contextmanager
def progress() -> Iterator[Callable[[str, int], Callable[..., None]]]:
    """Bars on stderr: begun with a name and a total.

    Each gives what moves it on: by one, or to the number that it is given.
    """
    from rich.progress import MofNCompleteColumn, Progress

    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bars:

        def bar(name: str, total: int) -> Callable[..., None]:
            task = bars.add_task(name, total=total)

            def move(done: int | None = None) -> None:
                bars.update(task, completed=done, advance=1 if done is None else None)

            return move

        yield bar
