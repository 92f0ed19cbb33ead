"""The model drawn (the document's Fig. 1): two masses, and the ball's spring between them."""

from golf_scenarios.scenario import Report, main

TITLE = "The model"
CHAPTER = 1


def run(fmu):
    """A drawing; nothing is simulated."""
    report = Report(TITLE, fmu)
    report.figure("diagram")(draw)
    report.say(
        "Law 2's damper stands between the bodies, beside the spring; law 1's drag acts on each "
        "body against the ground, which is what the document's equations say."
    )
    return report


def draw(figures):
    """Both laws, one above the other."""
    from matplotlib.patches import Circle, FancyBboxPatch

    figure, axes = figures.new("Club, ball, and the contact between them", (8.2, 6.2))
    axes.set(xlim=(0, 10), ylim=(-0.5, 7.1), aspect="equal")
    axes.axis("off")

    def spring(x0: float, x1: float, y: float, colour: str) -> None:
        n = 8
        xs, ys = [x0, x0 + 0.3], [y, y]
        for i in range(n):
            xs.append(x0 + 0.3 + (i + 0.5) * (x1 - x0 - 0.6) / n)
            ys.append(y + (0.22 if i % 2 else -0.22))
        axes.plot([*xs, x1 - 0.3, x1], [*ys, y, y], color=colour, lw=1.8)

    def damper(x0: float, x1: float, y: float, colour: str) -> None:
        middle = 0.5 * (x0 + x1)
        strokes = [
            ([x0, middle], [y, y]),
            ([middle, middle], [y - 0.13, y + 0.13]),
            ([middle - 0.25, middle + 0.25], [y + 0.22, y + 0.22]),
            ([middle - 0.25, middle + 0.25], [y - 0.22, y - 0.22]),
            ([middle + 0.25, middle + 0.25], [y - 0.22, y + 0.22]),
            ([middle + 0.25, x1], [y, y]),
        ]
        for xs, ys in strokes:
            axes.plot(xs, ys, color=colour, lw=1.8)

    for base, law, text in (
        (3.9, 1, "law 1 (absolute): a drag b·v on each body"),
        (0.0, 2, "law 2 (relative): a damper between the bodies"),
    ):
        y = base + 1.2
        axes.text(0.2, base + 2.75, text, fontweight="bold")
        club = FancyBboxPatch(
            (0.9, y - 0.65), 2.1, 1.3, boxstyle="round,pad=0.05", fc=figures.ORANGE, ec="black"
        )
        axes.add_patch(club)
        axes.text(1.95, y, "club\n$m_C$", ha="center", va="center")
        axes.add_patch(Circle((7.6, y), 0.72, fc="white", ec="black", lw=1.6))
        axes.text(7.6, y, "ball\n$m_B$", ha="center", va="center")
        if law == 1:
            spring(3.05, 6.88, y, figures.BLUE)
            axes.text(4.95, y + 0.4, "$k$", ha="center", color=figures.BLUE)
            for x in (1.95, 7.6):
                top = y - 0.72
                axes.plot([x - 0.5, x + 0.5], [top - 0.62] * 2, color="black", lw=1.2)
                for i in range(5):
                    left = x - 0.5 + 0.22 * i
                    axes.plot([left, left - 0.1], [top - 0.62, top - 0.75], color="black", lw=0.8)
                axes.plot([x] * 2, [top, top - 0.25], color=figures.VERMILION, lw=1.8)
                axes.plot([x - 0.14, x + 0.14], [top - 0.25] * 2, color=figures.VERMILION, lw=1.8)
                axes.plot(
                    [x - 0.22, x - 0.22, x + 0.22, x + 0.22],
                    [top - 0.12, top - 0.42, top - 0.42, top - 0.12],
                    color=figures.VERMILION,
                    lw=1.8,
                )
                axes.plot([x] * 2, [top - 0.42, top - 0.62], color=figures.VERMILION, lw=1.8)
                axes.text(x + 0.36, top - 0.3, "$b$", va="center", color=figures.VERMILION)
        else:
            spring(3.05, 6.88, y + 0.32, figures.BLUE)
            damper(3.05, 6.88, y - 0.32, figures.VERMILION)
            axes.text(3.35, y + 0.66, "$k$", ha="center", color=figures.BLUE)
            axes.text(3.35, y - 0.78, "$b$", ha="center", color=figures.VERMILION)
        axes.annotate(
            "", (0.95 + 2.0, y + 0.98), (0.95, y + 0.98), arrowprops={"arrowstyle": "->", "lw": 1.4}
        )
        axes.text(3.05, y + 0.98, "$x_C,\\ v_C$", va="center")
        axes.annotate(
            "", (8.4, y + 0.98), (6.9, y + 0.98), arrowprops={"arrowstyle": "->", "lw": 1.4}
        )
        axes.text(8.5, y + 0.98, "$x_B,\\ v_B$", va="center")
    axes.text(0.2, -0.3, "compression $d = x_C - x_B > 0$ while in contact", color="0.25")
    return figure


if __name__ == "__main__":
    main(__file__)
