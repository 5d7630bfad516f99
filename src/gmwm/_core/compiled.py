"""Compilation of hot loops, with a cache on disk where there is a place for one."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numba


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function with numba, without the lock of the interpreter.

    What is compiled is kept in the folder of the package or that of the user's caches. Where
    neither can be written (containers, service users), each process compiles anew.

    Parameters
    ----------
    **options
        Of `numba.njit`, beside ``cache`` and ``nogil``.
    """

    def compile_it(function: Callable[..., Any]) -> Any:
        try:
            return numba.njit(cache=True, nogil=True, **options)(function)
        except RuntimeError:  # numba's "cannot cache function: no locator available"
            _warn()
            return numba.njit(nogil=True, **options)(function)

    return compile_it


@lru_cache(maxsize=1)
def _warn() -> None:
    """Say it once."""
    logging.getLogger("gmwm").warning(
        "no folder for compiled code can be written, so each run compiles again, for up to a "
        "minute: set NUMBA_CACHE_DIR to a folder that can"
    )
