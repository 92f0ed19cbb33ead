"""The FMI 2.0 face of the golf club–ball impact: a pythonfmu slave around one component.

No physics in here, and no list of variables: both are golf_impact's.
"""

from collections import OrderedDict

from golf_impact.component.component import Component
from golf_impact.host.at_exit import release_at_exit
from golf_impact.host.thread_state import Hold
from golf_impact.variables import VARIABLES
from pythonfmu import Boolean, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.enums import Fmi2Status
from pythonfmu.logmsg import LogMsg


class ClubBallImpact(Fmi2Slave):
    """A golf club hits a ball; see golf_impact.variables for what goes in and comes out."""

    # Calls that a host makes again and again run straight into the component. pythonfmu looks them
    # up by name every time: a slot is found without a look into the instance's dictionary.
    __slots__ = (
        "_component",
        "_get_fmu_state",
        "_hold",
        "_set_fmu_state",
        "do_step",
        "get_real",
        "set_real",
        "vars",
    )

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        queue = self.log_queue

        def report(message: str) -> None:
            queue.append(LogMsg(Fmi2Status.error, "logStatusError", message))

        component = Component(report)
        self.vars = _registered
        self._component = component
        self._hold = None
        release_at_exit(self.resources, "linux64/ClubBallImpact.so")
        self.do_step = component.step
        self.get_real = component.reals
        self.set_real = component.set_values
        self._get_fmu_state = component.snapshot
        self._set_fmu_state = component.restore

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        # Not earlier: see Hold.
        self._hold = Hold()
        self._component.set_up(start_time)

    def enter_initialization_mode(self):
        self._component.enter_initialization()

    def exit_initialization_mode(self):
        self._component.exit_initialization()

    def terminate(self):
        self._component.terminate()
        if self._hold is not None:
            self._hold.release()

    def get_integer(self, vrs):
        return self._component.discretes(vrs, "Enumeration")

    def get_boolean(self, vrs):
        return self._component.discretes(vrs, "Boolean")

    def get_string(self, vrs):
        return [str(value) for value in self._component.discretes(vrs, "String")]

    def set_integer(self, vrs, values):
        self._component.set_values(vrs, values, "Enumeration")

    def set_boolean(self, vrs, values):
        self._component.set_values(vrs, values, "Boolean")

    def set_string(self, vrs, values):
        self._component.set_values(vrs, values, "String")

    @staticmethod
    def _fmu_state_to_bytes(state):
        return Component.packed(state)

    @staticmethod
    def _fmu_state_from_bytes(state):
        return Component.unpacked(state)


def _register() -> OrderedDict:
    """The table as pythonfmu knows variables: one set for all instances, which never change it."""
    kinds = {"Real": Real, "Enumeration": Integer, "Boolean": Boolean}
    registered = OrderedDict()
    for reference, row in enumerate(VARIABLES):
        if row.causality == "output":
            continuous = row.type == "Real"
            variability = Fmi2Variability.continuous if continuous else Fmi2Variability.discrete
            initial = Fmi2Initial.calculated
        else:
            is_input = row.causality == "input"
            variability = Fmi2Variability.continuous if is_input else Fmi2Variability.fixed
            initial = None if is_input else Fmi2Initial.exact
        variable = kinds[row.type](
            row.name,
            causality=Fmi2Causality[row.causality],
            variability=variability,
            initial=initial,
            description=row.description,
        )
        variable.value_reference = reference
        registered[reference] = variable
    return registered


_registered = _register()
