"""variables.h: what the native FMU has from golf_physics's tables, so that nothing is typed twice.

Value references, bounds and start values come from variables.py, limits and tolerances from the
modules that C has too, the constants of the quadratures from numerics, and the sentences of
refusals from refusals.py.
"""

from collections.abc import Iterator, Mapping
from string import Formatter
from typing import Any

from golf_physics import conflicts, impact, modes, refusals, restitution, values
from golf_physics.laws import contact, integrated, linear, power_law
from golf_physics.numerics import chebyshev, gauss, ode
from golf_physics.variables import (
    BY_NAME,
    CO_SIMULATION_ONLY,
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

_lines = "\n".join

_TYPES = {"Real": "REAL", "Enumeration": "ENUMERATION", "Boolean": "BOOLEAN"}


def header(fmi: int, token: str, start: Mapping[str, float]) -> str:
    """The C header for a version of FMI (0: the page), with the FMU's GUID or instantiation token.

    `start` has start values by name, where they aren't those of the table.
    """
    # Those that can be set first, in the order of an instance's values.
    rows = [*SETTABLE.values(), *(row for row in VARIABLES if row.start is None)]
    rows += (row for row in MORE_VARIABLES if fmi == 3 or (fmi == 2 and row.name != "time"))
    places = {row.reference: place for place, row in enumerate(rows)}
    nominals = [BY_NAME[name].nominal for name in STATES if fmi]
    historical = " || ".join(f"(reference) == VR_{name}" for name in CO_SIMULATION_ONLY)
    sentences = dict(_sentences())
    started = (row._replace(start=start.get(row.name, row.start)) for row in rows)
    return f"""/* Made from golf_physics by golf_build.native_header. */

#define FMI_VERSION {fmi}
#define TOKEN "{token}"

enum {{
{_lines(f"    VR_{row.name} = {row.reference}," for row in rows)}
    SETTABLE = {len(SETTABLE)}, /* inputs and parameters */
    INPUTS = {INPUTS},
    VARIABLES = {len(rows)},
    STATES = {len(STATES)}, /* of Model Exchange */
    INDICATORS = {len(INDICATORS)}
}};

/* FMI 3.0 has more of them, of which there are no variables. */
typedef enum {{
    REAL, ENUMERATION, BOOLEAN, STRING, FLOAT32, INT8, UINT8, INT16, UINT16, INT32, UINT32, UINT64
}} Type;
typedef enum {{ INPUT, PARAMETER, RESULT }} Causality;

/* A variable; what is said of a refused value of it. */
typedef struct {{
    const char *name;
    Type type;
    Causality causality;
    double start, low, high;
    const char *refused;
}} Variable;

/* Inputs and parameters come first, in the order of an instance's values. */
static const Variable TABLE[] = {{
{_lines(map(_variable, started))}
}};

/* Places in the table by value reference; -1: there is none. */
{_array("PLACES", [places.get(n, -1) for n in range(max(places) + 1)], "signed char")}

/* Outputs that depend on the history of the contact, not only on its states. */
#define NEEDS_HISTORY(reference) ({historical})

{_array("NOMINALS", nominals) if fmi else ""}
{_lines(_constants())}

/* Why something is refused, and the sentence. */
typedef enum {{
{_lines(f"    {reason}," for reason in ("FINE", *sentences))}
    REASONS
}} Reason;

/* %n: a name, %t: a type, %s: words, %r: a number, %g: one with six digits. */
static const char *const SENTENCES[] = {{
    "",
{_lines(f"    /* {reason} */ {text}," for reason, text in sentences.items())}
}};
"""


def native_row(row: Variable) -> Variable:
    """A variable as C has it: with the range of its laws."""
    return row._replace(high=max(NATIVE_LAWS)) if row.name == "law" else row


def _variable(row: Variable) -> str:
    row = native_row(row)
    causality = {"input": "INPUT", "parameter": "PARAMETER"}.get(row.causality, "RESULT")
    refused = '""' if row.start is None else _template("OUT_OF_RANGE", **modes.words_on_range(row))
    numbers = ", ".join(repr(float(x or 0.0)) for x in (row.start, row.low, row.high))
    return f'    {{"{row.name}", {_TYPES[row.type]}, {causality}, {numbers}, {refused}}},'


#: The numbers of these modules have the same names in C, but for an underscore; each is one number.
_SHARED = (values, refusals, modes, impact, contact, linear, power_law, integrated, ode)


def _constants() -> Iterator[str]:
    for name, value in (pair for module in _SHARED for pair in vars(module).items()):
        if name.isupper() and isinstance(value, float):
            yield f"#define {name.lstrip('_')} {value!r}"
    yield f"#define LEAST_RESTITUTION {restitution.LEAST!r}"
    yield f"#define MOST_DAMPING_RATIO {restitution.MOST_DAMPING!r}"
    yield f"enum {{ GAUSS_POINTS = {len(gauss.GAUSS_5)}, ORDER = {chebyshev.ORDER} }};"
    nodes, weights = zip(*gauss.GAUSS_5)
    yield _array("GAUSS_NODES", nodes)
    yield _array("GAUSS_WEIGHTS", weights)
    yield _array("NODES", chebyshev.NODES)
    for name, rows in (("TRANSFORM", chebyshev._TRANSFORM), ("INTEGRALS", chebyshev.INTEGRALS)):
        yield f"static const double {name}[][{len(rows[0])}] = {{"
        yield from (f"    {{{', '.join(map(repr, row))}}}," for row in rows)
        yield "};"
    yield _array("CUTS_BELOW_CRITICAL", power_law._CUTS_BELOW_CRITICAL)
    yield _array("CUTS_ABOVE_CRITICAL", power_law._CUTS_ABOVE_CRITICAL)


def _array(name: str, values: Any, type_: str = "double") -> str:
    return f"static const {type_} {name}[] = {{{', '.join(map(repr, values))}}};"


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
    for literal, field, spec, _ in Formatter().parse(refusals.RULES[rule]):
        text += literal
        if field in known:
            text += format(known[field], spec or "")
        elif field is not None:
            text += _WORDS.get(field, "%g" if spec == "g" else "%r")
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
