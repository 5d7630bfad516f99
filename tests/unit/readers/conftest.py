"""Small files to read."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

Writer = Callable[..., Path]


@pytest.fixture
def samples() -> np.ndarray:
    """80 samples of six axes, with few digits so that text gives them back exactly."""
    return np.round(np.random.default_rng(5).normal(size=(80, 6)), 5)


@pytest.fixture
def write(tmp_path: Path) -> Writer:
    """Write rows of numbers as text."""

    def _write(
        rows: np.ndarray,
        header: str | None = None,
        name: str = "static.csv",
        delimiter: str = ",",
        end: str = "\n",
        decimal: str = ".",
        last: str = "",
        before: str = "",
        after: str = "",
    ) -> Path:
        lines = [
            delimiter.join(map(repr, row)).replace(".", decimal) + last
            for row in np.atleast_2d(rows).astype(float).tolist()
        ]
        if header is not None:
            lines.insert(0, header)
        data = (before + end.join(lines) + end + after).encode()
        path = tmp_path / name
        path.write_bytes(gzip.compress(data) if name.endswith(".gz") else data)
        return path

    return _write


# These tests write files with the libraries of the extras, which `.[test]` installs. Where the
# lowest versions are tested, the extras are absent.
collect_ignore = [
    file
    for file, modules in {
        "logs/test_damaged_logs.py": ("pyulog",),
        "logs/test_read_rosbag.py": ("rosbags",),
        "formats/test_read_frames.py": ("rosbags", "h5py", "polars"),
        "logs/test_read_flight_logs.py": ("rosbags", "pyulog", "pymavlink"),
    }.items()
    if not all(map(find_spec, modules))
]
