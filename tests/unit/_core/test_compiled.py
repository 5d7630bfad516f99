"""Compiled loops: what is kept on disk, and where nothing can be written."""

from __future__ import annotations

import importlib
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import gmwm
from gmwm._core import compiled

_SCRIPT = """
import numpy as np
import gmwm.process.kinds.noise, gmwm.variance
print(gmwm.__file__)
x = np.random.default_rng(1).normal(size=4096)
print(gmwm.variance.wavelet_variance(x, dt=1.0).variance[0])
"""


def _installed_read_only(folder: Path) -> Path:
    """A copy of the package in which no folder for compiled code can be made."""
    source = Path(gmwm.__file__).parent
    copy = folder / "gmwm"
    shutil.copytree(source, copy, ignore=shutil.ignore_patterns("__pycache__"))
    for place in [copy, *(path for path in copy.rglob("*") if path.is_dir())]:
        (place / "__pycache__").write_text("")  # holds for the administrator too
    return folder


@pytest.mark.slow
def test_a_package_that_cannot_be_written_and_no_home(tmp_path):
    nowhere = tmp_path / "file"
    nowhere.write_text("")
    environment = {key: value for key, value in os.environ.items() if key != "LOCALAPPDATA"}
    environment |= {
        "PYTHONPATH": str(_installed_read_only(tmp_path / "site")),
        "PYTHONDONTWRITEBYTECODE": "1",
        "HOME": str(nowhere),
        "XDG_CACHE_HOME": str(nowhere / "cache"),
        "NUMBA_CACHE_DIR": str(nowhere / "numba"),
    }
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    place, value = done.stdout.split()
    assert Path(place).is_relative_to(tmp_path)
    assert float(value) > 0.0
    assert done.stderr.count("NUMBA_CACHE_DIR") == 1
    assert "Traceback" not in done.stderr


_CALLEE = "from gmwm._core.compiled import compiled\n@compiled()\ndef inner():\n    return {}\n"
_CALLER = """
from typing import NamedTuple
from gmwm._core.compiled import compiled
from stale_callee import inner
from stale_tuning import HALF, OTHER
class Pair(NamedTuple):
    {}: float
    {}: float
@compiled()
def outer(pair):
    return inner() + HALF + 0.001 * pair.first
x = OTHER
"""


def test_a_loop_is_compiled_anew_after_what_it_holds_changed_and_only_then(tmp_path, monkeypatch):
    """The code of a loop that it calls, a constant of another file, the fields of its record."""
    monkeypatch.syspath_prepend(tmp_path)
    tuning, fields = "HALF, OTHER = {}, {}", ("first", "last")
    for number, constants, names, value, is_kept in (
        ("1.5", ("0.25", "0"), fields, 1.751, False),
        ("1.5", ("0.25", "0"), fields, 1.751, True),
        ("1.5", ("0.25", "77"), fields, 1.751, True),
        ("22.5", ("0.25", "77"), fields, 22.751, False),
        ("22.5", ("0.125", "77"), fields, 22.626, False),
        ("22.5", ("0.125", "77"), fields[::-1], 22.627, False),
    ):
        (tmp_path / "stale_callee.py").write_text(_CALLEE.format(number))
        (tmp_path / "stale_tuning.py").write_text(tuning.format(*constants))
        (tmp_path / "stale_caller.py").write_text(_CALLER.format(*names))
        os.utime(tmp_path / "stale_caller.py", (0, 0))  # numba looks at it
        for name in ("callee", "tuning", "caller"):
            sys.modules.pop(f"stale_{name}", None)
        for bytecode in tmp_path.rglob("*.pyc"):
            bytecode.unlink()
        importlib.invalidate_caches()
        caller = importlib.import_module("stale_caller")
        assert caller.outer(caller.Pair(1.0, 2.0)) == pytest.approx(value)
        assert (sum(caller.outer.stats.cache_hits.values()) == 1) is is_kept


_BOTH = """
import sys, time
from pathlib import Path
from once_loop import inner
here = Path(sys.argv[1])
(here / f"ready-{sys.argv[2]}").touch()
while len(list(here.glob("ready-*"))) < 2:
    time.sleep(0.01)
inner()
print(sum(inner.stats.cache_misses.values()), sum(inner.stats.cache_hits.values()))
"""


def test_of_two_processes_one_compiles_and_the_other_loads_it(tmp_path):
    (tmp_path / "once_loop.py").write_text(_CALLEE.format("1.5"))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    began = [
        subprocess.Popen(
            [sys.executable, "-c", _BOTH, tmp_path, str(i)], env=environment, text=True,
            stdout=subprocess.PIPE,
        )
        for i in range(2)
    ]  # fmt: skip
    counts = sorted(each.communicate(timeout=120)[0].split() for each in began)
    assert counts == [["0", "1"], ["1", "0"]]
    assert not list(tmp_path.rglob("*.lock"))


def test_an_interrupt_that_is_swallowed_while_compiling_is_one():
    def swallowed():
        try:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1.0)
        except KeyboardInterrupt:
            pass

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), compiled._interruptible():
        swallowed()
        raise RuntimeError("no compiled object yet")
    with pytest.raises(KeyboardInterrupt), compiled._interruptible():
        swallowed()
    with pytest.raises(RuntimeError, match="ours"), compiled._interruptible():
        raise RuntimeError("ours")
    assert signal.getsignal(signal.SIGINT) is before
