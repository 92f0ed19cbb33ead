"""A host for Model Exchange: an FMU of either version of FMI by fmpy, integrated by SciPy."""

import ctypes

import fmus
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model
from golf_physics.variables import INDICATORS
from scipy.integrate import solve_ivp


def _vector(name, fmi3=None, size=4):
    """A method that returns so many numbers of the FMU by a function, in FMI 3.0 by another one."""

    def read(self):
        array = (ctypes.c_double * size)()
        getattr(self.instance, fmi3 if fmi3 and self.fmi == 3 else name)(array, size)
        return list(array)

    return read


class Model:
    """An extracted FMU for Model Exchange: fmpy's `instance`, and the `messages` it has logged."""

    states = _vector("getContinuousStates")
    nominals = _vector("getNominalsOfContinuousStates")
    derivatives = _vector("getDerivatives", "getContinuousStateDerivatives")
    indicators = _vector("getEventIndicators", size=len(INDICATORS))

    def __init__(self, folder, fmi):
        kind = FMU2Model if fmi == 2 else FMU3Model
        self.instance = fmus.make_instance(folder, "solved", kind, loggingOn=True)
        self.messages, self.fmi = self.instance.messages, fmi

    def begin(self, start=0.0, **values):
        """From instantiation to continuous-time mode, with the events of the start."""
        fmus.initialize(self.instance, start, **values)
        self.instance.exitInitializationMode()
        assert not self.event()
        self.instance.enterContinuousTimeMode()
        return self

    def place(self, time, *states):
        """Set time (s) and continuous states."""
        self.instance.setTime(time)
        self.instance.setContinuousStates((ctypes.c_double * 4)(*states), 4)
        return self

    def event(self):
        """Handle the events of this instant; returns whether the simulation must stop."""
        self.instance.enterEventMode()
        update = "newDiscreteStates" if self.fmi == 2 else "updateDiscreteStates"
        again, stop, nominals, jumped, *_ = getattr(self.instance, update)()
        assert (again, nominals, jumped) == (False, False, True)
        return stop

    def set(self, **values):
        """Set inputs by name."""
        fmus.put(self.instance, **values)

    def read(self, *names):
        """Real outputs by name."""
        return dict(zip(names, fmus.get(self.instance, *names), strict=True))

    def flags(self):
        """touched, in_contact, separated."""
        return [bool(flag) for flag in self.instance.getBoolean(self.instance.flags)]

    def changes(self, unknowns, known, seed=1.0):
        """The directional derivatives of variables by one."""
        r = self.instance.references
        found = self.instance.getDirectionalDerivative(
            [r[name] for name in unknowns], [r[known]], [seed]
        )
        return dict(zip(unknowns, found, strict=True))

    def solve(self, stop, rtol=1e-12, start=0.0, inputs=None, method="DOP853", atol=None):
        """Integrate to a time (s) from event to event, as a host does: the times of the events, s.

        `inputs` is called with the time before each evaluation and returns inputs by name. By
        default `atol` is `rtol` times 1 mm and 1 m/s. AssertionError: the FMU ends the simulation.
        """

        def slopes(t, y):
            if inputs:
                self.set(**inputs(t))
            return self.place(t, *y).derivatives()

        def indicator(number):
            def event(t, y):
                slopes(t, y)
                return self.indicators()[number]

            event.terminal, event.direction = True, -1
            return event

        t, found, events = start, [], [indicator(0), indicator(1)]
        atol = atol or [1e-3 * rtol, 1e-3 * rtol, rtol, rtol]
        while t < stop:
            run = solve_ivp(
                slopes, (t, stop), self.states(), method, events=events, rtol=rtol, atol=atol
            )
            t = run.t[-1]
            slopes(t, run.y[:, -1])
            if run.status == 1:
                found.append(t)
                assert len(found) < 5, found
                assert not self.event(), self.messages
        return found


def is_error(call, *arguments):
    """Whether a call returns Error."""
    try:
        call(*arguments)
    except FMICallException as error:
        return error.status == 3
    return False
