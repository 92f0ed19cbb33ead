"""Compression ratings: predictions over club speed from an indicative stiffness of each."""

from golf_impact.scenario import BALLS, QUANTITIES, Report, document, main, rating_stiffness

TITLE = "Rating: compression ratings over club speed"
CHAPTER = 10

_PRESETS = ("rating-low", "rating-mid", "rating-high")

#: Club speeds, m/s; of them one in each of the document's bands, and the limits of these bands.
_SPEEDS = tuple(float(speed) for speed in range(20, 61, 4))
_IN_BAND = {"slow": 32.0, "moderate": 40.0, "fast": 48.0}
_LIMITS = (130.0 / 3.6, 160.0 / 3.6)

#: The ratings in the table of stiffnesses.
_RATINGS = (30, 45, 60, 73, 80, 90, 98, 110)

_COLUMNS = ("ball_velocity", "smash_factor", "max_force", "contact_time")


def run(fmu):
    """Three balls with the measured COR line, and with the same b as the document assumes."""
    report = Report(TITLE, fmu)
    report.table(
        "Rating and stiffness: 160 - mil of deflection under 200 lbf, one side of the ball",
        ["rating", *(str(rating) for rating in _RATINGS)],
        [["k (1e5 N/m)", *(f"{rating_stiffness(rating) / 1e5:.2f}" for rating in _RATINGS)]],
    )

    # By ball and club speed.
    line, fixed = {}, {}
    for name in _PRESETS:
        for speed in _SPEEDS:
            values = {**BALLS[name].values, "club_speed": speed}
            line[name, speed] = report.impact(f"{name}, COR line, {speed:g} m/s", **values)
            values |= {"restitution_at_rest": 0.0, "restitution_slope": 0.0, "b": 9.0}
            fixed[name, speed] = report.impact(f"{name}, b = 9, {speed:g} m/s", **values)
    rows = []
    for band, speed in _IN_BAND.items():
        for name in _PRESETS:
            metrics = line[name, speed]
            cells = [QUANTITIES[metric].format_value(metrics[metric]) for metric in _COLUMNS]
            cells.append(f"{metrics['max_compression'] / document.USED['ball_diameter']:.3f}")
            cells.append(f"{fixed[name, speed]['smash_factor']:.4f}")
            rows.append([f"{name.removeprefix('rating-')}, {speed:g} m/s", *cells])
        for claim, trend, cases, metric in (
            ("a higher rating has a larger maximum force", report.rises, line, "max_force"),
            ("a higher rating has a shorter contact", report.falls, line, "contact_time"),
            ("a higher rating is compressed less", report.falls, line, "max_compression"),
            ("with the same COR, S is the same", report.stays, line, "smash_factor"),
            ("with the same b, S increases with rating", report.rises, fixed, "smash_factor"),
        ):
            trend(f"{band}: {claim}", [cases[name, speed][metric] for name in _PRESETS])
    labels = [QUANTITIES[metric].label for metric in _COLUMNS]
    columns = ["rating, club speed", *labels, "compression / D", "S if b = 9 N·s/m"]
    report.table("Predictions with the measured COR line, the same for all ratings", columns, rows)
    at = _IN_BAND["moderate"]
    gain = fixed["rating-high", at]["ball_velocity"] - fixed["rating-low", at]["ball_velocity"]
    report.say(
        "Indicative only: there is no industry standard for compression. A rating comes from slow "
        "compression by a fifth of the force of an impact or less, without any information on "
        "damping.",
        "That a harder ball is faster follows from the document's assumption of the same b: "
        f"{gain:.1f} m/s at {at:g} m/s between low and high.",
    )

    @report.figure("rating", "The rating determines compression, ball speed only if b is the same.")
    def over_speed(figures):
        title = "Compression ratings over club speed (indicative)"
        figure, (left, right) = figures.new_pair(title, "law 2, k from the rating")
        for name in _PRESETS:
            style = figures.STYLES[name].line
            smash = [fixed[name, speed]["smash_factor"] for speed in _SPEEDS]
            compression = [line[name, speed]["max_compression"] * 1e3 for speed in _SPEEDS]
            left.plot(_SPEEDS, smash, **style, label=BALLS[name].title)
            right.plot(_SPEEDS, compression, **style)
        smash = [line[_PRESETS[0], speed]["smash_factor"] for speed in _SPEEDS]
        dots = {"color": figures.BLACK, "ls": ":", "label": "all ratings, measured COR line"}
        left.plot(_SPEEDS, smash, **dots)
        left.annotate("each rating with b = 9 N·s/m", (21.0, 1.555), fontsize=9)
        for axes in (left, right):
            at_bottom = {"transform": axes.get_xaxis_transform(), "ha": "center", "fontsize": 9}
            for limit in _LIMITS:
                axes.axvline(limit, color=figures.BLACK, alpha=0.4, lw=1.0, ls=":")
            for band, speed in _IN_BAND.items():
                axes.text(speed, 0.02, band, **at_bottom)
            axes.set_xlabel("club speed (m/s); dotted: 130 and 160 km/h")
        left.set_ylabel("smash factor S (axis doesn't begin at 0)")
        right.set(ylabel="maximum compression (mm)", ylim=(0, None))
        figures.add_legend_below(figure, left, columns=2)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
