"""The FMI 2.0 adapter of the golf club–ball impact: a pythonfmu slave around one component.

No physics in here, and no list of variables: both are golf_physics's.
"""

from golf_physics.component.component import Component
from golf_physics.variables import BY_NAME
from host.adapter import Adapter, accessors
from host.at_exit import prepare_process
from host.messages import Messages
from pythonfmu import Fmi2Slave


class ClubBallImpact(Adapter, Fmi2Slave):
    """A golf club hits a ball; see golf_physics.variables for what goes in and comes out."""

    # Frequent calls are bound to the component in slots: pythonfmu resolves them by name each time,
    # and a slot is found without searching the instance's dictionary.
    __slots__ = (
        "_component", "_get_fmu_state", "_set_fmu_state", "do_step", "get_real", "set_real",
    )  # fmt: skip

    def __init__(self, start: dict[str, float], **kwargs):
        """`start`: values of variables that differ from their start values, by name."""
        super().__init__(**kwargs)
        component = Component(Messages(self.log_queue, kwargs, lambda: component.instant()))
        self._component = component
        for name, value in start.items():
            row = BY_NAME[name]
            component.set_values([row.reference], [value], row.type)
        prepare_process(self.resources, "linux64/ClubBallImpact.so")
        self.do_step = component.step
        self.get_real = component.reals
        self.set_real = component.set_values
        self._get_fmu_state = component.snapshot
        self._set_fmu_state = component.restore

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        self._component.set_up(start_time)

    get_integer, set_integer = accessors("Enumeration")
    _fmu_state_to_bytes = staticmethod(Component.packed)
    _fmu_state_from_bytes = staticmethod(Component.unpacked)
