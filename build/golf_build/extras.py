"""The command that installs an extra of this package, which is on no package index."""

import importlib.metadata
import os
import re
import shlex
import sys
from pathlib import Path
from subprocess import list2cmdline

from golf_build.sources import CHECKOUT


def install_command(extra: str) -> str:
    """The command that installs an extra into the current Python environment.

    Where a wheel is installed, it installs the packages that the extra consists of.
    """
    words = [_shown(Path(sys.executable)), "-m", "pip"]
    command = list2cmdline(words) if os.name == "nt" else shlex.join(words)
    if CHECKOUT:
        return f'{command} install -e "{_shown(CHECKOUT)}[{extra}]"'
    of_extra = re.compile(rf"\bextra\s*==\s*['\"]{extra}['\"]")
    declared = (line.partition(";") for line in importlib.metadata.requires("golf-impact") or ())
    packages = (f'"{name.strip()}"' for name, _, marker in declared if of_extra.search(marker))
    return f"{command} install {' '.join(packages)}"


def _shown(path: Path) -> str:
    """Relative to the working folder, if it is in there."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)
