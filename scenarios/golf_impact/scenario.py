"""The interface for scenario scripts.

A scenario is a file with TITLE and a function `run(fmu)` that returns a `Report`: it runs impacts,
checks them, and makes tables and figures. `golf-impact run FILE` runs it, or `python FILE` if it
ends with `main(__file__)`. CHAPTER is its position in the report of all scenarios; a scenario
without one comes last.
"""

from pathlib import Path

from golf_impact import closed_forms, document, measured
from golf_impact.ball import BALLS, rating_stiffness
from golf_impact.errors import UserError
from golf_impact.fmu.coupling import COUPLINGS, run_pushed
from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.fmu.loaded import LoadedFmu3
from golf_impact.fmu.shots import HEAD, bisect, loaded_shots
from golf_impact.fmu.system import build_system, extract_fmus, run_ssp, run_system
from golf_impact.peers.document_scheme import document_fmu
from golf_impact.quantities import QUANTITIES, format_value, label
from golf_impact.report.report import Metrics, Report

__all__ = ["BALLS", "COUPLINGS", "HEAD", "QUANTITIES", "ImpactFmu", "LoadedFmu3", "Metrics"]
__all__ += ["Report", "UserError", "bisect", "build_system", "closed_forms", "current_fmu"]
__all__ += ["document", "document_fmu", "extract_fmus", "format_value", "label", "loaded_shots"]
__all__ += ["main", "measured", "rating_stiffness", "run_pushed", "run_ssp", "run_system"]


def main(script: str) -> None:
    """Run the scenario in this script with the options of `golf-impact run`, and exit."""
    import sys

    from golf_impact import stopping

    stopping.listen()
    from golf_impact.commands.app import main as command

    command(["run", str(Path(script).resolve()), *sys.argv[1:]])
