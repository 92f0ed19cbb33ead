"""What a host may set in a companion FMU, and how it is told no.

A refused value leaves the old one; steps are refused until the variable is set right.
"""

from collections.abc import Callable

from pythonfmu.enums import Fmi2Status


class Settings:
    """Setters of a slave's variables; the slave has `_refused`, why by name, and `_fixed`."""

    _refused: dict[str, str]
    #: Whether parameters can't be set any more.
    _fixed: bool
    #: Of the slave.
    log: Callable[..., None]

    def _setter(self, name: str, low: float, high: float, fixed: bool) -> Callable[[float], None]:
        """Of a parameter (`fixed`) or an input that may be from low to high."""

        def assign(value: float) -> None:
            if value == getattr(self, name):
                self._refused.pop(name, None)
            elif not low <= value <= high:
                self._refuse(name, f"{name} = {value!r} is refused: it must be {low:g} to {high:g}")
            elif fixed and self._fixed:
                self._refuse(name, f"{name} = {value!r} is refused: a parameter is fixed now")
            else:
                self._refused.pop(name, None)
                setattr(self, name, value)

        return assign

    def _refuse(self, name: str, message: str) -> None:
        self._refused[name] = message
        self.log(message, Fmi2Status.error)

    def _no_setter(self, value: float) -> None:
        self.log("an output can't be set", Fmi2Status.error)
