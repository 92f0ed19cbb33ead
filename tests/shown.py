"""What results, pictures and axes show, as text; comparison with tests/snapshots."""

from unittest import mock

from conftest import HERE

from golf_impact.studies.sweep import picture
from golf_impact.studies.sweep.sweep import OUTPUTS, Design, sobol_indices


def result_lines(result):
    """Of a scenario: tables, sentences, and what figures have."""
    yield f"\n## {result.title}\n"
    for title, columns, rows in result.tables:
        yield from (f"**{title}**", *(f"| {' | '.join(row)} |" for row in (columns, *rows)), "")
    yield from (f"- {'✓' if holds else '✗'} {claim}" for claim, holds in result.claims.items())
    yield f"- {result.words}"
    for name, figure in result.figures.items():
        yield f"- {name}.png: {figure.get_suptitle()}"
        for axes in figure.axes:
            first, *others = axes_lines(axes)
            yield from (f"  - {first}", *(f"    - {line}" for line in others))
        for legend in figure.legends:
            yield f"  - legend: {' | '.join(text.get_text() for text in legend.get_texts())}"


def sweep_picture(sets, outputs=OUTPUTS, samples=None):
    """Print what the picture of a sweep shows."""
    design, drawn = Design(sets, outputs, samples), []
    indices = sobol_indices(design) if len(design.distributions) > 1 else {}
    with mock.patch.object(picture, "png", lambda figure: drawn.append(figure) or b"image"):
        image = picture.picture(design, indices)
    for axes in drawn[0].axes if image else ():
        print(*axes_lines(axes), sep="\n")


def axes_lines(axes):
    """Title, labels, limits and texts; lines, bands and bars by how many, and some numbers."""
    titles = *filter(None, (axes.get_title(), axes.get_title("left"))), axes.get_xscale()
    limits = f"x {some(axes.get_xlim())}, y {some(axes.get_ylim())}"
    yield f"{'; '.join(titles)!r}: {axes.get_ylabel()} over {axes.get_xlabel()}, {limits}"
    for line in axes.lines:
        colour = line.get_color() if isinstance(line.get_color(), str) else some(line.get_color())
        style = f"{line.get_marker()} {line.get_linestyle()} {line.get_linewidth():g} {colour}"
        yield f"line {line.get_label()!r}, {style}: {' -> '.join(map(some, line.get_data()))}"
    for band in axes.collections:
        box = band.get_datalim(axes.transData)
        yield f"band: {some(box.intervalx)} -> {some(box.intervaly)}"
    if axes.patches:
        bars = ((bar.get_x(), bar.get_width(), bar.get_height()) for bar in axes.patches)
        yield f"bars: {', '.join(map(some, zip(*bars)))}"
    legend = axes.get_legend()
    named = [legend.get_title(), *legend.get_texts()] if legend else []
    named += [text for text in axes.get_xticklabels() if text.get_text()[:1].isalpha()]
    texts = [text.get_text().replace("\n", " ") for text in (*named, *axes.texts)]
    yield f"{axes.get_figure().get_figwidth():g} in: {' | '.join(filter(None, texts))}".rstrip()


def some(values):
    """How many, and the first, second, middle and last with four digits; rounding errors are 0."""
    values = [*values]
    places = sorted({0, min(1, len(values) - 1), len(values) // 2, len(values) - 1})
    chosen = (values[n] for n in places)
    texts = (x if isinstance(x, str) else f"{round(x, 9) + 0.0:.4g}" for x in chosen)
    return f"{len(values)} of {' '.join(texts)}"


def check_snapshot(config, name, lines):
    """The lines are those of this file, which `pytest --update FILE` writes: read the diff."""
    expected = HERE / "snapshots" / name
    text = "\n".join([*lines, ""])
    if config.getoption("--update"):
        expected.write_text(text, "utf-8")
    assert text == expected.read_text("utf-8")
