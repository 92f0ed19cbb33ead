"""What pictures show, as text: for sessions in transcripts."""

from unittest import mock

from golf_impact.studies.sweep import picture
from golf_impact.studies.sweep.sweep import OUTPUTS, Design, sobol_indices


def sweep_picture(sets, outputs=OUTPUTS, samples=None):
    """Print what the picture of a sweep shows."""
    design, drawn = Design(sets, outputs, samples), []
    indices = sobol_indices(design) if len(design.distributions) > 1 else {}
    with mock.patch.object(picture, "png", lambda figure: drawn.append(figure) or b"image"):
        image = picture.picture(design, indices)
    for axes in drawn[0].axes if image else ():
        print(*shown(axes), sep="\n")


def shown(axes):
    """Lines of text: title, labels, legend; lines, bands and bars by how many, and some numbers."""
    yield f"{axes.get_title('left')!r}: {axes.get_ylabel()} over {axes.get_xlabel()}"
    for line in axes.lines:
        colour = line.get_color() if isinstance(line.get_color(), str) else some(line.get_color())
        style = f"{line.get_marker()} {line.get_linestyle()} {colour}"
        yield f"line {line.get_label()!r}, {style}: {' -> '.join(map(some, line.get_data()))}"
    for band in axes.collections:
        box = band.get_datalim(axes.transData)
        yield f"band: {some(box.intervalx)} -> {some(box.intervaly)}"
    if axes.patches:
        bars = ((bar.get_x(), bar.get_width(), bar.get_height()) for bar in axes.patches)
        yield f"bars: {', '.join(map(some, zip(*bars)))}"
    legend = axes.get_legend().get_texts() if axes.get_legend() else []
    texts = [text.get_text() for text in [*legend, *axes.get_xticklabels()]]
    names = [text for text in texts if text[:1].isalpha()]
    yield f"{axes.get_xscale()}, {axes.get_figure().get_figwidth():g} in: {names}"


def some(values):
    """How many, and the first, second, middle and last."""
    values = [*values]
    places = sorted({0, min(1, len(values) - 1), len(values) // 2, len(values) - 1})
    chosen = (values[n] for n in places)
    texts = (x if isinstance(x, str) else f"{round(x, 12) + 0.0:.5g}" for x in chosen)
    return f"{len(values)} of {' '.join(texts)}"
