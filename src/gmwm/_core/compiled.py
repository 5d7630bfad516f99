"""Compilation of hot loops, with a cache on disk where there is a place for one."""

import hashlib
import logging
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from threading import current_thread, main_thread
from types import CodeType, FrameType
from typing import Any

import numba
import numpy as np
from numba.core.compiler_lock import global_compiler_lock

_LONGEST_WAIT = 60.0  # s, for a process that compiles the same loop


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
    """Let what is kept on disk count as long as nothing that it holds changes, and be made once.

    Numba looks at the time of the function's file only. A loop holds the code and the constants of
    what it calls, so after a change of another file it would go on with the old ones.
    """
    kept = getattr(getattr(loop, "_cache", None), "_cache_file", None)
    if kept is not None:
        load_index = kept._load_index

        def load_readable_index() -> Any:
            """What is kept, or nothing if it names a record class that was renamed since."""
            kept._source_stamp = stamp_of(loop)
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


def stamp_of(loop: Any) -> bytes:
    """Digest of the code of a loop and of those it calls, of their constants and their records."""
    digest = hashlib.sha256()
    seen: list[Any] = []

    def add(value: Any, names: Mapping[str, Any]) -> None:
        if isinstance(value, CodeType):
            digest.update(value.co_code)
            add((*value.co_consts, *value.co_names, *map(names.get, value.co_names)), names)
        elif isinstance(value, tuple):
            for part in value:
                add(part, names)
        elif isinstance(value, np.ndarray):
            digest.update(value.tobytes())
        elif isinstance(value, bool | int | float | complex | str | np.generic):
            digest.update(repr(value).encode())
        elif hasattr(value, "py_func") and value not in seen:
            seen.append(value)
            own = value.py_func.__globals__
            add(value.py_func.__code__, own)
            add_records(own)

    def add_records(names: Mapping[str, Any]) -> None:
        for each in names.values():
            if isinstance(each, type) and hasattr(each, "_fields") and each not in seen:
                seen.append(each)
                add((each.__qualname__, each._fields), {})
                add_records(vars(sys.modules[each.__module__]))  # one may hold others

    add(loop, {})
    return digest.digest()


@contextmanager
def _alone(index: Path) -> Iterator[None]:
    """Wait for a process that compiles the same loop for the first time, and load what it made."""
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
def _warn() -> None:
    """Say it once."""
    logging.getLogger("gmwm").warning(
        "no folder for compiled code can be written, so each run compiles again, for up to a "
        "minute: set NUMBA_CACHE_DIR to a folder that can"
    )
