"""Any order of FMI calls: never a wrong number afterwards; see `lockstep`."""

import math
import sys

import hypothesis.strategies as st
import pytest
from conftest import HERE, some
from hypothesis import HealthCheck, Phase, given, settings
from lockstep import ERROR, Session, random_lines

from golf_build import native
from golf_build.system import COMPANIONS
from golf_impact.data.files import read_toml

#: By model its FMUs; the first one's fresh instance is quick.
MODELS = {
    "ClubBallImpact": ("native, FMI 2.0", "FMI 2.0", "native, FMI 3.0"),
    **{name: (name,) for name in COMPANIONS},
}


@pytest.fixture(
    scope="module",
    params=[pytest.param(m, marks=[pytest.mark.plain] * (m in COMPANIONS)) for m in MODELS],
)
def session(request, pytestconfig, way_of):
    """A session; after a crash the trace in pytest's cache ends with the call that did it."""
    names = MODELS[request.param]
    # Functions of another C library differ from Python's.
    if sys.platform != "linux" or not native.pythonfmu_runs_here():
        names = [name for name in names if name != "FMI 2.0"]
    folders = [way_of(name).slave.unzipDirectory for name in names]
    trace = pytestconfig.cache.mkdir("lockstep") / request.param
    with trace.open("w", buffering=1) as stream:
        session = Session(request.param, folders, stream)
        yield session
        session.close()


@pytest.mark.parametrize("examples", some(1, [16, 200, 5000], 2))
def test_random_calls(session, examples):
    before, examples = dict(session.counts), examples // (4 if session.model == "Swing" else 1)

    @settings(
        max_examples=examples, deadline=None, database=None, derandomize=examples < 1000,
        phases=(Phase.generate, Phase.shrink), suppress_health_check=list(HealthCheck),
        print_blob=False,
    )  # fmt: skip
    @given(st.lists(random_lines(session.model, session.table), min_size=15, max_size=40))
    def play(lines):
        session.play("; ".join(["begin; save A; save B", *lines, "compare"]))

    play()
    for what, number in session.counts.items():
        assert number - before[what] > 3 * examples, what


#: Borders that random calls meet too seldom: scripts of all FMUs, and of one model's.
SCRIPTS = read_toml(HERE / "contract" / "scripts.toml")


def refused_calls(table):
    """Calls that are refused; what is right goes on as if they hadn't been made."""
    sizes = [f"step {size}" for size in (0, -1e-6, "nan", "inf", "-inf", 1e101, "inf at=-inf")]
    shifts = (0.9e-6, -0.9e-6, 1.1e-6, -1.1e-6, 1.0, -1.0, math.nan, math.inf)
    points = [f"step 1e-4 off={shift * 1e-4}" for shift in shifts]
    damages = [f"damage {n / 40} {n % 2}" for n in range(40)]
    misuses = "; ".join(f"misuse get Real {900 + n}" for n in range(10))
    for call in (*sizes, *points, *damages, misuses):
        yield f"begin; step 1e-4; {call}; recover"
    # All that can be refused at once.
    values = ((r.name, "nan" if r.type == "Real" else r.high + 1) for r in table.values())
    bad = "; ".join(
        f"set {name}={value}" for name, value in values if table[name].start is not None
    )
    yield f"reset; setup nan; enter; leave; {bad}; {misuses}; step 1e-4; compare"


def ranges(table):
    """Each value on both sides of its limits, before the run and in it."""
    for name, row in table.items():
        if row.start is None or row.type == "Boolean":
            continue
        values = row.low, row.high, row.low - 1, row.high + 1
        if row.type == "Real":
            beyond = math.nextafter(row.low, -math.inf), math.nextafter(row.high, math.inf)
            values = (row.low, row.high, *beyond, math.nan, -math.inf, math.inf)
        for value in values:
            yield f"begin {name}={value}; step 1e-4; recover; end; set {name}={value}; recover"
            yield f"begin; step 1e-4; set {name}={value}; step 1e-4; compare; recover"
        late = row.start + 1e-3 if row.type == "Real" else row.high
        yield f"begin; set {name}={row.start}; step 1e-4; set {name}={late}; step 1e-4; recover"


def test_scripts(session):
    texts = [*SCRIPTS["all"].values(), *refused_calls(session.table), *ranges(session.table)]
    # Each start of a swing is a search.
    texts = texts[:: 24 if session.model == "Swing" else 1]
    for text in [*texts, *SCRIPTS.get(session.model, {}).values()]:
        try:
            session.play(text)
        except AssertionError as error:
            raise AssertionError(f"{text}\n{error}") from None


#: Of FMI 2.0; no FMU has them.
UNSUPPORTED = (
    "CancelStep", "GetStatus", "GetIntegerStatus", "GetBooleanStatus", "GetStringStatus",
    "SetRealInputDerivatives", "GetRealOutputDerivatives", "GetDirectionalDerivative",
)  # fmt: skip


def test_functions_that_no_fmu_has(session):
    """No effect, whatever the status, and never Fatal."""
    session.begin()
    session.step(1e-4)
    for player in session.players:
        for name in UNSUPPORTED if not player.fmi3 else ():
            function = getattr(player.slave.dll, f"fmi2{name}")
            kinds = [kind._type_ for kind in function.argtypes[1:]]
            given = [1 if isinstance(kind, str) else (kind * 1)() for kind in kinds]
            assert function(player.slave.component, *given) <= ERROR
    session.compare()
