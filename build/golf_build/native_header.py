"""variables.h: what the native FMU has from golf_physics's tables, so that nothing is typed twice.

Value references, bounds and start values come from variables.py, the constants of the quadratures
from numerics; the sentences of refusals are those that golf_physics says when it is made to, with
%s in place of each number and name.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from math import nan
from typing import Any
from unittest import mock

from golf_physics.component.component import Component, _not_computed
from golf_physics.component.hybrid import HybridComponent
from golf_physics.laws import LAWS, extended, integrated, power_law
from golf_physics.laws.extended import ExtendedContact
from golf_physics.laws.integrated import IntegratedContact
from golf_physics.numerics import chebyshev, gauss, ode
from golf_physics.refusals import conflict, refusal
from golf_physics.values import Inputs, Motion, Parameters, rejected
from golf_physics.variables import INPUTS, MORE_VARIABLES, MOTION, SETTABLE, VARIABLES, Variable

_TYPES = {"Real": "REAL", "Enumeration": "ENUMERATION", "Boolean": "BOOLEAN"}


def header(fmi: int, token: str, start: Mapping[str, float]) -> str:
    """The C header for a version of FMI, with the FMU's GUID or instantiation token.

    `start` has start values by name, where they aren't those of the table.
    """
    lines = _lines(fmi, token, start)
    return "\n".join(["/* Made from golf_physics by golf_build.native_header. */", "", *lines])


def _lines(fmi: int, token: str, start: Mapping[str, float]) -> Iterator[str]:
    # Those that can be set first, in the order of an instance's values.
    rows = [*SETTABLE.values(), *(row for row in VARIABLES if row.start is None)]
    rows += MORE_VARIABLES if fmi == 3 else ()
    yield f"#define FMI_VERSION {fmi}"
    yield f'#define TOKEN "{token}"'
    yield ""
    yield "enum {"
    yield from (f"    VR_{row.name} = {row.reference}," for row in rows)
    yield f"    SETTABLE = {len(SETTABLE)}, /* inputs and parameters */"
    yield f"    INPUTS = {INPUTS},"
    yield f"    VARIABLES = {len(rows)}"
    yield "};"
    yield ""
    # FMI 3.0 has more of them, of which there are no variables.
    others = "FLOAT32, INT8, UINT8, INT16, UINT16, INT32, UINT32, UINT64"
    yield f"typedef enum {{ REAL, ENUMERATION, BOOLEAN, STRING, {others} }} Type;"
    yield "typedef enum { INPUT, PARAMETER, RESULT } Causality;"
    yield ""
    yield "/* A variable; what is said of a refused value of it. */"
    yield "typedef struct {"
    yield "    const char *name;"
    yield "    Type type;"
    yield "    Causality causality;"
    yield "    double start, low, high;"
    yield "    const char *refused;"
    yield "} Variable;"
    yield ""
    yield "/* Inputs and parameters come first, in the order of an instance's values. */"
    yield "static const Variable TABLE[] = {"
    yield from (_variable(row._replace(start=start.get(row.name, row.start))) for row in rows)
    yield "};"
    yield ""
    yield "/* Places in the table by value reference; -1: there is none. */"
    places = {row.reference: place for place, row in enumerate(rows)}
    yield from _array("PLACES", [places.get(n, -1) for n in range(max(places) + 1)], "signed char")
    yield ""
    yield "/* X(name) for every output that isn't part of the state of the bodies. */"
    outputs = (row.name for row in rows if row.causality != "input" and row.start is None)
    yield "#define OUTPUTS(X) \\"
    yield " \\\n".join(f"    X({name})" for name in outputs if name not in MOTION)
    yield ""
    yield from _constants()
    yield ""
    yield "/* Why something is refused, and the sentence. */"
    sentences = list(_sentences())
    yield "typedef enum {"
    yield ",\n".join(["    FINE", *(f"    {reason}" for reason, _ in sentences)]) + ","
    yield f"    LAST_REASON = {sentences[-1][0]}"
    yield "} Reason;"
    yield ""
    yield "static const char *const SENTENCES[] = {"
    yield '    "",'
    yield from (f"    /* {reason} */ {_quoted(text)}," for reason, text in sentences)
    yield "};"
    yield ""


def _variable(row: Variable) -> str:
    causality = {"input": "INPUT", "parameter": "PARAMETER"}.get(row.causality, "RESULT")
    refused = _quoted(_template(refusal(row, 1234.5), 1234.5)) if row.start is not None else '""'
    numbers = ", ".join(repr(float(x or 0.0)) for x in (row.start, row.low, row.high))
    return f'    {{"{row.name}", {_TYPES[row.type]}, {causality}, {numbers}, {refused}}},'


def _constants() -> Iterator[str]:
    yield f"enum {{ GAUSS_POINTS = {len(gauss.GAUSS_5)}, ORDER = {chebyshev.ORDER} }};"
    nodes, weights = zip(*gauss.GAUSS_5)
    yield from _array("GAUSS_NODES", nodes)
    yield from _array("GAUSS_WEIGHTS", weights)
    yield from _array("NODES", chebyshev.NODES)
    yield from _matrix("TRANSFORM", chebyshev._TRANSFORM)
    yield from _matrix("INTEGRALS", chebyshev.INTEGRALS)
    yield from _array("CUTS_BELOW_CRITICAL", power_law._CUTS_BELOW_CRITICAL)
    yield from _array("CUTS_ABOVE_CRITICAL", power_law._CUTS_ABOVE_CRITICAL)


def _array(name: str, values: Any, type_: str = "double") -> Iterator[str]:
    yield f"static const {type_} {name}[] = {{{', '.join(map(repr, values))}}};"


def _matrix(name: str, rows: Any) -> Iterator[str]:
    yield f"static const double {name}[][{len(rows[0])}] = {{"
    yield from (f"    {{{', '.join(map(repr, row))}}}," for row in rows)
    yield "};"


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


# SENTENCES


def _template(sentence: object, *values: object) -> str:
    """A sentence with %s in place of these values, in their order."""
    rest, done = str(sentence), ""
    for value in values:
        shown = value if isinstance(value, str) else repr(value)
        before, found, rest = rest.partition(shown)
        if not found:
            raise ValueError(f"{sentence} doesn't mention {shown}")
        done += f"{before}%s"
    return done + rest


def _case(**values: float) -> tuple[Parameters, Inputs]:
    """Parameters and inputs that differ from the start values in these."""
    all_values: list[Any] = [values.get(row.name, row.start) for row in SETTABLE.values()]
    return Parameters(*all_values[INPUTS:]), Inputs(*all_values[:INPUTS])


def _refused(*calls: Callable[[Any], Any], kind: Any = Component, stepping: bool = True) -> str:
    """What an instance says last after these calls."""
    said: list[Any] = []
    component = kind(said.append)
    if stepping:
        component.enter_initialization()
        component.exit_initialization()
    for call in calls:
        call(component)
    return str(said[-1])


def _setting(reference: int, value: Any, type_: str = "Real") -> Callable[[Any], Any]:
    return lambda component: component.set_values([reference], [value], type_)


def _sentences() -> Iterator[tuple[str, str]]:
    """Reasons, and their sentences."""
    yield "OUT_OF_RANGE", ""  # of every variable, see the table
    fixed = _refused(_setting(3, 0.375))
    yield "FIXED", _template(fixed, "m_club", 0.375, 0.21)
    begun = _refused(lambda c: c.set_up(1e999), stepping=False)
    yield "START_TIME", _template(begun, 1e999)
    yield "LATE_SET_UP", _refused(lambda c: c.set_up(0.0))
    yield "ENTERED_TWICE", _refused(lambda c: c.enter_initialization())
    yield "NOT_ENTERED", _refused(lambda c: c.exit_initialization())
    yield "STEP_SIZE", _template(_refused(lambda c: c.step(0.0, -2.5)), -2.5)
    jumped = _refused(lambda c: c.step(0.0, 0.125), lambda c: c.step(7.5, 0.125))
    yield "POINT_JUMPS", _template(jumped, 7.5, 0.125)
    early = _refused(lambda c: c.step(0.0, 0.125), stepping=False)
    yield "STEP_BEFORE_START", early
    yield "STEP_AFTER_END", _refused(lambda c: c.terminate(), lambda c: c.step(0.0, 0.125))
    output = _refused(_setting(24, 1.0))
    yield "NOT_SETTABLE", _template(output, "smash_factor", "Real")
    yield "NO_VARIABLE", _template(_refused(_setting(99, 1.0)), "99").partition(" is no")[0]
    ended = _refused(lambda c: c.terminate(), _setting(0, 1e5))
    yield "SET_AFTER_END", _template(ended, "k")
    yield "UNKNOWN", _template(_refused(lambda c: c.discretes([99], "Boolean")), "Boolean")
    yield "FOREIGN_STATE", _refused(lambda c: c.restore(None))
    blocked = _refused(_setting(0, -2.5), lambda c: c.step(0.0, 0.125))
    yield "UNTIL_CORRECTED", blocked[: blocked.index("k = ")] + "%s"
    hybrid = _refused(lambda c: c.update(), kind=HybridComponent, stepping=False)
    yield "NO_EVENT", hybrid
    stopped = _refused(_setting(0, -2.5), lambda c: c.update(), kind=HybridComponent)
    yield "MUST_STOP", stopped[: stopped.index("k = ")] + "%s"
    yield from _conflicts()
    yield from _contacts()


def _contacts() -> Iterator[tuple[str, str]]:
    """Contacts that can't be computed, and what that prevents."""
    p, inputs = _case(law=2, exponent=1.5)
    start = Motion(0.0, 0.0, 35.0, 0.0, 0.0, 35.0)

    def contact(force: Callable = LAWS[2].force) -> IntegratedContact:
        return IntegratedContact(partial(force, p, 1e6, 9.0), 0.0, 0.25, 0.125, start, 100.0)

    yield "UNDECIDED", integrated._UNDECIDED.replace("{!r}", "%s")
    endless = contact()
    endless._panels, endless.duration = [None] * integrated._MOST_PANELS, 0.125  # type: ignore[list-item]
    yield "TOO_MANY_PANELS", _raised(endless.extend, 0.125)
    yield (
        "NO_NUMBERS",
        _raised(lambda: ode._slopes(_diverging, 0.125, 1.0, [0.5] * 2, 1, [0.0]), 0.125),
    )
    yield "NOT_FINITE", _raised(lambda: contact(lambda *_: nan), 0.0, 35.0, nan)
    with mock.patch.object(extended, "_MOST_EXTREMA", 1):
        pushed = _raised(lambda: ExtendedContact(1e6, 9.0, 0.0, 0.25, 0.125, start, 1e6), 0.0)
    most = f"after {extended._MOST_EXTREMA} extrema"
    yield "TOO_MANY_EXTREMA", pushed.replace("after 1 extrema", most)
    push = LAWS[2].refusal_of_touch(p, inputs._replace(club_force=1e12))
    shown = str(push).partition("leads to, ")[2].partition(" N")[0]
    yield "LARGE_PUSH", _template(push, 1e12, shown)
    yield "NOT_COMPUTABLE", str(_not_computed(ArithmeticError("%s")))
    change = "k = %s, b = %s are refused: "
    yield "CHANGE_REFUSED", change + str(_not_computed(ArithmeticError("%s")))
    yield "FORCE_REFUSED", _template(rejected("club_force", 1e12, "%s", " N"), 1e12)


def _diverging(t: float, quantities: Any) -> list[float]:
    return [1e9 * quantities[1]]


def _raised(call: Callable[[], Any], *values: float) -> str:
    """The template of the sentence that a call raises."""
    try:
        call()
    except ArithmeticError as error:
        return _template(error, *values)
    raise ValueError("a contact that can't be computed is")


def _conflicts() -> Iterator[tuple[str, str]]:
    """Values that are refused together."""
    extreme = {
        "k": 2.5e6, "b": 3.5, "m_club": 1e-80, "m_ball": 0.0625, "club_speed": 41.5,
        "ball_speed": -1.5, "gap": 0.75,
    }  # fmt: skip
    yield "EXTREME_VALUES", _template(conflict(*_case(**extreme)), *extreme.values())
    force = conflict(*_case(club_force=1e99))
    yield "EXTREME_FORCE", _template(force, 1e99)
    for name, value in (("exponent", 1.5), ("restitution_at_rest", 0.75)):
        others = conflict(*_case(law=1, **{name: value}))
        yield f"{name.upper()}_WITH_LAW_1", _template(others, value)
    line, closing = {"restitution_at_rest": 0.5, "restitution_slope": 0.0625}, 77.5 + 1.5
    p, _ = _case(law=2, ball_speed=-1.5, **line)
    _, inputs = _case(club_speed=77.5)
    touch, coefficient = LAWS[2].refusal_of_touch(p, inputs), 0.5 - 0.0625 * closing
    yield "TOUCH", _template(touch, 77.5, *line.values(), closing, coefficient)
    p, inputs = _case(law=2, exponent=11.5, reference_compression=1e100, club_speed=35.0)
    powers = str(conflict(p, inputs))
    reach = powers.partition("lead to (")[2].partition(" m)")[0]
    yield "EXTREME_POWERS", _template(powers, 11.5, 1e100, inputs.k, inputs.club_speed, reach)
