"""COR and smash factor over club speed: what laws say, and what was measured."""

from golf_scenarios.errors import UserError
from golf_scenarios.facts.balls import BALLS
from golf_scenarios.facts.closed_forms import elastic_smash_factor
from golf_scenarios.facts.document import USED
from golf_scenarios.facts.measured import (
    LOUGHBOROUGH,
    MEASUREMENTS,
    PENNER,
    PENNER_AT_REST,
    PENNER_SLOPE,
)
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.checks import falls, run_case, shown, stays
from golf_scenarios.report.outcome import Outcome, Table

TITLE = "Speed dependence: measured COR falls with club speed, a constant damper's doesn't"

_SPEEDS = tuple(float(speed) for speed in range(10, 71, 5))

#: Balls by preset, with what the figure calls them.
_BALLS = {
    "document": "document, law 1: k, b fixed",
    "roh-lee-linear": "Kelvin–Voigt: k, b fixed",
    "roh-lee": "power law n = 1.62: k, b fixed",
    "penner": "power law, COR = 0.86 − 0.0029 v",
}

#: Where labels that would lie on a line go instead, in points.
_BESIDE = {"Roh & Lee": (-52, -16), "rules' limit": (-6, 8)}


def run(fmu: ImpactFmu) -> Outcome:
    """Impacts from 10 to 70 m/s with four balls."""
    outcome = Outcome(TITLE)
    found = {
        name: [
            run_case(outcome, fmu, f"{name}, {speed:g} m/s", club_speed=speed, **BALLS[name].values)
            for speed in _SPEEDS
        ]
        for name in _BALLS
    }

    def over_speed(name: str, metric: str) -> list[float]:
        return [metrics[metric] for metrics in found[name]]

    cor, smash, time = "coefficient_of_restitution", "smash_factor", "contact_time"
    for title, metric in (("COR", cor), ("Smash factor S", smash), ("Contact time (µs)", time)):
        rows = [
            [f"{speed:g}", *(shown(metric, found[name][n][metric]) for name in _BALLS)]
            for n, speed in enumerate(_SPEEDS)
            if speed % 10.0 == 0.0
        ]
        outcome.tables.append(Table(f"{title} by ball", ["club speed (m/s)", *_BALLS], rows))

    for name in _BALLS:
        if name != "penner":
            stays(outcome, f"{name}: COR is the same at every speed", over_speed(name, cor))
    for speed, e, s in zip(
        _SPEEDS, over_speed("penner", cor), over_speed("penner", smash), strict=True
    ):
        line = PENNER_AT_REST - PENNER_SLOPE * speed
        outcome.check_close(f"penner: COR at {speed:g} m/s is the measured line's", e, line, 1e-12)
        expected = 0.5 * (1.0 + line) * elastic_smash_factor(USED["m_club"], USED["m_ball"])
        outcome.check_close(
            f"penner: S at {speed:g} m/s is (1 + COR)/(1 + m_B/m_C)", s, expected, 1e-12
        )
    stays(outcome, "a linear law's contact time is the same", over_speed("roh-lee-linear", time))
    falls(outcome, "a power law's contact is shorter at speed", over_speed("roh-lee", time))
    falls(outcome, "so it is with a COR that falls", over_speed("penner", time))
    _check_refusal(outcome, fmu)
    lost = found["penner"][0][smash] - found["penner"][-1][smash]
    outcome.words += [
        "With k and b fixed no law here has a COR that depends on speed; measured, it falls by "
        f"0.0029 per m/s ({PENNER}), which takes {lost:.3f} from S between {_SPEEDS[0]:g} and "
        f"{_SPEEDS[-1]:g} m/s. The FMU follows it with restitution_at_rest = 0.86 and "
        "restitution_slope = 0.0029 (ball penner).",
        "Contact gets shorter with speed as measured "
        f"({LOUGHBOROUGH}) only with an exponent above 1.",
        "Tour drivers lie above the line: their faces are springs too, which the COR line of a "
        "rigid head leaves out (ball tour takes both together).",
    ]
    outcome.figures["speed_dependence"] = lambda: _drawn(found, cor, smash)
    return outcome


def _check_refusal(outcome: Outcome, fmu: ImpactFmu) -> None:
    speed = 1.01 * PENNER_AT_REST / PENNER_SLOPE
    try:
        fmu.impact(club_speed=speed, **BALLS["penner"].values)
        message = ""
    except UserError as error:
        message = str(error)
    outcome.check(
        f"penner: {speed:.0f} m/s, where the line is below 0, is refused at touch",
        "restitution_slope" in message,
        message or "it wasn't",
    )


def _drawn(found: dict[str, list[dict[str, float]]], cor: str, smash: str):
    from golf_scenarios.report import figures

    figure, (left, right) = figures.new_pair("COR and smash factor over club speed")
    styles = (
        (figures.ORANGE, "-."),
        (figures.GREEN, "--"),
        (figures.SKY, "-"),
        (figures.BLUE, "-"),
    )
    for (name, text), (colour, style) in zip(_BALLS.items(), styles, strict=True):
        for axes, metric in ((left, cor), (right, smash)):
            values = [metrics[metric] for metrics in found[name]]
            axes.plot(_SPEEDS, values, color=colour, ls=style, label=text)
    ratio = 1.0 + USED["m_ball"] / USED["m_club"]
    line = [PENNER_AT_REST - PENNER_SLOPE * speed for speed in _SPEEDS]
    for axes, values in ((left, line), (right, [(1.0 + e) / ratio for e in line])):
        axes.plot(_SPEEDS, values, color=figures.BLACK, alpha=0.2, lw=9, label="measured, Penner")
    for face, mark in (("rigid", "o"), ("springy", "^")):
        label = f"published, {face} face"
        for m in MEASUREMENTS:
            if m.face != face or m.metric not in (cor, smash):
                continue
            # One is the other: S = (1 + COR)/(1 + m_B/m_C).
            e = m.middle if m.metric == cor else ratio * m.middle - 1.0
            for axes, value in ((left, e), (right, (1.0 + e) / ratio)):
                point = (m.club_speed, value)
                axes.plot(*point, mark, color=figures.BLACK, ms=6, label=label, zorder=5)
                axes.annotate(
                    m.short,
                    point,
                    _BESIDE.get(m.short, (8, -4)),
                    textcoords="offset points",
                    fontsize=9,
                    zorder=5,
                )
            label = ""
    left.set(xlabel="club speed (m/s)", ylabel="coefficient of restitution", ylim=(0.6, 1.0))
    right.set(xlabel="club speed (m/s)", ylabel="smash factor S")
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


if __name__ == "__main__":
    from golf_scenarios.commands.app import run_alone

    run_alone("speed_dependence")
