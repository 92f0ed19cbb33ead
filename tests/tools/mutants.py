"""Mutants: small defects in the sources, each a change of one expression or statement."""

import ast
import difflib
import random
import re
from itertools import chain, pairwise, zip_longest
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = (
    *(f"fmu_src/golf_physics{name}" for name in ("", "/component", "/laws", "/numerics")),
    "fmu_src/golf_physics/companions",
    *(f"scenarios/golf_impact/{name}" for name in ("arrays", "calibration")),
)
_OPERATORS = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.Pow: ("**", "*"), ast.FloorDiv: ("//", "/"), ast.Mod: ("%", "*"), ast.Lt: ("<", "<=", ">="),
    ast.LtE: ("<=", "<", ">"), ast.Gt: (">", ">=", "<="), ast.GtE: (">=", ">", "<"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"), ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"),
    ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
_PAIRS = "min max", "sin cos", "any all", "floor ceil", "minimum maximum"
_NAMES = {a: b for pair in _PAIRS for a, b in (pair.split(), pair.split()[::-1])}
#: Swapped, their arguments only raise an error.
_REFLECTIVE = {*_NAMES, "getattr", "isinstance", "super"}


class Mutant(NamedTuple):
    """A part of a file, in bytes, and what replaces it."""

    file: str
    start: int
    end: int
    new: str
    lines: tuple[int, ...]  #: executed if the part is; none outside functions

    @property
    def source(self) -> str:
        data = (ROOT / self.file).read_bytes()
        return (data[: self.start] + self.new.encode() + data[self.end :]).decode()

    @property
    def difference(self) -> list[str]:
        """The file, and the changed lines before and after, without indentation."""
        before = (ROOT / self.file).read_text("utf-8").splitlines()
        lines = [*difflib.unified_diff(before, self.source.splitlines(), n=0)][3:]
        return [self.file, *(f"{line[0]} {line[1:].strip()}" for line in lines)]

    @property
    def key(self) -> str:
        return f"{' '.join(self.difference)} @{self.start}"


def mutants(file: str) -> list[Mutant]:
    """All mutants of a file; none of text, annotations, what is raised, or styles of figures."""
    data, found = (ROOT / file).read_bytes(), []
    begins = [0, *(newline.end() for newline in re.finditer(b"\n", data))]
    idle = {"annotation", "returns", "decorator_list", "exc", "msg"}
    idle |= {"keywords"} if b"matplotlib" in data else set()

    def span(node):
        start, end = begins[node.lineno - 1], begins[node.end_lineno - 1]
        return start + node.col_offset, end + node.end_col_offset

    def text(node):
        return data[slice(*span(node))].decode()

    def visit(node, line, inside, nested=False):
        def put(start, end, *news):
            own = range(node.lineno, node.end_lineno + 1) if isinstance(node, ast.expr) else ()
            lines = (line, *own) if inside else ()
            found.extend(Mutant(file, start, end, new, lines) for new in news)

        def between(left, right, operator):
            start, end = span(left)[1], span(right)[0]
            old, *news = _OPERATORS.get(type(operator), [None])
            if old and not isinstance(left, ast.JoinedStr | ast.List):
                place = re.search(re.escape(old).replace("\\ ", r"\s+").encode(), data[start:end])
                put(start + place.start(), start + place.end(), *news)

        match node:
            case ast.JoinedStr() | ast.Expr(value=ast.Constant()):
                return
            case (
                ast.If(test=ast.Name(id="TYPE_CHECKING"))
                | ast.ClassDef(bases=[ast.Name("Protocol")])
            ):
                return
            case ast.Assign(targets=[ast.Name(id="__all__" | "__slots__" | "__version__")]):
                return
            case ast.BinOp():
                between(node.left, node.right, node.op)
            case ast.BoolOp():
                between(*node.values[:2], node.op)
            case ast.Compare():
                for pair, operator in zip(pairwise((node.left, *node.comparators)), node.ops):
                    between(*pair, operator)
            case ast.UnaryOp(op=ast.Not() | ast.USub()):
                put(*span(node), f"({text(node.operand)})")
            case ast.Constant(value=bool(value)):
                put(*span(node), str(not value))
            case ast.Constant(value=int(value)):
                put(*span(node), str(value + 1), str(value - 1))
            case ast.Constant(value=float(value)):
                # The smallest are tolerances: a per mille of them has no effect.
                factor = 1.0 + 1e-3 if abs(value) >= 1e-4 else 1e3
                put(*span(node), repr(value * factor if value else 1e-3))
            case ast.If() | ast.While() | ast.IfExp():
                put(*span(node.test), f"(not ({text(node.test)}))")
            case ast.Name(id=name) if name in _NAMES:
                put(*span(node), _NAMES[name])
            case ast.Call(func=function, args=[ast.Name() as a, ast.Name() as b, *_]):
                if a.id != b.id and text(function) not in _REFLECTIVE:
                    put(span(a)[0], span(b)[1], f"{text(b)}, {text(a)}")
            case ast.Continue() | ast.Break():
                put(*span(node), "break" if isinstance(node, ast.Continue) else "continue")
            case ast.AugAssign():
                between(node.target, node.value, node.op)
                put(*span(node), "pass")
            case ast.Expr() | ast.Raise() | ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
                put(*span(node), "pass")
            case ast.Return() if nested:
                put(*span(node), "pass")
        function = isinstance(node, ast.FunctionDef | ast.Lambda)
        for name, value in ast.iter_fields(node):
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST) and name not in idle:
                    its = child.lineno if isinstance(child, ast.stmt) else line
                    visit(child, its, inside or (function and name == "body"), not function)

    visit(ast.parse(data), 0, False)
    return found


def sample(count: int, seed: int) -> list[Mutant]:
    """The first mutants of a seed, in turns from each package."""
    packages = []
    for package in PACKAGES:
        files = sorted((ROOT / package).glob("*.py"))
        packages.append([m for file in files for m in mutants(str(file.relative_to(ROOT)))])
        random.Random(f"{seed} {package}").shuffle(packages[-1])
    return [m for m in chain(*zip_longest(*packages)) if m is not None][:count]
