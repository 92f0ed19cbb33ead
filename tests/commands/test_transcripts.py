"""Sessions in Markdown: what a user types and sees, in a terminal and in Python.

Blocks ```console have commands (`$ …`) and what each prints: stdout, then stderr. `…` stands for
any text, in a line of its own for any lines. A block has a fresh folder, with the files that stand
above it (```toml NAME, ```python NAME). A last line such as [1] is the exit code, unless that is
0, or 2 with a line "Error: ". golf-impact at the beginning of a line runs in this process, other
commands in a shell. Blocks ```pycon have Python (`>>> …`, `... …`); of an error its type, its
variable and its sentence are printed.
`pytest --update tests/commands/test_transcripts.py` writes what is printed: read the diff.
"""

import io
import os
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest
import readmes
from command import COMMAND, DOCUMENTS, ROOT, contents, golf_here

FOLDER = Path(__file__).parent / "transcripts"
BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)

#: Languages of sessions, and where they aren't run.
SKIPPED = {
    "console": pytest.mark.skipif(sys.platform == "win32", reason="POSIX's shell and paths"),
    "pycon": (),
}


def sessions():
    """The console blocks of all documents, with the files before them."""
    for document in (*sorted(FOLDER.glob("*.md")), *DOCUMENTS):
        files = {}
        for number, block in enumerate(BLOCK.finditer(document.read_text("utf-8"))):
            language, name, text = block.groups()
            if language in SKIPPED:
                title = document.relative_to(FOLDER if document.parent == FOLDER else ROOT)
                yield pytest.param(
                    document, text, files.copy(), id=f"{title}-{number}", marks=SKIPPED[language]
                )
            elif name:
                files[name] = text


def printed(line, folder):
    """What a command prints in this folder, which it leaves as it was if it is refused."""
    before = contents(folder)
    program, *words = shlex.split(line)
    if Path(program).name == "golf-impact":
        done = golf_here(*words, cwd=folder)
    else:
        path = os.pathsep.join((str(COMMAND.parent), os.environ["PATH"]))
        options = {"shell": True, "capture_output": True, "text": True, "cwd": folder}
        done = subprocess.run(line, **options, env=os.environ | {"PATH": path})
    text = (done.stdout + done.stderr).replace(f"{folder}/", "")
    lines = [line.rstrip() for line in text.splitlines()]
    if any(line.startswith("Error: ") for line in lines):
        assert done.returncode == 2
        assert contents(folder) == before, "what is refused writes nothing"
    elif done.returncode:
        lines.append(f"[{done.returncode}]")
    return "\n".join(lines).strip("\n")


def evaluated(line, names):
    """What a line of Python prints."""
    out = io.StringIO()
    with redirect_stdout(out):
        try:
            exec(compile(f"{line}\n", "line", "single"), names)
        except (NameError, SyntaxError):
            raise  # of the session itself
        except Exception as error:
            of = f" of {error.variable}" if getattr(error, "variable", "") else ""
            print(f"{type(error).__name__}{of}: {error}")
    return out.getvalue().strip("\n")


def matches(text, expected):
    """Whether it is the text that is expected, where `…` is any text."""
    lines = (
        "(?s:.*)" if line == "…" else re.escape(line).replace("…", ".*")
        for line in expected.splitlines()
    )
    return re.fullmatch("\n".join(lines), text)


@pytest.mark.parametrize(("document", "session", "files"), [*sessions()])
def test_a_session(tmp_path, monkeypatch, pytestconfig, document, session, files):
    monkeypatch.chdir(tmp_path)
    for name, text in files.items():
        (tmp_path / name).write_text(text, "utf-8")
    found, names = [], {}
    for call in re.split(r"(?m)^(?=\$ |>>> )", session)[1:]:
        typed, expected = re.match(r"(.*(?:\n\.\.\..*)*)\n?((?s:.*?))\n*$", call).groups()
        line = re.sub(r"(?m)^(\$|>>>|\.\.\.) ?", "", typed)
        text = printed(line, tmp_path) if typed[0] == "$" else evaluated(line, names)
        fits = matches(text, expected)
        if not pytestconfig.getoption("--update"):
            assert fits or text == expected, line
        found += [typed, *(expected if fits else text).splitlines()]
    if pytestconfig.getoption("--update"):
        new = "\n".join([*found, ""])
        document.write_text(document.read_text("utf-8").replace(session, new, 1), "utf-8")


def test_the_table_of_variables(pytestconfig):
    """That of the model's README."""
    text = readmes.README.read_text("utf-8")
    if pytestconfig.getoption("--update"):
        readmes.README.write_text(readmes.updated(text), "utf-8")
    else:
        assert readmes.updated(text) == text, "pytest --update tests/commands/test_transcripts.py"
