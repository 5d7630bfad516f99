"""The package as an object: what other processes get of functions that use it."""

import sys

import pytest

import gmwm
import gmwm.export
import gmwm.ins

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
