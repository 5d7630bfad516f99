"""How many single changes of the source do the unit tests notice?

Run with ``pip install cosmic-ray coverage`` and ``python benchmarks/mutation.py -o FOLDER`` (an
hour on one core; ``--rooms readers`` for one room). Cosmic Ray makes the changes in a copy of the
checkout, drawn at random, as many in each room: arithmetic and comparisons turned, terms and
conditions negated, constants raised or lowered by one, loops skipped; not those of flags that only
forbid (``strict`` of zip, ``frozen`` of a dataclass, names of arguments). Which unit tests pass
through which line is traced once. Of these (or, where the line is compiled or runs at import, of
those that pass through its file), as many run as take ``--longest`` together, the nearest and
quickest first, in a fork of a process that has what the package imports. A change that none of them
fails on survives; survivors are printed with the changed line.

The folder keeps results; a second call goes on with what is there.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from xml.etree import ElementTree

import numba
import numpy as np
import pytest
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names
from coverage import CoverageData

ROOMS = (
    "process", "variance", "estimate", "selection", "diagnosis", "readers", "ins",
    "calibration filter_numbers export population",
)  # fmt: skip
ARITHMETIC = "Add_Sub|Sub_Add|Mul_Div|Div_Mul|Pow_Mul"
SLOW_TO_IMPORT = ("scipy.linalg", "scipy.optimize", "scipy.special", "scipy.stats", "pandas")
OPERATORS = re.compile(
    rf"ReplaceBinaryOperator_({ARITHMETIC})$|ReplaceComparisonOperator_(Lt|Gt|LtE|GtE|Eq|NotEq)_"
    "(Lt|Gt|LtE|GtE|Eq|NotEq)$|NumberReplacer|ReplaceUnaryOperator_USub_UAdd|AddNot|"
    "ReplaceTrueWithFalse|ReplaceFalseWithTrue|ReplaceAndWithOr|ReplaceOrWithAnd|ZeroIteration"
)

_NO_TESTS = (4, 5)
"""Codes of pytest."""


@dataclass(frozen=True)
class Mutant:
    """One change: the occurrence of an operator in a file, and the line it is in."""

    path: str
    operator: str
    occurrence: int
    line: int
    column: int


def mutants_of(path: Path, tree: Path) -> Iterator[Mutant]:
    """All changes of a file."""
    nodes = list(ast_nodes(get_ast(path.read_text())))
    for name in operator_names():
        if not OPERATORS.search(name):
            continue
        operator = get_operator(name)()
        places = (start for node in nodes for start, _ in operator.mutation_positions(node))
        for occurrence, (line, column) in enumerate(places):
            yield Mutant(str(path.relative_to(tree)), name, occurrence, line, column)


class _WithoutGuards(ast.NodeTransformer):
    """Leaves out what forbids and computes nothing: zip(strict=True), dataclass(frozen=True), how
    arguments may be given.
    """

    def visit_arguments(self, node: ast.arguments) -> ast.AST:
        """By position or by name, all of them."""
        self.generic_visit(node)
        node.args = [*node.posonlyargs, *node.args, *node.kwonlyargs]
        node.defaults = [*node.defaults, *filter(None, node.kw_defaults)]
        node.posonlyargs, node.kwonlyargs, node.kw_defaults = [], [], []
        return node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Without its flags, if it is one of these."""
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id in ("zip", "dataclass"):
            node.keywords = []
        return node


def _is_change(mutant: Mutant, tree: Path) -> bool:
    """Whether it is one: 1e60 + 1 is 1e60, and ``{*a, *b}`` with a power in it is no Python."""
    source = (tree / mutant.path).read_text()
    changed = mutate_code(source, get_operator(mutant.operator)(), mutant.occurrence)
    try:
        before, after = (ast.dump(_WithoutGuards().visit(ast.parse(s))) for s in (source, changed))
    except SyntaxError:
        return False
    return before != after


def drawn(tree: Path, count: int, seed: int, rooms: Sequence[str] = ROOMS) -> list[Mutant]:
    """As many of each room; at most one of each place in the source."""
    rng = np.random.default_rng(seed)
    chosen = []
    for room in rooms:
        files = [f for each in room.split() for f in (tree / "src/gmwm" / each).rglob("*.py")]
        everything = [mutant for file in sorted(files) for mutant in mutants_of(file, tree)]
        seen: set[tuple[str, int, int]] = set()
        for k in rng.permutation(len(everything)):
            mutant = everything[k]
            place = (mutant.path, mutant.line, mutant.column)
            if place not in seen and _is_change(mutant, tree):
                seen.add(place)
                chosen.append(mutant)
            if len(seen) == -(-count // len(rooms)):
                break
    return chosen


def tested(
    tree: Path, tests: Sequence[str], loops: Path, longest: float, *options: str
) -> int | None:
    """How the tests end in a fork of this process, by pytest's code; None if they take too long.

    loops: Folder of what is compiled.
    longest: s.
    options: More of pytest.
    """
    if (child := os.fork()) == 0:
        status = 3
        try:
            os.setsid()  # what the tests start ends with them
            os.environ |= {"PYTHONPATH": _path(tree), "NUMBA_CACHE_DIR": str(loops)}
            numba.config.CACHE_DIR = str(loops)  # type: ignore[attr-defined]
            sys.path.insert(0, str(tree / "src"))
            sys.dont_write_bytecode = True
            os.chdir(tree)
            for stream in (1, 2):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
            always = ("-x", "-q", "-p", "no:cacheprovider", "-o", "addopts=-m 'not slow'")
            status = int(pytest.main([*always, *options, *tests]))
        finally:
            os._exit(status)
    end, ended, status = time.monotonic() + longest, 0, 0
    while not ended and time.monotonic() < end:
        ended, status = os.waitpid(child, os.WNOHANG)
        time.sleep(0.02)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    if not ended:
        os.waitpid(child, 0)
        return None
    return os.waitstatus_to_exitcode(status)


def traced(tree: Path, folder: Path) -> tuple[CoverageData, dict[str, float]]:
    """Which test functions pass through which line, and how long each of them takes, s."""
    file, times = folder / "coverage", folder / "times.xml"
    if not times.exists():
        part = folder / "times.part.xml"
        settings = folder / "coverage.ini"
        settings.write_text(
            f"[run]\nsource = {tree}/src/gmwm\ndata_file = {file}\n"
            "dynamic_context = test_function\n"
        )
        command = (sys.executable, "-m", "coverage", "run", f"--rcfile={settings}", "-m", "pytest")
        options = (f"--junitxml={part}", "-q", "-o", "addopts=-m 'not slow'", "tests/unit")
        environment = {**os.environ, "PYTHONPATH": _path(tree)}
        done = subprocess.run((*command, *options), cwd=tree, env=environment, check=False)
        if done.returncode > 1:  # a failed test is another matter
            raise SystemExit("the tests were not traced to their end")
        part.rename(times)
    data = CoverageData(str(file))
    data.read()
    took: dict[str, float] = defaultdict(float)
    for case in ElementTree.parse(times).iter("testcase"):
        function = case.attrib["name"].partition("[")[0]
        took[f"{case.attrib['classname']}.{function}"] += float(case.attrib["time"])
    return data, took


def _path(tree: Path) -> str:
    return os.pathsep.join([str(tree / "src"), *filter(None, [os.environ.get("PYTHONPATH")])])


def tests_of(
    mutant: Mutant, tree: Path, data: CoverageData, took: dict[str, float], longest: float
) -> list[str]:
    """Test functions through its line, or its file: the nearest and quickest, as time allows.

    Where a file is all compiled, none is seen to pass through it, and all may run.

    took: s, of each function.
    longest: s, together.
    """
    lines = data.contexts_by_lineno(str(tree / mutant.path))
    named = set(lines.get(mutant.line, [])) - {""} or set().union(*lines.values()) - {""}
    folder = Path("tests/unit", *Path(mutant.path).parts[2:-1])
    ranked = []
    for function, duration in took.items():
        if named and not any(function.endswith(f".{name}") for name in named):
            continue
        parts = function.split(".")
        depth = next(k for k in range(len(parts), 0, -1) if _file(tree, parts[:k]).exists())
        common = len(os.path.commonpath([folder, Path(*parts[:depth])]))
        node = "::".join([str(_file(tree, parts[:depth])), *parts[depth:]])
        ranked.append((-common, duration, node))
    chosen, spent = [], 0.0
    for _, duration, node in sorted(ranked):
        spent += duration
        if spent <= longest:
            chosen.append(node)
    return chosen


def _file(tree: Path, parts: Sequence[str]) -> Path:
    return tree.joinpath(*parts).with_suffix(".py")


def survives(mutant: Mutant, tree: Path, tests: Sequence[str], longest: float) -> bool | None:
    """Whether no test fails; None if they take too long, by the change or by the machine's load."""
    if not tests:
        return True
    file = tree / mutant.path
    source, stamps = file.read_text(), file.stat()
    changed = mutate_code(source, get_operator(mutant.operator)(), mutant.occurrence)
    loops = tree.parent / "loops"
    try:
        file.write_text(changed)
        code = tested(tree, tests, loops, longest)
    finally:
        file.write_text(source)
        os.utime(file, ns=(stamps.st_atime_ns, stamps.st_mtime_ns))
    if code in _NO_TESTS:  # a failure, too, if without the change there are some
        return None if tested(tree, tests, loops, longest, "--collect-only") else False
    return None if code is None else code == 0


def main() -> None:
    """Draw, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--draw", type=int, default=64, help="changes, over all rooms")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rooms", nargs="+", default=ROOMS, choices=ROOMS)
    longest = "s of tests of a change; stopped after twice that, it counts for nothing"
    parser.add_argument("--longest", type=float, default=60.0, help=longest)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # so that a change is taken back
    folder = options.output.resolve()
    tree = folder / "tree"
    if not tree.exists():
        ignored = shutil.ignore_patterns(".git", ".venv", "out")
        shutil.copytree(Path(__file__).resolve().parents[1], tree, ignore=ignored)
    data, took = traced(tree, folder)
    for name in SLOW_TO_IMPORT:  # once, before the forks
        import_module(name)
    record = folder / "results.json"
    results = json.loads(record.read_text()) if record.exists() else {}
    for mutant in drawn(tree, options.draw, options.seed, options.rooms):
        key = json.dumps(asdict(mutant))
        if key not in results:
            tests = tests_of(mutant, tree, data, took, options.longest)
            results[key] = survives(mutant, tree, tests, 2.0 * options.longest)
            record.write_text(json.dumps(results))
    report({Mutant(**json.loads(key)): alive for key, alive in results.items()}, tree)


def report(results: dict[Mutant, bool | None], tree: Path) -> None:
    """Caught by room, of those whose tests ended, and the survivors."""
    print(f"{'room':<28}caught   of")
    for room in (*ROOMS, " ".join(ROOMS)):
        alive = [a for m, a in results.items() if Path(m.path).parts[2] in room.split()]
        name = "all" if room == " ".join(ROOMS) else room
        print(f"{name:<28}{alive.count(False):>6}{len(alive) - alive.count(None):>5}")
    print(f"{list(results.values()).count(None)} were stopped")
    print("\nSurvivors")
    for mutant in sorted((m for m, a in results.items() if a), key=lambda m: (m.path, m.line)):
        line = (tree / mutant.path).read_text().splitlines()[mutant.line - 1]
        print(f"{mutant.path}:{mutant.line}:{mutant.column} {mutant.operator.split('/')[1]}")
        print(f"    {line.strip()}")


if __name__ == "__main__":
    main()
