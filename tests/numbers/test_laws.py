"""Properties of every contact law of the table, and of one that is added to it.

The reference is an integration of a law's `force` by SciPy's DOP853. So phases that differ from the
equations are found, by any steps. Model Exchange has no phases: test_model_exchange.py.
"""

import os
import re
import sys
from functools import cache
from itertools import pairwise

import pytest
from cases import integrated
from command import ROOT, checkout
from command import run as run_process
from compare import assert_close
from golf_physics.laws import LAWS
from golf_physics.laws.law import LinearLaw
from golf_physics.values import Parameters

VALUES = {"m_ball": 0.0625, "b": 30.0}
END = 2e-3
ENERGY = 0.5 * 0.21 * 35.0**2


@cache
def exact(number):
    """Outputs at separation, from the law's equations of motion."""
    law = LAWS[number]
    parameters = Parameters(0.21, 0.0625, 0.04, 0.0, 0.0, number, 1.0, 0.005, 0.0, 0.0)

    def force(compression, closing, values):
        return law.force(parameters, values["k"], values["b"], compression, closing)

    return integrated(VALUES | {"law": number}, force=force)


@pytest.mark.parametrize("law", sorted(LAWS))
@pytest.mark.parametrize("steps", [1, 7, 200])
def test_co_simulation_against_the_equations(way_of, law, steps):
    """By any steps; what is added up never falls, energy never rises."""
    values, size = VALUES | {"law": law}, END / steps
    rows = way_of("in process").path(values, [(size, {})] * steps)
    # DOP853 reaches 1.2e-14, of the largest force 1e-9; a law that is integrated 1e-13.
    tolerance = 1e-13 if isinstance(LAWS[law], LinearLaw) else 1e-11
    expected, scales = exact(law), {"club_velocity": 35.0, "ball_velocity": 35.0}
    scales["max_force"] = 1e-9 / tolerance * expected["max_force"]
    assert_close(rows[-1], expected, scales, tolerance, law=law)
    for before, now in pairwise(rows):
        assert now["impulse"] >= before["impulse"] - 1e-16
        assert now["max_force"] >= before["max_force"]
        assert now["contact_time"] >= before["contact_time"]
        assert now["kinetic_energy"] <= ENERGY * (1.0 + 1e-13)
    if not LAWS[law].drag(30.0):
        gained = 0.0625 * rows[-1]["ball_velocity"]
        assert gained == pytest.approx(rows[-1]["impulse"], rel=1e-13)
        assert rows[-1]["momentum"] == pytest.approx(0.21 * 35.0, rel=1e-13)


#: A law whose phases and equations differ.
_SPLIT = '''"""Law 3: in contact a damper that the equations don't have."""

from .law import LinearLaw
from .linear import linear_contact


class SplitLaw(LinearLaw):
    def contact(self, p, inputs, start):
        return linear_contact(inputs.k, inputs.b, 0.0, p.m_club, p.m_ball, start)
'''


CONTRIBUTING = (ROOT / ".github" / "CONTRIBUTING.md").read_text("utf-8")
(NAME_ROW,) = re.findall(r"^    3: \(\"hunt-crossley\".*\),$", CONTRIBUTING, re.MULTILINE)


def recipe():
    """The law of CONTRIBUTING.md."""
    (code,) = re.findall(r"```python\n(\"\"\"Law 3.*?)```", CONTRIBUTING, re.DOTALL)
    assert len(code.splitlines()) <= 20
    return code


def checkout_with(code, folder):
    """A copy of the checkout with this law as number 3, and the environment that uses it."""
    path = checkout(folder)
    laws = folder / "fmu_src" / "golf_physics" / "laws"
    (laws / "third.py").write_text(code)
    (name,) = re.findall(r"class (\w+)\(", code)
    table = (laws / "__init__.py").read_text()
    table = table.replace("from .relative", f"from .third import {name}\nfrom .relative", 1)
    changed = table.replace("2: RelativeLaw()}", f"2: RelativeLaw(), 3: {name}()}}")
    assert changed != table
    (laws / "__init__.py").write_text(changed)
    variables_py = laws.parent / "variables.py"
    rows = variables_py.read_text()
    changed = re.sub(r"^    2: \(\"relative\".*$", rf"\g<0>\n{NAME_ROW}", rows, flags=re.MULTILINE)
    assert changed != rows
    variables_py.write_text(changed)
    return os.environ | path | {"GOLF_IMPACT_LAWS": code}


added = pytest.mark.skipif("GOLF_IMPACT_LAWS" in os.environ, reason="the run with a law added")


@added
@pytest.mark.ci
@pytest.mark.parametrize(("code", "fails"), [(recipe(), False), (_SPLIT, True)])
def test_a_law_is_one_file_and_two_rows(tmp_path, code, fails):
    """The tests above with a third law; one whose phases and equations differ fails them."""
    words = sys.executable, "-m", "pytest", "-n", "0", "-o", f"cache_dir={tmp_path / 'cache'}"
    options = {"env": checkout_with(code, tmp_path), "cwd": ROOT, "timeout": 600}
    done = run_process(*words, __file__, code=int(fails), **options)
    failed = set(re.findall(r"FAILED \S+::(\w+)\[(?:.*-)?(\d)\]", done.stdout))
    assert {law for _, law in failed} == ({"3"} if fails else set()), done.stdout[-3000:]
    if fails:
        assert {"test_co_simulation_against_the_equations"} <= {name for name, _ in failed}


@added
@pytest.mark.ci
def test_a_law_of_ones_own_in_the_commands(tmp_path):
    """The recipe of CONTRIBUTING.md: the plain FMU runs it, the engine says where it runs."""
    options = {"env": checkout_with(recipe(), tmp_path), "cwd": tmp_path}
    words = "run", "--set", "law=3", "--set", "b=30", "--no-figures", "--out", "out"
    out = run_process(sys.executable, "-m", "golf_impact", *words, **options).stdout
    assert "law = 3, b = 30" in out
    code = "import golf_impact; golf_impact.run_impact(law=3)"
    done = run_process(sys.executable, "-c", code, code=1, **options)
    assert "golf-impact run --set law=3" in done.stderr
