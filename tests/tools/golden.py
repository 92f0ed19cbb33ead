"""Golden rows, which pin the references of the tests: `python tests/tools/golden.py` writes them.

Linear laws by matrix exponentials, from which stress's reference has nothing; the power law by
quadrature. Tables that were computed elsewhere, before the project, agree with both within 6e-16:
their decimals aren't doubles.
"""

import json
from pathlib import Path

import mpmath
from cases import CASES, POWER_LAW, exact, horizon
from quadrature import PowerLawContact

FILE = Path(__file__).parents[1] / "data" / "golden.json"
ABOUT = (
    "SI units, 25 digits, at separation, of the power law also before it. Written by `python "
    "tests/tools/golden.py`: linear laws by matrix exponentials of 60 digits, the power law by "
    "quadrature of 40. Tables computed elsewhere agree within 6e-16, the rounding of decimals."
)
#: Linear ones.
NAMES = (
    "undamped", "stiff and damped", "stiff and damped, law 2", "critical", "just above critical",
    "drag 1000", "very light ball", "marble", "grains", "against each other",
)  # fmt: skip

mp = mpmath.mp.clone()
mp.dps = 60


def rows_of(v, k, b):
    """The matrix A of x' = A x for x = (d, v_club, v_ball, impulse, x_ball); its force's row."""
    damper, drag = (0, b) if v["law"] == 1 else (b, 0)
    force = [k, damper, -damper, 0, 0]
    club, ball = [-f / v["m_club"] for f in force], [f / v["m_ball"] for f in force]
    club[1] -= drag / v["m_club"]
    ball[2] -= drag / v["m_ball"]
    return [[0, 1, -1, 0, 0], club, ball, force, [0, 0, 1, 0, 0]]


def moved(v, k, b, time, state):
    """The state some time later in contact: exp(A t) x."""
    return list(mp.expm(mp.matrix(rows_of(v, k, b)) * time) * mp.matrix(state))


def first_fall(function, end):
    """Where it becomes negative first in (0, end]: by 300 places, then by bisection."""
    places = [end * n / 300 for n in range(1, 301)]
    high = next(place for place in places if function(place) < 0)
    low = high - end / 300
    for _ in range(190):
        middle = (low + high) / 2
        low, high = (low, middle) if function(middle) < 0 else (middle, high)
    return high


def by_the_matrix(v, end):
    """The outputs at separation."""
    v = {name: mp.mpf(value) for name, value in v.items()}
    k, b = v["k"], v["b"]
    matrix = mp.matrix(rows_of(v, k, b))
    force = matrix[3, :]
    ending = force if v["law"] == 2 else mp.matrix([[1, 0, 0, 0, 0]])

    def at(row, time):
        return (row * mp.matrix(moved(v, k, b, time, start)))[0]

    start = [0, v["club_speed"], v["ball_speed"], 0, 0]
    time = first_fall(lambda t: at(ending, t), end)
    rises = (force * matrix * mp.matrix(start))[0] > 0
    peak = first_fall(lambda t: at(force * matrix, t), time) if rises else mp.mpf(0)
    _, v_club, v_ball, impulse, x_ball = moved(v, k, b, time, start)
    return {
        "contact_time": time, "club_velocity": v_club, "ball_velocity": v_ball, "impulse": impulse,
        "contact_displacement": x_ball, "max_force": at(force, peak), "time_of_max_force": peak,
        "coefficient_of_restitution": (v_ball - v_club) / (v["club_speed"] - v["ball_speed"]),
    }  # fmt: skip


def texts(outputs):
    return {output: mpmath.nstr(value, 25) for output, value in outputs.items()}


def by_quadrature(name):
    """The row of a case of the power law: after separation, and on the way."""
    contact = PowerLawContact(**CASES[name].values)
    return [texts(row) for row in (contact.outputs(), *contact.path())]


if __name__ == "__main__":
    power_law = {name: by_quadrature(name) for name in POWER_LAW}
    rows = {name: texts(by_the_matrix(CASES[name].values, mp.mpf(horizon(name)))) for name in NAMES}
    for name, row in rows.items():
        worst = max(
            abs(exact(name)[n] / mp.mpf(text) - 1) for n, text in row.items() if text != "0.0"
        )
        print(f"{name}: {mpmath.nstr(worst, 2)} from the reference")
    content = {"about": ABOUT, "rows": rows, "power law": power_law}
    FILE.write_text(json.dumps(content, indent=1) + "\n")
