"""A diagram of the model (the document's Fig. 1): two masses and the contact between them."""

from golf_impact.scenario import Report, main

TITLE = "Diagram: two masses and the contact between"
CHAPTER = 1

#: Text beside each diagram, by law.
_WORDS = {
    1: (
        "law 1 (absolute)",
        "a drag on each body,\nagainst the ground",
        r"$m_C\, \dot v_C = -k\, d - b\, v_C$",
        r"$m_B\, \dot v_B = k\, d - b\, v_B$",
    ),
    2: (
        "law 2 (relative)",
        "a damper between the bodies,\nbeside the spring",
        r"$m_C\, \dot v_C = -F,\quad m_B\, \dot v_B = F$",
        r"$F = k\, d + b\, \dot d$",
    ),
}

#: Polylines in the complex plane, from 0 to 1.9.
_ZIGZAG = [0.38 + 0.1625 * n + (-0.2j if n % 2 else 0.2j) for n in range(8)]
_SPRING = [[0.0, 0.3, *_ZIGZAG, 1.6, 1.9]]
_DAMPER = [[0.0, 0.95], [0.95 - 0.13j, 0.95 + 0.13j], [1.2, 1.9]]
_DAMPER += [[0.75 + 0.2j, 1.2 + 0.2j, 1.2 - 0.2j, 0.75 - 0.2j]]

#: The ground, with hatching below.
_GROUND = [[-0.5, 0.5], *([x, x - 0.12 - 0.14j] for x in (-0.4, -0.2, 0.0, 0.2, 0.4))]


def run(fmu):
    """A diagram; nothing is simulated."""
    report = Report(TITLE, fmu)
    report.figure("diagram", "The ball is a mass behind a spring: d = x_C − x_B.")(draw)
    return report


def draw(figures):
    """Plot both laws, one above the other."""
    from matplotlib.patches import Circle, FancyBboxPatch, Rectangle

    figure, axes = figures.new("Club, ball, and the contact between them", (8.2, 6.6))
    axes.set(xlim=(0.2, 10.8), ylim=(-2.5, 6.5), aspect="equal")
    axes.axis("off")
    club, ball = (figures.STYLES[body].colour for body in ("club", "ball"))

    def place(strokes, at, colour, turn=1.0, width=1.8):
        for stroke in strokes:
            points = [at + turn * point for point in stroke]
            xs, ys = [z.real for z in points], [z.imag for z in points]
            axes.plot(xs, ys, color=colour, lw=width, solid_capstyle="round")

    for law, y in ((1, 4.2), (2, -0.6)):
        colour, half = figures.STYLES[f"law {law}"].colour, 0.4 if law == 1 else 0.75
        rounded = "round,pad=0,rounding_size=0.12"
        box = FancyBboxPatch((0.7, y - 0.8), 2.0, 1.6, rounded, fc=club, ec="black", lw=1.4)
        axes.add_patch(box)
        axes.text(1.7, y, "club\n$m_C$", ha="center", va="center")
        axes.add_patch(Circle((4.22, y), 1.5, fc="#E9F3FA", ec="black", lw=1.4))
        axes.add_patch(Rectangle((4.7, y - half), 0.62, 2.0 * half, fc="white", ec=ball, lw=1.8))
        axes.text(5.01, y, "$m_B$", ha="center", va="center", fontsize=10)
        axes.text(4.22, y + 1.08, "ball", ha="center", va="center")
        spring = y if law == 1 else y + 0.35
        place(_SPRING, complex(2.8, spring), ball)
        axes.text(3.75, spring + 0.32, "$k$", ha="center", color=ball)
        if law == 1:
            for x, bottom in ((1.7, y - 0.8), (5.01, y - half)):
                floor = complex(x, y - 2.3)
                place([[complex(x, bottom), floor + 1.14j]], 0.0, colour)
                place(_DAMPER, floor + 1.14j, colour, turn=-0.6j)
                place(_GROUND, floor, figures.BLACK, width=1.0)
                axes.text(x + 0.32, y - 1.85, "$b$", va="center", color=colour)
        else:
            place(_DAMPER, complex(2.8, y - 0.4), colour)
            axes.text(3.75, y - 0.72, "$b$", ha="center", va="top", color=colour)
        for x, symbols in ((0.9, "x_C,\\ v_C"), (4.0, "x_B,\\ v_B")):
            arrow = {"arrowstyle": "->", "lw": 1.4}
            axes.annotate("", (x + 0.9, y + 1.85), (x, y + 1.85), arrowprops=arrow)
            axes.text(x + 1.0, y + 1.85, f"${symbols}$", va="center")
        name, *words = _WORDS[law]
        axes.text(6.5, y + 1.15, name, color=colour, fontweight="bold", va="center")
        for text, height in zip(words, (0.4, -0.5, -1.1)):
            axes.text(6.5, y + height, text, va="center")
        axes.text(6.5, y - 1.8, "$d = x_C - x_B$: compression", va="center", color="0.25")
    return figure


if __name__ == "__main__":
    main(__file__)
