"""Tables of what the source document says and how it is read here: for the report and a README."""

from pathlib import Path

from golf_build.packaging import bundle
from golf_impact.facts import document
from golf_impact.report.outcome import Table

#: The scenario scripts: beside golf_impact in a checkout, inside it where it is installed.
_PACKAGE = Path(__file__).resolve().parents[1]


def tables() -> list[Table]:
    """Equations and statements, the parameters of Table 1, and the numbers not reproduced."""
    return [
        Table(
            "What the document says and how it is read",
            ["the document says", "why not literally", "how it is read here", "implemented in"],
            [[*row[:3], locate(row.file, row.line)] for row in document.READINGS],
        ),
        Table(
            "Table 1 and the values that the printed results come from",
            ["parameter", "Table 1", "used"],
            [
                [
                    f"{name} ({'m' if name == 'ball_diameter' else 'kg'})",
                    f"{printed:.3f}",
                    f"{used:.5f}".removesuffix("00"),
                ]
                for (name, printed), used in zip(
                    document.TABLE_1.items(), document.USED.values(), strict=True
                )
            ],
        ),
        Table(
            "Printed numbers that the document's scheme doesn't reproduce",
            ["number", "printed", "its scheme gives", "remark"],
            [
                [row.case, row.number.text, row.scheme, row.remark]
                for row in document.NOT_REPRODUCED.values()
            ],
        ),
    ]


def locate(file: str, beginning: str) -> str:
    """`path:number` of the first line of code that begins like this, indentation aside.

    The file is below fmu_src/ or scenarios/. LookupError: there is no such file or line.
    """
    package, _, inside = file.partition("/")
    if package == "golf_physics":
        path, text = f"fmu_src/{file}", bundle()[inside].decode()
    else:
        scripts = _PACKAGE / "scripts" if (_PACKAGE / "scripts").is_dir() else _PACKAGE.parent
        folder = _PACKAGE.parent if package == "golf_impact" else scripts
        path, text = f"scenarios/{file}", (folder / file).read_text("utf-8")
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip().startswith(beginning):
            return f"{path}:{number}"
    raise LookupError(f"{path} has no line that begins with {beginning!r}")
