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
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from gmwm._core import memory
from gmwm.errors import InputError
from gmwm.readers.formats.arrays import AnyArray, Array, ArrayTable

Opener = Callable[[Path], ArrayTable]

_LARGEST = 64 << 20  # bytes of a file whose arrays are read too; of others only their headers
_SECONDS, _PER_SECOND = 6, 4 << 20  # of the processor, and bytes of the file for each one more
_MEMORY, _UNPACKED = 512 << 20, 40  # bytes, and of each byte of the file, which may be compressed
_MARK = "gmwm: "  # before the answer: libraries print too
_PROGRAM = "from gmwm.readers.formats.trial import answer; answer()"


def tried(opener: Opener, path: Path) -> ArrayTable:
    """Open a file of arrays, if another process could.

    Raises InputError if that process ended, or as it did. An array that it could not read is
    rejected when it is asked for.
    """
    question = [f"{opener.__module__}:{opener.__qualname__}", os.fspath(path.absolute())]
    done = subprocess.run(
        # -P: modules are not looked for in the folder of the data.
        [sys.executable, "-P", "-c", _PROGRAM, *question, str(memory.budget())],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="replace",
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    last = done.stdout.rpartition(_MARK)[2] if _MARK in done.stdout else ""
    found: dict[str, Any] = {}
    with suppress(json.JSONDecodeError):
        found = json.loads(last)
    if "unread" not in found:
        damage = "is damaged, so that its library fails or reads on for too long: save it again"
        raise InputError(**found) if found else InputError(f"{path.name} {damage}")
    table = opener(path)
    arrays = tuple(
        Array(array.like, partial(_rejected, found["unread"][name]))
        if name in found["unread"]
        else array
        for name, array in zip(table.names, table.arrays, strict=True)
    )
    return replace(table, arrays=arrays)


def _rejected(text: str) -> AnyArray:
    raise InputError(text)


def answer() -> None:
    """Try a file in this process, and print what came of it."""
    opener, name, budget = sys.argv[1:]
    path = Path(name)
    size = path.stat().st_size
    with memory.limited(int(budget) / (1 << 30)):
        with suppress(ImportError, ValueError, OSError):  # not every system has limits
            import resource

            used = resource.getrusage(resource.RUSAGE_SELF)
            seconds = int(used.ru_utime + used.ru_stime) + _SECONDS + size // _PER_SECOND
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.RLIM_INFINITY))
            signal.signal(signal.SIGXCPU, signal.SIG_DFL)
            most = min(memory.budget(), _MEMORY + _UNPACKED * size)
            resource.setrlimit(resource.RLIMIT_DATA, (most, resource.RLIM_INFINITY))
        found: dict[str, Any] = {"unread": {}}
        try:
            table: ArrayTable = resolve_name(opener)(path)
            for i, column in enumerate(table.names if size <= _LARGEST else ()):
                try:
                    table.load([i])
                except InputError as error:
                    found["unread"][column] = str(error)
        except InputError as error:
            found = {"text": error.problem, "code": error.code, "hint": error.hint}
            found["values"] = error.values
        print(_MARK + json.dumps(found), flush=True)
