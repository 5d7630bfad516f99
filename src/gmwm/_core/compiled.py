"""Compilation of hot loops, with a cache on disk where there is a place for one."""

from __future__ import annotations

import hashlib
import logging
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from threading import current_thread, main_thread
from types import FrameType
from typing import Any

import numba
from numba.core.compiler_lock import global_compiler_lock

_CONSTANT = re.compile(rb"\b[A-Z][A-Z0-9_]+\b")
_LONGEST_WAIT = 60.0  # s, for a process that compiles the same loop
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
    """Let what is kept on disk count as long as no compiled file changes, and be made once.

    Numba looks at the file of the function only. A loop holds the code and the constants of what it
    calls, so after an upgrade that changed another file it would go on with the old ones.
    """
    kept = getattr(getattr(loop, "_cache", None), "_cache_file", None)
    if kept is not None:
        kept._source_stamp = digest_of(Path(__file__).parents[1])
        load_index = kept._load_index

        def load_readable_index() -> Any:
            """What is kept, or nothing if it names a record class that was renamed since."""
            try:
                return load_index()
            except (AttributeError, ImportError):
                return {}

        kept._load_index = load_readable_index
        compile_now, index = loop.compile, Path(kept._index_path)

        def compile_once(signature: Any) -> Any:
            with _alone(index):
                return compile_now(signature)

        loop.compile = compile_once
    return loop


@contextmanager
def _alone(index: Path) -> Iterator[None]:
    """Wait for a process that compiles the same loop for the first time, and load what it made.

    index: Of what is kept of the loop. Where there is one, nobody waits.
    """
    if index.exists():
        yield
        return
    from filelock import FileLock

    lock = index.with_suffix(".lock")
    # Threads take numba's own lock first, in this order, so that no two wait for each other.
    with global_compiler_lock, ExitStack() as held:
        # No folder, none that knows locks, or a process that holds one and does not go on.
        with suppress(OSError, RuntimeError):
            index.parent.mkdir(parents=True, exist_ok=True)
            held.enter_context(FileLock(lock, timeout=_LONGEST_WAIT, is_singleton=True))
        with _interruptible():
            yield
    with suppress(OSError):
        lock.unlink()


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let an interrupt end the block as one, where LLVM swallows it and numba fails for it."""
    before = signal.getsignal(signal.SIGINT)
    if current_thread() is not main_thread() or not callable(before):
        yield
        return
    seen = False

    def noted(number: int, frame: FrameType | None) -> None:
        nonlocal seen
        seen = True
        before(number, frame)

    signal.signal(signal.SIGINT, noted)
    try:
        yield
    except RuntimeError:
        if not seen:
            raise
    finally:
        signal.signal(signal.SIGINT, before)
    if seen:
        raise KeyboardInterrupt


@lru_cache(maxsize=1)
def digest_of(package: Path) -> bytes:
    """Of the version, and of each file with a compiled function or a constant that one may hold."""
    texts = {file: file.read_bytes() for file in sorted(package.rglob("*.py"))}
    loops = {file: text for file, text in texts.items() if b"@compiled" in text}
    named = set(_CONSTANT.findall(b"".join(loops.values())))
    digest = hashlib.sha256(texts[package / "_core" / "__init__.py"])
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
