"""Components in this process: the physics with clock and modes, without FMI."""

from golf_physics.component.component import Component
from golf_physics.variables import BY_NAME


def initialized(kind=Component, report=lambda refusal: None, **values):
    """A component, or a `kind` of it, after its initialization."""
    component = kind(report)
    component.enter_initialization()
    put(component, **values)
    component.exit_initialization()
    return component


def put(component, **values):
    for name, value in values.items():
        component.set_values([BY_NAME[name].reference], [value], BY_NAME[name].type)


def get(component, *names):
    return component.reals([BY_NAME[name].reference for name in names])


def is_set(component, name):
    """Whether a Boolean output is true."""
    return bool(component.discretes([BY_NAME[name].reference], "Boolean")[0])
