"""A file is read in another process first, where its library may fail as it likes.

The libraries of HDF5 and of MAT files are compiled code that trusts the sizes and addresses in a
file. Damaged ones end the process, read on without end, or take all memory, in more ways than can
be looked for beforehand.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import replace
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from gmwm._core import memory
from gmwm.errors import InputError
from gmwm.readers.formats.arrays import AnyArray, Array, ArrayTable

Opener = Callable[[Path], ArrayTable]

_LARGEST = 64 << 20  # bytes of a file whose arrays are read too; of others only what is about them
_SECONDS, _PER_SECOND = 15, 4 << 20  # of the processor, and bytes of the file for each one more
_MEMORY, _UNPACKED = 512 << 20, 40  # bytes, and of each byte of the file, which may be compressed
_MARK = "gmwm: "  # before an answer: what else is printed is not ours
_PROGRAM = "from gmwm.readers.formats.trial import serve; serve()"

_kept: ContextVar[list[_Reader] | None] = ContextVar("kept", default=None)


def tried(opener: Opener, path: Path) -> ArrayTable:
    """Open a file of arrays, if another process could.

    Raises InputError if that ended, or with what it raised. An array that it could not read is
    refused when it is asked for.
    """
    found = _asked(f"{opener.__module__}:{opener.__qualname__}", path)
    if "unread" not in found:
        raise InputError(**found)
    table = opener(path)
    unread: Mapping[str, str] = found["unread"]
    arrays = (
        Array(array.like, partial(_refused, unread[name])) if name in unread else array
        for name, array in zip(table.names, table.arrays, strict=True)
    )
    return replace(table, arrays=tuple(arrays))


def _refused(text: str) -> AnyArray:
    raise InputError(text)


@contextmanager
def one_reader() -> Iterator[None]:
    """Keep the process that reads for further files, within the block."""
    readers: list[_Reader] = []
    token = _kept.set(readers)
    try:
        yield
    finally:
        _kept.reset(token)
        for each in readers:
            each.close()


def _asked(opener: str, path: Path) -> dict[str, Any]:
    kept = _kept.get()
    reader = kept.pop() if kept else _Reader()
    try:
        answer = reader.asked(opener, path)
    except BaseException:  # an interrupt
        reader.kill()
        raise
    if answer is None or kept is None:
        reader.close()
    else:
        kept.append(reader)
    return answer or {
        "text": f"{path.name} is damaged, so that its library fails or reads on for too long: save "
        "it again"
    }


class _Reader:
    """A process that reads files, each asked for by a line of JSON, and answers by another."""

    def __init__(self) -> None:
        # -P: modules are not looked for in the folder of the data.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True, encoding="utf-8",
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )  # fmt: skip

    def asked(self, opener: str, path: Path) -> dict[str, Any] | None:
        """What came of a file; ``None`` if the process ended."""
        question, answer = self._process.stdin, self._process.stdout
        assert question is not None and answer is not None
        with suppress(BrokenPipeError):
            question.write(json.dumps([opener, os.fspath(path.absolute()), memory.budget()]) + "\n")
            question.flush()
        for line in answer:
            if line.startswith(_MARK) and line.endswith("\n"):
                found: dict[str, Any] = json.loads(line.removeprefix(_MARK))
                return found
        return None

    def kill(self) -> None:
        """End it, whatever it is at."""
        self._process.kill()
        self.close()

    def close(self) -> None:
        """Let it end."""
        with suppress(BrokenPipeError):
            self._process.communicate()


def serve() -> None:
    """Answer until there are no more questions."""
    for line in sys.stdin:
        opener, name, budget = json.loads(line)
        path = Path(name)
        with memory.limited(budget / (1 << 30)):
            _limit(path.stat().st_size)
            print(_MARK + json.dumps(_answer(resolve_name(opener), path)), flush=True)


def _limit(size: int) -> None:
    """Let the process end that reads without end, and memory that no such file needs be refused."""
    with suppress(ImportError, ValueError, OSError):  # not every system has limits
        import resource

        used = resource.getrusage(resource.RUSAGE_SELF)
        seconds = int(used.ru_utime + used.ru_stime) + _SECONDS + size // _PER_SECOND
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.RLIM_INFINITY))
        signal.signal(signal.SIGXCPU, signal.SIG_DFL)
        most = min(memory.budget(), _MEMORY + _UNPACKED * size)
        resource.setrlimit(resource.RLIMIT_DATA, (most, resource.RLIM_INFINITY))


def _answer(opener: Opener, path: Path) -> dict[str, Any]:
    unread = {}
    try:
        table = opener(path)
        for i, name in enumerate(table.names if path.stat().st_size <= _LARGEST else ()):
            try:
                table.load([i])
            except InputError as error:
                unread[name] = str(error)
    except InputError as error:
        return {
            "text": error.problem, "code": error.code, "hint": error.hint, "values": error.values
        }  # fmt: skip
    return {"unread": unread}
