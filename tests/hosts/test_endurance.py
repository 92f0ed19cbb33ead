"""Long lives: thousands of instances and resets, without a crash or memory gained.

A few with --ci; `pytest -m nightly` does them in full (about ten minutes).
"""

import json
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fmpy
import pytest
from command import run
from conftest import HERE, build_plain_fmu

from golf_impact.peers import empty_fmu

FEW = {"instances": 200, "restarts": 2000}
MANY = {"instances": 3000, "restarts": 100_000}


@pytest.fixture(scope="module")
def folders(fmu_path, tmp_path_factory):
    """Extracted: ours, and a pythonfmu FMU in which nothing is computed."""
    place = tmp_path_factory.mktemp("endurance")
    files = {"ours": fmu_path, "empty": build_plain_fmu(Path(empty_fmu.__file__), place)}
    return [fmpy.extract(str(file), str(place / name)) for name, file in files.items()]


#: How many bytes each may leave behind: of an instance pythonfmu leaks some, of a restart nothing
#: (the smallest object has 16).
ALLOWED = {"instances": 0.0, "restarts": 4.0}


@pytest.mark.parametrize(
    "much",
    [
        pytest.param(FEW, id="few", marks=pytest.mark.ci),
        pytest.param(MANY, id="many", marks=pytest.mark.nightly),
    ],
)
@pytest.mark.parametrize("task", ALLOWED)
def test_nothing_is_left_behind(much, folders, record_property, task):
    count = much[task]
    command = sys.executable, "-X", "faulthandler", HERE / "hosts" / "endurance.py", task, count
    env = os.environ | {"PYTHONPATH": str(HERE.parent)}
    with ThreadPoolExecutor(2) as pool:
        ended = pool.map(lambda folder: run(*command, folder, env=env, timeout=3600), folders)
    ours, empty = (json.loads(done.stdout) for done in ended)
    record_property("bytes_each", (ours, empty))
    assert ours["cycles"] > count
    # Beside these, only pages that aren't full.
    leaked = empty["bytes_each"] if task == "instances" else 0.0
    assert ours["bytes_each"] <= leaked + max(ALLOWED[task], 300_000 / count)
