"""What every test runs under."""

import gc
import os
import signal
import sys
from collections import defaultdict
from pathlib import Path

# Before numpy is imported: as many workers as cores, each with threads of its own, wait for each
# other more than they compute.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
from hypothesis import settings

# Without bytecode every worker rewrites the assertions of all tests anew, and every process that
# a test starts compiles the package. It stands in __pycache__ beside the compiled kernels.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# A shell has what it runs in the background ignore interrupts, and so would what tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)

# A suite that fails one day in fifty teaches people to run it again; the bounds of statistical
# properties hold with a probability. `pytest --hypothesis-profile explore` draws examples anew.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("explore", deadline=None, max_examples=500)
settings.load_profile("fixed")


# A fifth of the time went into looking again and again for garbage among all that was imported.
gc.set_threshold(50_000, 20, 20)


def pytest_collection_finish():
    gc.collect()
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Of stacked parametrizations run cases in which every value occurs; the others are slow."""
    functions = defaultdict(list)
    for item in items:
        if hasattr(item, "callspec") and not item.get_closest_marker("slow"):
            functions[item.nodeid.partition("[")[0]].append(item)
    for cases in functions.values():
        for item in _beyond_covering(cases) if len(cases) > FEW else ():
            item.add_marker(pytest.mark.slow)


FEW = 4
"""Combinations that are all run."""


def _beyond_covering(cases):
    """Cases off the diagonal of the product whose values occur in others."""
    rows = [_values(case) for case in cases]
    factors = [list(dict.fromkeys(column)) for column in zip(*rows, strict=True)]
    longest = max(map(len, factors), default=1)
    diagonal = {tuple(each[k % len(each)] for each in factors) for k in range(longest)}
    seen = {value for row in diagonal & set(rows) for value in enumerate(row)}
    beyond = []
    for case, row in zip(cases, rows, strict=True):
        if row in diagonal:
            continue
        if seen.issuperset(enumerate(row)):
            beyond.append(case)
        seen.update(enumerate(row))
    return beyond


def _values(case):
    """Which value of each of its parametrizations a case has."""
    values = []
    for mark in case.iter_markers("parametrize"):
        names = mark.kwargs["argnames"] if not mark.args else mark.args[0]
        names = names.split(",") if isinstance(names, str) else names
        values.append(tuple(id(case.callspec.params[name.strip()]) for name in names))
    return tuple(values)


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run ``gmwm ARGUMENTS`` in an empty folder: exit code, what was printed, what was reported."""
    from gmwm import cli

    for name in ("FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tmp_path)

    def _run(*arguments):
        monkeypatch.setattr(sys, "argv", ["gmwm", *map(str, arguments)])
        code = 0
        try:
            cli.main()
        except SystemExit as stop:
            code = stop.code
        return code, *capsys.readouterr()

    return _run


@pytest.fixture
def interpreted_pyins(monkeypatch):
    """The loop of pyins without numba, which takes longer to compile than a flight of minutes."""
    loops = pytest.importorskip("pyins._numba_integrate")
    monkeypatch.setattr("pyins.strapdown.integrate", loops.integrate.py_func)
    for name in ("gravity", "mat_from_rotvec"):
        monkeypatch.setattr(loops, name, getattr(loops, name).py_func)


@pytest.fixture
def closed_figures():
    yield
    import matplotlib.pyplot as plt

    plt.close("all")


@pytest.fixture
def no_pages(monkeypatch):
    """Pages take most of the time of a command: tests that do not look at one go without."""
    from gmwm.calibration.calibration import Calibration
    from gmwm.ins import Navigated
    from gmwm.ins.simulation.validation import Validation
    from gmwm.motion import InMotion

    def empty(self, path, *_, **__):
        Path(path).touch()
        return path

    for each in (Calibration, InMotion, Navigated, Validation):
        monkeypatch.setattr(each, "report", empty)
