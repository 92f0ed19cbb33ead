"""The ways to get an impact's outputs, one list with one interface.

Steppable ones: the physics in this process, and the FMUs, in Python and native. Others
give the results of whole impacts: `golf_impact.Impact`, Python's functions by the engine (of one
impact, or of rows), and the page.
"""

import math
from contextlib import ExitStack, closing, suppress
from dataclasses import replace
from functools import cache, partial
from itertools import chain, repeat

import fmpy
import fmus
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from golf_physics.component.component import Component
from golf_physics.variables import BY_NAME, VARIABLES

import golf_impact
from golf_build import native
from golf_build.system import COMPANIONS
from golf_impact.data.runs import FLAGS, METRICS, REALS
from golf_impact.fmu import builder_of


class Stepped:
    """An instance with its clock, for any number of runs.

    Attributes:
        model: the name of what it is an instance of.
        outputs: all of them.
        start: values of inputs and parameters.
        time: the host's, s.
        messages: the sentences by which it has refused something in this run.
    """

    def begin(self, values=None, start=0.0):
        """A new run from a time (s) on; bad values are messages."""
        self.messages.clear()
        self.time = start
        self._begin(values or {}, start)
        return self

    def step(self, size, point=None):
        """A step of `size` s, from the present time unless a point is given; if it's accepted."""
        point = self.time if point is None else point
        accepted = self._step(point, size)
        if accepted:
            self.time = point + size
        return accepted

    def read(self, names=None):
        """Outputs by name, by default all."""
        names = list(names or self.outputs)
        reals = [name for name in names if name not in self.flags]
        found = dict(zip(reals, self._reals(reals), strict=True)) if reals else {}
        return found | {name: self._flag(name) for name in names if name in self.flags}

    def __getitem__(self, name):
        """An output."""
        return self.read([name])[name]

    def path(self, values, steps):
        """All outputs after each step (s), with the inputs that are set before it."""
        self.begin(values)
        found = []
        for size, inputs in steps:
            self.set(**inputs)
            assert self.step(size), self.messages
            found.append(self.read())
        return found


class InProcess(Stepped):
    """golf_physics in this process."""

    model, outputs, flags = "ClubBallImpact", (*REALS, *FLAGS), FLAGS

    def __init__(self):
        self.messages = []
        self.component = Component(lambda refusal: self.messages.append(str(refusal)))
        self.start = {row.name: row.start for row in VARIABLES if row.start is not None}
        self._initial = self.component.snapshot()

    def _begin(self, values, start):
        self.component.restore(self._initial)
        self.component.set_up(start)
        self.component.enter_initialization()
        self.set(**values)
        self.component.exit_initialization()

    def set(self, **values):
        for name, value in values.items():
            row = BY_NAME[name]
            self.component.set_values([row.reference], [value], row.type)

    def _step(self, point, size):
        return self.component.step(point, size)

    def _reals(self, names):
        found = self.component.reals([BY_NAME[name].reference for name in names])
        return found[: len(names)]

    def _flag(self, name):
        return bool(self.component.discretes([BY_NAME[name].reference], "Boolean")[0])

    def save(self, as_bytes=False):
        """The state, through bytes if asked for."""
        state = self.component.snapshot()
        if as_bytes:
            state = Component.unpacked(Component.packed(state))
        return state, self.time

    def restore(self, saved):
        state, self.time = saved
        self.component.restore(state)


class InFmu(Stepped):
    """An FMU by fmpy, of either version of FMI, in Python or native; of another `kind` if given."""

    def __init__(self, folder, kind=None):
        self.slave = fmus.make_instance(folder, kind=kind, loggingOn=True)
        self.messages = self.slave.messages
        self.model, variables = self.slave.description.modelName, self.slave.variables
        self.outputs = [v.name for v in variables.values() if v.causality == "output"]
        self.flags = [name for name in self.outputs if variables[name].type == "Boolean"]
        self.start = {
            name: (float if self.slave.types[name] == self.slave.real else int)(v.start)
            for name, v in variables.items()
            if v.causality in ("input", "parameter") and v.type != "Boolean"
        }
        self._initial = fmus.call_state(self.slave, "get")

    def close(self):
        fmus.call_state(self.slave, "free", self._initial)
        self.slave.freeInstance()

    def _begin(self, values, start):
        fmus.call_state(self.slave, "set", self._initial)
        fmus.initialize(self.slave, start, **values)
        # The native FMU returns Error for values that don't fit together.
        with suppress(FMICallException):
            self.slave.exitInitializationMode()

    def set(self, **values):
        fmus.put(self.slave, **values)

    def _step(self, point, size):
        accepted = fmus.step_status(self.slave, point, size) == 0
        assert accepted or self.messages
        return accepted

    def _reals(self, names):
        return fmus.get(self.slave, *names)

    def _flag(self, name):
        return fmus.is_set(self.slave, name)

    def save(self, as_bytes=False):
        """The state, through bytes if asked for."""
        return fmus.saved(self.slave, as_bytes), self.time

    def restore(self, saved):
        state, self.time = saved
        fmus.call_state(self.slave, "set", state)


# Ways of whole impacts: functions of cases, to the metrics of each, NaN where there is none, or why
# it is refused.


def one_by_one(cases, function=golf_impact.run_impact):
    """By `golf_impact.run_impact`, or `golf_impact.Impact`, which has the same arguments."""
    found = []
    for values in cases:
        try:
            found.append(function(**values))
        except golf_impact.UserError as refusal:
            found.append(str(refusal))
    return found


def in_rows(cases):
    """By `golf_impact.run_impacts` in one call: of all refused ones but the first, "" is why."""
    cases = list(cases)
    default = {name: BY_NAME[name].start for values in cases for name in values}
    columns = {name: np.array([(default | v)[name] for v in cases]) for name in default}
    found = golf_impact.run_impacts(**columns)
    rows = (dict(zip(found, map(float, row))) for row in zip(*found.values()))
    sentences = chain([found.reason], repeat(""))
    return [next(sentences) if bad else row for bad, row in zip(found.refused, rows)]


def by_page(cases, folder):
    """By the WebAssembly of `golf-impact explore`, in one run of node."""
    from page.tab import by_wasm

    def row(metrics):
        return {n: math.nan if x is None else x for n, x in metrics.items() if n in METRICS}

    found = by_wasm(list(cases), folder)
    return [one["refused"] if "refused" in one else row(one["metrics"]) for one in found]


#: FMUs: their builders, those of native ones for this machine alone.
FMUS = {
    "FMI 2.0": builder_of(),
    "native, FMI 2.0": replace(native.BUILDERS[2], here=True),
    "native, FMI 3.0": replace(native.BUILDERS[3], here=True),
}
STEPPED = ("in process", *FMUS)
WHOLE = {"Impact": None, "engine": one_by_one, "engine, rows": in_rows, "page": None}


def fmu_file(once, name):
    """An FMU of the list, built once."""
    builder = FMUS[name]
    return once(f"{builder.name}.fmu", builder.digest(), builder.build, "here")


@pytest.fixture
def fmu(request, way_of):
    """The FMU for FMI 2.0: in Python, or native with --native."""
    return way_of("native, FMI 2.0" if request.config.getoption("--native") else "FMI 2.0")


@pytest.fixture(scope="session")
def impact(once):
    """`golf_impact.Impact` of the FMU."""
    with golf_impact.Impact(fmu_file(once, "FMI 2.0")) as impact:
        yield impact


@pytest.fixture(scope="session")
def way_of(request, once, system_files, tmp_path_factory):
    """A function that makes the way of a name, once; FMUs skip where they can't be built."""
    with ExitStack() as stack:

        @cache
        def way_of(name):
            if name in FMUS or name in COMPANIONS:
                paths = {path.stem: path for path in system_files()} if name in COMPANIONS else {}
                path = paths.get(name) or fmu_file(once, name)
                folder = fmpy.extract(str(path), str(tmp_path_factory.mktemp("way")))
                return stack.enter_context(closing(InFmu(folder)))
            if name == "Impact":
                return partial(one_by_one, function=request.getfixturevalue("impact"))
            if name == "page":
                return partial(by_page, folder=tmp_path_factory.mktemp("page"))
            return InProcess() if name == "in process" else WHOLE[name]

        yield way_of


def marked(names):
    """Values for `parametrize`: with --native the native FMUs alone."""
    return [
        pytest.param(name, id=name, marks=[] if "native" in name else [pytest.mark.plain])
        for name in names
    ]


def _each(names):
    """A fixture of each of these ways."""

    @pytest.fixture(params=marked(names), scope="session")
    def way(request, way_of):
        return way_of(request.param)

    return way


stepped_way, fmu_way, whole_way = _each(STEPPED), _each(FMUS), _each(WHOLE)
any_fmu, any_stepped = _each([*FMUS, *COMPANIONS]), _each([*STEPPED, *COMPANIONS])
