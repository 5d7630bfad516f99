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
from gmwm._core.compiled import compiled
from {0}_callee import inner
@compiled()
def outer():
    return inner()
"""


def test_a_loop_is_compiled_anew_after_what_it_calls_changed(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "stale_caller.py").write_text(_CALLER.format("stale"))
    values = []
    for text, stamp in (("1.5", b"old"), ("22.5", b"new"), ("22.5", b"new")):
        (tmp_path / "stale_callee.py").write_text(_CALLEE.format(text))
        monkeypatch.setattr(compiled, "digest_of", lambda _, stamp=stamp: stamp)
        for name in ("stale_callee", "stale_caller"):
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        caller = importlib.import_module("stale_caller")
        values.append(caller.outer())
        hits = caller.outer.stats.cache_hits
    assert values == [1.5, 22.5, 22.5]
    assert sum(hits.values()) == 1  # the third time from the disk


def test_the_stamp_changes_with_each_compiled_file_and_with_the_constants_that_one_names(tmp_path):
    texts = {
        "_core/__init__.py": "1", "a.py": "@compiled()\ndef f():\n    return tuning.LEAST * HALF",
        "b/tuning.py": "MOST, LEAST = 2, 1", "b/half.py": "_ALL = 4\nHALF: float = _ALL / 2",
        "b/other.py": "OTHER = 1\ny = HALF",
    }  # fmt: skip
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    digest = compiled.digest_of.__wrapped__
    first = digest(tmp_path)
    for name, text in texts.items():
        (tmp_path / name).write_text(text + " ")
        assert (digest(tmp_path) != first) == (name != "b/other.py"), name
        (tmp_path / name).write_text(text)
    assert digest(tmp_path) == first


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
