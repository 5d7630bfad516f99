"""Compilation of hot loops, with a cache on disk where there is a place for one."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function with numba, without the lock of the interpreter.

    What is compiled is kept in the folder of the package or that of the user's caches. Where
    neither can be written (containers, service users), each process compiles anew.

    **options: Of `numba.njit`, beside ``cache`` and ``nogil``.
    """

    def compile_it(function: Callable[..., Any]) -> Any:
        try:
            return _stamped(numba.njit(cache=True, nogil=True, **options)(function))
        except RuntimeError:  # numba's "cannot cache function: no locator available"
            _warn()
            return numba.njit(nogil=True, **options)(function)

    return compile_it


def _stamped(loop: Any) -> Any:
    """Let what is kept on disk count as long as no compiled file changes.

    Numba looks at the file of the function only. A loop holds the code and the constants of what it
    calls, so after an upgrade that changed another file it would go on with the old ones.
    """
    kept = getattr(getattr(loop, "_cache", None), "_cache_file", None)
    if kept is not None:
        kept._source_stamp = digest_of(Path(__file__).parents[1])
    return loop


@lru_cache(maxsize=1)
def digest_of(package: Path) -> bytes:
    """Of the version, of the constants and of each file with a compiled function."""
    digest = hashlib.sha256()
    for file in sorted(package.rglob("*.py")):
        text = file.read_bytes()
        if b"@compiled" in text or file.name == "tuning.py" or file == package / "__init__.py":
            digest.update(text)
    return digest.digest()


@lru_cache(maxsize=1)
def _warn() -> None:
    """Say it once."""
    logging.getLogger("gmwm").warning(
        "no folder for compiled code can be written, so each run compiles again, for up to a "
        "minute: set NUMBA_CACHE_DIR to a folder that can"
    )
