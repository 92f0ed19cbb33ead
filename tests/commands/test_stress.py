"""`golf-impact stress`: what is tried, and that each error is found, as large as it is."""

import json
import random
from itertools import cycle, groupby, product

import numpy as np
import pytest
from cases import DEFAULTS
from command import golf_here
from shown import check_snapshot

import stability
from golf_impact.data.runs import FLAGS, REALS
from golf_impact.evidence import checks
from golf_impact.evidence.random_impacts import ImpactCase, critical_damping, random_impact


def numbers(values, digits):
    """With these digits; equal ones once, with their number."""
    texts = groupby(f"{value:.{digits}g}" for value in values)
    return " ".join(f"{text}×{n}" if (n := len([*equal])) > 1 else text for text, equal in texts)


def drawn():
    """The first impacts of a seed, every third with forces, by their numbers; of some the steps.

    The least and the largest values of all that a full run tries, and of its damping ratios.
    """
    tried = [random_impact(20, n).values for n in range(1000)]
    tried = [values | {"zeta": values["b"] / critical_damping(values)} for values in tried]
    for name in tried[0]:
        yield f"{name}: {numbers([pick(row[name] for row in tried) for pick in (min, max)], 3)}"
    for n in range(48):
        case = random_impact(20, n, pushed=n % 3 == 2)
        yield f"{n}: {numbers([*case.values.values(), case.end, case.start_time], 9)}"
        yield from (f"  {numbers([time, *later.values()], 9)}" for time, later in case.changes)
        for name, steps in case.patterns(1e-4, random.Random(n)).items() if n % 6 == 0 else ():
            yield f"  {name}: {numbers([step.length for step in steps], 3)}"


def test_what_is_drawn(pytestconfig):
    """The same on any machine."""
    check_snapshot(pytestconfig, "random_impacts.txt", drawn())


@pytest.mark.parametrize("number", range(10))
def test_steps_add_up_exactly(number):
    """Whatever the order, no bit is lost; changes are set when they act."""
    case = random_impact(5, number, pushed=True)
    for steps in case.patterns(1e-4, random.Random(number)).values():
        sizes = [step.length for step in steps]
        assert min(sizes) > 0.0
        assert sum(sizes) == sum(reversed(sizes)) == case.end
        begins = np.cumsum([0.0, *sizes[:-1]]).tolist()
        for time, inputs in case.changes:
            assert steps[begins.index(time)]._asdict().items() >= inputs.items()


#: In golf, with a change of k and b, after an approach.
CASE = ImpactCase(
    DEFAULTS | {"gap": 0.001}, 2.0**-10, ((2.0**-12, {"k": 1.5e6, "b": 20.0}),), 2.0**-10
)
COLUMNS = [*REALS, *FLAGS]


@pytest.fixture(scope="module")
def reference():
    return checks.Reference(CASE.values | {"start_time": CASE.start_time}, CASE.changes)


@pytest.fixture
def errors(impact, reference, monkeypatch):
    """A function: the largest error by check and output, if `spoil` has changed the rows."""
    monkeypatch.setattr(checks, "Reference", lambda *_: reference)
    follow = checks.follow

    def errors(spoil, parts=(0, 1, 2)):
        part = cycle(range(3))  # of a run: up to the state, from there, and once more

        def spoiled(*arguments):
            rows = follow(*arguments)
            if next(part) in parts:
                spoil(rows)
            return rows

        monkeypatch.setattr(checks, "follow", spoiled)
        found = {}
        for which, output, _, error in checks.check(impact, CASE, random.Random(1)):
            known = found.get((which, output), 0.0)
            found[which, output] = known if error <= known else error
        return found

    return errors


def test_right_outputs(errors):
    found = errors(lambda rows: None)
    *patterns, state = stability.CLAIMS
    assert found.keys() == {(state, ""), *product(patterns, COLUMNS)}
    # Measured: 6e-16.
    assert max(found.values()) < 3e-15
    assert found[state, ""] == 0.0


@pytest.mark.parametrize("name", COLUMNS)
def test_a_wrong_output(errors, reference, name):
    """At the end, by three tolerances; of mean_force the sum counts. In no other output."""
    outputs, column = reference.outputs(CASE.end), COLUMNS.index(name)
    scales = checks.Scales(CASE.values, outputs, CASE.approach, CASE.end, CASE.changes)

    def spoil(rows):
        for row in rows if name == "mean_force" else rows[-1:]:
            if name in FLAGS:
                row[column] = not row[column]
            else:
                row[column] += 3e-13 * (row[column] if name == "mean_force" else scales.of(name))

    for (which, output), error in errors(spoil).items():
        expected = 0.0 if output != name else np.inf if name in FLAGS else 3e-13
        assert error == pytest.approx(expected, abs=3e-15), (which, output)


def test_wrong_outputs_on_the_way(errors):
    """Not only at the end; NaN is an error; a restored state changes nothing."""
    column = COLUMNS.index("force")

    def put(value):
        def spoil(rows):
            for row in rows[:-1]:
                row[column] = value

        return spoil

    assert errors(put(-1e3))["random steps", "force"] > 0.1
    assert np.isnan(errors(put(np.nan))["random steps", "force"])
    changed = errors(put(-1.0), parts=[2])
    assert changed["state", ""] > 1.0
    assert changed["equal steps", "force"] < 3e-15


@pytest.mark.ci
def test_random_impacts(tmp_path):
    """None of 150 has an error above its tolerance."""
    golf_here("stress", "--quick", "--seed", 7, "--out", tmp_path, code=0)


@pytest.mark.parametrize("worst", [1e-13, np.nan])
def test_the_command(monkeypatch, tmp_path, pytestconfig, worst):
    """Of each check stress.json has the case with the largest one."""

    def check(impact, case, rng):
        largest = case == random_impact(7, 60)
        for n, which in enumerate(stability.CLAIMS):
            yield which, "force", 64, worst if largest and n == 1 else n % 4 * 1e-14 * rng.random()
            yield which, "impulse", 64, 0.0

    monkeypatch.setattr(checks, "check", check)
    fails = np.isnan(worst)
    done = golf_here("stress", "--quick", "--seed", 7, "--out", tmp_path, code=int(fails))
    assert (tmp_path / "stability.png").read_bytes().startswith(b"\x89PNG")
    found = json.loads((tmp_path / "stress.json").read_text())["checks"]
    assert found["equal steps"]["worst"] == (None if fails else worst)
    if fails:
        lines = done.stdout.splitlines()[:-1]
        for name, row in found.items():
            lines.append(f"{name}: {', '.join(map(text, [*row.values()][:3]))}")
            lines += [f"  {key}: {text(value)}" for key, value in row["case"].items()]
        check_snapshot(pytestconfig, "stress.md", lines)


def text(value):
    return f"{value:.9g}" if isinstance(value, float) else str(value)
