"""The system around ClubBallImpact: its companion FMUs, and the system of all four as SSP 1.0.

Everything that can be chosen is in `system.toml`; the companions' variables are in fmu_src.
"""

import hashlib
import io
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from golf_physics import variables
from golf_physics.variables import LARGEST, Unit, Variable

from golf_build import fmi2
from golf_build.archive import pack, unpack, write_archive
from golf_build.native import BUILDERS as NATIVE
from golf_build.packaging import Builder, PythonBuilder
from golf_build.sources import HERE, fmu_source, toml
from golf_build.templates import render

_SYSTEM = toml(HERE / "system.toml")

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


def _row(causality: str, name: str, reference: int, unit: str, *values: Any) -> Variable:
    """A variable from a line of a table: `values` has limits and text, or text alone."""
    *limits, text = values
    display = next(iter(_UNITS[unit].display), None) if unit else None
    start, low, high = limits or (None, -LARGEST, LARGEST)
    about = "Real" if unit else "Boolean", unit, start, low, high, None, display
    return Variable(name, causality, *about, text, reference)


def _companion(name: str) -> Builder:
    """The FMU whose modules and experiment are in `system.toml`."""
    modules = _SYSTEM["modules"][name] + _SYSTEM["modules"]["shared"]
    sources = [f"golf_physics/{module}.py" for module in modules]
    table = toml(fmu_source(sources[0]).with_suffix(".toml"))
    about = {"description": table.pop("description"), "model": table.pop("model")}
    rows = [_row(group, one, *table[group][one]) for group in table for one in table[group]]
    units = {unit: _UNITS[unit] for unit in _UNITS if unit in {row.unit for row in rows}}
    tables = {"rows": rows, "units": units, "experiment": _SYSTEM["experiments"][name], **about}
    return PythonBuilder(name, tables, sources=(*sources, "companion.py", "host"), entry=_ENTRY)


#: The companions by name.
COMPANIONS = {name: _companion(name) for name in _SYSTEM["experiments"]}


class System:
    """GolfSwing.ssp: the FMUs of a drive and their connections; built as a `Builder` builds."""

    name, suffix = "GolfSwing", ".ssp"

    def structure(self) -> bytes:
        """SystemStructure.ssd; a connector is its name, kind and unit (none: Boolean)."""
        ends = {wire[:2] for wire in CONNECTIONS} | {wire[2:] for wire in CONNECTIONS}
        ends |= {(part, name) for part, names in _SYSTEM["components"].items() for name in names}
        connectors = {
            part: [(r.name, r.causality, r.unit) for r in builder.rows() if (part, r.name) in ends]
            for part, builder in self.builders().items()
        }
        used = {unit for group in connectors.values() for _, _, unit in group if unit}
        units = {name: unit.base for name, unit in _UNITS.items() if name in used}
        context = _SYSTEM | {"connections": CONNECTIONS, "connectors": connectors, "units": units}
        return render(HERE / "SystemStructure.ssd.jinja", **context)

    def builders(self, native: bool = False) -> dict[str, Builder]:
        """The FMUs inside by name, with the drive's start values; ClubBallImpact native or not.

        An importer that sets nothing, such as fmpy.ssp, which ignores parameter bindings, has these
        start values too.
        """
        impact = NATIVE[2] if native else fmi2.BUILDER
        known: dict[str, Builder] = {**COMPANIONS, impact.model: impact}
        return {name: replace(known[name], start=start) for name, start in DRIVE.items()}

    def digest(self) -> str:
        """SHA-256 digest of all sources."""
        parts = (self.structure().decode(), *(one.guid() for one in self.builders().values()))
        return hashlib.sha256("/".join(parts).encode()).hexdigest()

    def is_current(self, ssp: Path) -> bool:
        """Whether a file is that of the current sources, unchanged since it was built."""
        try:
            files = unpack(ssp)
            return files["SystemStructure.ssd"] == self.structure() and all(
                builder.is_current(io.BytesIO(files[f"resources/{name}.fmu"]))
                for name, builder in self.builders().items()
            )
        except Exception:  # zipfile raises many types for damaged files
            return False

    def build(self, out: Path, native: bool = False) -> Path:
        """Write the .ssp; OSError: it can't be, UserError: no native FMUs on this machine."""
        files = {"SystemStructure.ssd": self.structure()}
        for name, builder in self.builders(native).items():
            files[f"resources/{name}.fmu"] = pack(builder.files())
        # FMUs are compressed already.
        return write_archive(out, files, zipfile.ZIP_STORED)


SYSTEM = System()


def build(folder: Path, native: bool = False) -> dict[str, Path]:
    """Build the companions and the .ssp in a folder, by name; errors as of `System.build`."""
    made = {name: builder.build(folder / f"{name}.fmu") for name, builder in COMPANIONS.items()}
    ssp = folder / f"{SYSTEM.name}{'.native' if native else ''}{SYSTEM.suffix}"
    return made | {SYSTEM.name: SYSTEM.build(ssp, native)}
