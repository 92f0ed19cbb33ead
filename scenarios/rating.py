"""Compression ratings over club speed: what a rating determines, and what not (indicative)."""

import matplotlib.pyplot as plt
import numpy as np

from golf_impact.data.balls import BALLS, rating_stiffness
from golf_impact.data.quantities import describe
from golf_impact.scenario import Result, main

NAMES = ("rating-low", "rating-mid", "rating-high")
SPEEDS = np.arange(20.0, 61.0, 4.0)

#: The same damping for all, as the document assumes, instead of the measured COR line.
FIXED = {"restitution_at_rest": 0.0, "restitution_slope": 0.0, "b": 9.0}


def run(impact):
    result = Result("Compression ratings over club speed (indicative)")
    line, fixed = {name: [] for name in NAMES}, {name: [] for name in NAMES}
    for name in NAMES:
        for speed in SPEEDS.tolist():
            values = {**BALLS[name].values, "club_speed": speed}
            for rows, more, words in ((line, {}, "COR line"), (fixed, FIXED, "b = 9")):
                rows[name].append(impact(**values | more))
                result.cases[f"{name}, {words}, {speed:g} m/s"] = rows[name][-1]

    def over(rows, metric):
        """An output by rating (rows, from low to high) and club speed."""
        return np.array([[row[metric] for row in rows[name]] for name in NAMES])

    def steps(rows, metric):
        """Changes from a rating to the next higher one."""
        return np.diff(over(rows, metric), axis=0)

    result.claims = {
        "a higher rating has a larger force": np.all(steps(line, "max_force") > 0.0),
        "and a shorter contact": np.all(steps(line, "contact_time") < 0.0),
        "with the same COR, S is the same": np.abs(steps(line, "smash_factor")).max() < 1e-13,
        "with the same b (the document) S increases": np.all(steps(fixed, "smash_factor") > 0.0),
    }
    at = int(np.argmax(SPEEDS == 40.0))
    gain = over(fixed, "ball_velocity")[:, at]
    result.words = (
        "There is no industry standard for compression: a rating comes from slow compression by a "
        "fifth of an impact's force or less, without any information on damping. That a harder "
        "ball is faster follows from the assumption of the same b: "
        f"{gain[2] - gain[0]:.1f} m/s at 40 m/s."
    )
    ratings = (30, 45, 60, 73, 80, 90, 98, 110)
    cells = [f"{rating_stiffness(rating) / 1e6:.3f}" for rating in ratings]
    title = "k of a rating, 160 - mil of deflection under 200 lbf, of one side (law 2; b is open)"
    result.tables.append((title, ["rating", *map(str, ratings)], [["k (MN/m)", *cells]]))
    metrics = {
        "ball_velocity": ("v_B (m/s)", 1.0), "max_force": ("max force (N)", 1.0),
        "contact_time": ("contact time (µs)", 1e6), "max_compression": ("compression (mm)", 1e3),
    }  # fmt: skip
    table = []
    for name, with_line, with_b in zip(NAMES, line.values(), fixed.values()):
        numbers = (f"{with_line[at][m] * factor:.4g}" for m, (_, factor) in metrics.items())
        law = describe(BALLS[name].values)
        table.append([BALLS[name].title, law, *numbers, f"{with_b[at]['smash_factor']:.4f}"])
    columns = ["40 m/s", "law, k, b", *(label for label, _ in metrics.values()), "S if b = 9 N·s/m"]
    result.tables.append(("Predictions with the measured COR line", columns, table))

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2))
    figure.suptitle("With the measured COR line no rating is faster (law 2, k from the rating)")
    for name, dashes, row in zip(NAMES, ("--", "-", "-."), over(fixed, "smash_factor")):
        left.plot(SPEEDS, row, dashes, label=f"{BALLS[name].title}, b = 9 N·s/m")
    left.plot(SPEEDS, over(line, "smash_factor")[0], "k:", label="all ratings, measured COR line")
    for name, dashes, row in zip(NAMES, ("--", "-", "-."), over(line, "max_compression")):
        right.plot(SPEEDS, row * 1e3, dashes, label=BALLS[name].title)
    left.set(xlabel="club speed (m/s)", ylabel="smash factor S")
    right.set(xlabel="club speed (m/s)", ylabel="maximum compression (mm)", ylim=(0, None))
    low, high = left.get_ylim()
    left.set_ylim(low - 0.5 * (high - low), high)
    left.legend(fontsize=9, loc="lower left")
    right.legend(fontsize=9, loc="lower right")
    result.figures["rating"] = figure
    return result


if __name__ == "__main__":
    main(run)
