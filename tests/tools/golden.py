"""Golden rows of law 2 with an exponent or a COR.

`PYTHONPATH=tests python tests/tools/golden.py` adds those that are missing.

The rows were computed once, by methods that nothing else here uses: power laws by another
quadrature, linear laws by matrix exponentials of 60 digits, with events found by bisection.
"""

import json
from pathlib import Path

from cases import CASES, POWER_LAW, golden, restitution

from golf_impact.data.runs import reduced_mass
from golf_impact.evidence.reference import mp

FILE = Path(__file__).parents[1] / "data" / "golden.json"

#: After separation, and on the way at these shares of the contact's own time.
ENDS = (
    "smash_factor", "coefficient_of_restitution", "club_velocity", "ball_velocity", "impulse",
    "max_force", "max_compression", "contact_time", "time_of_max_force", "contact_displacement",
)  # fmt: skip
PATH = ("contact_time", "force", "compression", "club_velocity", "ball_velocity", "impulse")
SHARES = ("0.0001", "0.25", "0.8", "0.995")


def damping(v):
    """The b (N.s/m) of a COR at the approach speed."""
    closing = v["club_speed"] - v["ball_speed"]
    log = mp.log(v["restitution_at_rest"] - v["restitution_slope"] * closing)
    guess = -log / mp.sqrt(mp.pi**2 + log**2)
    zeta = mp.findroot(lambda zeta: mp.log(restitution(zeta)) - log, guess)
    return 2 * zeta * mp.sqrt((v["exponent"] + 1) / 2 * v["k"] * reduced_mass(v))


def rows(values):
    """Outputs after separation, and on the way.

    In a time s of its own, ds = rate x^P dt, P = (n - 1)/(n + 1), the contact is that of a linear
    oscillator, x'' + 2 ζ x' + x = 0, of x = (d/length)^m, m = (n + 1)/2; x' is the closing speed
    over that at touch.
    """
    v = {name: mp.mpf(value) for name, value in values.items()}
    m, mu, d_r = (v["exponent"] + 1) / 2, reduced_mass(v), v["reference_compression"]
    power, closing = 1 - 1 / m, v["club_speed"] - v["ball_speed"]
    omega = mp.sqrt(m * v["k"] / mu)
    zeta = (damping(v) if v["restitution_at_rest"] else v["b"]) / (2 * mu * omega)
    zeta += mp.mpf(10) ** -36  # not just critical, at which w is 0
    w, length = mp.sqrt(1 - zeta**2), d_r * (m * closing / (d_r * omega)) ** (1 / m)
    rate, end = m * closing / length, mp.re(2 * mp.acos(zeta) / w)

    def motion(s):
        """x, x' and the force over the largest without damping: all real, though w may not be."""
        x = mp.re(mp.exp(-zeta * s) * mp.sin(w * s) / w)
        slope = mp.re(mp.exp(-zeta * s) * mp.cos(w * s)) - zeta * x
        return x, slope, x + 2 * zeta * slope

    def integrand(z):  # s = z^m removes the singularity at touch
        with mp.workdps(80):
            ratio = motion(z**m)[0] / z**m if z**m > mp.mpf(10) ** -25 else mp.one
            return m * ratio**-power

    def outputs(s):
        (x, slope, force), cuts = motion(s), [s]
        while cuts[-1] * max(1, zeta) > 1:
            cuts.append(cuts[-1] / 2)
        with mp.workdps(32):
            time = mp.quad(integrand, [0, *(cut ** (1 / m) for cut in reversed(cuts))]) / rate
        compression, impulse = length * x ** (1 / m), mu * closing * (1 - slope)
        drift = v["ball_speed"] + mu / v["m_ball"] * closing  # of the centre of mass
        return {
            "contact_time": time,
            "force": mu * closing * rate * x**power * force,
            "compression": compression,
            "club_velocity": v["club_speed"] - impulse / v["m_club"],
            "ball_velocity": v["ball_speed"] + impulse / v["m_ball"],
            "impulse": impulse,
            "contact_displacement": drift * time - mu / v["m_ball"] * compression,
        }

    def rise(s):
        x, slope, force = motion(s)
        return power * slope * force + x * (slope - 2 * zeta * force)

    # The largest compression is at half the end, the largest force not later.
    bracket = end * mp.mpf(10) ** -30, end * 3 / 4
    peak = outputs(mp.findroot(rise, bracket, solver="pegasus", maxsteps=1000, verify=False))
    after, deepest = outputs(end), outputs(end / 2)
    after |= {
        "smash_factor": after["ball_velocity"] / v["club_speed"],
        "coefficient_of_restitution": (after["ball_velocity"] - after["club_velocity"]) / closing,
        "max_force": peak["force"],
        "time_of_max_force": peak["contact_time"],
        "max_compression": deepest["compression"],
    }
    path = [outputs(end * mp.mpf(share)) for share in SHARES]
    return [{n: after[n] for n in ENDS}, *({n: row[n] for n in PATH} for row in path)]


if __name__ == "__main__":
    content = golden()
    known = content["power law"]
    for name in POWER_LAW:
        if name not in known:
            new = rows(CASES[name].values)
            known[name] = [{n: mp.nstr(value, 25) for n, value in row.items()} for row in new]
    FILE.write_text(json.dumps(content, indent=1) + "\n")
