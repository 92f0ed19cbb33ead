"""Errors that a user can correct."""

from collections.abc import Collection
from typing import Any


class UserError(Exception):
    """An error in one line: what was given, what is allowed, what to do. The exit code is 2.

    Args:
        message: in one line.
        variable: the name of the variable to be corrected, if it is a single one.
        value: the refused value.
        reason: what is allowed, and what to do.
    """

    def __init__(
        self, message: str, variable: str = "", value: Any = None, reason: str = ""
    ) -> None:
        super().__init__(message)
        self.variable, self.value, self.reason = variable, value, reason


class MissingFileError(UserError):
    """A scenario needs a further FMU or system that isn't there."""


class MissingEngineError(UserError):
    """wasmtime, which `golf_impact.engine` needs, can't be used here."""


def first_line(error: BaseException | str) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0]


def unknown_name(kind: str, name: Any, known: Collection[str], also: str = "") -> UserError:
    """The error for a name that isn't one of those known, with the most similar one, if one is.

    `kind` is what it should be the name of, `also` what may be given instead, after a comma.
    """
    # Imported here: usually no name is wrong.
    from difflib import get_close_matches

    similar = get_close_matches(str(name), known, 1, 0.5)
    hint = f" (did you mean {similar[0]}?)" if similar else ""
    reason = f"choose from {', '.join(known)}{also}"
    return UserError(f"there is no {kind} {name!r}{hint}: {reason}", str(name), None, reason)


def missing_package(what: str, package: str, extra: str, otherwise: str = "") -> UserError:
    """The error for a package of an extra that isn't installed; `otherwise` is an alternative."""
    # Imported here: usually nothing is missing.
    from golf_build.extras import install_command

    line = f"{what} needs {package}: install it with `{install_command(extra)}`"
    return UserError(f"{line}{otherwise}")
