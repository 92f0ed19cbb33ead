"""A shaft on the club head, through fmpy on the built FMU: the couplings' errors."""

import re
import shutil
import sys
from pathlib import Path

import pytest
from cases import integrated
from command import run
from scipy.integrate import solve_ivp

from golf_impact.fmu.coupling import run_pushed

#: Tip of the shaft (kg), ball (kg), ball's stiffness and damping, the shaft's damping, grip (m/s).
M_CLUB, M_BALL, K, B, DAMPING, GRIP = 0.2, 0.04593, 1e6, 9.0, 5.0, 40.0
VALUES = {"law": 2, "k": K, "b": B, "m_club": M_CLUB, "m_ball": M_BALL, "club_speed": GRIP}
PHASES = 8

#: Largest error of the ball's speed at 0.1 ms and 10 µs, over `PHASES`, as measured: of order 1 for
#: "late", 2 for the others.
ERRORS = {
    2e4: {"late": (3.3e-4, 3.8e-5), "middle": (1.2e-5, 9.7e-8), "repeated": (6.1e-5, 6.1e-7)},
    2e5: {"late": (1.4e-3, 1.7e-4), "middle": (5.6e-5, 6.4e-7), "repeated": (3.4e-4, 3.4e-6)},
    2e6: {"late": (1.2e-2, 1.3e-3), "middle": (6.0e-4, 5.5e-6), "repeated": (2.2e-3, 2.2e-5)},
}
FREE = {2e4: -1.1e-3, 2e5: -4.2e-3, 2e6: -3.5e-2}


def shaft(stiffness, start):
    """The force of a shaft on its tip; relaxed before touch, with the tip at `start` at first."""
    return lambda t, x, v: stiffness * (GRIP * t + start - x) + DAMPING * (GRIP - v)


def exact_speed(push, start=0.0):
    """Of the ball after the impact with a head that starts at `start` (m), by DOP853, m/s."""

    def free(t, y):
        return [y[1], push(t, *y) / M_CLUB]

    def touch(t, y):
        return y[0]

    touch.terminal, time, speed = True, 0.0, GRIP
    if start:
        options = {"events": touch, "rtol": 1e-13, "atol": 1e-15, "max_step": 1e-4}
        path = solve_ivp(free, (0.0, 1.0), [start, speed], "DOP853", **options)
        time, speed = path.t[-1], path.y[1, -1]
    values = VALUES | {"club_speed": speed}
    return integrated(values, push=push, touch=time)["ball_velocity"]


@pytest.mark.parametrize("stiffness", ERRORS)
def test_errors_of_the_couplings(fmu, stiffness):
    exact = exact_speed(shaft(stiffness, 0.0))
    free = run_pushed(fmu, lambda t, x, v: 0.0, 1e-4, "late", **VALUES)
    assert free / exact - 1.0 == pytest.approx(FREE[stiffness], rel=0.03)
    for coupling, limits in ERRORS[stiffness].items():
        for size, limit in zip((1e-4, 1e-5), limits, strict=True):
            gaps = [n / PHASES * size * GRIP for n in range(PHASES)]
            speeds = [
                run_pushed(fmu, shaft(stiffness, -gap), size, coupling, **VALUES, gap=gap)
                for gap in gaps
            ]
            worst = max(abs(speed / exact - 1.0) for speed in speeds)
            assert 0.8 * limit < worst <= limit, f"{coupling}, {size} s: {worst:.2e}"


@pytest.mark.parametrize("coupling", ["late", "middle"])
def test_a_step_longer_than_the_contact_leaves_a_free_head(fmu, coupling):
    gap = 0.2 * 1e-3 * GRIP
    free, pushed = (
        run_pushed(fmu, push, 1e-3, coupling, **VALUES, gap=gap)
        for push in (lambda t, x, v: 0.0, shaft(2e5, -gap))
    )
    # The contact takes 0.59 ms of the last 0.8 ms; the shaft is relaxed before.
    assert pushed == pytest.approx(free, rel=1e-12)


HOST = (Path(__file__).parent.parent / "build" / "README.md").read_text("utf-8")


@pytest.mark.parametrize("stiffness", [0.0, 2e5])
def test_the_host_in_the_readme(fmu_path, tmp_path, stiffness):
    """A host for a club of one's own, as it stands there, and with a shaft as its force."""
    text = HOST.partition("A host for a club")[2]
    (program,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len([line for line in program.splitlines() if line.strip()]) <= 36
    push, tolerance = lambda t, x, v: 400.0, 1e-12
    if stiffness:
        (body,) = re.findall(r"`(return 2e5 .*?)`", text)
        program = program.replace("return 400.0", body).replace(
            "[1e-3, 3e-4, 1e-4]", "[2e-5, 1e-5]"
        )
        assert body in program
        push, tolerance = shaft(stiffness, -0.5), 3e-6
    shutil.copy(fmu_path, tmp_path / "ClubBallImpact.fmu")
    for seed in range(3):
        (tmp_path / "host.py").write_text(f"import random\nrandom.seed({seed})\n{program}")
        done = run(sys.executable, "host.py", cwd=tmp_path)
        ball = float(re.findall(r"ball (\S+) m/s", done.stdout)[0])
        assert ball == pytest.approx(exact_speed(push, -0.5), rel=tolerance)
