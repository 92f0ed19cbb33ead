"""Mutation testing: which small defect does no test notice?

`python tests/tools/mutation.py --count 300` puts defects into a copy of the checkout, one at a
time, and runs the tests that execute the changed line (also inside a built FMU or a subprocess) up
to the first failure; a mutant that survives these gets all other default tests. The mutants follow
from the seed, in turns from each package: a larger count continues a smaller one. Results are
appended to a file, so that an interrupted run continues; `--again FILE...` runs these test files on
the survivors. equivalent_mutants.toml lists mutants that change no result, with the reason.

mutmut 3.8 writes its dispatch and imports into the sources, from where they would be packed into
the FMUs; cosmic-ray 8.7 runs all tests on every mutant, 650 of `golf_physics.impact` alone.
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
import time
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

import pytest
from mutants import PACKAGES, ROOT, Mutant, sample

#: They compare documents with the code: a defect that they notice may be written down by mistake.
NO_EVIDENCE = tuple(
    f"tests/commands/test_documents.py::test_{name}"
    for name in ("tables_are_those_of_the_code", "contracts", "scenarios_import_no_machinery")
)

#: s, measured: so many of the tests that execute its line are run on every mutant.
_FIRST = 60.0


# In the test processes this file is a plugin: it records which test executes which line (coverage
# measures subprocesses too, by the environment), or selects and orders tests.

_seconds: dict[str, float] = {}


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    if plan := os.environ.get("MUTATION_PLAN"):
        run, skip, seconds = json.loads(Path(plan).read_text())
        _seconds.update(seconds)
        place = {name: n for n, name in enumerate(run)}
        items[:] = [i for i in items if i.nodeid not in skip and (i.nodeid in place or not run)]
        items.sort(key=lambda item: place.get(item.nodeid, 0))
        resource.setrlimit(resource.RLIMIT_DATA, (8 << 30, 8 << 30))
        from golf_impact.fmu import current_fmu

        # Where commands find them: otherwise they report that they had to build them.
        for fmi in (2, 3):
            current_fmu(fmi=fmi)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    os.environ["MUTATION_TEST"] = item.nodeid
    if "COVERAGE_PROCESS_START" in os.environ:
        from coverage import Coverage

        Coverage.current().switch_context(item.nodeid)
    else:
        signal.alarm(60 + int(20.0 * _seconds.get(item.nodeid, 30.0)))
    try:
        return (yield)
    finally:
        signal.alarm(0)


def pytest_runtest_logreport(report):
    if report.when == "call" or report.failed:
        with open(os.environ["MUTATION_REPORT"], "a") as file:
            print(json.dumps([report.nodeid, report.failed, report.duration]), file=file)


class Checkout:
    """A copy of the checkout in which mutants are tested."""

    def __init__(self, folder: Path):
        self.folder, self.root = folder, folder / "checkout"
        shutil.rmtree(folder, ignore_errors=True)
        listed = "git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"
        for name in subprocess.check_output(listed, cwd=ROOT, text=True).split("\0"):
            if (ROOT / name).is_file():
                (self.root / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / name, self.root / name)

    def run(self, *arguments: str, **more: str) -> tuple[str, list]:
        """Run pytest with more environment; how it ended, and name, failure, seconds by test."""
        path = [
            str(self.root / name)
            for name in ("fmu_src", "build", "scenarios", "tests", "tests/tools")
        ]
        report, log = self.folder / "report", self.folder / "log"
        report.write_text("")
        env = {"PYTHONPATH": os.pathsep.join(path), "MUTATION_REPORT": str(report), **more}
        options = [
            *["-x", "-n0", "-p", "mutation", "-p", "no:cacheprovider"],
            f"--basetemp={self.folder}/t",
        ]
        # Not the variables of a test run that this may be part of.
        own = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
        process = subprocess.Popen(
            [sys.executable, "-B", "-m", "pytest", *options, *arguments],
            cwd=self.root, env=own | env, stdout=log.open("w"), stderr=subprocess.STDOUT,
            start_new_session=True,
        )  # fmt: skip
        try:
            code = process.wait(7200.0)
        except subprocess.TimeoutExpired:
            code = -signal.SIGALRM
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
        files = sorted(file for package in PACKAGES for file in (ROOT / package).glob("*.py"))
        digest = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]
        place, data = folder / f"coverage-{digest}.json", folder / "coverage"
        if not place.exists():
            shutil.rmtree(data, ignore_errors=True)
            checkout = Checkout(data)
            settings = data / "settings"
            settings.write_text(
                f"[run]\ndata_file = {data}/c\nparallel = true\ncontext = ${{MUTATION_TEST}}\n"
                "include = */golf_*/*\nomit = */golf_build/*\n"
            )
            _, ran = checkout.run("--maxfail=9999", COVERAGE_PROCESS_START=str(settings))
            if not ran:
                raise SystemExit(f"no test has run: see {data / 'log'}")
            place.write_text(json.dumps(cls._of(data, ran)))
        return cls(*json.loads(place.read_text()))

    @classmethod
    def _of(cls, data: Path, ran: list) -> "Coverage":
        from coverage import CoverageData

        seconds = {name: taken for name, _, taken in ran}
        skip = [name for name, failed, _ in ran if failed or name.startswith(NO_EVIDENCE)]
        lines: dict = defaultdict(lambda: defaultdict(set))
        for part in data.glob("c.*"):
            (read := CoverageData(str(part))).read()
            for file in read.measured_files():
                # In FMUs the packages are golf_physics_ or golf_swing_ and a digest.
                *_, package, name = re.split(r"/golf_(\w+)/", file)
                parent = "scenarios/golf_impact" if package == "impact" else "fmu_src/golf_physics"
                for line, tests in read.contexts_by_lineno(file).items():
                    lines[f"{parent}/{name}"][line].update(seconds.keys() & tests)
        found = {file: {n: sorted(t) for n, t in own.items()} for file, own in lines.items()}
        return cls(seconds, skip, found)

    def tests(self, mutant: Mutant) -> list[str]:
        """Of the tests that execute a mutant's line, or its file: quick ones, quick files first."""
        own = self.lines.get(mutant.file, {})
        tests = {t for n in map(str, mutant.lines or own) for t in own.get(n, ())} - {*self.skip}
        files: Counter = Counter()
        for name in tests:
            files[name.partition("::")[0]] += self.seconds[name]

        def order(name: str) -> tuple:
            file = name.partition("::")[0]
            return self.seconds[name] > 0.2, files[file], file

        tests = sorted((name for name in self.seconds if name in tests), key=order)
        until = accumulate(map(self.seconds.__getitem__, tests))
        return [name for name, time in zip(tests, until) if time <= _FIRST]


def try_mutant(mutant: Mutant, stage: str, checkout: Checkout, known: Coverage, files=()) -> dict:
    """Run the tests of a stage on one mutant: `covering`, the `rest`, or these files `again`."""
    tests = known.tests(mutant)
    run, skip = (tests if stage == "covering" else []), known.skip
    skip = skip + tests if stage == "rest" else skip
    files = files or dict.fromkeys(name.partition("::")[0] for name in run)
    plan, target = checkout.folder / "plan", checkout.root / mutant.file
    plan.write_text(json.dumps([run, skip, known.seconds]))
    begin, state, by = time.perf_counter(), "survived", ""
    if files or stage == "rest":
        target.write_text(mutant.source, "utf-8")
        state, ran = checkout.run(*files, MUTATION_PLAN=str(plan))
        by = "" if state == "survived" else next((name for name, bad, _ in ran if bad), "the end")
        shutil.copy(ROOT / mutant.file, target)
    seconds = round(time.perf_counter() - begin, 1)
    return {"key": mutant.key, "stage": stage, "state": state, "by": by, "seconds": seconds}


def equivalents() -> dict[tuple[str, ...], str]:
    """Reasons why mutants are equivalent, by their differences."""
    from golf_impact.files import read_toml

    rows = read_toml(ROOT / "tests" / "tools" / "equivalent_mutants.toml")["mutants"]
    return {tuple(difference): reason for *difference, reason in rows}


def share(chosen: list[Mutant], results: dict, reasons: dict) -> float:
    """Print survivors and a table by package; the share caught of those that aren't equivalent."""
    columns = "mutants", "caught", "timeout", "survived", "equivalent", "not run"
    counts: dict = {package: Counter() for package in (*PACKAGES, "all")}
    for mutant in chosen:
        state = results.get(mutant.key, {"state": "not run"})["state"]
        if state == "survived":
            reason = reasons.get(tuple(mutant.difference), "")
            state = "equivalent" if reason else state
            print(state, *mutant.difference, *filter(None, [reason]), sep="\n  ")
        for package in (str(Path(mutant.file).parent), "all"):
            counts[package].update([state, "mutants"])
    print(f"{'':36}", *(f"{name:>10}" for name in columns))
    for package, count in counts.items():
        print(f"{package:36}", *(f"{count[name]:10}" for name in columns))
    caught = count["caught"] + count["timeout"]
    return caught / max(1, caught + count["survived"])


def main(arguments: list[str] | None = None) -> float:
    """Test mutants as the arguments say; see `share`."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=300, help="mutants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "mutation")
    parser.add_argument("--covering", action="store_true", help="without the other tests")
    parser.add_argument("--again", nargs="+", default=(), help="test files to run on survivors")
    options = parser.parse_args(arguments)
    options.folder.mkdir(parents=True, exist_ok=True)
    known, chosen = Coverage.measured(options.folder), sample(options.count, options.seed)
    reasons, log = equivalents(), options.folder / "results.jsonl"
    log.touch()
    results = {row["key"]: row for row in map(json.loads, log.open())}
    checkouts: queue.Queue = queue.Queue()
    for n in range(options.workers):
        checkouts.put(Checkout(options.folder / f"worker{n}"))

    def step(stage, mutant):
        checkout = checkouts.get()
        result = try_mutant(mutant, stage, checkout, known, options.again)
        checkouts.put(checkout)
        results[mutant.key] = result
        with log.open("a") as file:
            print(json.dumps(result), file=file, flush=True)

    def is_due(stage, mutant):
        result = results.get(mutant.key)
        if result is None or stage == "covering":
            return result is None
        over = (result["stage"], stage) == ("rest", "rest") or tuple(mutant.difference) in reasons
        return result["state"] == "survived" and not over

    for stage in ["again"] if options.again else ["covering", "rest"][: 2 - options.covering]:
        due = [mutant for mutant in chosen if is_due(stage, mutant)]
        with ThreadPoolExecutor(options.workers) as pool:
            list(pool.map(partial(step, stage), due))
    caught = share(chosen, results, reasons)
    print(f"{caught:.1%} of the mutants that aren't equivalent are caught")
    return caught


if __name__ == "__main__":
    main()
