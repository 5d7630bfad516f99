"""How many single changes of the source do the unit tests notice?

Run with ``pip install cosmic-ray coverage`` and ``python benchmarks/mutation.py -o FOLDER`` (two
hours on one core; ``--mutants 24`` for a first look, ``--rooms readers`` for one room). Cosmic Ray
makes the changes in a copy of the checkout, drawn at random, as many in each room: arithmetic and
comparisons turned, terms and conditions negated, constants raised or lowered by one, loops skipped;
not those of flags that only forbid (``strict`` of zip, ``frozen`` of a dataclass). Of the unit
tests, those run that pass through the changed line (or, where it is compiled or runs at import,
those of its room), each time in a fork of a process that has what the package imports. A change
that no test fails on survives; survivors are printed with the changed line.

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
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

import numba
import numpy as np
import pytest
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names
from coverage import CoverageData

ROOMS = (
    "process", "variance", "estimate", "selection", "diagnosis", "readers", "ins",
    "calibration budget export",
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
    """Leaves out what forbids and computes nothing: zip(strict=True), dataclass(frozen=True)."""

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
            os.environ |= {"PYTHONPATH": str(tree / "src"), "NUMBA_CACHE_DIR": str(loops)}
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


def traced(tree: Path, folder: Path) -> CoverageData:
    """Which test functions pass through which line."""
    file = folder / "coverage"
    if not file.exists():
        settings = folder / "coverage.ini"
        settings.write_text(
            f"[run]\nsource = {tree}/src/gmwm\ndata_file = {file}\n"
            "dynamic_context = test_function\n"
        )
        command = (sys.executable, "-m", "coverage", "run", f"--rcfile={settings}", "-m", "pytest")
        options = ("-q", "-p", "no:cacheprovider", "-o", "addopts=-m 'not slow'", "tests/unit")
        environment = {**os.environ, "PYTHONPATH": str(tree / "src")}
        subprocess.run((*command, *options), cwd=tree, env=environment, check=False)
    data = CoverageData(str(file))
    data.read()
    return data


def tests_of(mutant: Mutant, tree: Path, data: CoverageData) -> list[str]:
    """Test functions through its line, those of its own room first; or its room's files."""
    contexts = data.contexts_by_lineno(str(tree / mutant.path)).get(mutant.line, [])
    parts = Path(mutant.path).parts[2:]
    own = tree / "tests/unit" / parts[0]
    files = {file.stem: file for file in (tree / "tests/unit").rglob("test_*.py")}
    found = []
    for context in contexts:
        names = context.split(".")
        module = next((name for name in names if name in files), None)
        if module is not None:
            rest = names[names.index(module) + 1 :]
            found.append(
                (not files[module].is_relative_to(own), "::".join([str(files[module]), *rest]))
            )
    return [name for _, name in sorted(set(found))] or [str(own)]


def survives(mutant: Mutant, tree: Path, tests: Sequence[str], longest: float) -> bool | None:
    """Whether no test fails; None if they take too long, by the change or by the machine's load."""
    file = tree / mutant.path
    source, stamps = file.read_text(), file.stat()
    changed = mutate_code(source, get_operator(mutant.operator)(), mutant.occurrence)
    loops = tree.parent / "loops"
    try:
        file.write_text(changed)
        if "@compiled" not in source:
            code = tested(tree, tests, loops, longest)
        else:
            with TemporaryDirectory() as own:  # what is compiled of the change is not kept
                code = tested(tree, tests, Path(own), longest)
    finally:
        file.write_text(source)
        os.utime(file, ns=(stamps.st_atime_ns, stamps.st_mtime_ns))
    if code in _NO_TESTS:  # a failure, too, if without the change there are some
        return None if tested(tree, tests, loops, longest, "--collect-only") else False
    return None if code is None else code == 0


def main() -> None:
    """Draw, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--mutants", type=int, default=304)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rooms", nargs="+", default=ROOMS, choices=ROOMS)
    longest = "s, after which the tests of a change are stopped, which then counts for nothing"
    parser.add_argument("--longest", type=float, default=240.0, help=longest)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # so that a change is taken back
    folder = options.output.resolve()
    tree = folder / "tree"
    if not tree.exists():
        ignored = shutil.ignore_patterns(".git", ".venv", "out")
        shutil.copytree(Path(__file__).resolve().parents[1], tree, ignore=ignored)
    data = traced(tree, folder)
    for name in SLOW_TO_IMPORT:  # once, before the forks
        import_module(name)
    record = folder / "results.json"
    results = json.loads(record.read_text()) if record.exists() else {}
    for mutant in drawn(tree, options.mutants, options.seed, options.rooms):
        key = json.dumps(asdict(mutant))
        if key not in results:
            results[key] = survives(mutant, tree, tests_of(mutant, tree, data), options.longest)
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
