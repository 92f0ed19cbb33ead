"""Output of the commands: lines, tables and progress bars; the option --out."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

from rich.console import Console
from typer import Option

from golf_impact.report.outcome import Table

#: The option --out of commands that write several files, and its default.
Out = Annotated[Path, Option("--out", metavar="FOLDER", help="Folder of the results.")]
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


def print_paragraphs(words: Iterable[str]) -> None:
    """Print paragraphs, wrapped at words."""
    for paragraph in words:
        out.print(paragraph, highlight=False)


def print_table(table: Table, numbers: bool = True) -> None:
    """Print a table, wrapped between words only; if too wide, in parts with the first column each.

    `numbers` aligns all columns but the first to the right.
    """
    from rich.table import Table as RichTable

    cells = [list(map(str, column)) for column in zip(table.columns, *table.rows, strict=True)]
    title = table.title or None
    for widths in _parts(cells, out.width):
        rich = RichTable(title=title, title_justify="left", title_style="bold")
        for n, width in widths.items():
            right = numbers and n
            rich.add_column(table.columns[n], justify="right" if right else "left", width=width)
        for row in table.rows:
            rich.add_row(*(row[n] for n in widths))
        out.print(rich)
        title = None


def _parts(cells: list[list[str]], width: int) -> Iterator[dict[int, int]]:
    """The widths of the columns of each part of a table, by their number, from cells by column."""
    longest = [max(len(line) for cell in column for line in cell.split("\n")) for column in cells]
    least = [max(len(word) for cell in column for word in cell.split() or [""]) for column in cells]
    others = [*range(1, len(cells))]
    while True:
        # A column is wider than its text by 3, a table than its columns by 1.
        widths, left = {0: least[0]}, width - 4 - least[0]
        while others and (left >= least[others[0]] + 3 or len(widths) == 1):
            n = others.pop(0)
            widths[n] = least[n]
            left -= least[n] + 3
        # The remaining width goes to the columns that wrap: the first one, then the narrowest.
        while left > 0 and (wrapped := [n for n in widths if widths[n] < longest[n]]):
            widths[min(wrapped, key=lambda n: (n > 0, widths[n]))] += 1
            left -= 1
        yield widths
        if not others:
            return


@contextmanager
def progress() -> Iterator[Callable[[str, int], Callable[..., None]]]:
    """Progress bars on stderr, if that is a terminal; yields a function from name and total.

    It returns one that advances the bar by one or to a number, and may rename it.
    """
    from rich.progress import MofNCompleteColumn, Progress

    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bars:

        def bar(name: str, total: int) -> Callable[..., None]:
            task = bars.add_task(name, total=total)

            def advance(to: int | None = None, name: str | None = None) -> None:
                bars.update(task, advance=1 if to is None else 0, completed=to, description=name)

            return advance

        yield bar
