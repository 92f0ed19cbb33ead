"""One instance of ClubBallImpact.fmu for all tests that step it."""

import fmpy
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Discard, fmi2Error
from fmus import discard, get, initialize, is_set, make_instance, put

from golf_impact.errors import UserError, first_line
from golf_impact.runs import ImpactRuns, Named


class ImpactFmu(ImpactRuns):
    """ClubBallImpact.fmu for FMI 2.0, in one instance for any number of runs.

    For use in a `with` block.

    Attributes:
        slave: the instance; see `make_instance`.
        messages: of its logger, since the last `start`.
    """

    def __init__(self, path):
        self.slave = make_instance(fmpy.extract(str(path)), loggingOn=True)
        self.variables, self.messages = self.slave.variables, self.slave.messages
        self.description = self.slave.description
        kinds = ("output", "Real")
        self.real_outputs = [
            name for name, v in self.variables.items() if (v.causality, v.type) == kinds
        ]
        # Restoring it is far cheaper than a reset, which makes a new Python object.
        self._initial = self.slave.getFMUstate()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.slave.freeFMUstate(self._initial)
        discard(self.slave)

    def default(self, name):
        """The start value of an input or parameter."""
        return float(self.variables[name].start)

    def references(self, names):
        return [self.slave.references[name] for name in names]

    def begin_run(self, values):
        """Begin a run with these inputs and parameters (SI units); refusals are messages."""
        self.slave.setFMUstate(self._initial)
        initialize(self.slave)
        self.set(values)
        try:
            self.slave.exitInitializationMode()
        except FMICallException as error:
            if error.status != fmi2Error or not self.messages:
                raise

    def start(self, **values):
        """Begin a run with these inputs and parameters; UserError if they are refused."""
        self.messages.clear()
        self.begin_run(values)
        if self.messages:
            raise UserError(self.messages[0])

    def set(self, values):
        """Set inputs and parameters (SI units)."""
        put(self.slave, **values)

    def step(self, point, size):
        """Make a communication step of `size` s from `point`, s; UserError if it is discarded."""
        try:
            self.slave.doStep(point, size)
        except FMICallException as error:
            if error.status != fmi2Discard:
                raise
            raise UserError(self.messages[-1] if self.messages else first_line(error)) from error

    def read(self, names):
        """Values of Real variables at this communication point, by name (SI units)."""
        return Named(zip(names, get(self.slave, *names), strict=True))

    def read_flag(self, name):
        return is_set(self.slave, name)


@pytest.fixture(scope="session")
def _loaded(fmu_path):
    with ImpactFmu(fmu_path) as fmu:
        yield fmu


@pytest.fixture
def fmu(_loaded):
    """One instance for all tests; each begins a new run."""
    _loaded.messages.clear()
    return _loaded
