"""The FMI 2.0 adapter of the companions: a pythonfmu slave around one component.

No physics in here, and no list of variables: both are in golf_physics.companions.
"""

from host.adapter import Adapter, accessors


class CompanionAdapter(Adapter):
    """A companion of one kind, with its variables in rows."""

    rows: list[tuple]

    def __init__(self, **kwargs) -> None:
        super().__init__(self.rows, **kwargs)

    get_real, _ = accessors("Real")
    get_integer, set_integer = accessors("Integer")
