"""The FMI 3.0 adapter of the golf club–ball impact: a pythonfmu3 slave around one component.

No physics in here, and no list of variables: both are golf_physics's. Co-simulation and Model
Exchange are one class, since pythonfmu3 gives an instance no information on its kind.
"""

from collections import namedtuple
from ctypes import c_uint64

from golf_physics.component.hybrid import HybridComponent
from golf_physics.variables import BY_NAME, INDICATORS, STATES
from host.adapter import Adapter, accessors
from host.at_exit import prepare_process
from pythonfmu3 import Fmi3Slave, ModelExchange
from pythonfmu3.enums import Fmi3Status
from pythonfmu3.logmsg import LogMsg

#: Results of fmi3UpdateDiscreteStates, named as pythonfmu3's binary reads them; its own class has
#: other names (discreteStateNeedsUpdate ...).
Update = namedtuple(
    "Update",
    "terminateSimulation valuesOfContinuousStatesChanged nextEventTimeDefined nextEventTime "
    "discreteStatesNeedUpdate nominalContinuousStatesChanged",
    defaults=(False, False),
)


class ClubBallImpact(Adapter, Fmi3Slave, ModelExchange):
    """A golf club hits a ball; see golf_physics.variables for what goes in and comes out."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        queue = self.log_queue

        def report(message: object) -> None:
            queue.append(LogMsg(Fmi3Status.error, "logStatusError", str(message), False))

        component = HybridComponent(report)
        self.event_indicators = [BY_NAME[name].reference for name in INDICATORS]
        #: pythonfmu3 requires one; the clock is the component's.
        self.time = 0.0
        self._component = component
        prepare_process(self.resources, "x86_64-linux/ClubBallImpact.so")
        # Bound here, a call from the host runs straight into the component.
        self.__dict__.update(
            do_step=component.step,
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

    def update_discrete_states(self):
        stop, jumped, when = self._component.update()
        return Update(stop, jumped, when is not None, 0.0 if when is None else when)

    def get_number_of_continuous_states(self):
        return len(STATES)

    def get_nominals_of_continuous_states(self, size):
        return [BY_NAME[name].nominal for name in STATES]

    # Abstract in pythonfmu3; __init__ binds them.
    do_step = get_continuous_state_derivatives = None

    get_int32, set_int32 = accessors("Int32")
    get_int64, set_int64 = accessors("Enumeration")
    get_uint64, set_uint64 = accessors("UInt64", c_uint64)
    _fmu_state_to_bytes = staticmethod(HybridComponent.packed)
    _fmu_state_from_bytes = staticmethod(HybridComponent.unpacked)
