"""The READMEs: links, lengths, and the tables made from the code.

`python tests/test_readmes.py` writes these tables anew.
"""

import ast
import re

import pytest
from command import ROOT
from golf_physics.variables import VARIABLES

from golf_impact.document import tables as document_tables

FOLDERS = ("", "fmu_src", "fmu_src/golf_physics/companions", "build", "scenarios", "tests")


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
    for n, (title, columns, cells) in enumerate(document_tables()):
        rows = [[*row[:-1], f"`{row[-1]}`"] if n == 0 else row for row in cells]
        parts.append(f"{title}:\n\n{markdown(columns, rows)}")
    return "\n\n".join(parts)


README = ROOT / "fmu_src" / "README.md"

#: By the name in the comment before a table in it.
TABLES = {"variables": variables, "document": document}


def updated(text):
    """The README with these tables as they are now."""
    pattern = r"(<!-- (\w+):[^>]*-->\n).*?(<!-- end -->)"
    text, number = re.subn(
        pattern, lambda found: f"{found[1]}{TABLES[found[2]]()}\n{found[3]}", text, flags=re.DOTALL
    )
    assert number == len(TABLES)
    return text


def test_tables_are_those_of_the_code():
    text = README.read_text("utf-8")
    assert updated(text) == text, "run `python tests/test_readmes.py`"


def test_what_is_implemented_where_exists():
    for row in document_tables()[0][2]:
        path, _, symbol = row[-1].partition(": ")
        tree = ast.parse((ROOT / path).read_text("utf-8"))
        for name in symbol.split("."):
            names = {getattr(node, "name", None): node for node in tree.body}
            assert name in names, row
            tree = names[name]


def test_the_first_page_is_one_page():
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= 80


def anchors(file):
    """The anchors of a file's headings, as GitHub makes them."""
    headings = re.findall(r"(?m)^#+ (.*)$", file.read_text("utf-8"))
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("folder", FOLDERS)
def test_links_lead_somewhere(folder):
    readme = ROOT / folder / "README.md"
    for target in re.findall(r"\]\(([^)]+)\)", readme.read_text("utf-8")):
        if not target.startswith(("http://", "https://")):
            path, _, anchor = target.partition("#")
            file = readme.parent / path if path else readme
            assert file.exists(), target
            assert not anchor or anchor in anchors(file), target


if __name__ == "__main__":
    README.write_text(updated(README.read_text("utf-8")), "utf-8")
