"""Run what the pages show: every Python block and every ``gmwm`` command, page by page.

    python docs/pages.py                     # all pages, without what is marked slow
    python docs/pages.py docs/odd-plots.md   # some pages
    python docs/pages.py --slow              # with what is marked slow
    python docs/pages.py --figures           # and keep the figures that they save, in docs/img
    python docs/pages.py --show              # with what they print

The blocks of a page run in order in one empty folder, Python in one namespace. A YAML block whose
first line is ``# NAME.yaml`` is written to that file. A comment before a block, ``<!-- slow -->``
or ``<!-- not run: WHY -->``, leaves it out.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import re
import shlex
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

DOCS = Path(__file__).resolve().parent
PAGES = (DOCS.parent / "README.md", *sorted(DOCS.glob("*.md")))

_BLOCK = re.compile(
    r"(?P<mark><!--[^>]*-->\n)?^```(?P<kind>[a-z]*)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL
)
_YAML_NAME = re.compile(r"# (?P<name>[\w.-]+\.yaml)\n")


@dataclass(frozen=True)
class Block:
    """A fenced block of a page.

    Attributes
    ----------
    page : Path
    line : int
    kind : str
        As written behind the fence.
    text : str
    mark : str
        The comment before it, "" if there is none.
    """

    page: Path
    line: int
    kind: str
    text: str
    mark: str

    @property
    def place(self) -> str:
        return f"{self.page.name}:{self.line}"

    def runs(self, slow: bool) -> bool:
        """Whether it is run."""
        return not self.mark.startswith("not run:") and (slow or self.mark != "slow")

    @property
    def commands(self) -> list[list[str]]:
        """Of a shell block: the words of each line."""
        lines = self.text.replace("\\\n", " ").splitlines()
        return [words for line in lines if (words := shlex.split(line, comments=True))]


def blocks_of(page: Path) -> list[Block]:
    """All fenced blocks of a page."""
    text = page.read_text(encoding="utf-8")
    found = []
    for match in _BLOCK.finditer(text):
        mark = (match["mark"] or "").strip().removeprefix("<!--").removesuffix("-->").strip()
        line = text.count("\n", 0, match.start("text"))
        found.append(Block(page, line, match["kind"], match["text"], mark))
    return found


class Runner:
    """Runs pages; folders that begin with the same commands are filled once."""

    def __init__(self, scratch: Path, slow: bool = False, show: bool = False) -> None:
        self.scratch, self.slow, self.show = scratch, slow, show
        self._filled: dict[str, Path] = {}

    def run(self, page: Path) -> Path:
        """Run a page; the folder with the files that it wrote."""
        blocks = [block for block in blocks_of(page) if block.runs(self.slow)]
        folder = self.scratch / page.stem
        names: dict[str, Any] = {"__name__": f"page {page.stem}"}
        if blocks and blocks[0].kind == "sh":
            first, *blocks = blocks
            if first.text not in self._filled:
                self._filled[first.text] = self.scratch / f"first-{len(self._filled)}"
                self._filled[first.text].mkdir()
                self._in(self._filled[first.text], first, names)
            shutil.copytree(self._filled[first.text], folder)
        folder.mkdir(exist_ok=True)
        for block in blocks:
            self._in(folder, block, names)
        return folder

    def _in(self, folder: Path, block: Block, names: dict[str, Any]) -> None:
        try:
            with contextlib.chdir(folder), _quiet(None if self.show else io.StringIO()):
                _run(block, names)
        except (Exception, SystemExit) as error:
            raise AssertionError(f"{block.place}: {type(error).__name__}: {error}") from error


def _run(block: Block, names: dict[str, Any]) -> None:
    if block.kind == "python":
        code = compile("\n" * block.line + block.text, block.page.name, "exec")
        exec(code, names)
        import matplotlib.pyplot as plt

        plt.close("all")
    elif block.kind == "sh":
        for words in block.commands:
            _command(words)
    elif block.kind == "yaml" and (name := _YAML_NAME.match(block.text)):
        Path(name["name"]).write_text(block.text, encoding="utf-8")


def _command(words: list[str]) -> None:
    from gmwm import cli

    if words[0] != "gmwm":
        raise ValueError(f"{shlex.join(words)}: mark the block with <!-- not run: WHY -->")
    status = cli.cli.main(words[1:], prog_name="gmwm", standalone_mode=False)
    if status:
        raise ValueError(f"{shlex.join(words)}: exit status {status}")


@contextlib.contextmanager
def _quiet(output: TextIO | None) -> Iterator[None]:
    os.environ["MPLBACKEND"] = "agg"
    import matplotlib as mpl

    style = {"svg.fonttype": "none", "svg.hashsalt": "gmwm", "figure.figsize": (6.4, 4.0),
             "figure.constrained_layout.use": True}  # fmt: skip
    with contextlib.redirect_stdout(output or sys.stdout), mpl.rc_context(style):
        yield


def main() -> None:
    """Run pages and print the time of each."""
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pages", nargs="*", type=Path, default=PAGES)
    parser.add_argument("--slow", action="store_true")
    parser.add_argument("--figures", action="store_true")
    parser.add_argument("--show", action="store_true")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        runner = Runner(Path(scratch), given.slow, given.show)
        for page in given.pages:
            start = time.process_time()
            folder = runner.run(page.resolve())
            print(
                f"{page.name}: {time.process_time() - start:.1f} s of the processor",
                file=sys.stderr,
            )
            for figure in folder.glob("*.svg") if given.figures else ():
                shutil.copy(figure, DOCS / "img" / figure.name)


if __name__ == "__main__":
    main()
