"""How an extra of this package is installed here: the package is on no index."""

import importlib.metadata
import os
import re
import shlex
import sys
from pathlib import Path

#: The root of a checkout; anything else where golf_build is installed.
_ROOT = Path(__file__).resolve().parents[2]


def install_command(extra: str) -> str:
    """The line that installs an extra into the Python that runs this.

    A checkout is installed again, with the extra. Where a wheel was installed, the packages that
    the extra names are.
    """
    pip = Path(sys.executable).with_name("pip.exe" if os.name == "nt" else "pip")
    command = shlex.quote(_shown(pip if pip.is_file() else Path(sys.executable)))
    command += "" if pip.is_file() else " -m pip"
    if (_ROOT / "pyproject.toml").is_file():
        return f'{command} install -e "{_shown(_ROOT)}[{extra}]"'
    packages = " ".join(f'"{name}"' for name in _packages(extra))
    return f"{command} install {packages}"


def _shown(path: Path) -> str:
    """From the working folder, if it lies there."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)


def _packages(extra: str) -> list[str]:
    """What an extra asks for, as pip takes it."""
    asked = re.compile(rf"\bextra\s*==\s*['\"]{extra}['\"]")
    declared = (line.partition(";") for line in importlib.metadata.requires("golf-impact") or ())
    return [name.strip() for name, _, marker in declared if asked.search(marker)]
