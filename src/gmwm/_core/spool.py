"""Arrays of a long record on disk, so that memory does not grow with its length."""

import mmap
import os
import shutil
import tempfile
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError

ROWS = 1 << 16
"""Rows of a window: half a MB a column."""

_LEFT_FREE = 64 << 20  # bytes of the disk: other programs need some


class Spool:
    """Rows of some numbers in a temporary file, which vanishes with the last array of it."""

    def __init__(self, width: int) -> None:
        # It has to outlive this call: the arrays lie in it.
        self._file = tempfile.TemporaryFile()  # noqa: SIM115
        self._width, self.n = width, 0

    def append(self, rows: FloatArray) -> None:
        """Add rows, (n, width)."""
        _check_room(8 * rows.size)
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


def _check_room(size: int) -> None:
    """Raise InputError unless the disk has room for so many bytes."""
    folder = tempfile.gettempdir()
    if shutil.disk_usage(folder).free < size + _LEFT_FREE:
        raise InputError(
            f"there is no room for the samples of a long file in {folder}: set TMPDIR to a folder "
            "with more space, or read fewer channels",
            "disk-full",
        )


def alike(array: FloatArray, n: int, dtype: Any = float) -> npt.NDArray[Any]:
    """An array for ``n`` numbers, on disk if another one is."""
    if not is_spooled(array):
        return np.empty(n, dtype)
    size = n * np.dtype(dtype).itemsize
    _check_room(size)
    with tempfile.TemporaryFile() as file:  # a map holds the file itself
        if hasattr(os, "posix_fallocate"):  # a full disk would end the process where it is mapped
            os.posix_fallocate(file.fileno(), 0, size)
        return np.asarray(np.memmap(file, dtype, "r+", shape=(n,)))


def scaled(array: FloatArray, factor: float, offset: float = 0.0) -> FloatArray:
    """A new array, ``array * factor + offset``, on disk if ``array`` is."""
    result = alike(array, array.size)
    for part in windows(array.size) if is_spooled(array) else (slice(None),):
        if factor == 1.0:  # one pass
            np.add(array[part], offset, out=result[part])
        else:
            np.multiply(array[part], factor, out=result[part])
            result[part] += offset
        release(array)
        release(result)
    return result


def moved(array: npt.NDArray[Any], like: FloatArray) -> npt.NDArray[Any]:
    """The array itself, or a copy on disk if ``like`` is there."""
    if not is_spooled(like):
        return array
    result = alike(like, array.size, array.dtype)
    for part in windows(array.size):
        result[part] = array[part]
        release(result)
    return result


def windows(n: int) -> Iterator[slice]:
    """Consecutive rows of ``n``, some at a time."""
    for begin in range(0, n, ROWS):
        yield slice(begin, min(begin + ROWS, n))


def release(array: npt.NDArray[Any]) -> None:
    """Give back the memory of an array on disk that was read; others stay as they are."""
    if (held := _mapped(array)) is not None and hasattr(mmap, "MADV_DONTNEED"):
        held.madvise(mmap.MADV_DONTNEED)


def is_spooled(array: npt.NDArray[Any]) -> bool:
    """Whether an array lies on disk."""
    return _mapped(array) is not None


def _mapped(array: npt.NDArray[Any]) -> mmap.mmap | None:
    held: object = array
    while held is not None and not isinstance(held, mmap.mmap):
        held = getattr(held, "base", None)
    return held
