"""Memory that a process keeps for its next arrays."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

_GIVEN = "MALLOC_TRIM_THRESHOLD_"
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # of mallopt, as malloc.h has them
_KEPT, _LARGEST = 256 << 20, 32 << 20  # bytes; the latter is the most that glibc takes


@contextmanager
def memory_kept() -> Iterator[None]:
    """Let the C library keep what arrays leave within the block, and give it back at its end.

    The nannies of Dask set `MALLOC_TRIM_THRESHOLD_` to 64 kB. With that, glibc takes each array of
    more than 128 kB from the system and gives it back, page by page, which costs a calibration
    more than its own work. Where the variable is not set, nothing is changed.
    """
    library = _library() if _GIVEN in os.environ else None
    if library is None:
        yield
        return
    library.mallopt(_TRIM_THRESHOLD, _KEPT)
    library.mallopt(_MMAP_THRESHOLD, _LARGEST)
    try:
        yield
    finally:
        library.malloc_trim(0)


@cache
def _library() -> Any:
    """The C library, if it is glibc."""
    if sys.platform != "linux":
        return None
    with suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        if library.mallopt and library.malloc_trim:
            return library
    return None
