"""Draw the rooms of the package by layer, from the import contract: ``docs/img/architecture.svg``.

Each box has the first sentence of the room's docstring and, on the right, what the room makes of
the data. A room imports only from boxes below it.
"""

import ast
import textwrap
import tomllib
from html import escape
from pathlib import Path

DOCS = Path(__file__).parent
SOURCE = DOCS.parent / "src" / "gmwm"
WIDTH, ROW, GAP, LETTERS = 920, 58, 10, 6.4
MADE = {
    "readers": "file -> Recording",
    "variance": "-> WaveletVariance",
    "diagnosis": "-> Health",
    "estimate": "-> Fit",
    "selection": "-> Selection",
    "calibration": "-> Calibration",
    "motion": "-> InMotion",
    "ins": "-> Solution",
    "filter_numbers": "-> AxisFilterNumbers",
    "export": "-> file of a program",
    "population": "-> SensorComparison, Fleet",
    "report": "-> page",
}
"""What a room makes of the data."""


def layers() -> list[list[str]]:
    """Rooms of each layer, top to bottom."""
    content = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))
    names = content["tool"]["importlinter"]["contracts"][0]["layers"]
    return [[each.strip().removeprefix("gmwm.") for each in row.split("|")] for row in names]


def sentence(room: str) -> str:
    """The first sentence of a room's docstring."""
    path = SOURCE / room / "__init__.py"
    path = path if path.exists() else SOURCE / f"{room}.py"
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split()).partition(". ")[0].rstrip(".")


def picture() -> str:
    """The picture as SVG."""
    parts, y = [], GAP
    for row in layers():
        width = (WIDTH - GAP * (len(row) + 1)) / len(row)
        for k, room in enumerate(row):
            x = GAP + k * (width + GAP)
            parts.append(
                f'<rect x="{x:.0f}" y="{y}" width="{width:.0f}" height="{ROW}" rx="6" '
                'fill="#eef3f8" stroke="#5b7c99"/>'
                f'<text x="{x + 12:.0f}" y="{y + 20}" font-weight="bold">{escape(room)}</text>'
                f'<text x="{x + width - 12:.0f}" y="{y + 20}" text-anchor="end" '
                f'fill="#2a6">{MADE.get(room, "").replace("->", "→")}</text>'
            )
            lines = textwrap.wrap(sentence(room), int((width - 24) / LETTERS))[:2]
            for i, line in enumerate(lines):
                parts.append(
                    f'<text x="{x + 12:.0f}" y="{y + 36 + 14 * i}" font-size="11" '
                    f'fill="#444">{escape(line)}</text>'
                )
        y += ROW + GAP
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {y}" '
        f'font-family="system-ui, sans-serif" font-size="13">\n'
        f'<rect width="{WIDTH}" height="{y}" fill="white"/>\n' + "\n".join(parts) + "\n</svg>\n"
    )


if __name__ == "__main__":
    (DOCS / "img" / "architecture.svg").write_text(picture(), encoding="utf-8")
