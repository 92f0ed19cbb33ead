"""Files of the wheel beside its three packages, as data inside them.

An editable installation needs none of it: there each file is where it is in the checkout.
"""

from itertools import chain
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CustomBuildHook(BuildHookInterface):
    """Adds the FMUs' classes to golf_build and the scenario scripts to golf_impact."""

    def initialize(self, version, build_data):
        """Called before the wheel is made."""
        if version == "editable":
            return
        root = Path(self.root)
        files = {root / "LICENSE": "golf_build/LICENSE"}
        for folder, place, patterns in (
            ("fmu_src", "golf_build/adapters", ("*.py", "host/*.py", "native/*")),
            ("scenarios", "golf_impact/scripts", ("*.py", "*.ipynb", "*.csv")),
        ):
            for file in chain.from_iterable(map((root / folder).glob, patterns)):
                files[file] = f"{place}/{file.relative_to(root / folder).as_posix()}"
        build_data["force_include"] |= {str(file): name for file, name in files.items()}
