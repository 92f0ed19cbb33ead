"""A diagram of the model (the document's Fig. 1): two masses and the contact between them."""

from golf_impact.scenario import Report, main

TITLE = "Diagram: two masses and the contact between"
CHAPTER = 1


#: Text beside each diagram.
_WORDS = {
    1: (
        "law 1 (absolute)",
        "a drag on each body,\nagainst the ground",
        ("$m_C\\, \\dot v_C = -k\\, d - b\\, v_C$", "$m_B\\, \\dot v_B = k\\, d - b\\, v_B$"),
    ),
    2: (
        "law 2 (relative)",
        "a damper between the bodies,\nbeside the spring",
        ("$m_C\\, \\dot v_C = -F,\\quad m_B\\, \\dot v_B = F$", "$F = k\\, d + b\\, \\dot d$"),
    ),
}


def run(fmu):
    """A diagram; nothing is simulated."""
    report = Report(TITLE, fmu)
    report.figure(
        "diagram",
        "The ball is a mass m_B behind a spring k that the club face compresses by d = x_C − x_B.",
    )(draw)
    report.say(
        "Law 1 is the document's equations, read with d = x_C − x_B: a drag on each body against "
        "the ground. Law 2 is the document's text: a damper between the bodies, parallel to the "
        "spring."
    )
    return report


def draw(figures):
    """Plot both laws, one above the other."""
    from matplotlib.patches import Circle, FancyBboxPatch, Rectangle

    figure, axes = figures.new("Club, ball, and the contact between them", (8.2, 6.6))
    axes.set(xlim=(0.2, 10.8), ylim=(-2.5, 6.5), aspect="equal")
    axes.axis("off")
    club, ball = (figures.STYLES[body].colour for body in ("club", "ball"))

    def lines(strokes, colour, width=1.8):
        for xs, ys in strokes:
            axes.plot(xs, ys, color=colour, lw=width, solid_capstyle="round")

    def spring(y):
        ends = (2.8, 3.1, 4.4, 4.7)
        zigzag = [(ends[1] + (n + 0.5) * 1.3 / 8, y + (-0.2 if n % 2 else 0.2)) for n in range(8)]
        xs, ys = zip((ends[0], y), (ends[1], y), *zigzag, (ends[2], y), (ends[3], y))
        lines([(xs, ys)], ball)
        axes.text(3.75, y + 0.32, "$k$", ha="center", color=ball)

    def damper(y, colour):
        cup = ([3.55, 4.0, 4.0, 3.55], [y + 0.2, y + 0.2, y - 0.2, y - 0.2])
        lines([([2.8, 3.75], [y] * 2), ([3.75] * 2, [y - 0.13, y + 0.13]), cup], colour)
        lines([([4.0, 4.7], [y] * 2)], colour)
        axes.text(3.75, y - 0.32, "$b$", ha="center", va="top", color=colour)

    def drag(x, top, floor, colour):
        cup = ([x - 0.2, x - 0.2, x + 0.2, x + 0.2], [floor + d for d in (0.5, 0.25, 0.25, 0.5)])
        lines([([x] * 2, [top, floor + 0.4]), ([x - 0.13, x + 0.13], [floor + 0.4] * 2)], colour)
        lines([cup, ([x] * 2, [floor + 0.25, floor])], colour)
        axes.text(x + 0.32, floor + 0.35, "$b$", va="center", color=colour)
        lines([([x - 0.5, x + 0.5], [floor] * 2)], figures.BLACK, 1.2)
        hatch = (x - 0.4 + 0.2 * n for n in range(5))
        lines((([left, left - 0.12], [floor, floor - 0.14]) for left in hatch), "black", 0.8)

    for law, y in ((1, 4.2), (2, -0.6)):
        colour = figures.STYLES[f"law {law}"].colour
        axes.add_patch(FancyBboxPatch((0.7, y - 0.8), 2.0, 1.6, fc=club, ec="black", lw=1.4,
                                      boxstyle="round,pad=0,rounding_size=0.12"))  # fmt: skip
        axes.text(1.7, y, "club\n$m_C$", ha="center", va="center")
        axes.add_patch(Circle((4.22, y), 1.5, fc="#E9F3FA", ec="black", lw=1.4))
        half = 0.4 if law == 1 else 0.75
        axes.add_patch(Rectangle((4.7, y - half), 0.62, 2.0 * half, fc="white", ec=ball, lw=1.8))
        axes.text(5.01, y, "$m_B$", ha="center", va="center", fontsize=10)
        axes.text(4.22, y + 1.08, "ball", ha="center", va="center")
        if law == 1:
            spring(y)
            drag(1.7, y - 0.8, y - 2.3, colour)
            drag(5.01, y - half, y - 2.3, colour)
        else:
            spring(y + 0.35)
            damper(y - 0.4, colour)
        for x, symbols in ((0.9, "x_C,\\ v_C"), (4.0, "x_B,\\ v_B")):
            axes.annotate("", (x + 0.9, y + 1.85), (x, y + 1.85),
                          arrowprops={"arrowstyle": "->", "lw": 1.4})  # fmt: skip
            axes.text(x + 1.0, y + 1.85, f"${symbols}$", va="center")
        name, words, equations = _WORDS[law]
        axes.text(6.5, y + 1.15, name, color=colour, fontweight="bold", va="center")
        axes.text(6.5, y + 0.4, words, va="center")
        for n, equation in enumerate(equations):
            axes.text(6.5, y - 0.5 - 0.6 * n, equation, va="center")
        axes.text(6.5, y - 1.8, "$d = x_C - x_B$: compression", va="center", color="0.25")
    return figure


if __name__ == "__main__":
    main(__file__)
