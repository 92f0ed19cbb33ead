"""The lesson: it runs from top to bottom anywhere, and what is stored of it is what it gives."""

import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

FILE = Path(__file__).resolve().parents[2] / "scenarios" / "first_impact.ipynb"


def printed(notebook):
    """What its code cells print; figures and values are left out."""
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return "".join(output["text"] for output in outputs if output["output_type"] == "stream")


# Of jupyter_client, about a kernel on this machine.
@pytest.mark.filterwarnings("ignore")
@pytest.mark.ci  # a kernel takes its time
def test_it_runs_from_any_folder(tmp_path):
    notebook = nbformat.read(FILE, as_version=4)
    stored = printed(notebook)
    where = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, kernel_name="python3", timeout=120, resources=where).execute()
    assert printed(notebook) == stored
    assert list(tmp_path.iterdir()) == []


def test_its_extra_brings_all():
    """What it imports, and Jupyter."""
    text = (FILE.parents[1] / "pyproject.toml").read_text("utf-8")
    table = text.partition("\nlesson = [\n")[2].partition("\n]\n")[0]
    assert re.findall(r'^    "([a-z]+)', table, re.M) == ["jupyterlab", "lmfit"]
    assert '".[lesson]"' in " ".join(c.source for c in nbformat.read(FILE, as_version=4).cells)


def test_what_is_stored():
    notebook = nbformat.read(FILE, as_version=4)
    nbformat.validate(notebook)
    assert notebook.metadata.kernelspec.name == "python3"
    assert FILE.stat().st_size < 300_000
    counts = [cell.execution_count for cell in notebook.cells if cell.cell_type == "code"]
    assert counts == list(range(1, len(counts) + 1))
    text = FILE.read_text("utf-8")
    assert text.count("<details>") == 5
    assert not re.search(r"/(home|root|work|tmp)/", text)
