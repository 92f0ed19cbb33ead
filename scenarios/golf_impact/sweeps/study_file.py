"""A study as a TOML file: the options of the command line as keys, and the table [set]."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from golf_impact.errors import UserError
from golf_impact.files import read_text

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

#: Keys of a study beside [set], and the types of their values.
KEYS: dict[str, type] = {
    "out": str,
    "outputs": list,
    "samples": int,
    "seed": int,
    "design": str,
    "workers": int,
    "chunk": int,
    "scheduler": str,
    "compare": bool,
    "figures": bool,
    "fmu": str,
}
_WORDS = {str: "a text", list: "a list of names", int: "a whole number", bool: "true or false"}


def read_study(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Swept variables by name, as `Study.of` takes them, and the options of a study.

    UserError if it can't be read, or has something else than these.
    """
    try:
        options = tomllib.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path} is no TOML file: {error}") from error
    sets = options.pop("set", {})
    if not isinstance(sets, dict):
        raise UserError(f"{path}: write a table [set] with a line for each swept variable")
    for name, value in sets.items():
        items = value if isinstance(value, list) else [value]
        if not all(type(one) in (int, float, str) for one in items):
            raise UserError(f"{path}: {name} in [set] must be a number, a text or a list of them")
    for key, value in options.items():
        if key not in KEYS:
            raise UserError(f"{path}: there is no key {key}: choose from {', '.join(KEYS)}, [set]")
        kind = KEYS[key]
        # Not isinstance: a Boolean is an integer to Python. No path has a NUL character.
        fits = type(value) is kind and "\0" not in str(value)
        if not fits or (kind is list and not all(isinstance(name, str) for name in value)):
            raise UserError(f"{path}: {key} = {value!r} is refused: it must be {_WORDS[kind]}")
    return sets, options
