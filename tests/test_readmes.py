"""What the READMEs say where a program can tell: links, lengths and the table of variables."""

import re
from pathlib import Path

import pytest
from golf_physics.variables import VARIABLES

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("fmu_src", "build", "scenarios", "tests")
READMES = [
    ROOT / "README.md",
    *(file for room in ROOMS for file in (ROOT / room).rglob("README.md")),
]


def table():
    """The table of variables as Markdown."""
    rows = ["| name | causality | unit | start | allowed | meaning |", "|---|---|---|---|---|---|"]
    for v in VARIABLES:
        start = "" if v.start is None else f"{v.start:g}"
        allowed = "" if v.causality == "output" else v.allowed
        unit = "" if v.unit in ("", "1") else v.unit.replace(".", "·")
        kind = "Boolean" if v.type == "Boolean" else unit
        rows.append(
            f"| `{v.name}` | {v.causality} | {kind} | {start} | {allowed} | {v.description} |"
        )
    return "\n".join(rows)


def test_the_table_of_variables_is_that_of_the_code():
    text = (ROOT / "fmu_src" / "README.md").read_text()
    written = re.search(r"<!-- variables[^>]*-->\n(.*?)\n<!-- end -->", text, re.DOTALL)
    assert written is not None
    assert written[1] == table()


def test_the_first_page_is_one_page():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 120


@pytest.mark.parametrize("room", ROOMS)
def test_each_room_explains_itself(room):
    assert (ROOT / room / "README.md").is_file()


@pytest.mark.parametrize("path", READMES, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(path):
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", path.read_text()):
        if not target.startswith(("http://", "https://")):
            assert (path.parent / target).exists(), target
