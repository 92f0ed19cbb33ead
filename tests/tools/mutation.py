"""Mutation testing: which small defects does no test notice?

`python tests/tools/mutation.py --count 300` puts defects into a copy of the checkout, one at a
time, and runs the default tests that execute the changed line (also inside a built FMU or a
subprocess) up to the first failure; of C those of native FMUs and the engine, of JavaScript those
of the page. The mutants follow from the seed, a new one each week; a larger count continues a
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
from concurrent.futures import ThreadPoolExecutor
from datetime import date
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import pytest
from mutants import ROOT, Mutant, packages, sample

from golf_build import native, wasm
from golf_impact.data.files import read_toml

#: They compare documents with the code: a defect that they notice may be written down by mistake.
NO_EVIDENCE = tuple(
    f"tests/commands/test_documents.py::test_{name}"
    for name in ("tables_are_those_of_the_code", "contracts", "scenarios_import_no_machinery")
)

#: The tests of languages that coverage doesn't measure, by the end of a file's name.
SUITES = {
    "stepped_impact.c": ("tests/commands/test_bench.py",),
    ".c": ("--native", "tests/numbers", "tests/contract", "tests/hosts/test_native.py"),
    ".js": ("tests/page", "-m", "browser or not browser"),
}

#: The engine's, made anew for each mutant of C and of the modules that its build imports.
WASM = Path("scenarios", "golf_impact", "explore", "physics.wasm")
_IMPORTED = [vars(module).get("__file__") for module in (*sys.modules.values(), wasm)]
BUILDERS = {Path(file).resolve() for file in _IMPORTED if file}

#: s: a longer test is an endless loop.
_LONGEST = 300


# In the test processes this file is a plugin: it records which test executes which line (coverage
# measures subprocesses too, by the environment), or selects and orders tests.


def pytest_configure():
    if "MUTATION_PLAN" in os.environ:
        signal.alarm(_LONGEST)


def switch_context(name):
    """What is executed from now on, also by subprocesses, is executed by this test or fixture."""
    os.environ["MUTATION_TEST"] = name
    if "COVERAGE_PROCESS_START" in os.environ:
        from coverage import Coverage

        Coverage.current().switch_context(name)


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
    users = defaultdict(list)
    for item in items:
        for fixtures in item._fixtureinfo.name2fixturedefs.values():
            users[str(fixtures[-1])].append(item.nodeid)
    Path(os.environ["MUTATION_REPORT"]).with_name("users").write_text(json.dumps(users))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item):
    switch_context(item.nodeid)
    if "COVERAGE_PROCESS_START" not in os.environ:
        signal.alarm(_LONGEST)


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef):
    """What a shared fixture executes, all tests that use it execute."""
    test = os.environ["MUTATION_TEST"]
    if fixturedef.scope != "function":
        switch_context(str(fixturedef))
    try:
        return (yield)
    finally:
        switch_context(test)


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
        report = self.folder / "report"
        report.write_text("")
        command = ["pytest", "-n0", "-p", "mutation", "--maxfail=9999" if every else "-x"]
        command += [f"--basetemp={self.folder}/t", *arguments]
        code = self.python(*command, MUTATION_REPORT=str(report), **more)
        ends = {0: "survived", 5: "survived", -signal.SIGALRM: "timeout"}
        return ends.get(code, "caught"), [json.loads(line) for line in report.open()]

    def python(self, *module: str, **more: str) -> int:
        """Run a module with more environment, and end its processes; returns its exit code."""
        names = "fmu_src", "build", "scenarios", "tests", "tests/tools"
        # Not the variables of a test run that this may be part of.
        env = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
        env |= {"PYTHONPATH": os.pathsep.join(str(self.root / name) for name in names)}
        env |= {"CC": str(self.compiler), **more}
        command = [sys.executable, "-B", "-m", *module]
        with (self.folder / "log").open("w") as log:
            to: dict = {"stdout": log, "stderr": subprocess.STDOUT, "start_new_session": True}
            process = subprocess.Popen(command, cwd=self.root, env=env, **to)
            try:
                return process.wait()
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()

    def test(self, mutant: Mutant, known: "Coverage") -> dict:
        """How the tests of a mutant end, and which of them fail."""
        suite, run = next((SUITES[end] for end in SUITES if mutant.file.endswith(end)), None), []
        if suite is None:
            run = known.tests(mutant)
            suite = tuple({name.partition("::")[0] for name in run})
        plan, target, wasm = self.folder / "plan", self.root / mutant.file, self.root / WASM
        plan.write_text(json.dumps([run, known.skip]))
        kept = {file: file.read_bytes() for file in (target, wasm)}
        target.write_text(mutant.source, "utf-8")
        state, ran = "survived", []
        # Otherwise the engine refuses a module of other sources, whatever the defect.
        makes_wasm = mutant.file.endswith(".c") or ROOT / mutant.file in BUILDERS
        if makes_wasm and self.python("golf_build.wasm"):
            state = "caught"
        elif suite:
            state, ran = self.run(*suite, MUTATION_PLAN=str(plan))
        for file, data in kept.items():
            file.write_bytes(data)
        by = [name for name, failed, _ in ran if failed]
        return {"key": mutant.key, "state": state, "by": by}


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
                f"include = */golf_*/*, */resources/*, {checkout.root}/*\n"
                "omit = */checkout/tests/*\n"
            )
            _, ran = checkout.run("-n2", every=True, COVERAGE_PROCESS_START=str(settings))
            if not ran:
                raise SystemExit(f"no test has run: see {data / 'log'}")
            seconds, lines = {name: taken for name, _, taken in ran}, cls._lines(data)
            for suite in SUITES.values():
                ran += checkout.run(*suite, every=True)[1]
            skip = [name for name, bad, _ in ran if bad or name.startswith(NO_EVIDENCE)]
            place.write_text(json.dumps([seconds, skip, lines], default=sorted))
        return cls(*json.loads(place.read_text()))

    @staticmethod
    def _lines(data: Path) -> dict[str, dict[int, set[str]]]:
        from coverage import CoverageData

        def source(file: str) -> str:
            # In FMUs the package is golf_physics_ or golf_swing_ and a digest.
            name = re.sub(r".*/checkout/|.*/golf_\w+_[0-9a-f]{16}/|.*/resources/", "", file)
            folders = "", "fmu_src/golf_physics", "fmu_src", "scenarios/golf_impact/evidence/peers"
            places = (str(Path(folder, name)) for folder in folders)
            return next((place for place in places if (ROOT / place).is_file()), name)

        users = json.loads((data / "users").read_text())
        lines: dict = defaultdict(lambda: defaultdict(set))
        for part in data.glob("c.*"):
            (read := CoverageData(str(part))).read()
            for file in read.measured_files():
                for line, by in read.contexts_by_lineno(file).items():
                    tests = (users.get(one, [one]) for one in by)
                    lines[source(file)][line].update(chain.from_iterable(tests))
        return lines

    def tests(self, mutant: Mutant) -> list[str]:
        """The tests that execute a mutant's line, or its file, the quick ones first, by file."""
        own = self.lines.get(mutant.file, {})
        found = own.get(str(mutant.line)) or chain.from_iterable(own.values())
        if "/host/" in mutant.file:  # in programs in C nothing is measured
            found = [*found, *(name for name in self.seconds if name.startswith("tests/hosts/"))]
        found = (self.seconds.keys() & found) - {*self.skip}
        return sorted(found, key=lambda name: (self.seconds[name] > 0.2, name))


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
    columns = "mutants", "caught", "timeout", "survived", "equivalent", "not run"
    print(f"{'':44}", *(f"{name:>10}" for name in columns))
    for package, count in counts.items():
        print(f"{package:44}", *(f"{count[name]:10}" for name in columns))
    caught = counts["all"]["caught"] + counts["all"]["timeout"]
    return caught / max(1, caught + counts["all"]["survived"])


def main(arguments: list[str] | None = None) -> float:
    """Test mutants as the arguments say; see `share`."""
    year, week, _ = date.today().isocalendar()
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=300, help="mutants")
    parser.add_argument("--seed", type=int, default=100 * year + week, help="default: this week's")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "mutation")
    options = parser.parse_args(arguments)
    print("seed", options.seed)
    if native.ziglang() is None:
        raise SystemExit(native.advice())
    known, chosen = Coverage.measured(options.folder), sample(options.count, options.seed)
    log = options.folder / "results.jsonl"
    log.touch()
    results = {row["key"]: row for row in map(json.loads, log.open())}
    rows = read_toml(Path(__file__).with_name("equivalent_mutants.toml"))["mutants"]
    reasons = {tuple(difference): reason for *difference, reason in rows}
    checkouts = queue.Queue[Checkout]()
    for n in range(options.workers):
        checkouts.put(Checkout(options.folder / f"worker{n}"))

    def test(mutant: Mutant) -> None:
        if mutant.key in results or tuple(mutant.difference) in reasons:
            return
        checkout = checkouts.get()
        results[mutant.key] = checkout.test(mutant, known)
        checkouts.put(checkout)
        with log.open("a") as file:
            print(json.dumps(results[mutant.key]), file=file, flush=True)

    with ThreadPoolExecutor(options.workers) as pool:
        list(pool.map(test, chosen))
    caught = share(chosen, results, reasons)
    print(f"{caught:.1%} of the mutants that aren't equivalent are caught")
    return caught


if __name__ == "__main__":
    main()
