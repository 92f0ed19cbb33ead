"""The FMI 3.0 face of the golf club–ball impact: a pythonfmu3 slave around one component.

No physics in here, and no list of variables: both are golf_impact's. Co-simulation and Model
Exchange are one class, since pythonfmu3 doesn't tell an instance what it is made for.
"""

from collections import OrderedDict
from typing import NamedTuple

from golf_impact.component.hybrid import HybridComponent
from golf_impact.host.at_exit import release_at_exit
from golf_impact.host.thread_state import Hold
from golf_impact.variables import (
    INDICATORS,
    MORE_VARIABLES,
    STATES,
    VARIABLES,
)
from pythonfmu3 import Boolean, Enumeration, Float64, Fmi3Causality, Fmi3Slave, ModelExchange
from pythonfmu3.enums import Fmi3Initial, Fmi3Status, Fmi3Variability
from pythonfmu3.logmsg import LogMsg


class Update(NamedTuple):
    """What fmi3UpdateDiscreteStates answers, by the names that pythonfmu3's binary looks for.

    Its own class for this has other names (discreteStateNeedsUpdate ...), which nobody reads.
    """

    terminateSimulation: bool
    valuesOfContinuousStatesChanged: bool
    nextEventTimeDefined: bool
    nextEventTime: float
    discreteStatesNeedUpdate: bool = False
    nominalContinuousStatesChanged: bool = False


class ClubBallImpact(Fmi3Slave, ModelExchange):
    """A golf club hits a ball; see golf_impact.variables for what goes in and comes out."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        queue = self.log_queue

        def report(message: str) -> None:
            queue.append(LogMsg(Fmi3Status.error, "logStatusError", message, False))

        component = HybridComponent(report)
        self.vars = _registered
        self.event_indicators = [reference for reference, row in _ROWS if row.name in INDICATORS]
        #: pythonfmu3 wants one; the component has the time.
        self.time = 0.0
        self._component = component
        self._hold = None
        release_at_exit(self.resources, "x86_64-linux/ClubBallImpact.so")
        # Bound here, a call from the host runs straight into the component.
        self.__dict__.update(
            do_step=component.step,
            step_to_event=component.step_to_event,
            setup_experiment=component.set_up,
            get_float64=component.reals,
            set_float64=component.set_values,
            set_time=component.set_time,
            get_continuous_states=component.states,
            set_continuous_states=component.set_states,
            get_continuous_state_derivatives=component.derivatives,
            get_event_indicators=component.indicators,
            _get_fmu_state=component.snapshot,
            _set_fmu_state=component.restore,
        )

    def enter_initialization_mode(self):
        # Not earlier: see Hold. pythonfmu3 never calls setup_experiment; the standalone FMU does.
        self._hold = Hold()
        self._component.enter_initialization()

    def exit_initialization_mode(self):
        self._component.exit_initialization()

    def update_discrete_states(self):
        stop, jumped, when = self._component.update()
        return Update(stop, jumped, when is not None, 0.0 if when is None else when)

    def do_step(self, current_time, step_size):
        return self._component.step(current_time, step_size)

    def terminate(self):
        self._component.terminate()
        if self._hold is not None:
            self._hold.release()

    def get_continuous_state_derivatives(self):
        return self._component.derivatives()

    def get_number_of_continuous_states(self):
        return len(STATES)

    def get_nominals_of_continuous_states(self, size):
        return [row.nominal for name in STATES for row in VARIABLES if row.name == name]

    def get_int64(self, vrs):
        return self._component.discretes(vrs, "Enumeration")

    def get_int32(self, vrs):
        return self._component.discretes(vrs, "Int32")

    def get_uint64(self, vrs):
        # Not above: the standalone FMU has none, and reads no values of this type.
        from ctypes import c_uint64

        return [c_uint64(value) for value in self._component.discretes(vrs, "UInt64")]

    def get_boolean(self, vrs):
        return self._component.discretes(vrs, "Boolean")

    def get_string(self, vrs):
        return [str(value) for value in self._component.discretes(vrs, "String")]

    def set_int64(self, vrs, values):
        self._component.set_values(vrs, values, "Enumeration")

    def set_int32(self, vrs, values):
        self._component.set_values(vrs, values, "Int32")

    def set_uint64(self, vrs, values):
        self._component.set_values(vrs, values, "UInt64")

    def set_boolean(self, vrs, values):
        self._component.set_values(vrs, values, "Boolean")

    def set_string(self, vrs, values):
        self._component.set_values(vrs, values, "String")

    @staticmethod
    def _fmu_state_to_bytes(state):
        return HybridComponent.packed(state)

    @staticmethod
    def _fmu_state_from_bytes(state):
        return HybridComponent.unpacked(state)


_ROWS = tuple(enumerate(VARIABLES + MORE_VARIABLES))


def _register() -> OrderedDict:
    """The table as pythonfmu3 knows variables: one set for all instances, which never change it."""
    kinds = {"Real": Float64, "Enumeration": Enumeration, "Boolean": Boolean}
    registered = OrderedDict()
    for reference, row in _ROWS:
        fixed = row.causality == "parameter"
        continuous = row.type == "Real" and not fixed
        variable = kinds[row.type](
            row.name,
            causality=Fmi3Causality[row.causality],
            variability=Fmi3Variability.fixed
            if fixed
            else Fmi3Variability.continuous
            if continuous
            else Fmi3Variability.discrete,
            initial=Fmi3Initial.exact if fixed else None,
            description=row.description,
        )
        variable.value_reference = reference
        registered[reference] = variable
    return registered


_registered = _register()
