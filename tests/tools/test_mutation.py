"""Mutants, and at night how many of them the tests catch."""

import re
from pathlib import Path

import mutants
import pytest

from golf_impact.data.files import read_toml

SOURCES = {
    "x.py": '''"""1 + 1."""
LIMIT: int = 3
def f(a: "1 + 1", b=2.0):
    if a < b and not b:  # 1 + 1
        raise ValueError("1 + 1")
    g(a, b)
''',
    "x.c": "#include <a1.h>\n/* 1 + 1\n*/\n    x = f(a);\n    if (a && *b) g(-a, '1');\n",
    "x.js": 'const x = y.replace(/1 + 1/, "1 + 1") + `1 + 1` // 1 + 1\n',
}
CHANGED = {
    "x.py": """LIMIT: int = 4; LIMIT: int = 2; def f(a: "1 + 1", b=2.002):; g(b, a); pass;
        if a <= b and not b:  # 1 + 1; if a >= b and not b:  # 1 + 1; if a < b or not b:  # 1 + 1;
        if a < b and b:  # 1 + 1""",
    "x.c": """; if (0 && a && *b) g(-a, '1');; if (1 || a && *b) g(-a, '1');;
        if (a || *b) g(-a, '1');; if (a && *b) g( a, '1');""",
    "x.js": 'const x = y.replace(/1 + 1/, "1 + 1") - `1 + 1` // 1 + 1',
}


@pytest.mark.parametrize("file", SOURCES)
def test_mutants_of_a_file(file, tmp_path, monkeypatch):
    (tmp_path / file).write_text(SOURCES[file])
    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    found = [mutant for mutant in mutants.mutants(file) if mutant.is_valid]
    expected = {text.strip("; ") for text in re.split(r";\s+", CHANGED[file])}
    assert {one.difference[2][2:].strip(";") for one in found} == expected


def test_a_sample_follows_from_the_seed(monkeypatch):
    folders = "build/golf_build", "fmu_src/native", "scenarios/golf_impact/explore"
    some = {folder: mutants.packages()[folder] for folder in folders}
    monkeypatch.setattr(mutants, "packages", lambda: some)
    one, other = (mutants.sample(60, seed) for seed in (1, 2))
    assert {Path(mutant.file).suffix for mutant in one} == {".py", ".c", ".js"}
    assert one[:5] == mutants.sample(5, 1) != other[:5]


def test_equivalent_mutants_are_of_lines_that_exist():
    for file, *lines, _ in read_toml(Path(__file__).with_name("equivalent_mutants.toml"))[
        "mutants"
    ]:
        found = {line.strip() for line in (mutants.ROOT / file).read_text("utf-8").splitlines()}
        assert {line[2:] for line in lines if line.startswith("-")} <= found, file


@pytest.mark.nightly
def test_nine_of_ten_mutants_are_caught():
    import mutation

    assert mutation.main(["--count", "300"]) >= 0.9
