"""Errors that a user can correct, and how they are worded."""

from collections.abc import Collection
from typing import Any

from golf_build.errors import UnavailableError as UnavailableError
from golf_build.errors import UserError as UserError


def refused(variable: str, value: Any, reason: str, given: str = "") -> UserError:
    """The error for a value that isn't allowed.

    `given` is how it was given, "k=8e5" or "mine.toml: k = 8e5"; by default "k = 8e5".
    """
    what = given or f"{variable} = {value!r}"
    return UserError(f"{what} is refused: {reason}", variable, value, reason)


def refusal(sentence: str, variable: str = "", value: Any = None) -> UserError:
    """The error for what an FMU or the engine rejects, which is text: "k = -1 N/m is refused: …".

    `variable` and `value` are what was set, where that is known.
    """
    what, _, reason = sentence.partition(": ")
    name = what.partition(" = ")[0]
    return UserError(sentence, variable or (name if name.isidentifier() else ""), value, reason)


def first_line(error: BaseException | str) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0]


def unknown_name(kind: str, name: Any, known: Collection[str], also: str = "") -> UserError:
    """The error for a name that isn't one of those known, with the most similar one, if one is.

    `kind` is what it should be the name of, `also` what may be given instead, after a comma.
    """
    # Imported here: usually no name is wrong.
    from difflib import get_close_matches

    similar = [one for one in known if _initials(one) == str(name).lower()]
    similar += get_close_matches(str(name), known, 1)
    hint = f" (did you mean {similar[0]}?)" if similar else ""
    reason = f"choose from {', '.join(known)}{also}"
    return UserError(f"there is no {kind} {name!r}{hint}: {reason}", str(name), None, reason)


def _initials(name: str) -> str:
    """Of several words: cor of coefficient_of_restitution."""
    return "".join(word[:1] for word in name.split("_")) if "_" in name else name


def missing_package(what: str, package: str, extra: str, otherwise: str = "") -> UserError:
    """The error for a package of an extra that isn't installed; `otherwise` is an alternative."""
    # Imported here: usually nothing is missing.
    from golf_build.extras import install_command

    line = f"{what} needs {package}: install it with `{install_command(extra)}`"
    return UnavailableError(f"{line}{otherwise}")
