"""One thread for the products of small matrices, whoever set how many there are."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from threading import Lock
from typing import Any

_LINKED = ("numpy.linalg.lapack_lite", "scipy.linalg.cython_blas")
"""Compiled modules, each linked to the BLAS of its package, through which that is found."""

_FUNCTIONS = ("scipy_openblas_{}_num_threads{}", "openblas_{}_num_threads{}")
_SUFFIXES = ("64_", "")  # of builds with long integers, as those of numpy

_lock = Lock()
_within = 0
_before: list[int] = []


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let OpenBLAS work in one thread within the block, or the function that this decorates.

    Matrices here are small: threads for each product cost three times what the work does, and more
    where other programs keep the processors busy. Of blocks side by side the last one to end sets
    what was before. Another BLAS is left as it is.
    """
    global _within
    with _lock:
        _within += 1
        if _within == 1:
            _before[:] = [get() for get, _ in _libraries()]
            for _, set_number in _libraries():
                set_number(1)
    try:
        yield
    finally:
        with _lock:
            _within -= 1
            if not _within:
                for (_, set_number), number in zip(_libraries(), _before, strict=True):
                    set_number(number)


@cache
def _libraries() -> list[tuple[Callable[[], int], Callable[[int], Any]]]:
    """What tells and sets the number of threads of each BLAS."""
    found = []
    for module in _LINKED:
        try:
            linked = ctypes.CDLL(import_module(module).__file__)
        except (ImportError, OSError):
            continue
        for name in _FUNCTIONS:
            for suffix in _SUFFIXES:
                get = getattr(linked, name.format("get", suffix), None)
                set_number = getattr(linked, name.format("set", suffix), None)
                if get is not None and set_number is not None:
                    found.append((get, set_number))
    return found
