"""Drives the document's own scheme, packed as an FMU."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Slave

from golf_scenarios.facts.document import TIME_STEP
from golf_scenarios.fmu.file import build_plain_fmu

#: The FMU's one source, which needs nothing but pythonfmu.
SLAVE = Path(__file__).with_name("document_fmu.py")

_READ = (
    "club_velocity",
    "ball_velocity",
    "max_force",
    "contact_time",
    "impulse",
    "contact_displacement",
    "smash_factor",
    "coefficient_of_restitution",
    "energy_efficiency",
)


class DocumentFmu:
    """The document's scheme, one instance reset for every impact.

    Args:
        folder: the extracted FMU.
    """

    def __init__(self, folder: str) -> None:
        description = fmpy.read_model_description(folder, validate=False)
        assert description.coSimulation is not None
        self._references = {v.name: v.valueReference for v in description.modelVariables}
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="document",
        )
        self.slave.instantiate()

    def impact(self, dt: float = TIME_STEP, **values: float) -> dict[str, float]:
        """One impact, stepped by dt until contact ends; read once, at the end.

        Args:
            dt: communication step and Euler step, s.
            values: inputs and parameters by name.

        Returns:
            The outputs by name (SI units).
        """
        slave = self.slave
        slave.reset()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        for name, value in {"dt": dt, **values}.items():
            slave.setReal([self._references[name]], [value])
        slave.exitInitializationMode()
        in_contact = [self._references["in_contact"]]
        n = 0
        while slave.getBoolean(in_contact)[0]:
            slave.doStep(n * dt, dt)
            n += 1
        values_read = slave.getReal([self._references[name] for name in _READ])
        return dict(zip(_READ, values_read, strict=True))


@contextmanager
def document_fmu() -> Iterator[DocumentFmu]:
    """The document's scheme as an FMU, built and extracted for the time of a `with` block."""
    folder = tempfile.mkdtemp(prefix="golf-impact-")
    try:
        fmu = build_plain_fmu(SLAVE, Path(folder) / "fmu")
        extracted = str(Path(folder) / "extracted")
        fmpy.extract(str(fmu), extracted)
        document = DocumentFmu(extracted)
        try:
            yield document
        finally:
            document.slave.terminate()
            document.slave.freeInstance()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
