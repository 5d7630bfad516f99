"""Array types, and products of long arrays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
ArrayLike = npt.ArrayLike
"""What becomes an array of numbers, such as a list of them."""
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

Progress = Callable[[int, int, str], None]
"""Called with how many are done, of how many, and what is being worked on (may be empty)."""


def inner(a: FloatArray, b: FloatArray) -> float:
    """Sum of products.

    In one thread: the threads of a BLAS cost more than this little work where other programs keep
    the processor busy.
    """
    return float(np.einsum("i,i->", a, b))
