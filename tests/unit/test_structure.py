"""The house: rooms with faces, one direction, and limits that keep it readable."""

import ast
import re
import sys
from collections import defaultdict
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import get_args, get_type_hints

from gmwm.issues import CATALOGUE, SEVERITIES, Issue
from places import REPOSITORY

ROOT = REPOSITORY / "src" / "gmwm"
FILES = sorted(ROOT.rglob("*.py"))
NATURAL = {"process.base", "process.model"}
"""A Process makes a Model with +, and a Model is made of Processes."""

INNER = ("estimate", "ins")
"""Rooms whose own rooms have faces for other rooms, and import each other directly."""


def dotted(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def tree(path):
    return ast.parse(path.read_text())


MODULES = {dotted(path) for path in FILES}
PACKAGES = {dotted(path) for path in FILES if path.name == "__init__.py"}
FACES = {
    dotted(path): {
        alias.asname or alias.name
        for node in tree(path).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    for path in FILES
    if path.name == "__init__.py"
}
"""Names that the rooms show; a function may have the name of its file."""


@cache
def imports(path):
    """Modules of the package that a file imports when it runs."""
    return set(_imports(path))


def _imports(path):
    typing_only = {
        id(node)
        for branch in ast.walk(tree(path))
        if isinstance(branch, ast.If) and "TYPE_CHECKING" in ast.dump(branch.test)
        for node in ast.walk(branch)
    }
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.ImportFrom) and id(node) not in typing_only:
            module = (node.module or "").removeprefix("gmwm").removeprefix(".")
            if not (node.module or "").startswith("gmwm"):
                continue
            for alias in node.names:
                below = f"{module}.{alias.name}".removeprefix(".")
                named = alias.name in FACES.get(module, ())
                yield module if named or below not in MODULES else below


def circles(graph):
    """Strongly connected components of more than one file (Tarjan's algorithm, by recursion)."""
    index, low, stack, found = {}, {}, [], []

    def visit(node):
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in graph[node]:
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            component = set()
            while node not in component:
                component.add(stack.pop())
            if len(component) > 1:
                found.append(component)

    for node in list(graph):
        if node not in index:
            visit(node)
    return found


def test_files_import_each_other_in_one_direction_only():
    graph = defaultdict(set)
    for path in FILES:
        graph[dotted(path)] |= imports(path) - {dotted(path), ""}
    assert circles(graph) == [NATURAL]


def room(name):
    """Where a module lives, as far as others must not look inside."""
    parts = name.split(".")
    depth = len(parts) if name in PACKAGES else len(parts) - 1
    return ".".join(parts[: min(depth, 2 if parts[0] in INNER else 1)])


def test_outsiders_import_faces_only():
    """But the package's own ``__init__``, which says where pages are made."""
    looks = [(dotted(path), name) for path in FILES for name in imports(path) - PACKAGES]
    looks = [
        (own, name) for own, name in looks if own.split(".")[0] not in ("", name.split(".")[0])
    ]
    free = ("", "_core", *INNER)
    assert not [(own, name) for own, name in looks if room(name) not in (*free, room(own))]


LINES = {
    "": 400, "_core": 2_250, "process": 3_150, "readers": 5_600, "plotting": 750,
    "variance": 4_650, "diagnosis": 3_350, "estimate": 8_150, "selection": 1_200,
    "calibration": 3_370, "motion": 1_800, "datasheet": 700, "filter_numbers": 3_700, "ins": 9_530,
    "population": 2_550, "export": 1_400, "report": 2_550, "study": 1_800, "cli": 2_290,
}  # fmt: skip
"""Most lines of Python of each room; only a new kind or room raises one."""

LONGEST_FUNCTION, MOST_PARAMETERS, MOST_SKIPS = 60, 8, 20


def test_no_room_grows_and_nothing_stands_loose():
    lines = defaultdict(int)
    for path in FILES:
        folder = path.relative_to(ROOT).parts[:-1]
        lines[folder[0] if folder else ""] += path.read_text().count("\n")
    assert {room: count for room, count in lines.items() if count > LINES[room]} == {}
    loose = {path.name for path in ROOT.glob("*.py")}
    assert loose == {"__init__.py", "__main__.py", "errors.py", "issues.py"}


@cache
def definitions():
    """Classes, and functions that are no kernels, each with its file."""
    classes, functions = [], []
    for path in FILES:
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ClassDef):
                classes.append((path, node))
            elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                is_kernel = any("compiled" in ast.unparse(each) for each in node.decorator_list)
                functions += [] if is_kernel else [(path, node)]
    return classes, functions


def length(function):
    """Lines without the docstring."""
    first = function.body[0]
    is_text = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    doc = first.end_lineno - first.lineno + 1 if is_text else 0
    return function.end_lineno - function.lineno + 1 - doc


def test_functions_can_be_read_at_once():
    _, functions = definitions()
    assert [(path.name, f.name) for path, f in functions if length(f) > LONGEST_FUNCTION] == []


def test_functions_have_few_parameters():
    """Options of commands are parameters; `read` and filter numbers have many keywords."""
    wide = {
        f"{path.parent.name}.{f.name}"
        for path, f in definitions()[1]
        if "cli" not in path.parts
        and len([*f.args.posonlyargs, *f.args.args, *f.args.kwonlyargs]) > MOST_PARAMETERS
    }
    assert wide <= {
        "readers.read",
        *(f"filter_numbers.{n}" for n in ("bound", "certify", "reduce")),
    }


def test_the_formatter_is_not_fought():
    assert sum(path.read_text().count("fmt: skip") for path in FILES) <= MOST_SKIPS


def test_tests_mirror_the_rooms():
    """And have names of their own: pytest imports no second file of one name."""
    tests = REPOSITORY / "tests" / "unit"
    names = [path.name for path in tests.parent.rglob("test_*.py")]
    assert [name for name in set(names) if names.count(name) > 1] == []
    folders = {path.parent.relative_to(tests) for path in tests.rglob("test_*.py")}
    rooms = {Path(name.replace(".", "/")) for name in PACKAGES | MODULES}
    assert folders <= rooms


def test_no_script_stands_in_front_of_a_package():
    # Python looks beside a script first: numba imports `coverage`, and would find ours.
    folders = (REPOSITORY / "benchmarks", REPOSITORY / "examples")
    scripts = {path.stem for folder in folders for path in folder.glob("*.py")}
    taken = set(sys.stdlib_module_names) | set(packages_distributions()) | {"coverage"}

    assert scripts.isdisjoint(taken)


def test_where_things_are_added_is_there():
    """Files and names that CONTRIBUTING.md and the page on architecture quote."""
    _, lists = (REPOSITORY / "CONTRIBUTING.md").read_text().split("\n## Adding something\n")
    pages = lists.split("\n## Tests\n")[0]
    pages += (REPOSITORY / "docs" / "architecture.md").read_text()
    quoted = set(re.findall(r"`([^`\n]+)`", pages))
    assert len(quoted) > 50
    places = [REPOSITORY, REPOSITORY / "tests" / "unit", ROOT]
    known = {f"{file}" for place in places[1:] for file in place.rglob("*.*")}
    code = "\n".join(file.read_text() for file in [*FILES, *ROOT.rglob("*.pyi")])
    for text in quoted:
        place = text.removeprefix("python ").rstrip("/")
        if "/" in text or place.endswith((".py", ".pyi", ".md", ".toml")):
            ending = f"/{place}"
            exists = any((base / place).exists() for base in places)
            assert exists or any(file.endswith(ending) for file in known), text
        else:
            for name in re.findall(r"[A-Za-z_]\w+", text):
                assert re.search(rf"\b{name}", code), f"{name} of `{text}` is gone"


def test_what_was_found_does_not_change():
    """Dataclasses are frozen."""
    thawed = [
        f"{file.name}: {node.name}"
        for file, node in definitions()[0]
        for decorator in map(ast.unparse, node.decorator_list)
        if decorator.startswith("dataclass") and "frozen=True" not in decorator
    ]
    assert thawed == []


def test_the_catalogue_says_of_each_issue_what_programs_can_know():
    """That no code stands twice, the reader of the file ensures."""
    assert len(CATALOGUE) > 100
    allowed = {name: get_args(kind) for name, kind in get_type_hints(Issue).items()}
    for code, issue in CATALOGUE.items():
        assert re.fullmatch("[a-z]+(-[a-z]+)*", code) and issue.sentence
        assert issue.severity in SEVERITIES and issue.topic in allowed["topic"]
        assert issue.repeats in allowed["repeats"]
        assert set(issue.spoils) <= {"gyro", "accel", "channel"}
