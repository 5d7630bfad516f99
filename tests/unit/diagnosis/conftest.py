"""Recordings of one channel or a few."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from gmwm import Recording

Maker = Callable[..., Recording]


@pytest.fixture
def record() -> Maker:
    """Recording of channels in SI units at 100 Hz."""

    def _record(rate: float = 100.0, **channels: np.ndarray) -> Recording:
        units = {"gyro": "rad/s", "accel": "m/s^2"}
        return Recording.from_arrays(channels, rate, units, source="bench.csv")

    return _record
