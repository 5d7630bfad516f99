"""Numbers by which rows of samples are known again."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from gmwm._core.typing import FloatArray

RowKeys = NDArray[np.uint64]

MIXED = np.uint64(0x9E3779B97F4A7C15)
"""2^64 over the golden ratio, odd: neighbouring numbers go far apart (Knuth, *The Art of Computer
Programming* 3, sec. 6.4)."""


def row_keys(columns: Iterable[FloatArray]) -> RowKeys:
    """A number for each row, the same for the same values.

    columns: One at least, of (n,).
    """
    keys: RowKeys = np.zeros(1, dtype=np.uint64)
    for values in columns:
        keys = keys ^ np.ascontiguousarray(values, dtype=float).view(np.uint64)
        # Numbers of few digits differ in their highest bits alone.
        for _ in range(2):
            keys *= MIXED
            keys ^= keys >> np.uint64(29)
    return keys
