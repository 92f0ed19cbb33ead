"""Errors that a user can correct: the whole tree, for building and for `golf_impact`."""

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


class UnavailableError(UserError):
    """Something that isn't here is needed: a compiler, a library, a file."""
