"""Any order of FMI calls: never a wrong number afterwards; see `lockstep`."""

import math
import sys

import pytest
from conftest import some
from hypothesis import HealthCheck, Phase, settings
from hypothesis.stateful import run_state_machine_as_test
from lockstep import Machine, Session

from golf_build.system import COMPANIONS

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
    if sys.platform != "linux" or pytestconfig.getoption("--native"):
        names = [name for name in names if name != "FMI 2.0"]
    folders = [way_of(name).slave.unzipDirectory for name in names]
    trace = pytestconfig.cache.mkdir("lockstep") / request.param
    with trace.open("w", buffering=1) as stream:
        session = Session(request.param, folders, stream)
        yield session
        session.close()


@pytest.mark.parametrize("examples", some(1, [50, 200, 5000], 2))
def test_random_calls(session, examples):
    before = dict(session.counts)
    options = settings(
        max_examples=examples // (4 if session.model == "Swing" else 1),
        stateful_step_count=40, deadline=None, database=None, derandomize=examples < 5000,
        phases=(Phase.generate, Phase.shrink), suppress_health_check=list(HealthCheck),
        print_blob=False,
    )  # fmt: skip
    run_state_machine_as_test(lambda: Machine(session), settings=options)
    for what, number in session.counts.items():
        assert number - before[what] > 3 * options.max_examples, what


# The same calls as a table: borders that random calls meet too seldom. `shift` is beside where the
# last step ended, `at` a point; `recover`: correct all, step, compare.

MISUSES = "; ".join(f"misuse get Real {900 + n}" for n in range(10))

SCRIPTS = {
    **{f"size {size}": f"begin; step 1e-4; step {size}; recover"
       for size in (0, -1e-6, "nan", "inf", "-inf", 1e101)},
    **{f"shift {shift}": f"begin; step 1e-4; shift {shift * 1e-4} 1e-4; recover"
       for shift in (0.9e-6, -0.9e-6, 1.1e-6, -1.1e-6, 1.0, -1.0, math.nan, math.inf)},
    **{f"damage {n}": f"begin; step 1e-4; damage {n / 40} {n % 2}; recover" for n in range(40)},
    "of a later time a quarter of the step":
        "begin start=1e3; step 1e-4; shift 2.4e-5 1e-4; shift -2.4e-5 1e-4; shift 2.6e-5 1e-4; "
        "shift -2.6e-5 1e-4; recover",
    "single precision": "begin start=20; step 0.02; shift 1.9e-5 0.02; shift 2.1e-5 0.02; recover",
    "digits of a late point": "begin start=1e6; step 1e-12; shift 0.9e-9 1e-12; recover",
    "illegal calls": f"begin; step 1e-4; {MISUSES}; recover",
    "another time": "begin; step 1e-4; save A; step 1e-4; restore A; at 7 1e-5; at 9 1e-5; recover",
    "no time": "begin; step 1e-4; save A; restore A; at nan 1e-5; at inf 1e-5; at 1e101 1e-5; "
        "at 1e99 1e-5; recover",
    "as before":
        "begin; step 1e-5; step 1e-5; save A bytes; restore A; step 1e-5; at 9 1e-5; recover",
    "another instance": "begin; step 1e-4; save A; save B bytes; switch; restore A; compare; "
        "step 1e-4; switch; step 2e-4; compare; restore B; recover; renew; restore A; recover",
    "start time": "reset; setup nan; setup 2; enter; leave; step 1e-4; compare; setup 1; enter; "
        "recover; reset; setup inf; enter; leave; recover",
    "wrong order": "reset; leave; enter; enter; leave; leave; enter; step 1e-4; recover; end; "
        "step 1e-4; compare; reset; step 1e-4; compare; end; recover",
}  # fmt: skip

#: Of the impact.
ITS_OWN = {
    "touch at the restored instant":
        "begin gap=0.0035; step 1e-4; save A; restore A; at 5 1e-4; compare",
    "before touch":
        "begin gap=0.0035 law=2; step 5e-5; compare; save A; restore A; at 5 1e-4; compare",
    "after touch":
        "begin gap=0.0035; step 2e-4; compare; save A; restore A; at 5 1e-4; compare",
    "parameter after a restore":
        "reset; enter; save A; leave; step 1e-4; restore A; set m_club=0.3; leave; step 1e-4; "
        "compare; restore A; leave; step 1e-4; compare",
    "read, then another value":
        "reset; enter; compare; set m_ball=0.05; compare; set gap=1e-3; compare; set gap=0; leave; "
        "compare; set club_speed=50; set k=2e6; compare; step 1e-4; compare",
    "values act together":
        "begin law=2; step 2e-4; set k=5e5; compare; set b=60; compare; set k=-1; compare; "
        "set k=5e5; step 1e-4; compare; step 0.4; compare",
    "a zero of another sign":
        "begin club_speed=0; set club_speed=-0.0; step 1e-4; compare; begin club_speed=-0.0; "
        "step 1e-4; compare",
    "refused at touch":
        "begin law=2 restitution_at_rest=0.1 restitution_slope=0.0029 gap=0.01; step 1e-4; save A; "
        "step 1e-4; step 1e-4; step 1e-4; set club_speed=20; step 1e-4; save B; compare; "
        "restore A; step 1e-4; step 1e-4; compare; restore B; recover; step 1e-3; compare",
    "inputs that conflict":
        "begin law=2 exponent=1.5; step 1e-4; set k=1e-3 b=1e9; step 1e-4; compare; set k=1e6; "
        "step 1e-4; set b=9; recover",
    "start values that conflict":
        "begin exponent=2; step 1e-4; save A; set exponent=1; step 1e-4; compare; restore A; "
        "set law=2; step 1e-4; compare; set law=1; step 1e-4; recover",
    "masses that conflict":
        "begin m_club=1e-6 m_ball=2; step 1e-4; compare; set m_ball=0.1; step 1e-4; compare; "
        "set m_club=0.2; set k=2e6; step 1e-4; compare",
    "after the end":
        "begin; step 1e-4; save A; end; set k=2; step 1e-4; compare; restore A; recover",
    "a long approach":
        "begin gap=1; step 0.02857; step 1e-6; step 1e-6; step 1e-6; compare; step 1e-6; compare",
}  # fmt: skip


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


def play(session, text):
    """A script: calls of the session with words."""

    def pairs(words):
        for name, value in (word.split("=") for word in words):
            yield name, int(value) if name == "law" else float(value)

    for line in text.split(";"):
        match line.split():
            case ["begin", *words]:
                session.begin(**dict(pairs(words)))
            case ["set", *words]:
                session.set(**dict(pairs(words)))
            case ["shift", shift, size]:
                session.step(float(size), float(shift))
            case ["at", point, size]:
                session.step(float(size), point=float(point))
            case ["misuse", verb, kind, reference]:
                session.misuse(verb, kind, int(reference))
            case ["damage", place, cut]:
                session.damage(float(place), cut == "1")
            case ["save", slot, *words]:
                session.save(slot, "bytes" in words)
            case ["restore", slot]:
                session.restore(slot)
            case [("step" | "setup") as call, number]:
                getattr(session, call)(float(number))
            case [call]:
                getattr(session, call)()


def test_scripts(session):
    own = ITS_OWN if session.model == "ClubBallImpact" else {}
    texts = [*SCRIPTS.values(), *own.values(), *ranges(session.table)]
    # Each start of a swing is a search.
    for text in texts[:: 8 if session.model == "Swing" else 1]:
        session.clear()
        try:
            play(session, text)
        except AssertionError as error:
            raise AssertionError(f"{text}\n{error}") from None


def test_the_comparison_can_fail(session):
    """An instance that is driven by other calls than the accepted ones deviates."""
    session.clear()
    name = "ball_speed" if session.model == "ClubBallImpact" else "gravity"
    name = "friction" if session.model == "Launch" else name
    session.begin()
    session.compare()
    session.rules.begun[name] = session.rules.values[name] = 1.0
    session.dirty = True
    with pytest.raises(AssertionError, match=name):
        session.compare()
