"""The system around ClubBallImpact: its companion FMUs, and the system of all four as SSP 1.0.

Everything that can be chosen is in `system.toml`; the companions' variables are in fmu_src.
"""

import sys
import zipfile
from pathlib import Path

from golf_physics import variables
from golf_physics.variables import Unit, Variable

from golf_build import fmi2
from golf_build import standalone as alone
from golf_build.archive import pack, write_archive
from golf_build.packaging import HERE, Builder, fmu_source, render

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_SYSTEM = tomllib.loads((HERE / "system.toml").read_text("utf-8"))

#: From component and variable to component and variable.
CONNECTIONS = tuple(
    (*start.split("."), *end.split(".")) for end, start in _SYSTEM["connections"].items()
)

#: Start values in the .ssp where they differ from those of the FMUs beside it, by component.
DRIVE: dict[str, dict[str, float]] = _SYSTEM["drive"]

#: Those of ClubBallImpact, in SI alone, and the companions' own.
_UNITS = {
    name: Unit(unit.base, {}) for name, unit in (variables.UNITS | variables.MORE_UNITS).items()
} | {name: Unit(**unit) for name, unit in _SYSTEM["units"].items()}


_ENTRY = '''"""The entry point of the FMU; pythonfmu compiles this file anew for every instance."""

from {package} import VALUES
from {package}.companion import CompanionAdapter
from {package}.companions.{module} import {model} as Component


class {model}(CompanionAdapter):
    kind, rows = Component, VALUES

    # pythonfmu 0.7.0 crashes on the second instance of a class without a method in its body.
    def __init__(self, **kwargs):
        CompanionAdapter.__init__(self, **kwargs)
'''


#: What every companion needs of golf_physics.
_SHARED = (
    "companions/companion", "companions/__init__", "numerics/ode", "numerics/events",
    "numerics/chebyshev", "numerics/__init__", "codec", "values", "variables",
)  # fmt: skip


class _Row(Variable):
    """Of a companion: its bounds are for refusals, not FMI's min and max."""

    allowed = ""


def _companion(name: str, *modules: str) -> Builder:
    """The FMU of these modules, whose variables are in the .toml file beside the first of them."""
    modules = *modules, *_SHARED
    sources = [f"golf_physics/{module}.py" for module in modules]
    table = fmu_source(sources[0]).with_suffix(".toml").read_text("utf-8")
    (_, description), *groups = tomllib.loads(table).items()
    rows = []
    for causality, group in groups:
        for variable, (reference, unit, *values, text) in group.items():
            limits = values or (None, 0.0, 0.0)
            display = next(iter(_UNITS[unit].display), None) if unit else None
            kind = "Real" if unit else "Boolean"
            row = variable, causality, kind, unit, *limits, None, display, text, reference
            rows.append(_Row(*row))
    used = {row.unit for row in rows}
    units = {unit: about for unit, about in _UNITS.items() if unit in used}
    tables = {"rows": rows, "description": description, "units": units}
    sources += ["companion.py", "host"]
    return Builder(2, name, tuple(sources), _ENTRY, tables)


#: The companions by name.
COMPANIONS = {
    "Swing": _companion("Swing", "companions/swing", "companions/double_pendulum"),
    "Launch": _companion("Launch", "companions/launch", "restitution"),
    "BallFlight": _companion("BallFlight", "companions/ball_flight"),
}


def build(folder: Path, standalone: bool = False, pythons: alone.Pythons = None) -> dict[str, Path]:
    """Build the companions and the .ssp in a folder, standalone or plain.

    Returns their files by name: those of the companions, GolfSwing.

    OSError: one can't be written. StandaloneError: this machine can't build standalone ones.
    """

    def files(builder: Builder) -> dict[str, bytes]:
        files = builder.files()
        return alone.standalone(files, pythons) if standalone else files

    suffix = alone.SUFFIX if standalone else ""
    made = {
        name: write_archive(folder / f"{name}{suffix}.fmu", files(builder))
        for name, builder in COMPANIONS.items()
    }
    structure = render(HERE / "SystemStructure.ssd.jinja", **_SYSTEM | {"connections": CONNECTIONS})
    system = {"SystemStructure.ssd": structure}
    for name, start in DRIVE.items():
        # An importer that sets nothing, such as fmpy.ssp, which ignores parameter bindings, has
        # these start values too.
        builder = COMPANIONS.get(name, fmi2.BUILDER)._replace(start=start)
        system[f"resources/{name}.fmu"] = pack(files(builder))
    # FMUs are compressed already.
    ssp = folder / f"GolfSwing{suffix}.ssp"
    return made | {"GolfSwing": write_archive(ssp, system, zipfile.ZIP_STORED)}
