"""variables.h: what the native FMU has from golf_physics's tables, so that nothing is typed twice.

Value references, bounds and start values come from variables.py, the constants of the quadratures
from numerics, and the sentences of refusals from where golf_physics has them.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from golf_physics import modes, refusals, restitution
from golf_physics.component import component
from golf_physics.laws import integrated, law, linear, power_law, relative
from golf_physics.numerics import chebyshev, gauss, ode
from golf_physics.values import SLOWEST, rejected
from golf_physics.variables import (
    BY_NAME,
    INDICATORS,
    INPUTS,
    LAWS,
    MORE_VARIABLES,
    MOTION,
    SETTABLE,
    STATES,
    VARIABLES,
    Variable,
)

#: The contact laws that C has (law.c): native FMUs and the page offer these alone.
NATIVE_LAWS = {number: LAWS[number] for number in (1, 2)}

_TYPES = {"Real": "REAL", "Enumeration": "ENUMERATION", "Boolean": "BOOLEAN"}


def header(fmi: int, token: str, start: Mapping[str, float]) -> str:
    """The C header for a version of FMI (0: the page), with the FMU's GUID or instantiation token.

    `start` has start values by name, where they aren't those of the table.
    """
    lines = _lines(fmi, token, start)
    return "\n".join(["/* Made from golf_physics by golf_build.native_header. */", "", *lines])


def _lines(fmi: int, token: str, start: Mapping[str, float]) -> Iterator[str]:
    # Those that can be set first, in the order of an instance's values.
    rows = [*SETTABLE.values(), *(row for row in VARIABLES if row.start is None)]
    rows += (row for row in MORE_VARIABLES if fmi == 3 or (fmi == 2 and row.name != "time"))
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
    # Model Exchange.
    yield f"enum {{ STATES = {len(STATES)}, INDICATORS = {len(INDICATORS)} }};"
    if fmi:
        yield from _array("NOMINALS", [BY_NAME[name].nominal for name in STATES])
    yield ""
    yield from _constants()
    yield ""
    yield "/* Why something is refused, and the sentence. */"
    sentences = [(reason, _quoted(text)) for reason, text in _sentences()]
    yield "typedef enum {"
    yield ",\n".join(["    FINE", *(f"    {reason}" for reason, _ in sentences)]) + ","
    yield f"    LAST_REASON = {sentences[-1][0]}"
    yield "} Reason;"
    yield ""
    yield "static const char *const SENTENCES[] = {"
    yield '    "",'
    yield from (f"    /* {reason} */ {text}," for reason, text in sentences)
    yield "};"
    yield ""


def native_row(row: Variable) -> Variable:
    """A variable as C has it: with the range of its laws."""
    return row._replace(high=max(NATIVE_LAWS)) if row.name == "law" else row


def _variable(row: Variable) -> str:
    row = native_row(row)
    causality = {"input": "INPUT", "parameter": "PARAMETER"}.get(row.causality, "RESULT")
    refused = _quoted(modes.out_of_range(row, _HOLE) if row.start is not None else "")
    numbers = ", ".join(repr(float(x or 0.0)) for x in (row.start, row.low, row.high))
    return f'    {{"{row.name}", {_TYPES[row.type]}, {causality}, {numbers}, {refused}}},'


def _constants() -> Iterator[str]:
    yield f"#define SLOWEST {SLOWEST!r}"
    yield f"#define LEAST_RESTITUTION {restitution.LEAST!r}"
    yield f"#define MOST_DAMPING_RATIO {restitution.MOST_DAMPING!r}"
    yield f"#define MOST_RATIO {refusals._MOST_RATIO!r}"
    yield f"#define MOST_PUSH {law._MOST_PUSH!r}"
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


def _quoted(sentence: object) -> str:
    """A sentence as C has it, with %s in place of each name and number."""
    text = str(sentence).format(*[_HOLE] * str(sentence).count("{"))
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


# SENTENCES


class _Hole:
    """Stands for a name or a number in a sentence."""

    def __repr__(self) -> str:
        return "%s"

    def __format__(self, spec: str) -> str:
        return "%s"


_HOLE: Any = _Hole()


def _sentences() -> Iterator[tuple[str, object]]:
    """Reasons, and their sentences."""
    yield "OUT_OF_RANGE", ""  # of every variable, see the table
    yield "FIXED", rejected(_HOLE, _HOLE, modes.FIXED)
    yield "START_TIME", rejected("start time", _HOLE, modes.START_TIME, " s")
    yield "LATE_SET_UP", modes.LATE_SET_UP
    yield "ENTERED_TWICE", modes.ENTERED_TWICE
    yield "NOT_ENTERED", modes.NOT_ENTERED
    yield "STEP_SIZE", rejected("communication step size", _HOLE, modes.STEP_SIZE, " s")
    yield "POINT_JUMPS", rejected("communication point", _HOLE, modes.POINT_JUMPS, " s")
    yield "STEP_BEFORE_START", modes.STEP_BEFORE_START
    yield "STEP_AFTER_END", modes.STEP_AFTER_END
    yield "NOT_SETTABLE", modes.NOT_SETTABLE
    yield "NOT_READABLE", modes.NOT_READABLE
    yield "NO_VARIABLE", modes.NO_VARIABLE
    yield "SET_AFTER_END", modes.SET_AFTER_END
    yield "FOREIGN_STATE", component.FOREIGN_STATE
    yield "UNTIL_CORRECTED", modes.UNTIL_CORRECTED
    yield "NO_EVENT", "an event before initialization or after the end is refused"
    yield "MUST_STOP", "the simulation must stop: {}"
    yield "MASS_RATIO", refusals.mass_ratio(_HOLE, _HOLE)
    yield "DAMPING_RATIO", refusals.damping_ratio(_HOLE, _HOLE)
    for name in ("exponent", "restitution_at_rest"):
        yield f"{name.upper()}_WITH_LAW_1", refusals.of_other_laws(1, name, _HOLE)
    yield "TOUCH", relative.refused_touch(*[_HOLE] * 5)
    yield "UNDECIDED", integrated.UNDECIDED
    yield "TOO_MANY_PANELS", integrated.TOO_MANY_PANELS
    yield "NO_NUMBERS", ode.NO_NUMBERS
    yield "NOT_FINITE", integrated.NOT_FINITE
    yield "TOO_MANY_EXTREMA", linear.TOO_MANY_EXTREMA
    yield "LARGE_PUSH", rejected("club_force", _HOLE, law.LARGE_PUSH, " N")
    yield "LARGE_PUSH_OF_POWER_LAW", rejected("club_force", _HOLE, relative.LARGE_PUSH, " N")
    not_computable = component.not_computed(ArithmeticError("{}"))
    yield "NOT_COMPUTABLE", not_computable
    yield "CHANGE_REFUSED", component.CHANGE_REFUSED.format(_HOLE, _HOLE, not_computable)
    yield "FORCE_REFUSED", rejected("club_force", _HOLE, "{}", " N")
