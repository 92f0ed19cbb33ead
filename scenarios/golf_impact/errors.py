"""Errors that a user can correct."""

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


def first_line(error: BaseException | str) -> str:
    """The first line of an error's message."""
    return (str(error).strip() or type(error).__name__).splitlines()[0]


def missing_package(what: str, package: str, extra: str, otherwise: str = "") -> UserError:
    """The error for a package of an extra that isn't installed; `otherwise` is an alternative."""
    # Imported here: usually nothing is missing.
    from golf_build.extras import install_command

    line = f"{what} needs {package}: install it with `{install_command(extra)}`"
    return UserError(f"{line}{otherwise}")
