"""The table of variables in the README of the model.

test_transcripts.py compares it; with --update it writes it anew.
"""

import re
from pathlib import Path

from golf_physics.variables import VARIABLES

README = Path(__file__).resolve().parents[2] / "fmu_src" / "README.md"


def variables():
    """The table of variables as Markdown."""
    rows = [("name", "causality", "unit", "start", "allowed", "meaning"), ("---",) * 6]
    for v in VARIABLES:
        start = "" if v.start is None else f"{v.start:g}"
        allowed = "" if v.causality == "output" else v.allowed
        unit = "" if v.unit in ("", "1") else v.unit.replace(".", "·")
        kind = "Boolean" if v.type == "Boolean" else unit
        rows.append((f"`{v.name}`", v.causality, kind, start, allowed, v.description))
    return "\n".join(f"| {' | '.join(cells)} |" for cells in rows)


def updated(text):
    """The README with the table of variables as it is now."""
    start, end = "(<!-- variables:[^>]*-->\n)", "(<!-- end -->)"
    text, number = re.subn(
        f"{start}.*?{end}",
        lambda found: f"{found[1]}{variables()}\n{found[2]}",
        text,
        flags=re.DOTALL,
    )
    assert number == 1
    return text
