"""Array types, and products of long arrays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gmwm._typing import FloatArray

IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


def inner(a: FloatArray, b: FloatArray) -> float:
    """Sum of products.

    In one thread: the threads of a BLAS cost more than this little work where other programs keep
    the processor busy.
    """
    return float(np.einsum("i,i->", a, b))
