"""Errors that a user can do something about."""


class UserError(Exception):
    """One clear line: what was given, what is allowed, what to do. The command exits with 2."""


def lacking(what: str, package: str, extra: str, otherwise: str = "") -> UserError:
    """The error where `what` needs a package of an extra that isn't installed.

    `otherwise` is what else there is to do or to know.
    """
    # Looked up when it is needed: most runs lack nothing.
    from golf_build.extras import install_command

    line = f"{what} needs {package}: install it with `{install_command(extra)}`"
    return UserError(f"{line}{otherwise}")
