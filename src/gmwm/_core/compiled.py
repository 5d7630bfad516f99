"""Compilation of hot loops, with a cache on disk where there is a place for one."""

from __future__ import annotations

import hashlib
import logging
import re
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba

_CONSTANT = re.compile(rb"\b[A-Z][A-Z0-9_]+\b")
_DEFINED = re.compile(rb"^[A-Z][A-Z0-9_, ]*(?=[:=])", re.MULTILINE)


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
    """Of the version, and of each file with a compiled function or a constant that one may hold."""
    texts = {file: file.read_bytes() for file in sorted(package.rglob("*.py"))}
    loops = {file: text for file, text in texts.items() if b"@compiled" in text}
    named = set(_CONSTANT.findall(b"".join(loops.values())))
    digest = hashlib.sha256(texts[package / "__init__.py"])
    for file, text in texts.items():
        defined = _CONSTANT.findall(b" ".join(_DEFINED.findall(text)))
        if file in loops or not named.isdisjoint(defined):
            digest.update(text)
    return digest.digest()


@lru_cache(maxsize=1)
def _warn() -> None:
    """Say it once."""
    logging.getLogger("gmwm").warning(
        "no folder for compiled code can be written, so each run compiles again, for up to a "
        "minute: set NUMBA_CACHE_DIR to a folder that can"
    )
