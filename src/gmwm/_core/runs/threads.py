"""One thread for the products of small matrices, whoever set how many there are."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from threading import Lock
from typing import Any

_lock = Lock()
_within: list[Any] = []
"""One entry for each block that runs: the first has the limits to be taken off."""


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let the BLAS work in one thread within the block, or the function that this decorates.

    Matrices here are small: threads for each product cost three times what the work does, and more
    where other programs keep the processors busy. Of blocks side by side the last one to end sets
    what was before.
    """
    with _lock:
        _within.append(None if _within else _controller().limit(limits=1, user_api="blas"))
    try:
        yield
    finally:
        with _lock:
            last = _within[0] if len(_within) == 1 else None
            _within.pop()
            if last is not None:
                last.restore_original_limits()


@cache
def _controller() -> Any:
    """Of all that is loaded; looking for it takes milliseconds."""
    from threadpoolctl import ThreadpoolController

    import_module("scipy.linalg")  # has a BLAS of its own, found only once it is loaded
    return ThreadpoolController()
