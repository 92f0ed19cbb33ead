"""Mutants, and at night how many of them the tests catch."""

from pathlib import Path

import mutants
import pytest

SOURCE = '''"""Text: 1 + 1."""

__all__ = ["f"]
LIMIT: int = 3


def f(a: "1 + 1", b=2.0):
    """1 < 2."""
    if a < b and not b:
        return min(a, b)
    f(a, b)
    raise ValueError("1 + 1")
'''


def test_mutants_of_a_file(tmp_path, monkeypatch):
    """None of text, annotations or what is raised."""
    (tmp_path / "x.py").write_text(SOURCE)
    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    found = mutants.mutants("x.py")
    changed = {(one.difference[1][2:], one.difference[2][2:]) for one in found}
    condition = "if a < b and not b:"
    assert changed == {
        ("LIMIT: int = 3", "LIMIT: int = 4"),
        ("LIMIT: int = 3", "LIMIT: int = 2"),
        ('def f(a: "1 + 1", b=2.0):', 'def f(a: "1 + 1", b=2.002):'),
        (condition, "if a <= b and not b:"),
        (condition, "if a >= b and not b:"),
        (condition, "if a < b or not b:"),
        (condition, "if a < b and (b):"),
        (condition, "if (not (a < b and not b)):"),
        ("return min(a, b)", "pass"),
        ("return min(a, b)", "return max(a, b)"),
        ("f(a, b)", "f(b, a)"),
        ("f(a, b)", "pass"),
        ('raise ValueError("1 + 1")', "pass"),
    }
    for one in found:
        compile(one.source, "x.py", "exec")


def test_a_sample_takes_turns_and_follows_from_the_seed(monkeypatch):
    packages = "fmu_src/golf_physics/numerics", "scenarios/golf_impact/arrays"
    monkeypatch.setattr(mutants, "PACKAGES", packages)
    one, other = (mutants.sample(10, seed) for seed in (1, 2))
    assert [str(Path(mutant.file).parent) for mutant in one] == [*packages] * 5
    assert one == mutants.sample(20, 1)[:10] != other


@pytest.mark.nightly
def test_nine_of_ten_mutants_are_caught():
    import mutation

    assert mutation.main(["--count", "300"]) >= 0.9
