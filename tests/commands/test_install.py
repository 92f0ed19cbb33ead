"""Declared dependencies, and installations of the wheel and the source distribution."""

import importlib.metadata
import os
import re
import shlex
import shutil
import sys
import venv
from itertools import chain
from pathlib import Path

import pytest
from command import ROOT, run
from conftest import some
from packaging.requirements import Requirement

from golf_build import extras
from golf_impact.files import read_toml

PROJECT = read_toml(ROOT / "pyproject.toml")["project"]
EXTRAS = ("calibrate", "sweep", "cluster", "interop", "native", "bench")


def test_nothing_undeclared_is_imported():
    """Third-party modules come from declared packages."""
    extras = (PROJECT["optional-dependencies"][extra] for extra in EXTRAS)
    names = {Requirement(one).name for one in chain(PROJECT["dependencies"], *extras)}
    owners = importlib.metadata.packages_distributions()
    ours = {"golf_physics", "golf_build", "golf_impact"}
    for file in (path for folder in ("scenarios", "fmu_src", "build") for path in tree(folder)):
        text = file.read_text("utf-8")
        for module in re.findall(r"^ *(?:import|from) (\w+)", text, re.MULTILINE):
            if module in ours or module in sys.stdlib_module_names or module == "tomllib":
                continue
            packages = {name.lower().replace("_", "-") for name in owners.get(module, [])}
            assert packages & names or not packages, (file.name, module)


@pytest.mark.parametrize("extra", some(1, EXTRAS))
def test_the_command_that_installs_an_extra(monkeypatch, tmp_path, extra):
    """In a checkout the checkout with the extra; beside a wheel the packages of the extra."""
    monkeypatch.chdir(ROOT)
    python, *rest = shlex.split(extras.install_command(extra))
    assert rest == ["-m", "pip", "install", "-e", f".[{extra}]"]
    assert Path(python).is_absolute() != Path(sys.executable).is_relative_to(ROOT)
    assert str(Path(sys.prefix)) in run(python, "-m", "pip", "--version").stdout
    monkeypatch.chdir(tmp_path)
    assert shlex.split(extras.install_command(extra))[4:] == ["-e", f"{ROOT}[{extra}]"]
    # As without a checkout.
    monkeypatch.setattr(extras, "_ROOT", tmp_path)
    packages = shlex.split(extras.install_command(extra))[4:]
    declared = PROJECT["optional-dependencies"][extra]
    assert {*map(Requirement, packages)} == {*map(Requirement, declared)}


def tree(folder):
    return (ROOT / folder).rglob("*.py")


# Nightly: as a user does it, with a package index


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Wheel and source distribution, made by `python -m build` in the root of a checkout."""
    folder = tmp_path_factory.mktemp("checkout")
    tools = environment(tmp_path_factory.mktemp("tools"))
    if pip(tools, "build", code=None).returncode:
        pytest.skip("there is no package index here")
    for name in ("fmu_src", "build", "scenarios", "tests"):
        ignored = shutil.ignore_patterns("__pycache__", "*.fmu", "*.csv", "*.opt", "*.ssp")
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    for name in ("pyproject.toml", "README.md", "CHANGELOG.md", "LICENSE"):
        shutil.copy(ROOT / name, folder)
    shutil.copytree(ROOT / ".github", folder / ".github")
    # The folder build/ of the working folder doesn't hide the module.
    run(tools, "-m", "build", cwd=folder, timeout=None)
    return {path.suffix: path for path in (folder / "dist").iterdir()}


def environment(folder):
    """A fresh virtual environment's Python."""
    venv.create(folder, with_pip=True)
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def pip(python, *packages, code=0):
    return run(python, "-m", "pip", "install", "--quiet", *packages, code=code, timeout=None)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", [".whl", ".gz"])
def test_an_installed_copy(tmp_path, made, fmu_path, kind):
    python = environment(tmp_path / "environment")
    pip(python, made[kind])
    outside = tmp_path / "outside"
    outside.mkdir()
    hidden = ("PYTHONPATH", "PYTHONHOME")
    env = {key: value for key, value in os.environ.items() if key not in hidden}
    env |= {"XDG_CACHE_HOME": str(tmp_path / "cache"), "LOCALAPPDATA": str(tmp_path / "cache")}

    def golf(*arguments, code=0):
        command = python.with_name("golf-impact"), *arguments
        return run(*command, code=code, cwd=outside, env=env, timeout=None)

    assert "54.745" in golf("run", "baseline", "--no-figures").stdout
    results = {path.name for path in (outside / "golf-impact-results").iterdir()}
    assert results == {"results.json", "baseline.csv", "report.html"}
    built = list((tmp_path / "cache").rglob("*.fmu"))
    assert len(built) == 1
    for command in (("list",), ("doctor",), ("run",), ("build", "--system", "--out", "x.fmu")):
        golf(*command)
    calibrate = ("calibrate", "--cor", "0.743", "--contact-time", "600e-6")
    pip_line = re.search("`(.+)`", golf(*calibrate, code=2).stderr)[1]
    run(*shlex.split(pip_line), cwd=outside, timeout=None)
    golf(*calibrate)
    version = "import importlib.metadata as m; print(m.version('pythonfmu'))"
    theirs = run(python, "-c", version).stdout.strip()
    if theirs == importlib.metadata.version("pythonfmu"):
        assert built[0].read_bytes() == fmu_path.read_bytes()
