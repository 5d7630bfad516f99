"""Arrays of a long record on disk, so that memory does not grow with its length."""

from __future__ import annotations

import mmap
import tempfile
from collections.abc import Iterator

import numpy as np

from gmwm._core.typing import FloatArray

ROWS = 1 << 16
"""Of a window: half a MB a column."""


class Spool:
    """Rows of numbers in a temporary file, which vanishes with the last array of it.

    width: Numbers in a row.
    """

    def __init__(self, width: int) -> None:
        # It has to outlive this call: the arrays lie in it.
        self._file = tempfile.TemporaryFile()  # noqa: SIM115
        self._width, self.n = width, 0

    def append(self, rows: FloatArray) -> None:
        """Add rows, (n, width)."""
        self._file.write(np.ascontiguousarray(rows, dtype=float).data)
        self.n += len(rows)

    def array(self) -> FloatArray:
        """All rows, (n, width), read from the file where they are used."""
        self._file.flush()
        shape = (self.n, self._width)
        return np.asarray(np.memmap(self._file, float, "r+", shape=shape))

    def __del__(self) -> None:
        # A map holds the file itself.
        self._file.close()


def windows(n: int) -> Iterator[slice]:
    """Consecutive rows of ``n``, some at a time."""
    for begin in range(0, n, ROWS):
        yield slice(begin, min(begin + ROWS, n))


def release(array: FloatArray) -> None:
    """Give back the memory of what was read of an array on disk; nothing to do for any other."""
    if (held := _mapped(array)) is not None and hasattr(mmap, "MADV_DONTNEED"):
        held.madvise(mmap.MADV_DONTNEED)


def is_spooled(array: FloatArray) -> bool:
    """Whether an array lies on disk."""
    return _mapped(array) is not None


def _mapped(array: FloatArray) -> mmap.mmap | None:
    held: object = array
    while held is not None and not isinstance(held, mmap.mmap):
        held = getattr(held, "base", None)
    return held
