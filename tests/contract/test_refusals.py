"""What is refused, and why: one table for Python, FMUs, engine, page and commands, refusals.toml.

Refused calls in any order, of all values at their limits: test_lockstep.py.
"""

import math
from contextlib import suppress

import pytest
from command import golf_here
from conftest import HERE, some
from fmpy.fmi1 import FMICallException

import golf_impact
from golf_impact.data.files import read_toml

TABLE = read_toml(HERE / "refusals.toml")
IMPACTS = [row for row in TABLE["start"] if "of" not in row]


def rest(way):
    """All outputs after further steps."""
    assert way.step(1e-4), way.messages
    assert way.step(0.4), way.messages
    return way.read()


def reached(way, row, values):
    """The way where values are refused, or are to be set."""
    way.begin(values)
    assert way.step(row["before"]) if "before" in row else True, way.messages
    return way.read()


@pytest.mark.parametrize("kind", ["start", "later"])
def test_in_every_way_of_steps(any_stepped, kind):
    """No effect, the sentence, refused until it is corrected, then as if it had never been set."""
    way = any_stepped
    for row in TABLE[kind]:
        if row.get("of", "ClubBallImpact") != way.model:
            continue
        values, later = row.get("values", {}), row.get("set", {})
        corrected = row.get("corrected") or {name: way.start[name] for name in later or values}
        reached(way, row, values if "before" in row else values | corrected)
        way.set(**corrected)
        expected = rest(way)
        before = reached(way, row, values)
        # The native FMU returns Error for a parameter.
        with suppress(FMICallException):
            way.set(**later)
        for _ in "12":
            assert not way.step(1e-4 if "gap" not in values else 1.0), row
            assert way.messages[-1].endswith(row["sentence"]), row
            assert repr(way.read()) == repr(before)
        way.set(**corrected)
        assert rest(way) == expected, row


def test_of_whole_impacts(whole_way):
    # JSON has no infinity and no NaN.
    rows = [row for row in IMPACTS if all(map(math.isfinite, row["values"].values()))]
    found = whole_way(row["values"] for row in rows)
    assert found[0], "of rows that of the first is known"
    for row, sentence in zip(rows, found, strict=True):
        # The engine names what runs other laws.
        assert not sentence or sentence.startswith(row["sentence"])


@pytest.mark.parametrize("row", some(6, {str(row["values"]): row for row in IMPACTS}))
def test_errors_and_the_command(row, tmp_path):
    """The exception has the parts; the command, one line."""
    with pytest.raises(golf_impact.UserError) as caught:
        golf_impact.run_impact(**row["values"])
    error, sentence = caught.value, row["sentence"]
    assert str(error).startswith(sentence)
    assert sentence.startswith(f"{error.variable} = ")
    assert error.value is None or f" = {error.value:.12g} " in sentence
    assert sentence.partition(": ")[2].partition(";")[0] in error.reason
    if all(map(math.isfinite, row["values"].values())):
        pairs = [f"--set={name}={value!r}" for name, value in row["values"].items()]
        done = golf_here("run", *pairs, "--no-figures", cwd=tmp_path)
        assert done.returncode == 2
        *_, line = done.stderr.splitlines()
        assert line.startswith("Error: ")
        assert line.endswith(sentence)
        assert list(tmp_path.iterdir()) == []


def test_borders(stepped_way):
    for row in TABLE["borders"]:
        name, last, others = row["name"], row["last"], row["others"]
        beyond = last * (1.0 + 1e-9 if abs(last) > 1.0 else 1.0 - 1e-9)
        for value, accepted in ((last, True), (beyond, False)):
            way = stepped_way.begin({**others, name: value})
            assert way.step(1e-4) is accepted, (name, value, way.messages)
        assert row["words"] in way.messages[0], row
