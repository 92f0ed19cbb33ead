"""Compression ratings: what an indicative stiffness of each predicts over club speed."""

from golf_impact.scenario import BALLS, Report, document, main, rating_stiffness, shown

TITLE = "Compression ratings: low, mid and high over club speed (indicative)"
CHAPTER = 10

_PRESETS = ("rating-low", "rating-mid", "rating-high")

#: Where the document's bands of swing speed meet: 130 and 160 km/h, m/s.
_BANDS = (130.0 / 3.6, 160.0 / 3.6)

#: A club speed in each band, and how the document calls the balls for it.
_IN_BAND = {"slow": 32.0, "moderate": 40.0, "fast": 48.0}

_SPEEDS = tuple(float(speed) for speed in range(20, 61, 4))

#: The ratings whose stiffness is shown.
_RATINGS = (30, 45, 60, 73, 80, 90, 98, 110)

_COLUMNS = {
    "ball_velocity": "v_B (m/s)",
    "smash_factor": "S",
    "max_force": "max force (N)",
    "contact_time": "contact (µs)",
}


def run(fmu):
    """Three balls with the measured COR line, and with the document's assumption of one b."""
    report = Report(TITLE, fmu)
    report.table(
        "Rating and stiffness: 160 - mil of deflection under 200 lbf, one side of the ball",
        ["rating", *(str(rating) for rating in _RATINGS)],
        [["k (1e5 N/m)", *(f"{rating_stiffness(rating) / 1e5:.2f}" for rating in _RATINGS)]],
    )

    speeds = sorted({*_SPEEDS, *_IN_BAND.values()})

    def impacts(how, **changes):
        cases = {}
        for name in _PRESETS:
            for speed in speeds:
                values = {**BALLS[name].values, "club_speed": speed, **changes}
                cases[name, speed] = report.impact(f"{name}, {how}, {speed:g} m/s", **values)
        return cases

    line = impacts("COR line")
    fixed = impacts("b = 9", restitution_at_rest=0.0, restitution_slope=0.0, b=9.0)
    rows = []
    for speed in _IN_BAND.values():
        for name in _PRESETS:
            metrics, smash = line[name, speed], fixed[name, speed]["smash_factor"]
            diameters = metrics["max_compression"] / document.USED["ball_diameter"]
            values = [shown(metric, metrics[metric]) for metric in _COLUMNS]
            values += [f"{diameters:.3f}", shown("smash_factor", smash)]
            rows.append([f"{name.removeprefix('rating-')}, {speed:g} m/s", *values])
    report.table(
        "What it predicts: COR falling with speed as measured, the same for all ratings",
        ["rating, club speed", *_COLUMNS.values(), "compression / D", "S if b = 9 N·s/m"],
        rows,
    )
    for band, speed in _IN_BAND.items():
        for claim, trend, cases, metric in (
            ("a higher rating pushes harder", report.rises, line, "max_force"),
            ("its contact is shorter", report.falls, line, "contact_time"),
            ("it is compressed less", report.falls, line, "max_compression"),
            ("with one COR, S is the same", report.stays, line, "smash_factor"),
            ("with one b, S rises", report.rises, fixed, "smash_factor"),
        ):
            trend(f"{band}: {claim}", [cases[name, speed][metric] for name in _PRESETS])
    at = _IN_BAND["moderate"]
    gain = fixed["rating-high", at]["ball_velocity"] - fixed["rating-low", at]["ball_velocity"]
    report.say(
        "Indicative only: there is no industry standard of compression, a rating is a slow squeeze "
        "to a fifth of an impact's force or less, and it says nothing about damping. The swing "
        "speed bands are the document's.",
        "That a harder ball is faster follows from the document's assumption of one b for all: "
        f"{gain:.1f} m/s at {at:g} m/s between low and high. With one COR for all, rating changes "
        "force, contact time and compression (feel), not ball speed.",
    )

    @report.figure(
        "rating",
        "With one b for all a higher rating is faster; with the measured COR all are the same, and "
        "only compression, force and time differ.",
    )
    def over_speed(figures):
        figure, (left, right) = figures.new_pair("Compression ratings over club speed (indicative)")
        for name in _PRESETS:
            look = figures.LOOKS[name].line
            smash = [fixed[name, speed]["smash_factor"] for speed in _SPEEDS]
            squashed = [line[name, speed]["max_compression"] * 1e3 for speed in _SPEEDS]
            left.plot(_SPEEDS, smash, **look, label=BALLS[name].title)
            right.plot(_SPEEDS, squashed, **look)
        smash = [line[_PRESETS[0], speed]["smash_factor"] for speed in _SPEEDS]
        look = {"color": figures.BLACK, "ls": ":"}
        left.plot(_SPEEDS, smash, **look, label="every rating, measured COR line")
        left.annotate("each rating with b = 9 N·s/m", (21.0, 1.555), fontsize=9)
        for axes in (left, right):
            for edge in _BANDS:
                axes.axvline(edge, color=figures.BLACK, alpha=0.4, lw=1.0, ls=":")
            low = axes.get_xaxis_transform()
            for band, x in zip(_IN_BAND, (28.0, 40.3, 52.0), strict=True):
                axes.annotate(band, (x, 0.02), xycoords=low, ha="center", fontsize=9)
            axes.set_xlabel("club speed (m/s); dotted: 130 and 160 km/h")
        left.set_ylabel("smash factor S")
        right.set(ylabel="largest compression (mm)", ylim=(0, None))
        figures.legend_below(figure, left, columns=2)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
