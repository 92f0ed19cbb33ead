"""A study as a TOML file: the words of the command line as keys, and the table [set]."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from golf_impact.errors import UserError
from golf_impact.files import read_text

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


@dataclass(frozen=True)
class Options:
    """The options of `golf-impact sweep`, or the keys of a study; None: not given.

    `sets` are the swept variables in order, as `Study.of` takes them.
    """

    sets: dict[str, Any] = field(default_factory=dict)
    out: Path | None = None
    outputs: tuple[str, ...] | None = None
    samples: int | None = None
    seed: int | None = None
    design: str | None = None
    workers: int | None = None
    chunk: int | None = None
    scheduler: str | None = None
    compare: bool | None = None
    figures: bool | None = None
    fmu: Path | None = None

    def over(self, study: Options) -> Options:
        """These, and where they say nothing, a study's; a variable of both keeps its place."""
        mine = {name: value for name, value in vars(self).items() if value is not None}
        return replace(study, **mine | {"sets": study.sets | self.sets})


#: Keys of a study beside [set], and the type of their values where that isn't a whole number.
_KEYS: dict[str, type] = dict.fromkeys((one.name for one in fields(Options)[1:]), int)
_KEYS |= dict.fromkeys(("out", "design", "scheduler", "fmu"), str)
_KEYS |= {"outputs": list, "compare": bool, "figures": bool}
_WORDS = {str: "a text", list: "a list", int: "a whole number", bool: "true or false"}


def read_study(path: Path) -> Options:
    """The options of a study; UserError if it can't be read, or has something else than these."""
    try:
        table = tomllib.loads(read_text(path))
        _check_numbers(table)
    except RecursionError as error:
        raise UserError(f"{path} is refused: it is nested too deeply") from error
    except ValueError as error:
        raise UserError(f"{path} is no TOML file: {error}") from error
    sets = table.pop("set", {})
    if not isinstance(sets, dict):
        raise UserError(f"{path}: write a table [set] with a line for each swept variable")
    for name, value in sets.items():
        items = value if isinstance(value, list) else [value]
        if not all(type(one) in (int, float, str) for one in items):
            raise UserError(f"{path}: {name} in [set] must be a number, a text or a list of them")
    for key, value in table.items():
        if key not in _KEYS:
            raise UserError(f"{path}: there is no key {key}: choose from {', '.join(_KEYS)}, [set]")
        kind = _KEYS[key]
        # A Boolean is an integer to Python.
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            raise UserError(f"{path}: {key} = {value!r} is refused: it must be {_WORDS[kind]}")
        if isinstance(value, str) and "\0" in value:
            raise UserError(f"{path}: {key} is refused: there is a NUL character in it")
    if not all(isinstance(name, str) for name in table.get("outputs", ())):
        raise UserError(f"{path}: outputs must be a list of names")
    for key, make in (("outputs", tuple), ("out", Path), ("fmu", Path)):
        if key in table:
            table[key] = make(table[key])
    return Options(sets=sets, **table)


def _check_numbers(value: Any) -> None:
    """Raises ValueError for an integer beyond 64 bits, which TOML doesn't have."""
    if isinstance(value, (dict, list)):
        for item in value.values() if isinstance(value, dict) else value:
            _check_numbers(item)
    elif isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ValueError("a whole number in it has more than 64 bits")
