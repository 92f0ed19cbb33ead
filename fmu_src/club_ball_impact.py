"""The FMI 2.0 adapter of the golf club–ball impact: a pythonfmu slave around one component.

No physics in here, and no list of variables: both are golf_physics's.
"""

from golf_physics.component.component import Component
from golf_physics.variables import BY_NAME
from host.adapter import Adapter, accessors


class ClubBallImpact(Adapter):
    """A golf club hits a ball; see golf_physics.variables for what goes in and comes out."""

    __slots__ = ("get_real",)
    kind = Component

    def __init__(self, start: dict[str, float], **kwargs):
        """`start`: values of variables that differ from their start values, by name."""
        super().__init__(**kwargs)
        for name, value in start.items():
            row = BY_NAME[name]
            self._component.set_values([row.reference], [value], row.type)
        self.get_real = self._component.reals

    get_integer, set_integer = accessors("Enumeration")
