"""Reads TOML files: data beside modules of this package, and balls of users."""

import sys
from pathlib import Path
from typing import Any

from golf_impact.errors import UserError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def read_toml(path: Path | str) -> dict[str, Any]:
    """The tables of a TOML file (UTF-8, byte order mark or not); UserError if it is none."""
    try:
        return tomllib.loads(Path(path).read_text("utf-8-sig"))
    except OSError as error:
        raise UserError(f"can't read {path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path} is no TOML file: {error}") from error
