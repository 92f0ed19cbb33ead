"""What results of scenarios show, as lines of Markdown; comparison with tests/snapshots."""

from conftest import HERE


def result_lines(result):
    """Tables, sentences, and what figures have."""
    yield f"\n## {result.title}\n"
    for title, *rows in [(title, columns, *rows) for title, columns, rows in result.tables]:
        yield from (f"**{title}**", *(f"| {' | '.join(row)} |" for row in rows), "")
    yield from (f"- {'✓' if holds else '✗'} {claim}" for claim, holds in result.claims.items())
    yield f"- {result.words}"
    for name, figure in result.figures.items():
        yield f"- {name}.png: {figure.get_suptitle()}"
        for axes in figure.axes:
            yield from (f"  {line}" for line in _axes_lines(axes))


def _axes_lines(axes):
    """Texts and limits, and of each curve the style, its ends and the largest value."""
    texts = [axes.get_title(), axes.get_title("left"), axes.get_xlabel(), axes.get_ylabel()]
    if legend := axes.get_legend():
        texts += [text.get_text() for text in [legend.get_title(), *legend.get_texts()]]
    texts += [text.get_text().replace("\n", " ") for text in axes.texts]
    yield f"- {' | '.join(filter(None, texts))}; y {_numbers(axes.get_ylim())}"
    for line in axes.lines:
        x, y = line.get_data()
        style = f"{line.get_linestyle()} {line.get_marker()} {line.get_linewidth():g}"
        ends = (_numbers([x[n], y[n]]) for n in (0, -1))
        yield f"  - {style}, {len(x)}: {'; '.join(ends)}; up to {_numbers([max(y)])}"


def _numbers(values):
    """With three digits; what only rounding makes is 0."""
    return " ".join(f"{value:.3g}" if abs(value) > 1e-9 else "0" for value in values)


def check_snapshot(config, name, lines):
    """The lines are those of this file, which `pytest --update FILE` writes: read the diff."""
    expected = HERE / "snapshots" / name
    text = "\n".join([*lines, ""])
    if config.getoption("--update"):
        expected.write_text(text, "utf-8")
    assert text == expected.read_text("utf-8")
