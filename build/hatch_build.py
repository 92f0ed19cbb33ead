"""What the wheel holds beside its three packages, as data inside them.

An editable installation needs none of it: there each file is where it is in the checkout.
"""

from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CustomBuildHook(BuildHookInterface):
    """Adds the FMUs' classes to golf_build and the scenario scripts to golf_scenarios."""

    def initialize(self, version, build_data):
        """Called before the wheel is made."""
        if version == "editable":
            return
        root = Path(self.root)
        files = {root / "LICENSE": "golf_build/LICENSE"}
        files |= {file: f"golf_build/faces/{file.name}" for file in root.glob("fmu_src/*.py")}
        files |= {file: f"golf_build/loader/{file.name}" for file in root.glob("fmu_src/loader/*")}
        for pattern in ("*.py", "studies/*.toml"):
            for file in (root / "scenarios").glob(pattern):
                within = file.relative_to(root / "scenarios").as_posix()
                files[file] = f"golf_scenarios/scripts/{within}"
        build_data["force_include"] |= {str(file): name for file, name in files.items()}
