"""Mutation testing: which small defect does no test notice, and which tests notice it?

`python tests/tools/mutation.py --count 300` puts defects into a copy of the checkout, one at a
time, and runs the tests that execute the changed line (also inside a built FMU or a subprocess) up
to the first failure; a mutant that survives these gets all other default tests. Of C the first are
the tests of native FMUs; of JavaScript those of the page, then the page in a browser. `--matrix`
goes on after failures: which tests catch which mutants? `--again 'FILE …'` runs these test files on
the survivors. The mutants follow from the seed, a new one each week; a larger count continues a
smaller one, an interrupted run goes on by the file of its results.

mutmut 3.8 writes its dispatch and imports into the sources, from where they would be packed into
the FMUs; cosmic-ray 8.7 runs all tests on every mutant. Both change Python only.
"""

import argparse
import contextlib
import hashlib
import json
import os
import queue
import re
import resource
import shutil
import signal
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import date
from functools import partial
from itertools import accumulate, chain
from math import inf
from pathlib import Path
from typing import NamedTuple

import pytest
from mutants import ROOT, Mutant, packages, sample

from golf_impact.data.files import read_toml

#: They compare documents with the code: a defect that they notice may be written down by mistake.
NO_EVIDENCE = tuple(
    f"tests/commands/test_documents.py::test_{name}"
    for name in ("tables_are_those_of_the_code", "contracts", "scenarios_import_no_machinery")
)

#: By the language: the tests that come first, then, and in the matrix. Of Python those come first
#: that execute a line.
NATIVE, BOTH = ("--native", "tests/numbers", "tests/contract"), ("-m", "browser or not browser")
SUITES: dict[str, tuple[tuple[str, ...], ...]] = {
    ".py": ((), (), ()),
    ".c": (NATIVE, (), NATIVE),
    ".js": (("tests/page",), ("tests/page", "-m", "browser"), ("tests/page", *BOTH)),
}

#: s: so many of the tests that execute its line come first; a longer test is an endless loop.
_FIRST, _LONGEST = 60.0, 300


# In the test processes this file is a plugin: it records which test executes which line (coverage
# measures subprocesses too, by the environment), or selects and orders tests.


def pytest_configure():
    if "MUTATION_PLAN" in os.environ:
        signal.alarm(_LONGEST)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    # The compiler of this machine: native FMUs for all platforms take ten times as long.
    sys.modules["ziglang"] = None
    if plan := os.environ.get("MUTATION_PLAN"):
        run, skip = json.loads(Path(plan).read_text())
        place = {name: n for n, name in enumerate(run)}
        items[:] = [i for i in items if i.nodeid not in skip and (i.nodeid in place or not run)]
        items.sort(key=lambda item: place.get(item.nodeid, 0))
        resource.setrlimit(resource.RLIMIT_DATA, (8 << 30, 8 << 30))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item):
    os.environ["MUTATION_TEST"] = item.nodeid
    if "COVERAGE_PROCESS_START" in os.environ:
        from coverage import Coverage

        Coverage.current().switch_context(item.nodeid)
    else:
        signal.alarm(_LONGEST)


def pytest_runtest_logreport(report):
    if report.when == "call" or report.failed:
        with open(os.environ["MUTATION_REPORT"], "a") as file:
            print(json.dumps([report.nodeid, report.failed, report.duration]), file=file)


class Checkout:
    """A copy of the checkout in which mutants are tested."""

    def __init__(self, folder: Path):
        self.folder, self.root = folder, folder / "checkout"
        shutil.rmtree(folder, ignore_errors=True)
        left_out = shutil.ignore_patterns(".git", "*env*", "__pycache__", "mutation")
        shutil.copytree(ROOT, self.root, ignore=left_out)
        # Warnings about a mutant's code aren't evidence.
        self.compiler = folder / "cc"
        self.compiler.write_text('#!/bin/sh\nexec cc "$@" -w\n')
        self.compiler.chmod(0o755)

    def run(self, *arguments: str, every: bool = False, **more: str) -> tuple[str, list]:
        """Run pytest with more environment; how it ended, and name, failure, seconds by test."""
        report, log = self.folder / "report", self.folder / "log"
        report.write_text("")
        names = "fmu_src", "build", "scenarios", "tests", "tests/tools"
        # Not the variables of a test run that this may be part of.
        env = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
        env |= {"PYTHONPATH": os.pathsep.join(str(self.root / name) for name in names)}
        env |= {"MUTATION_REPORT": str(report), "CC": str(self.compiler), **more}
        command = [sys.executable, "-B", "-m", "pytest", "-n0", *("-p", "mutation"), *arguments]
        command += ["--maxfail=9999" if every else "-x", f"--basetemp={self.folder}/t"]
        to = {"stdout": log.open("w"), "stderr": subprocess.STDOUT, "start_new_session": True}
        process = subprocess.Popen(command, cwd=self.root, env=env, **to)
        try:
            code = process.wait()
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        ends = {0: "survived", 5: "survived", -signal.SIGALRM: "timeout"}
        return ends.get(code, "caught"), [json.loads(line) for line in report.open()]


class Coverage(NamedTuple):
    """What the default tests execute."""

    seconds: dict[str, float]  #: by test
    skip: list[str]  #: tests that failed here, or don't count
    lines: dict[str, dict[str, list[str]]]  #: tests by file and line

    @classmethod
    def measured(cls, folder: Path) -> "Coverage":
        """Measured once for these sources."""
        files = [ROOT / file for files in packages().values() for file in files]
        digest = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]
        place, data = folder / f"coverage-{digest}.json", folder / "coverage"
        if not place.exists():
            checkout, settings = Checkout(data), data / "settings"
            settings.write_text(
                f"[run]\ndata_file = {data}/c\nparallel = true\ncontext = ${{MUTATION_TEST}}\n"
                f"include = */golf_*/*, {checkout.root}/*\nomit = */checkout/tests/*\n"
            )
            _, ran = checkout.run("-n2", every=True, COVERAGE_PROCESS_START=str(settings))
            if not ran:
                raise SystemExit(f"no test has run: see {data / 'log'}")
            seconds, lines = {name: taken for name, _, taken in ran}, cls._lines(data)
            for suite in NATIVE, SUITES[".js"][1]:
                ran += checkout.run(*suite, every=True)[1]
            skip = [name for name, bad, _ in ran if bad or name.startswith(NO_EVIDENCE)]
            place.write_text(json.dumps([seconds, skip, lines], default=sorted))
        return cls(*json.loads(place.read_text()))

    @staticmethod
    def _lines(data: Path) -> dict[str, dict[int, set[str]]]:
        from coverage import CoverageData

        def source(file: str) -> str:
            # In FMUs the package is golf_physics_ or golf_swing_ and a digest.
            name = re.sub(r".*/checkout/|.*/golf_\w+_[0-9a-f]{16}/", "", file)
            places = name, f"fmu_src/golf_physics/{name}", f"fmu_src/{name}"
            return next((place for place in places if (ROOT / place).is_file()), name)

        lines: dict = defaultdict(lambda: defaultdict(set))
        for part in data.glob("c.*"):
            (read := CoverageData(str(part))).read()
            for file in read.measured_files():
                for line, tests in read.contexts_by_lineno(file).items():
                    lines[source(file)][line].update(tests)
        return lines

    def tests(self, mutant: Mutant, limit: float) -> list[str]:
        """Of the tests that execute a mutant's line, or its file, the quick ones first, by file."""
        own = self.lines.get(mutant.file, {})
        found = own.get(str(mutant.line)) or chain.from_iterable(own.values())
        found = (self.seconds.keys() & found) - {*self.skip}
        tests = sorted(found, key=lambda name: (self.seconds[name] > 0.2, name))
        until = accumulate(map(self.seconds.__getitem__, tests))
        return [name for name, time in zip(tests, until) if time <= limit]


def try_mutant(mutant: Mutant, stage: str, checkout: Checkout, known: Coverage) -> dict:
    """Run on one mutant the tests of a stage: `first`, `then`, `matrix`, or files to run again."""
    suites = dict(zip(("first", "then", "matrix"), SUITES[Path(mutant.file).suffix]))
    suite, run, skip = suites.get(stage, stage.split()), [], known.skip
    if mutant.file.endswith(".py") and stage in suites:
        run = known.tests(mutant, inf if stage == "matrix" else _FIRST)
        suite = {name.partition("::")[0] for name in run}
        if stage == "then":
            suite, run, skip = (), [], skip + run
    state, ran = "survived", []
    if suite or stage == "then":
        plan, target = checkout.folder / "plan", checkout.root / mutant.file
        plan.write_text(json.dumps([run, skip]))
        before = target.read_bytes()
        target.write_text(mutant.source, "utf-8")
        state, ran = checkout.run(*suite, every=stage == "matrix", MUTATION_PLAN=str(plan))
        target.write_bytes(before)
    by = [name for name, failed, _ in ran if failed]
    return {"key": mutant.key, "stage": stage, "state": state, "by": by}


def print_table(columns: Sequence[str], counts: dict[str, Counter]) -> None:
    print(f"{'':44}", *(f"{name:>10}" for name in columns))
    for row, count in counts.items():
        print(f"{row:44}", *(f"{count[name]:10}" for name in columns))


def share(chosen: list[Mutant], results: dict, reasons: dict) -> float:
    """Print survivors and a table by package; the share caught of those that aren't equivalent."""
    counts: dict[str, Counter] = {package: Counter() for package in (*packages(), "all")}
    for mutant in chosen:
        reason = reasons.get(tuple(mutant.difference), "")
        state = "equivalent" if reason else results.get(mutant.key, {}).get("state", "not run")
        if state in ("survived", "equivalent"):
            print(state, *mutant.difference, *filter(None, [reason]), sep="\n  ")
        for package in (str(Path(mutant.file).parent), "all"):
            counts[package].update([state, "mutants"])
    print_table(("mutants", "caught", "timeout", "survived", "equivalent", "not run"), counts)
    caught = counts["all"]["caught"] + counts["all"]["timeout"]
    return caught / max(1, caught + counts["all"]["survived"])


def print_matrix(chosen: list[Mutant], results: dict) -> None:
    """Print of each test file how many mutants it catches, and how many no other file does."""
    files = sorted(str(path.relative_to(ROOT)) for path in ROOT.glob("tests/**/test_*.py"))
    counts: dict[str, Counter] = {file: Counter() for file in files}
    for row in (results[mutant.key] for mutant in chosen if mutant.key in results):
        catching = {name.partition("::")[0] for name in row["by"]}
        for file in catching:
            counts[file].update(["caught", "alone"] if len(catching) == 1 else ["caught"])
    print_table(("caught", "alone"), counts)


def main(arguments: list[str] | None = None) -> float:
    """Test mutants as the arguments say; see `share`."""
    year, week, _ = date.today().isocalendar()
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=300, help="mutants")
    parser.add_argument("--seed", type=int, default=100 * year + week, help="default: this week's")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "mutation")
    parser.add_argument("--matrix", action="store_true", help="all tests, whatever fails")
    parser.add_argument("--again", default="", help="test files to run on survivors")
    options = parser.parse_args(arguments)
    print("seed", options.seed)
    known, chosen = Coverage.measured(options.folder), sample(options.count, options.seed)
    log = options.folder / ("matrix.jsonl" if options.matrix else "results.jsonl")
    log.touch()
    results = {row["key"]: row for row in map(json.loads, log.open())}
    rows = read_toml(Path(__file__).with_name("equivalent_mutants.toml"))["mutants"]
    reasons = {tuple(difference): reason for *difference, reason in rows}
    checkouts = queue.Queue[Checkout]()
    for n in range(options.workers):
        checkouts.put(Checkout(options.folder / f"worker{n}"))

    def step(stage: str, mutant: Mutant) -> None:
        last = results.get(mutant.key, {"state": "survived", "stage": ""})
        done = last["stage"] in (stage, "then") and not options.again
        if done or last["state"] != "survived" or tuple(mutant.difference) in reasons:
            return
        checkout = checkouts.get()
        results[mutant.key] = try_mutant(mutant, stage, checkout, known)
        checkouts.put(checkout)
        with log.open("a") as file:
            print(json.dumps(results[mutant.key]), file=file, flush=True)

    stages = ["matrix"] if options.matrix else ["first", "then"]
    for stage in [options.again] if options.again else stages:
        with ThreadPoolExecutor(options.workers) as pool:
            list(pool.map(partial(step, stage), chosen))
    caught = share(chosen, results, reasons)
    if options.matrix:
        print_matrix(chosen, results)
    print(f"{caught:.1%} of the mutants that aren't equivalent are caught")
    return caught


if __name__ == "__main__":
    main()
