"""Errors that a user can do something about."""


class UserError(Exception):
    """One clear line: what was given, what is allowed, what to do. The command exits with 2."""
