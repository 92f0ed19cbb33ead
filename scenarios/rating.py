"""Compression ratings: predictions over club speed from an indicative stiffness of each."""

from golf_impact.scenario import BALLS, Report, document, format_value, main, rating_stiffness

TITLE = "Rating: compression ratings over club speed"
CHAPTER = 10

_PRESETS = ("rating-low", "rating-mid", "rating-high")

#: Club speeds, m/s; of them one in each of the document's bands, and the limits of these bands.
_SPEEDS = tuple(float(speed) for speed in range(20, 61, 4))
_IN_BAND = {"slow": 32.0, "moderate": 40.0, "fast": 48.0}
_LIMITS = (130.0 / 3.6, 160.0 / 3.6)

#: The ratings in the table of stiffnesses.
_RATINGS = (30, 45, 60, 73, 80, 90, 98, 110)

_COLUMNS = {
    "ball_velocity": "v_B (m/s)",
    "smash_factor": "S",
    "max_force": "max force (N)",
    "contact_time": "contact (µs)",
}


def run(fmu):
    """Three balls with the measured COR line, and with the same b as the document assumes."""
    report = Report(TITLE, fmu)
    report.table(
        "Rating and stiffness: 160 - mil of deflection under 200 lbf, one side of the ball",
        ["rating", *(str(rating) for rating in _RATINGS)],
        [["k (1e5 N/m)", *(f"{rating_stiffness(rating) / 1e5:.2f}" for rating in _RATINGS)]],
    )

    def impacts(how, **changes):
        """Metrics by ball and club speed."""
        cases = {}
        for name in _PRESETS:
            for speed in _SPEEDS:
                values = {**BALLS[name].values, "club_speed": speed, **changes}
                cases[name, speed] = report.impact(f"{name}, {how}, {speed:g} m/s", **values)
        return cases

    line = impacts("COR line")
    fixed = impacts("b = 9", restitution_at_rest=0.0, restitution_slope=0.0, b=9.0)
    rows = [
        [
            f"{name.removeprefix('rating-')}, {speed:g} m/s",
            *(format_value(metric, line[name, speed][metric]) for metric in _COLUMNS),
            f"{line[name, speed]['max_compression'] / document.USED['ball_diameter']:.3f}",
            format_value("smash_factor", fixed[name, speed]["smash_factor"]),
        ]
        for speed in _IN_BAND.values()
        for name in _PRESETS
    ]
    report.table(
        "Predictions with the measured COR line, the same for all ratings",
        ["rating, club speed", *_COLUMNS.values(), "compression / D", "S if b = 9 N·s/m"],
        rows,
    )
    for band, speed in _IN_BAND.items():
        for claim, trend, cases, metric in (
            ("a higher rating has a larger maximum force", report.rises, line, "max_force"),
            ("a higher rating has a shorter contact", report.falls, line, "contact_time"),
            ("a higher rating is compressed less", report.falls, line, "max_compression"),
            ("with the same COR, S is the same", report.stays, line, "smash_factor"),
            ("with the same b, S increases with rating", report.rises, fixed, "smash_factor"),
        ):
            trend(f"{band}: {claim}", [cases[name, speed][metric] for name in _PRESETS])
    at = _IN_BAND["moderate"]
    gain = fixed["rating-high", at]["ball_velocity"] - fixed["rating-low", at]["ball_velocity"]
    report.say(
        "Indicative only: there is no industry standard for compression. A rating comes from slow "
        "compression by a fifth of the force of an impact or less, without any information on "
        "damping. The bands of swing speed are the document's.",
        "That a harder ball is faster follows from the document's assumption of the same b: "
        f"{gain:.1f} m/s at {at:g} m/s between low and high. With the same COR, the rating changes "
        "force, contact time and compression (feel), not ball speed.",
    )

    @report.figure(
        "rating",
        "With the same b a higher rating gives a higher ball speed; with the measured COR only "
        "compression, force and contact time differ.",
    )
    def over_speed(figures):
        figure, (left, right) = figures.new_pair(
            "Compression ratings over club speed (indicative)", "law 2, k from the rating"
        )
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
            for limit in _LIMITS:
                axes.axvline(limit, color=figures.BLACK, alpha=0.4, lw=1.0, ls=":")
            for band, speed in _IN_BAND.items():
                above = axes.get_xaxis_transform()
                axes.text(speed, 0.02, band, transform=above, ha="center", fontsize=9)
            axes.set_xlabel("club speed (m/s); dotted: 130 and 160 km/h")
        left.set_ylabel("smash factor S")
        right.set(ylabel="maximum compression (mm)", ylim=(0, None))
        figures.add_legend_below(figure, left, columns=2)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
