"""The command that installs an extra of this package, which is on no package index."""

import importlib.metadata
import os
import re
import shlex
import sys
from subprocess import list2cmdline

from golf_build.sources import CHECKOUT


def install_command(extra: str) -> str:
    """The command that installs an extra into the current Python environment.

    Where a wheel is installed, it installs the packages that the extra consists of.
    """
    words = [sys.executable, "-m", "pip", "install"]
    command = list2cmdline(words) if os.name == "nt" else shlex.join(words)
    if CHECKOUT:
        return f'{command} -e "{CHECKOUT}[{extra}]"'
    of_extra = re.compile(rf"\bextra\s*==\s*['\"]{extra}['\"]")
    declared = (line.partition(";") for line in importlib.metadata.requires("golf-impact") or ())
    packages = (f'"{name.strip()}"' for name, _, marker in declared if of_extra.search(marker))
    return f"{command} {' '.join(packages)}"
