"""Impacts by every way, beside the references; by any steps, with states restored in between."""

import random
from itertools import pairwise

import pytest
import random_cases
from cases import CASES, DEFAULTS, exact, exact_path, exact_path_of, horizon, instants, scales_of
from compare import assert_close, assert_same_results
from conftest import numbers, some
from ways import STEPPED

from golf_impact.evidence.reference import Reference


def points(case, compared, pattern):
    """Where steps end, s: at the compared instants after steps of their own, and as the pattern."""
    *_, end = compared
    rng = random.Random(1)
    found = {
        "one step": [],
        "equal": [end * n / 50 for n in range(1, 50)],
        "random": [end * rng.random() for _ in range(40)],
    }[pattern]
    if pattern != "one step":
        found = [t for t in found if not any(a < t < b for b, a in compared.items())]
        found += [*compared, *compared.values()]
    return sorted({*found, *dict(case.changes), end})


def path_of(way, case, compared, pattern):
    """Outputs at the compared instants, and impulse less the sum of mean forces times steps."""
    later, reached = dict(case.changes), {}
    rng, added = random.Random(2), 0.0
    way.begin(case.given, case.start)
    for point, after in pairwise([0.0, *points(case, compared, pattern)]):
        way.set(**later.get(point, {}))
        if pattern == "random" and rng.random() < 0.2:
            saved = way.save(as_bytes=rng.random() < 0.5)
            way.step(max(compared) * rng.random())
            way.restore(saved)
        assert way.step(after - point), way.messages
        added += way["mean_force"] * (after - point)
        if after in compared:
            reached[after] = way.read()
    assert not way.messages
    return reached, reached[after]["impulse"] - added


@pytest.mark.parametrize("of", some(1, STEPPED))
@pytest.mark.parametrize("name", CASES)
def test_cases_by_any_steps(way_of, name, of):
    """Every output on the way and at the end; of power laws those known. FMUs have its bits."""
    case, end, right = CASES[name], horizon(name), exact_path(name)
    compared = instants(end) if case.is_linear else {time: 0.998 * time for time in right}
    for pattern in ("one step", "equal", "random")[-3 if of == "in process" else -1 :]:
        reached, missing = path_of(way_of(of), case, compared, pattern)
        last = reached[end]
        assert case.is_linear or last["separated"]
        scales = scales_of(case, last, end)
        for time in reached:
            where = {"case": name, "time": time, "steps": pattern, "way": of}
            expected = dict(right[time])
            if pattern == "one step":
                expected.pop("mean_force", None)
            # Of a power law the worst is 6e-15, though only 1e-10 is stated.
            assert_close(reached[time], expected, scales, **where)
        assert_close({"impulse": missing}, {"impulse": 0.0}, scales, **where)


@pytest.mark.parametrize("number", numbers(18, 150, 1500))
@pytest.mark.parametrize("kind", [random_cases.far, random_cases.special])
def test_random_cases(way_of, kind, number):
    """In this process: FMUs have its bits."""
    case = kind(number)
    right = exact_path_of(case, case.end)
    reached, missing = path_of(way_of("in process"), case, instants(case.end), "random")
    scales = scales_of(case, right[case.end], case.end)
    for time, expected in right.items():
        assert_close(reached[time], expected, scales, case=case, time=time)
    assert_close({"impulse": missing}, {"impulse": 0.0}, scales, case=case)


#: Those that the ways of whole impacts run to the same instant, or beyond separation.
WHOLE = [n for n, case in CASES.items() if not (case.changes or case.end or case.start)]
WHOLE.remove("sticks")


def test_cases_by_whole_impacts(whole_way):
    """Results of impacts that end, in one call."""
    for name, found in zip(WHOLE, whole_way(CASES[name].given for name in WHOLE)):
        expected = {n: x for n, x in exact(name).items() if n in found}
        scales = scales_of(CASES[name], {"touched": True} | found, horizon(name))
        assert_close(found, expected, scales, case=name)


@pytest.fixture(scope="module")
def random_impacts(way_of):
    """Values, and what the FMU finds of them."""
    cases = [random_cases.whole(number) for number in range(400)]
    return cases, way_of("Impact")(cases)


@pytest.mark.parametrize("name", ["engine", "engine, rows", "page"])
def test_random_cases_by_whole_impacts(way_of, random_impacts, name):
    """Within 1e-13 of the FMU's; refused for the same reason."""
    cases, exact = random_impacts
    found = way_of(name)(cases)
    assert_same_results(found, exact, cases)
    assert 24 < sum(isinstance(one, str) for one in found) < 120


def test_touch_after_a_state_is_restored_for_another_time(stepped_way):
    way = stepped_way.begin({"gap": 0.0035}, start=5.0)
    assert way["touch_time"] == 5.0
    assert way.step(8e-5)
    way.restore(way.save())
    assert way.step(1.0, point=9.0)
    assert way["touch_time"] == pytest.approx(9.00002, rel=1e-15)


def test_the_largest_force_just_after_touch(stepped_way):
    """There it is the damper's; after 3e-17 s it is larger by 1e-12 of that."""
    values, size = {"law": 2, "b": 40.0}, 3e-17
    assert stepped_way.begin(values).step(size)
    exact = float(Reference(DEFAULTS | values).outputs(size)["max_force"])
    assert 40.0 * DEFAULTS["club_speed"] * (1.0 + 5e-13) < exact
    assert stepped_way["max_force"] == pytest.approx(exact, rel=1e-13)
    assert stepped_way["time_of_max_force"] == size
