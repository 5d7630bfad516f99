"""Array types, and products of long arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
ArrayLike = npt.ArrayLike
"""What becomes an array of numbers, such as a list of them."""
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

Progress = Callable[[int, int, str], None]
"""Called with how many are done, of how many, and what is being worked on (may be empty)."""


def inner(a: npt.NDArray[Any], b: npt.NDArray[Any]) -> float:
    """Sum of products, in double precision.

    In one thread: the threads of a BLAS cost more than this little work where other programs keep
    the processor busy.
    """
    return float(np.einsum("i,i->", a, b, dtype=np.float64))


def known_of(values: FloatArray) -> FloatArray:
    """Those that are not NaN: the array itself, not a copy, where none is."""
    missing = np.isnan(values)
    return values[~missing] if np.any(missing) else values
