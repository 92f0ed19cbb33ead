"""Drives ClubBallImpact.fmu: any number of impacts with one extraction and one instance."""

import shutil
from pathlib import Path
from typing import Any

from fmpy.fmi1 import FMICallException

from golf_impact.errors import UserError, first_line
from golf_impact.fmu.archive import check_temporary_folder, find_flaw
from golf_impact.fmu.loaded import Entered, LoadedFmu
from golf_impact.runs import FLAGS, METRICS, PATH, ImpactRuns


class ImpactFmu(ImpactRuns, LoadedFmu):
    """ClubBallImpact.fmu, extracted and instantiated once, for use in a `with` block.

    UserError: the file is missing, damaged or another FMU.
    """

    def __init__(self, path: Path) -> None:
        if why := find_flaw(path):
            raise UserError(why)
        super().__init__(path)
        about = self.description
        for name in (*METRICS, *PATH, *FLAGS):
            if name not in self.variables:
                raise UserError(f"{path} is another FMU ({about.modelName}): it lacks {name}")
        if about.fmiVersion != "2.0" or about.coSimulation is None:
            why = "is not an FMI 2.0 co-simulation FMU"
            raise UserError(f"{path} {why}: run `golf-impact build`")

    def __enter__(self: Entered) -> Entered:
        check_temporary_folder()
        try:
            super().__enter__()
            self.slave  # noqa: B018 (instantiates it here, where an error gets a message)
        except Exception as error:
            shutil.rmtree(self.folder, ignore_errors=True)
            full = isinstance(error, OSError) and error.errno
            what = "make room there, or set TMPDIR" if full else "run `golf-impact build`"
            why = f"{self.path} can't be loaded from {self.folder} ({first_line(error)})"
            raise UserError(f"{why}: {what}") from error
        return self

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        super().__exit__(kind, error, trace)
        if isinstance(error, FMICallException):
            message = f": {first_line(self.messages[-1])}" if self.messages else ""
            raise UserError(f"{self.path} failed ({first_line(error)}{message})") from error
