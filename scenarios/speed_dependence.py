"""COR and smash factor over club speed: contact laws and measurements."""

from golf_impact.scenario import BALLS, Report, UserError, document, format_value, main, measured

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
_BESIDE = {
    "Roh & Lee": (-52, -16),
    "rules' limit": (-6, 8),
    "tour, 113 mph": (8, -9),
    "Thomas": (-46, -4),
}


def run(fmu):
    report = Report(TITLE, fmu)
    cor, smash, time = "coefficient_of_restitution", "smash_factor", "contact_time"
    for name in _BALLS:
        for speed in _SPEEDS:
            report.impact(f"{name}, {speed:g} m/s", club_speed=speed, **BALLS[name].values)

    def over_speed(metric, name):
        return [report.cases[f"{name}, {speed:g} m/s"][metric] for speed in _SPEEDS]

    for title, metric in (("COR", cor), ("Smash factor S", smash), ("Contact time (µs)", time)):
        columns = (over_speed(metric, name) for name in _BALLS)
        rows = (
            [f"{speed:g}", *(format_value(metric, value) for value in values)]
            for speed, *values in zip(_SPEEDS, *columns)
            if speed % 10.0 == 0.0
        )
        report.table(f"{title} by ball", ["club speed (m/s)", *_BALLS], rows)

    for name in ("document", "roh-lee-linear", "roh-lee"):
        report.stays(f"{name}: COR is the same at all speeds", over_speed(cor, name), "invariants")
    line = [measured.PENNER_AT_REST - measured.PENNER_SLOPE * speed for speed in _SPEEDS]
    for speed, expected, found in zip(_SPEEDS, line, over_speed(cor, "penner")):
        claim = f"penner: COR at {speed:g} m/s agrees with the published line"
        report.check_close(claim, found, expected, 1e-12, kind="documents")
    claim = "roh-lee-linear: contact time is the same at all speeds"
    report.stays(claim, over_speed(time, "roh-lee-linear"), kind="invariants")
    for name in ("roh-lee", "penner"):
        report.falls(f"{name}: contact time decreases with speed", over_speed(time, name))
    too_fast = 1.01 * measured.PENNER_AT_REST / measured.PENNER_SLOPE
    try:
        fmu.impact(club_speed=too_fast, **BALLS["penner"].values)
        message = ""
    except UserError as error:
        message = str(error)
    claim = f"penner: the FMU rejects a touch at {too_fast:.0f} m/s, where the line is below 0"
    report.check(claim, "restitution_slope" in message, message or "it didn't")
    report.conclude(
        "Measured COR falls by 0.0029 per m/s of approach speed. With constant k and b COR is "
        "independent of speed; restitution_at_rest and restitution_slope follow the measurement "
        "(ball penner)."
    )
    report.say(
        f"The line is Penner's ({measured.PENNER}). Contact becomes shorter with speed, as "
        f"measured ({measured.LOUGHBOROUGH}), only with an exponent above 1. Tour drivers are "
        "above the line: they have flexible faces, and the line is that of a rigid head.",
    )
    # S = (1 + COR)/(1 + m_B/m_C), with the ball at rest.
    ratio = 1.0 + document.USED["m_ball"] / document.USED["m_club"]

    @report.figure("speed_dependence", "Measured COR falls; a ball with a COR line follows it.")
    def cor_and_smash_factor(figures):
        figure, (left, right) = figures.new_pair("COR and smash factor over club speed")
        for name, words in _BALLS.items():
            style, width = figures.STYLES[name], 4.0 if name == "penner" else 2.0
            for axes, metric in ((left, cor), (right, smash)):
                axes.plot(_SPEEDS, over_speed(metric, name), **style.line, lw=width, label=words)
        dots = {"color": figures.BLACK, "ls": ":", "lw": 1.5, "label": "measured line (Penner)"}
        left.plot(_SPEEDS, line, **dots)
        right.plot(_SPEEDS, [(1.0 + e) / ratio for e in line], **dots)
        labels = {"rigid": "published, rigid face", "flexible": "published, flexible face"}
        for m in measured.MEASUREMENTS:
            if m.metric == time:
                continue
            # Each follows from the other.
            e = m.middle if m.metric == cor else ratio * m.middle - 1.0
            points = {"color": figures.BLACK, "ms": 6, "zorder": 5, "label": labels.pop(m.face, "")}
            beside = {"textcoords": "offset points", "fontsize": 9, "zorder": 5}
            for axes, value in ((left, e), (right, (1.0 + e) / ratio)):
                at = m.club_speed, value
                axes.plot(*at, "o" if m.face == "rigid" else "^", **points)
                axes.annotate(m.short, at, _BESIDE.get(m.short, (8, -4)), **beside)
        left.set(xlabel="club speed (m/s)", ylabel="coefficient of restitution", ylim=(0.6, 1.0))
        right.set(xlabel="club speed (m/s)", ylabel="smash factor S")
        figures.add_legend_below(figure, left, columns=3)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
