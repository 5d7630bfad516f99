"""The package as an object: what other processes get of functions that use it."""

import ast
import sys
from importlib import import_module

import pytest

import gmwm
import gmwm.export
import gmwm.ins
from places import REPOSITORY

cloudpickle = pytest.importorskip("cloudpickle")


@pytest.mark.parametrize("name", ["gmwm", "gmwm.ins", "gmwm.export"])
def test_a_module_goes_to_another_process_by_name(name):
    module = sys.modules[name]
    assert cloudpickle.loads(cloudpickle.dumps(module)) is module


def test_a_function_that_uses_the_package_does_too():
    source = "def white(seed):\n    return gmwm.simulate(gmwm.WhiteNoise(1.0), 8, 1.0, seed)\n"
    names = {"gmwm": gmwm, "__name__": "__main__"}
    exec(source, names)
    assert cloudpickle.loads(cloudpickle.dumps(names["white"]))(1).size == 8


def test_programs_of_benchmarks_import_names_that_exist():
    """They print the tables of the documentation, and no other test runs them."""
    for path in sorted((REPOSITORY / "benchmarks").glob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("gmwm"):
                names = [each.name for each in node.names]
                room = import_module(node.module)
                lacking = [name for name in names if not hasattr(room, name)]
                assert not lacking, f"{path.name}: {node.module} has no {lacking}"
