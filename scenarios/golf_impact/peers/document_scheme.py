"""The document's own scheme, packed as an FMU by pythonfmu and driven like any other."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from golf_impact.document import END_GAP, TIME_STEP, USED
from golf_impact.fmu.file import build_plain_fmu
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.peers import document_fmu as scheme
from golf_impact.report.report import Metrics, derive_metrics


class DocumentFmu(LoadedFmu):
    """The document's scheme, one instance set back for every impact."""

    def impact(self, dt: float = TIME_STEP, **values: float) -> dict[str, float]:
        """One impact, stepped by dt (s) until contact ends: its outputs by name (SI units)."""
        self.start(dt=dt, **values)
        n = 0
        while self.read_flag("in_contact"):
            self.slave.doStep(n * dt, dt)
            n += 1
        return self.read(scheme.RESULTS)

    def as_printed(self, **values: float) -> Metrics:
        """One impact as the document's program ends it: the numbers that it prints rounded (SI
        units), by the names of results.json.
        """
        given = {"club_speed": 35.0, "ball_speed": 0.0, **USED, **values}
        return derive_metrics(self.impact(end_gap=END_GAP, **values), given)


@contextmanager
def document_fmu() -> Iterator[DocumentFmu]:
    """The document's scheme as an FMU, built for the time of a `with` block."""
    with (
        tempfile.TemporaryDirectory(prefix="golf-impact-") as folder,
        DocumentFmu(build_plain_fmu(Path(scheme.__file__), Path(folder))) as fmu,
    ):
        yield fmu
