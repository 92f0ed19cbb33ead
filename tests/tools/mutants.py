"""Mutants: small defects in the sources, each a change of a token or statement."""

import ast
import difflib
import random
import re
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]

#: Not mutated: comments and strings; in C directives, in JavaScript regular expressions.
_STRINGS = r""""(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'"""
_COMMENTS = r"//[^\n]*|/\*.*?\*/"
_TEXT = {
    ".py": rf'""".*?"""|#[^\n]*|{_STRINGS}|^if TYPE_CHECKING:$',
    ".c": rf"{_COMMENTS}|{_STRINGS}|^#(?!define)[^\n]*",
    ".js": rf"{_COMMENTS}|{_STRINGS}|`(?:\\.|[^`\\])*`|(?<=[(! ])/(?![ /*])[^/\n]+/(?=[,.)])",
}
#: Operators stand between spaces, as formatters write them; then pairs of functions.
_OPERATORS = (
    "+ -", "- +", "* /", "/ *", "// /", "% *", "< <= >=", "<= < >", "> >= <=", ">= > <", "== !=",
    "!= ==", "=== !==", "!== ===", "&& ||", "|| &&", "and or", "or and", "is not", "+= =", "-= =",
    "*= =", "/= =",
)  # fmt: skip
_PAIRS = (
    "min max", "sin cos", "any all", "floor ceil", "minimum maximum", "larger smaller", "fmin fmax",
)  # fmt: skip
_SHARED = {
    **{rf"(?<= ){re.escape(old)}(?= )": new for old, *new in map(str.split, _OPERATORS)},
    **{rf"\b{old}(?=\()": [new] for a in _PAIRS for old, new in (a.split(), a.split()[::-1])},
    r"(?<![\w.\])])-(?=[\w(])": [" "],
}
_C_LIKE = {
    r"\bif \((?=\S)": ["if (0 && ", "if (1 || "], r"\btrue\b": ["false"], r"\bfalse\b": ["true"],
    r"\bbreak;": [";"], r"\+\+": ["--"],
    r"^ +[\w.\[\]>-]+(?: [-+*/]?= [^;\n]*;|\([^()\n]*\);?)$": [";"],
}  # fmt: skip
_PYTHON = {
    r"\b(if|while) (.+)(?=:$)": [r"\1 (not (\2))"], r" if (.+?) else ": [r" if (not (\1)) else "],
    r"\bTrue\b": ["False"], r"\bFalse\b": ["True"], r"\bcontinue$": ["break"],
    r"\bbreak$": ["continue"], r"(?<!is )\bnot (?!in\b)": [""], r"\bis not\b": ["is"],
    r"\bnot in\b": ["in"], r"(?<= )in(?= )": ["not in"], r"(?<=\w)\*\*(?=\w)": ["*"],
    r"(?<!def )(\b[a-z]\w*)\((\w+), (\w+)(?=[,)])": [r"\1(\3, \2"],
    r"^( +)(?:raise|return) .+$": [r"\1pass"], r"^( +)(?!def)[\w.]+\(.*\)$": [r"\1pass"],
    r"^( +)(?:[\w.\[\]]*[.\]]\w*|[\w.\[\]]+ [-+*/])(?: =|=) .+$": [r"\1pass"],
}  # fmt: skip
_TOKENS = {".py": _SHARED | _PYTHON, ".c": _SHARED | _C_LIKE, ".js": _SHARED | _C_LIKE}
_NUMBER = r"(?<![\w.])(?:\d+\.\d*(?:e[-+]?\d+)?|\d+e-?\d+|\d+)(?![\w.])"


class Mutant(NamedTuple):
    """A part of a file and what replaces it."""

    file: str
    start: int
    end: int
    new: str
    line: int  #: executed if the part is; 0 outside functions, and in C

    @property
    def source(self) -> str:
        code = (ROOT / self.file).read_text("utf-8")
        return code[: self.start] + self.new + code[self.end :]

    @property
    def difference(self) -> list[str]:
        """The file, and the changed lines before and after, without indentation."""
        before = (ROOT / self.file).read_text("utf-8").splitlines()
        lines = [*difflib.unified_diff(before, self.source.splitlines(), n=0)][3:]
        return [self.file, *(f"{line[0]} {line[1:].strip()}" for line in lines)]

    @property
    def key(self) -> str:
        return f"{' '.join(self.difference)} @{self.start}"

    @property
    def is_valid(self) -> bool:
        """Whether it isn't an error of syntax; known of Python alone."""
        with suppress(SyntaxError):
            return not self.file.endswith(".py") or bool(ast.parse(self.source))
        return False


def _numbers(text: str) -> list[str]:
    if text.isdigit():
        return [str(int(text) + 1), str(int(text) - 1)]
    # The smallest are tolerances: a per mille of them has no effect.
    value = float(text)
    factor = 1.0 + 1e-3 if abs(value) >= 1e-4 else 1e3
    return [repr(value * factor if value else 1e-3)]


def mutants(file: str) -> Iterator[Mutant]:
    """Mutants of a file in Python, C or JavaScript, of which some aren't valid."""
    code, kind = (ROOT / file).read_text("utf-8"), Path(file).suffix
    text = {n for m in re.finditer(_TEXT[kind], code, re.S | re.M) for n in range(*m.span())}
    places = [(m, new) for old, new in _TOKENS[kind].items() for m in re.finditer(old, code, re.M)]
    found = [(m, m.expand(new)) for m, news in places for new in news]
    # Most numbers in files with figures are pixels and colours.
    if "createElementNS" not in code and "matplotlib" not in code:
        found += [(m, new) for m in re.finditer(_NUMBER, code) for new in _numbers(m[0])]
    tree = ast.walk(ast.parse(code if kind == ".py" else ""))
    functions = [node for node in tree if isinstance(node, ast.FunctionDef)]
    inside = {n for f in functions for n in range(f.body[0].lineno, (f.end_lineno or 0) + 1)}
    for match, new in found:
        if match.start() not in text:
            line = code.count("\n", 0, match.start()) + 1
            yield Mutant(file, *match.span(), new, line if line in inside else 0)


def packages() -> dict[str, list[str]]:
    """The sources in Python, C and JavaScript, by folder."""
    listed = "git", "ls-files", "fmu_src", "build", "scenarios"
    found: dict[str, list[str]] = {}
    for file in subprocess.check_output(listed, cwd=ROOT, text=True).split():
        if Path(file).suffix in _TEXT:
            found.setdefault(str(Path(file).parent), []).append(file)
    return found


def sample(count: int, seed: int) -> list[Mutant]:
    """The first mutants of a seed, each of all of them with the same chance."""
    found = [one for files in packages().values() for file in files for one in mutants(file)]
    random.Random(seed).shuffle(found)
    return list(islice((mutant for mutant in found if mutant.is_valid), count))
