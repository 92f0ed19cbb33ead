"""The interfaces and the model structure in modelDescription.xml."""

from collections.abc import Iterable, Iterator
from typing import Any

from golf_physics.variables import Variable

#: Attributes of XML elements; None: it hasn't got it.
Attributes = dict[str, str | int | None]


def interfaces(fmi: int, model: str, has_model_exchange: bool) -> dict[str, Attributes]:
    """The elements for the interfaces that an FMU has, by their tags."""
    state = "FMUstate" if fmi == 2 else "FMUState"
    common: Attributes = {"modelIdentifier": model, "needsExecutionTool": "false"}
    common["canBeInstantiatedOnlyOncePerProcess"] = "false"
    common |= {f"canGetAndSet{state}": "true", f"canSerialize{state}": "true"}
    solved: Attributes
    stepped: Attributes = {"canHandleVariableCommunicationStepSize": "true"}
    if fmi == 2:
        common["canNotUseMemoryManagementFunctions"] = "true"
        solved = {"completedIntegratorStepNotNeeded": "true"}
        solved["providesDirectionalDerivative"] = "true"
    else:
        solved = {"needsCompletedIntegratorStep": "false"}
        solved["providesDirectionalDerivatives"] = "true"
        stepped |= {"hasEventMode": "true", "mightReturnEarlyFromDoStep": "true"}
    found = {"ModelExchange": common | solved} if has_model_exchange else {}
    return found | {"CoSimulation": common | stepped}


#: Elements of ModelStructure: group and tag in FMI 2.0, tag in FMI 3.0.
_ELEMENTS = (
    ("Outputs", "Unknown", "Output"),
    ("Derivatives", "Unknown", "ContinuousStateDerivative"),
    ("InitialUnknowns", "Unknown", "InitialUnknown"),
    ("", "", "EventIndicator"),
)


def structure(
    fmi: int, rows: list[Variable], tables: dict[str, Any]
) -> Iterator[tuple[str, str, list[Attributes]]]:
    """Group ("": none), tag and attributes of the elements of ModelStructure.

    In FMI 2.0 an index is the position from 1 on, not the value reference. Without dependencies in
    the tables there is no direct feedthrough: what is read at a communication point belongs to the
    step before.
    """
    known = {row.name: row.reference if fmi == 3 else n for n, row in enumerate(rows, 1)}
    dependencies: dict[str, Iterable[str]] = tables.get("dependencies", {})
    outputs = [row.name for row in rows if row.causality == "output"]
    derivatives = [*tables.get("derivatives", {})]
    initial = [*dict.fromkeys((*outputs, *derivatives))]
    groups = (outputs, derivatives, initial, tables.get("indicators", ()))
    for (group, tag, tag_3), names in zip(_ELEMENTS, groups, strict=True):
        elements: list[Attributes] = []
        for name in names:
            listed = (known[other] for other in dependencies.get(name, ()) if other in known)
            depends: str | None = " ".join(map(str, listed))
            if group == "InitialUnknowns":
                depends = "" if name in tables.get("constant", ()) else None
            where = "index" if fmi == 2 else "valueReference"
            elements.append({where: known[name], "dependencies": depends})
        if elements and (tag if fmi == 2 else tag_3):
            yield (group, tag, elements) if fmi == 2 else ("", tag_3, elements)
