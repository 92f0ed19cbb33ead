"""What Swing, Launch and BallFlight share: any steps, and results of an event that stay.

Calls in any order, states, ranges: test_lockstep.py, test_state.py. What they can't compute is
refused until it is corrected: refusals.toml.
"""

import pytest
from fmus import get, get_all, put

CONTACT = {
    "ball_velocity": 50.0, "club_velocity": 24.0, "smash_factor": 1.43,
    "coefficient_of_restitution": 0.74,
}  # fmt: skip
SHOT = {"ball_velocity": 50.0, "touch_time": -0.1, "contact_time": 0.1}
#: Of a second contact or shot.
SLOWER = {"ball_velocity": 20.0}

#: Inputs; instants, s; communication step sizes by which all or some of these are reached.
RUNS = {
    # Plain sums of the small steps would be off by 1e-12 s, at 4,000 m/s².
    "Swing": ({}, (0.9,), ([0.45] * 2, [1e-5] * 90_000)),
    "Launch": (CONTACT | {"separated": True}, (2.5,), ([2.5], [1e-3, 2.0, 0.499], [0.5] * 5)),
    "BallFlight": (
        SHOT | {"separated": True},
        (0.5, 1.5, 3.0, 7.0),
        ([0.5] * 14, [0.001] * 500 + [0.25] * 26, [7.0]),
    ),
}


@pytest.mark.parametrize("name", RUNS)
def test_any_steps_give_the_same(companion, name):
    inputs, instants, patterns = RUNS[name]
    paths = []
    for steps in patterns:
        slave, time, path = companion(name), 0.0, {}
        put(slave, **inputs)
        for step in steps:
            slave.doStep(time, step)
            time += step
            if round(time, 6) in instants:
                path[round(time, 6)] = get_all(slave)[0]
        paths.append(path)
    assert len(paths[0]) == len(instants)
    for path in paths[1:]:
        for time, values in path.items():
            assert values == pytest.approx(paths[0][time], rel=1e-12, abs=1e-11)


@pytest.mark.parametrize(("name", "inputs"), [("Launch", CONTACT), ("BallFlight", SHOT)])
def test_results_are_those_of_the_event_and_stay(companion, name, inputs):
    """Nothing before, by any steps; afterwards no other contact or shot has an effect."""
    slave, fresh, time = companion(name), companion(name), 0.0
    outputs = [n for n, v in slave.variables.items() if (v.causality, v.type) == ("output", "Real")]
    results = [one for one in outputs if one not in ("distance", "height")]
    put(slave, **inputs)
    for step in (1e-6, 2e-6, 0.3, 1e-9):
        slave.doStep(time, step)
        time += step
        assert get(slave, *outputs) == [0.0] * len(outputs)
        assert not any(get_all(slave)[1])
    for one, begin in ((slave, time), (fresh, 0.0)):
        put(one, **inputs, separated=True)
        one.doStep(begin, 1e-3)
    found = get(slave, *results)
    assert found == get(fresh, *results)
    assert 0.0 not in found
    put(slave, **SLOWER)
    slave.doStep(time + 1e-3, 1e-3)
    assert get(slave, *results) == found
