"""The tables in the READMEs that are made from the code.

`python tests/tools/readmes.py` writes them anew; test_documents.py compares them.
"""

import re
from pathlib import Path

from golf_physics.variables import VARIABLES

from golf_impact.data.document import tables

README = Path(__file__).resolve().parents[2] / "fmu_src" / "README.md"


def markdown(columns, rows):
    """A table as Markdown."""
    lines = ["| " + " | ".join(cells) + " |" for cells in (columns, *rows)]
    return "\n".join((lines[0], "|" + "---|" * len(columns), *lines[1:]))


def variables():
    """The table of variables as Markdown."""
    rows = []
    for v in VARIABLES:
        start = "" if v.start is None else f"{v.start:g}"
        allowed = "" if v.causality == "output" else v.allowed
        unit = "" if v.unit in ("", "1") else v.unit.replace(".", "·")
        kind = "Boolean" if v.type == "Boolean" else unit
        rows.append([f"`{v.name}`", v.causality, kind, start, allowed, v.description])
    return markdown(("name", "causality", "unit", "start", "allowed", "meaning"), rows)


def document():
    """What the document says and how it is read, as Markdown."""
    parts = []
    for n, (title, columns, cells) in enumerate(tables()):
        rows = [[*row[:-1], f"`{row[-1]}`"] if n == 0 else row for row in cells]
        parts.append(f"{title}:\n\n{markdown(columns, rows)}")
    return "\n\n".join(parts)


#: By the name in the comment before a table in the README.
TABLES = {"variables": variables, "document": document}


def updated(text):
    """The README with these tables as they are now."""
    text, number = re.subn(
        r"(<!-- (\w+):[^>]*-->\n).*?(<!-- end -->)",
        lambda found: f"{found[1]}{TABLES[found[2]]()}\n{found[3]}",
        text,
        flags=re.DOTALL,
    )
    assert number == len(TABLES)
    return text


if __name__ == "__main__":
    README.write_text(updated(README.read_text("utf-8")), "utf-8")
