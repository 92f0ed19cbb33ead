"""The FMI 2.0 adapter of the companions: a pythonfmu slave around one component.

No physics in here, and no list of variables: both are in golf_physics.companions.
"""

from golf_physics.companions.companion import Companion
from host.adapter import Adapter, accessors
from host.at_exit import prepare_process
from host.messages import Messages
from pythonfmu import Fmi2Slave


class CompanionAdapter(Adapter, Fmi2Slave):
    """A companion of one kind, with its variables in rows."""

    kind: type[Companion]
    rows: list[tuple]

    def __init__(self, **kwargs) -> None:
        super().__init__(**kwargs)
        report = Messages(self.log_queue, kwargs, lambda: component.steps)
        component = self.kind(self.rows, report)
        self._component = component
        prepare_process(self.resources, f"linux64/{self.modelName}.so")
        # Bound here, a call from the host runs straight into the component.
        self.__dict__.update(
            do_step=component.step,
            _get_fmu_state=component.snapshot,
            _set_fmu_state=component.restore,
        )

    # The library calls these by the class.
    _fmu_state_to_bytes = staticmethod(Companion.packed)

    @classmethod
    def _fmu_state_from_bytes(cls, data):
        return cls.kind.unpacked(data)

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        self._component.set_up(start_time)

    get_real, set_real = accessors("Real")
    get_integer, set_integer = accessors("Integer")

    # Abstract in pythonfmu; __init__ binds it.
    do_step = None
