"""A diagram of the model (the document's Fig. 1): two masses and the contact between them."""

from io import BytesIO
from pathlib import Path

from golf_impact.scenario import Report, main

TITLE = "Diagram: two masses and the contact between"
CHAPTER = 1


def run(fmu):
    """The picture in the FMU's documentation; nothing is simulated."""
    report = Report(TITLE, fmu)
    drawing = Path(fmu.folder, "documentation", "model.png").read_bytes()

    @report.figure("diagram", "The ball is a mass behind a spring: d = x_C − x_B.")
    def diagram(figures):
        image = figures.plt.imread(BytesIO(drawing))
        figure = figures.plt.figure()
        height, width, _ = image.shape
        figure.set_size_inches(width / figure.dpi, height / figure.dpi)
        figure.figimage(image)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
