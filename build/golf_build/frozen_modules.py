"""Run by `standalone` in a Python of its own: compiles what an FMU's modules import.

python frozen_modules.py NAMES: the names of the FMU's modules, which lie beside this file. Prints a
JSON list of [name, whether it is a package, code in hexadecimal], or [name, null, path] for an
extension module (null if it is built in). What is frozen into libpython anyway isn't listed.
"""

import json
import marshal
import sys
from importlib.machinery import PathFinder

#: Accelerators that the standard library doesn't need, and their dependencies.
_WITHOUT = ("_bz2", "_elementtree", "_hashlib", "_lzma", "_uuid", "pyexpat", "zlib")


def _freeze(own: list[str]) -> list:
    for name in _WITHOUT:
        sys.modules[name] = None  # type: ignore[assignment]
    # The last one is imported by name, later than the rest.
    for name in (*own, "encodings.utf_8"):
        __import__(name)
    tops = {name.partition(".")[0] for name in own}
    rows: list[list] = []
    for name, module in sorted(sys.modules.items()):
        spec = getattr(module, "__spec__", None)
        if spec is not None and spec.name != name:
            # A module that has replaced itself (collections.abc of 3.13); os.path has no file.
            folder = getattr(sys.modules.get(name.rpartition(".")[0]), "__path__", None)
            spec = PathFinder.find_spec(name, folder) if folder is not None else None
        # typing.io and the like are no modules.
        if spec is not None and spec.origin == "built-in":
            rows.append([name, None, None])
        if spec is None or not spec.has_location or name == "__main__":
            continue
        if spec.origin.endswith(".so"):
            rows.append([name, None, spec.origin])
            continue
        with open(spec.origin, "rb") as file:
            source = file.read()
        bare = 0 if name.partition(".")[0] in tops else 2
        code = compile(source, f"<frozen {name}>", "exec", dont_inherit=True, optimize=bare)
        # Once more: the output of marshal depends on other references to a string.
        written = marshal.dumps(marshal.loads(marshal.dumps(code)))
        rows.append([name, spec.submodule_search_locations is not None, written.hex()])
    return rows


if __name__ == "__main__":
    print(json.dumps(_freeze(sys.argv[1:])))
