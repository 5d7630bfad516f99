"""Compiled loops where nothing can be written."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import gmwm

_SCRIPT = """
import numpy as np
import gmwm.process.noise, gmwm.variance
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
