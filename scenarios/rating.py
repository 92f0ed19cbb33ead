"""Compression ratings: what an indicative stiffness of each predicts over club speed."""

from golf_scenarios.facts.balls import BALLS, rating_stiffness
from golf_scenarios.facts.document import USED
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.checks import falls, rises, run_case, shown, stays
from golf_scenarios.report.outcome import Outcome, Table

TITLE = "Compression ratings: low, mid and high over club speed (indicative)"

_PRESETS = ("rating-low", "rating-mid", "rating-high")

#: Where the document's bands of swing speed meet: 130 and 160 km/h, m/s.
_BANDS = (130.0 / 3.6, 160.0 / 3.6)

#: A club speed in each band, and how the document calls the balls for it.
_IN_BAND = {"slow": 32.0, "moderate": 40.0, "fast": 48.0}

_SPEEDS = tuple(float(speed) for speed in range(20, 61, 4))

#: The ratings whose stiffness is shown.
_RATINGS = (30, 45, 60, 73, 80, 90, 98, 110)

_COLUMNS = ("ball_velocity", "smash_factor", "max_force", "contact_time", "max_compression")


def run(fmu: ImpactFmu) -> Outcome:
    """Three balls with the measured COR line, and with the document's assumption of one b."""
    outcome = Outcome(TITLE)
    outcome.tables.append(
        Table(
            "Rating and stiffness: 160 - mil of deflection under 200 lbf, one side of the ball",
            ["rating", *(str(rating) for rating in _RATINGS)],
            [["k (1e5 N/m)", *(f"{rating_stiffness(rating) / 1e5:.2f}" for rating in _RATINGS)]],
        )
    )
    line = _impacts(outcome, fmu, "COR line", {})
    damper = {"restitution_at_rest": 0.0, "restitution_slope": 0.0, "b": 9.0}
    fixed = _impacts(outcome, fmu, "b = 9", damper)
    rows = []
    for speed in _IN_BAND.values():
        for name in _PRESETS:
            metrics = line[name, speed]
            diameter = metrics["max_compression"] / USED["ball_diameter"]
            rows.append(
                [
                    f"{name.removeprefix('rating-')}, {speed:g} m/s",
                    *(shown(metric, metrics[metric]) for metric in _COLUMNS[:-1]),
                    f"{diameter:.3f}",
                    shown("smash_factor", fixed[name, speed]["smash_factor"]),
                ]
            )
    outcome.tables.append(
        Table(
            "What it predicts: COR falling with speed as measured, the same for all ratings",
            [
                "rating, club speed",
                "v_B (m/s)",
                "S",
                "max force (N)",
                "contact (µs)",
                "compression / D",
                "S if b = 9",
            ],
            rows,
        )
    )
    for band, speed in _IN_BAND.items():

        def by_rating(found, metric: str, speed: float = speed) -> list[float]:
            return [found[name, speed][metric] for name in _PRESETS]

        rises(outcome, f"{band}: a higher rating pushes harder", by_rating(line, "max_force"))
        falls(outcome, f"{band}: its contact is shorter", by_rating(line, "contact_time"))
        falls(outcome, f"{band}: it is compressed less", by_rating(line, "max_compression"))
        stays(outcome, f"{band}: with one COR, S is the same", by_rating(line, "smash_factor"))
        rises(outcome, f"{band}: with one b, S rises", by_rating(fixed, "smash_factor"))
    at = _IN_BAND["moderate"]
    gain = fixed["rating-high", at]["ball_velocity"] - fixed["rating-low", at]["ball_velocity"]
    outcome.words += [
        "Indicative only: there is no industry standard of compression, a rating is a slow squeeze "
        "to a fifth of an impact's force or less, and it says nothing about damping. The swing "
        "speed bands are the document's.",
        "That a harder ball is faster follows from the document's assumption of one b for all: "
        f"{gain:.1f} m/s at {at:g} m/s between low and high. With one COR for all, rating changes "
        "force, contact time and compression (feel), not ball speed.",
    ]
    outcome.figures["rating"] = lambda: _drawn(line, fixed)
    return outcome


def _impacts(
    outcome: Outcome, fmu: ImpactFmu, how: str, changes: dict[str, float]
) -> dict[tuple[str, float], dict[str, float]]:
    return {
        (name, speed): run_case(
            outcome,
            fmu,
            f"{name}, {how}, {speed:g} m/s",
            club_speed=speed,
            **{**BALLS[name].values, **changes},
        )
        for name in _PRESETS
        for speed in sorted({*_SPEEDS, *_IN_BAND.values()})
    }


def _drawn(line: dict, fixed: dict):
    from golf_scenarios.report import figures

    figure, (left, right) = figures.new_pair("Compression ratings over club speed (indicative)")
    for name, colour, style in zip(
        _PRESETS, (figures.SKY, figures.BLUE, figures.ORANGE), ("-", "--", "-."), strict=True
    ):
        label = BALLS[name].title
        smash = [fixed[name, speed]["smash_factor"] for speed in _SPEEDS]
        time = [line[name, speed]["max_compression"] * 1e3 for speed in _SPEEDS]
        left.plot(_SPEEDS, smash, color=colour, ls=style, label=label)
        right.plot(_SPEEDS, time, color=colour, ls=style)
    smash = [line[_PRESETS[0], speed]["smash_factor"] for speed in _SPEEDS]
    left.plot(_SPEEDS, smash, color=figures.BLACK, lw=1.5, label="every rating, measured COR line")
    left.annotate("each rating with b = 9", (21.0, 1.555), fontsize=9)
    for axes in (left, right):
        for edge in _BANDS:
            axes.axvline(edge, color=figures.BLACK, alpha=0.4, lw=1.0, ls=":")
        for band, x in zip(_IN_BAND, (28.0, 40.3, 52.0), strict=True):
            axes.annotate(
                band,
                (x, 0.02),
                xycoords=axes.get_xaxis_transform(),
                ha="center",
                fontsize=9,
            )
        axes.set_xlabel("club speed (m/s); dotted: 130 and 160 km/h")
    left.set_ylabel("smash factor S")
    right.set(ylabel="largest compression (mm)", ylim=(0, None))
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return figure


if __name__ == "__main__":
    from golf_scenarios.commands.app import run_alone

    run_alone("rating")
