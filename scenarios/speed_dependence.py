"""COR and smash factor over club speed: contact laws and measurements."""

from golf_impact.scenario import (
    BALLS,
    Report,
    UserError,
    closed_forms,
    document,
    format_value,
    main,
    measured,
)

TITLE = "Speed dependence: COR falls with club speed"
CHAPTER = 9

_SPEEDS = tuple(float(speed) for speed in range(10, 71, 5))

#: Preset balls and their labels in the figure.
_BALLS = {
    "document": "document, law 1: k, b fixed",
    "roh-lee-linear": "Kelvin–Voigt: k, b fixed",
    "roh-lee": "power law n = 1.62: k, b fixed",
    "penner": "power law, COR = 0.86 − 0.0029 s/m · v",
}

#: Offsets (points) of labels that would lie on a line.
_BESIDE = {"Roh & Lee": (-52, -16), "rules' limit": (-6, 8)}


def run(fmu):
    """Impacts at 10 to 70 m/s with four balls."""
    report = Report(TITLE, fmu)
    impacts = {
        name: [
            report.impact(f"{name}, {speed:g} m/s", club_speed=speed, **BALLS[name].values)
            for speed in _SPEEDS
        ]
        for name in _BALLS
    }

    def over_speed(name, metric):
        return [metrics[metric] for metrics in impacts[name]]

    cor, smash, time = "coefficient_of_restitution", "smash_factor", "contact_time"
    for title, metric in (("COR", cor), ("Smash factor S", smash), ("Contact time (µs)", time)):
        rows = [
            [f"{speed:g}", *(format_value(metric, impacts[name][n][metric]) for name in _BALLS)]
            for n, speed in enumerate(_SPEEDS)
            if speed % 10.0 == 0.0
        ]
        report.table(f"{title} by ball", ["club speed (m/s)", *_BALLS], rows)

    for name in _BALLS:
        if name != "penner":
            claim = f"{name}: COR is the same at all speeds"
            report.stays(claim, over_speed(name, cor), kind="invariants")
    elastic = closed_forms.elastic_smash_factor(document.USED["m_club"], document.USED["m_ball"])
    line = [measured.PENNER_AT_REST - measured.PENNER_SLOPE * speed for speed in _SPEEDS]
    for speed, metrics, e in zip(_SPEEDS, impacts["penner"], line, strict=True):
        claim = f"penner: COR at {speed:g} m/s agrees with the published line"
        report.check_close(claim, metrics[cor], e, 1e-12, "", "documents")
        claim = f"penner: S at {speed:g} m/s agrees with (1 + COR)/(1 + m_B/m_C)"
        report.check_close(claim, metrics[smash], 0.5 * (1.0 + e) * elastic, 1e-12)
    claim = "roh-lee-linear: contact time is the same at all speeds"
    report.stays(claim, over_speed("roh-lee-linear", time), kind="invariants")
    report.falls("roh-lee: contact time decreases with speed", over_speed("roh-lee", time))
    report.falls("penner: contact time decreases with speed", over_speed("penner", time))
    too_fast = 1.01 * measured.PENNER_AT_REST / measured.PENNER_SLOPE
    try:
        fmu.impact(club_speed=too_fast, **BALLS["penner"].values)
        message = ""
    except UserError as error:
        message = str(error)
    claim = f"penner: the FMU rejects a touch at {too_fast:.0f} m/s, where the line is below 0"
    report.check(claim, "restitution_slope" in message, message or "it didn't")
    lost = impacts["penner"][0][smash] - impacts["penner"][-1][smash]
    report.conclude(
        "Measured COR falls by 0.0029 per m/s of approach speed. With constant k and b COR is "
        "independent of speed; restitution_at_rest and restitution_slope follow the measurement "
        "(ball penner)."
    )
    report.say(
        f"The line is Penner's ({measured.PENNER}). It reduces S by {lost:.3f} between "
        f"{_SPEEDS[0]:g} and {_SPEEDS[-1]:g} m/s.",
        "Contact becomes shorter with speed, as measured "
        f"({measured.LOUGHBOROUGH}), only with an exponent above 1.",
        "Tour drivers are above the line: they have flexible faces, and the line is that of a "
        "rigid head (ball tour represents ball and face together).",
    )

    @report.figure(
        "speed_dependence",
        "With constant k and b COR and S are independent of speed. Measured COR falls; only the "
        "ball with a COR line follows it.",
    )
    def cor_and_smash_factor(figures):
        figure, (left, right) = figures.new_pair("COR and smash factor over club speed")
        for name, words in _BALLS.items():
            style, width = figures.STYLES[name], 4.0 if name == "penner" else 2.0
            for axes, metric in ((left, cor), (right, smash)):
                axes.plot(_SPEEDS, over_speed(name, metric), **style.line, lw=width, label=words)
        ratio = 1.0 + document.USED["m_ball"] / document.USED["m_club"]
        dots = {"color": figures.BLACK, "ls": ":", "lw": 1.5, "label": "measured line (Penner)"}
        left.plot(_SPEEDS, line, **dots)
        right.plot(_SPEEDS, [(1.0 + e) / ratio for e in line], **dots)
        for face, mark in (("rigid", "o"), ("flexible", "^")):
            label = f"published, {face} face"
            for m in measured.MEASUREMENTS:
                if m.face != face or m.metric not in (cor, smash):
                    continue
                # Each follows from the other: S = (1 + COR)/(1 + m_B/m_C).
                e = m.middle if m.metric == cor else ratio * m.middle - 1.0
                points = {"color": figures.BLACK, "ms": 6, "label": label, "zorder": 5}
                beside = {"textcoords": "offset points", "fontsize": 9, "zorder": 5}
                for axes, value in ((left, e), (right, (1.0 + e) / ratio)):
                    at = m.club_speed, value
                    axes.plot(*at, mark, **points)
                    axes.annotate(m.short, at, _BESIDE.get(m.short, (8, -4)), **beside)
                label = ""
        left.set(xlabel="club speed (m/s)", ylabel="coefficient of restitution", ylim=(0.6, 1.0))
        right.set(xlabel="club speed (m/s)", ylabel="smash factor S")
        figures.add_legend_below(figure, left, columns=3)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
