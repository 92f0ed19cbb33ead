"""variables.h: what the native FMU has from golf_physics's tables, so that nothing is typed twice.

Value references, bounds and start values come from variables.py, the constants of the quadratures
from numerics, and the sentences of refusals from refusals.py.
"""

from collections.abc import Iterator, Mapping
from string import Formatter
from typing import Any

from golf_physics import conflicts, modes, refusals, restitution
from golf_physics.laws import integrated, linear, power_law
from golf_physics.numerics import chebyshev, gauss
from golf_physics.values import SLOWEST
from golf_physics.variables import (
    BY_NAME,
    INDICATORS,
    INPUTS,
    LAWS,
    MORE_VARIABLES,
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
    # Model Exchange.
    yield f"enum {{ STATES = {len(STATES)}, INDICATORS = {len(INDICATORS)} }};"
    if fmi:
        yield from _array("NOMINALS", [BY_NAME[name].nominal for name in STATES])
    yield ""
    yield from _constants()
    yield ""
    yield "/* Why something is refused, and the sentence. */"
    sentences = dict(_sentences())
    yield "typedef enum {"
    yield ",\n".join(f"    {reason}" for reason in ("FINE", *sentences, "REASONS"))
    yield "} Reason;"
    yield ""
    yield "/* %n: a name, %t: a type, %s: words, %r: a number, %g: one of six digits. */"
    yield "static const char *const SENTENCES[] = {"
    yield '    "",'
    yield from (f"    /* {reason} */ {text}," for reason, text in sentences.items())
    yield "};"
    yield ""


def native_row(row: Variable) -> Variable:
    """A variable as C has it: with the range of its laws."""
    return row._replace(high=max(NATIVE_LAWS)) if row.name == "law" else row


def _variable(row: Variable) -> str:
    row = native_row(row)
    causality = {"input": "INPUT", "parameter": "PARAMETER"}.get(row.causality, "RESULT")
    refused = '""' if row.start is None else _template("OUT_OF_RANGE", **modes.words_on_range(row))
    numbers = ", ".join(repr(float(x or 0.0)) for x in (row.start, row.low, row.high))
    return f'    {{"{row.name}", {_TYPES[row.type]}, {causality}, {numbers}, {refused}}},'


def _constants() -> Iterator[str]:
    yield f"#define SLOWEST {SLOWEST!r}"
    yield f"#define LEAST_RESTITUTION {restitution.LEAST!r}"
    yield f"#define MOST_DAMPING_RATIO {restitution.MOST_DAMPING!r}"
    for name in ("MOST_RATIO", "MOST_PUSH", "MOST_PUSH_OF_POWER_LAW"):
        yield f"#define {name} {getattr(refusals, name)!r}"
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


# SENTENCES

#: What isn't a number, in C's templates.
_WORDS = {"name": "%n", "type": "%t", "why": "%s"}

#: Of rules that C has by other names, or fills with the limits of its own.
_KNOWN: dict[str, dict[str, Any]] = {
    "DAMPING_RATIO": {"most": restitution.MOST_DAMPING},
    "TOUCH": {"least": restitution.LEAST},
    "TOO_MANY_PANELS": {"most": integrated._MOST_PANELS},
    "TOO_MANY_EXTREMA": {"most": linear._MOST},
}


def _sentences() -> Iterator[tuple[str, str]]:
    """Reasons, and the templates of their sentences."""
    for rule in refusals.RULES:
        if rule == "OUT_OF_RANGE":
            yield rule, '""'  # of every variable, see the table
        elif rule == "OF_OTHER_LAWS":
            for name in ("exponent", "restitution_at_rest"):
                words = conflicts.of_other_laws(1, name)
                yield f"{name.upper()}_WITH_LAW_1", _template(rule, name=name, **words)
        else:
            yield rule, _template(rule, **_KNOWN.get(rule, {}))


def _template(rule: str, **known: Any) -> str:
    """A rule's sentence as C has it: these words filled in, a code in place of each other one."""
    text = ""
    for literal, field, spec, conversion in Formatter().parse(
        ": ".join(filter(None, refusals.RULES[rule]))
    ):
        text += literal
        if field in known:
            text += format(known[field], spec or "")
        elif field is not None:
            text += _WORDS.get(field, "%r" if conversion == "r" else f"%{spec}")
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
