"""The physics in C (fmu_src/native) as WebAssembly: for `golf-impact explore` and for Python.

`python -m golf_build.wasm` writes physics.wasm and the notices of what zig links into it where the
page has them. The same sources make the same bytes on every machine: ziglang is pinned.
"""

from pathlib import Path

from golf_build.archive import whole
from golf_build.errors import UnavailableError
from golf_build.extras import install_command
from golf_build.native import ZIG_CC, ZIGLANG, compiled, ziglang
from golf_build.sources import c_sources, digest

#: -Oz makes it 2 % smaller and 1.1 to 1.6 times slower, -O2 a third larger and hardly faster.
_FLAGS = (
    "-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c99", "-Os", "-mbulk-memory",
    "-ffp-contract=off", "-g0", "-s",
)  # fmt: skip

#: Licences of what is linked, by their files in ziglang.
_NOTICES = {
    "zig (compiler-rt)": "LICENSE",
    "musl": "lib/libc/musl/COPYRIGHT",
    "wasi-libc": "lib/libc/wasi/LICENSE",
    "wasi-libc, Apache License 2.0 with LLVM exceptions": "lib/libc/wasi/LICENSE-APACHE-LLVM",
    "wasi-libc, MIT": "lib/libc/wasi/LICENSE-MIT",
}


def build() -> dict[str, bytes]:
    """Compile rows.c; returns the files physics.wasm and physics.txt, its notices, by name.

    Raises:
        UserError: ziglang is missing or of another version, or fails.
    """
    zig = ziglang()
    if zig is None:
        needs = f"the page's WebAssembly needs ziglang {ZIGLANG} for its bytes"
        raise UnavailableError(f"{needs}: {install_command('native')}")
    command = [*ZIG_CC, *_FLAGS, "rows.c", "-o", "physics.wasm"]
    wasm = compiled(command, c_sources(digest()), "physics.wasm", "rows.c")
    notices = (f"{name}\n\n{(zig / file).read_text()}" for name, file in _NOTICES.items())
    return {"physics.wasm": wasm, "physics.txt": "\n\n".join(notices).encode()}


if __name__ == "__main__":
    place = Path(__file__).resolve().parents[2] / "scenarios" / "golf_impact" / "explore"
    for name, data in build().items():
        with whole(place / name) as stream:
            stream.write(data)
        print(f"{place / name}: {len(data)} bytes")
