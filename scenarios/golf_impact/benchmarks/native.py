"""Run time and memory in a host that isn't Python: the standalone FMU beside the plain one.

The plain FMU gets libpython by LD_PRELOAD. Both are measured in turns, in processes of their own.
"""

import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

import fmpy

from golf_build import toolchain
from golf_impact.errors import UserError
from golf_impact.fmu.file import build_fmu
from golf_impact.fmu.libpython import find_libpython_for
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.fmu.system import build_system

_OUTPUTS = ("smash_factor", "coefficient_of_restitution", "club_velocity", "ball_velocity")


def standalone_and_plain(quick: bool) -> dict[str, Any]:
    """What bench_native.json contains: both FMUs' medians, their ratio and its target by key.

    UserError: this machine can't build the standalone FMU, or has no libpython.
    """
    with tempfile.TemporaryDirectory(prefix="golf-impact-native-") as scratch:
        folder = Path(scratch)
        alone = build_fmu(folder / "ClubBallImpact.standalone.fmu", standalone=True)
        plain = build_fmu(folder / "ClubBallImpact.fmu")
        libpython = find_libpython_for(plain)
        if libpython is None:
            raise UserError("bench --native needs libpython for the plain FMU: see doctor")
        host, source = folder / "host", Path(__file__).with_name("native_host.c")
        headers = Path(fmpy.__file__).with_name("c-code")
        flags = ["-O2", f"-I{headers}", source, "-o", host, "-ldl"]
        _output([*toolchain.tool(toolchain.TARGETS["linux64"], "cc"), *flags])
        references = LoadedFmu(plain).references(_OUTPUTS)
        one, other = _extracted(alone, folder), _extracted(plain, folder)
        built = build_system(folder, standalone=True)
        companions = built["Swing"], built["Launch"]
        three = one + [word for fmu in companions for word in _extracted(fmu, folder)]
        with_python = {"LD_PRELOAD": str(libpython), "PYTHONHOME": sys.base_prefix}

        def run(count: int, fmus: list[str], **environment: str) -> list[float]:
            out = _output([host, count, *references, "--", *fmus], environment)
            return [float(number) for number in out.split()]

        run(1, other, **with_python)  # writes its bytecode
        count, times = (20_000, 3) if quick else (200_000, 9)
        rounds = [
            (run(count, one), run(count, other, **with_python), run(1, three)) for _ in range(times)
        ]
        size, plain_size = (fmu.stat().st_size / 1e6 for fmu in (alone, plain))
    a, p, t = ([median(column) for column in zip(*rows)] for rows in zip(*rounds))
    rows = (
        ("first_instantiate_ms", "the first instance, ms", 1e3 * a[0], 1e3 * p[0], 1.0),
        ("step_us", "doStep, µs", 1e6 * a[1], 1e6 * p[1], 1.0),
        ("read_us", "getReal of 4, µs", 1e6 * a[2], 1e6 * p[2], 1.0),
        ("memory_mb", "memory of a host with one, MB", a[3] / 1e3, p[3] / 1e3, 1.0),
        ("three_mb", "memory with three FMUs, beside one, MB", t[3] / 1e3, a[3] / 1e3, 1.3),
        ("size_mb", "the file, MB (5 at most)", size, plain_size, 5.0 / plain_size),
    )
    names = ("key", "meaning", "standalone", "plain", "limit")
    figures = {key: dict(zip(names, (key, *row))) for key, *row in rows}
    for figure in figures.values():
        figure["ratio"] = figure["standalone"] / figure["plain"]
        figure["passed"] = figure["ratio"] <= figure["limit"]
    passed = all(figure["passed"] for figure in figures.values())
    return {"quick": quick, "passed": passed, "figures": figures}


def _extracted(fmu: Path, folder: Path) -> list[str]:
    place = folder / f"extracted {fmu.stem}"
    fmpy.extract(str(fmu), str(place))
    (library,) = place.glob("binaries/linux64/[A-Z]*.so")
    return [str(library), f"file://{place}/resources", LoadedFmu(fmu).description.guid]


def _output(command: list[Any], environment: dict[str, str] | None = None) -> str:
    words = [str(word) for word in command]
    done = subprocess.run(words, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise UserError(f"{words[0]} failed: {done.stderr.strip()}")
    return done.stdout
