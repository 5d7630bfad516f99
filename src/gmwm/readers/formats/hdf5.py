"""MAT files (version 5 by scipy, 7.3 by h5py) and HDF5.

Their arrays are columns as those of an NPZ file are. A structure or a group stands before the names
of what it holds, ``imu.gyro`` or ``imu/gyro``, where these alone are not clear; the attribute
``units`` of a data set is its unit.

The libraries are compiled code that trusts the sizes and addresses in a file. Damaged ones end the
process, read on without end, or take all memory: a file is read in another process first.
"""

import json
import math
import os
import re
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np

from gmwm._core import memory
from gmwm._core.files import opened
from gmwm.errors import InputError
from gmwm.readers.formats.arrays import AnyArray, Array, ArrayTable, array_of, is_sensor
from gmwm.readers.names import bare, meaning
from gmwm.readers.registry import Wanted
from gmwm.readers.table import damage_named, library

_LARGEST = 64 << 20  # bytes of a file whose arrays are read too; of others only their headers
_SECONDS, _PER_SECOND = 6, 4 << 20  # of the processor, and bytes of the file for each one more
_WALL = 5  # seconds that pass for each one of the processor: others keep it busy
_DEEPEST = 32  # groups: what reading their names takes grows with the square
_MEMORY, _UNPACKED = 512 << 20, 40  # bytes, and of each byte of the file, which may be compressed
_MARK = "gmwm: "  # before the answer: libraries print too
_PROGRAM = "from gmwm.readers.formats.hdf5 import answer; answer()"

_MAT_73 = b"MATLAB 7.3"
_TOGETHER = 256 << 20  # bytes of arrays that are read together
_NO_NUMBERS = ("char", "cell", "object", "function", "opaque", "sparse", "logical")


def tried(opener: Callable[[Path], ArrayTable], path: Path) -> ArrayTable:
    """Open a file of arrays if another process could; InputError if that ended, or as it did.

    An array that it could not read is rejected when it is asked for.
    """
    question = [f"{opener.__module__}:{opener.__qualname__}", os.fspath(path.absolute())]
    done = subprocess.run(
        # -P: modules are not looked for in the folder of the data.
        [sys.executable, "-P", "-c", _PROGRAM, *question, str(memory.budget())],
        stdin=subprocess.DEVNULL,
        capture_output=True,
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
        damage = "is damaged: its library fails or takes too long; save it again"
        raise InputError(**found) if found else InputError(f"{path.name} {damage}")
    table, unread = opener(path), found["unread"]
    arrays = [
        Array(array.like, partial(_rejected, unread[name])) if name in unread else array
        for name, array in zip(table.names, table.arrays, strict=True)
    ]
    return replace(table, arrays=tuple(arrays))


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
            # Also where the library waits, or the parent was killed. Only the main thread may set
            # signals: this is that of a process of its own.
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.alarm(_WALL * seconds)
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


def open_hdf5(path: Path, wanted: Wanted) -> tuple[ArrayTable, ...]:
    """Open an HDF5 file, or a MAT file of version 7.3, whose arrays are stored transposed."""
    return (tried(read_hdf5, path),)


def open_mat(path: Path, wanted: Wanted) -> tuple[ArrayTable, ...]:
    """Open a MAT file of version 4 to 7."""
    return (tried(read_mat, path),)


def read_hdf5(path: Path) -> ArrayTable:
    """Columns of a file that does no harm to its library."""
    h5py = library("h5py", "hdf5", path.name)
    found: dict[str, Array] = {}

    @lru_cache(maxsize=1)
    def read(name: str) -> AnyArray:
        with h5py.File(path, "r") as file:
            array: AnyArray = file[name][()]
        return array

    with damage_named(path.name), opened(path) as stream, h5py.File(path, "r") as file:
        is_mat = stream.read(len(_MAT_73)) == _MAT_73

        def add(name: str, item: Any) -> None:
            if name.count("/") > _DEEPEST:
                raise InputError(
                    f"{path.name} has groups nested more than {_DEEPEST} deep: flatten it"
                )
            # What MATLAB refers to, cells and structure arrays, hides in #refs#.
            if name.startswith("#") or not isinstance(item, h5py.Dataset):
                return
            if item.external or item.is_virtual:
                text = f"{path.name}: {name} is in another file"
                text += f", {item.external[0][0]!r}" if item.external else ""
                raise InputError(f"{text}, which is not opened: save its samples in this one")
            if item.dtype.kind in "iufV" and item.shape:
                like = np.broadcast_to(np.empty((), item.dtype), item.shape)
                unit = "" if is_mat or meaning(name).unit is not None else _unit(item.attrs)
                found[f"{name} [{unit}]" if unit else name] = Array(like, partial(read, name))
            elif item.dtype.kind in "iuf" and item.shape == ():
                found[name] = array_of(np.asarray(item[()]))

        file.visititems(add)
    return _table(path.name, found, is_transposed=is_mat)


def _unit(attributes: Mapping[str, Any]) -> str:
    units = [attributes.get(key) for key in ("units", "unit", "Units", "Unit")]
    texts = [each.decode(errors="replace") if isinstance(each, bytes) else each for each in units]
    return next((text for text in texts if isinstance(text, str) and text), "")


def read_mat(path: Path) -> ArrayTable:
    """Columns of a file that does no harm to its library."""
    from scipy.io import loadmat, whosmat

    with damage_named(path.name):
        variables = whosmat(path)
        # Looking for each of many variables takes the square of the time.
        is_small = sum(8 * math.prod(shape) for _, shape, _ in variables) < _TOGETHER
        load = lru_cache(maxsize=1)(partial(loadmat, path, simplify_cells=True))

        def read(name: str) -> Any:
            return (load() if is_small else load(variable_names=(name,)))[name]

        def numbers(name: str) -> AnyArray:
            return np.squeeze(np.asarray(read(name)))

        found: dict[str, Array] = {}
        for name, shape, kind in variables:
            if kind == "struct":
                for inner, values in _fields(name, read(name)):
                    found[inner] = array_of(values)
            elif kind not in _NO_NUMBERS:
                # Vectors come without their second dimension, and whole numbers may be stored.
                like = np.broadcast_to(np.empty(()), tuple(n for n in shape if n != 1))
                found[name] = Array(like, partial(numbers, name))
    return _table(path.name, found, is_transposed=False)


def _fields(name: str, value: Any) -> Iterator[tuple[str, AnyArray]]:
    """Arrays of a structure and of those in it."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _fields(f"{name}.{key}", inner)
    elif isinstance(value, np.ndarray | float | int):
        yield name, np.asarray(value)


def _table(source: str, found: Mapping[str, Array], is_transposed: bool) -> ArrayTable:
    """A table of the arrays that have the shape of columns."""
    entries: dict[str, Array] = {}
    lasts = Counter(map(_last, found))
    for name, array in found.items():
        if is_transposed and array.like.ndim == 2:
            array = array.map(np.transpose)
        shape = array.like.shape
        if len(shape) == 2 and 1 in shape:
            array = array.map(np.squeeze)
        elif len(shape) == 2 and shape[0] == 3 < shape[1] and is_sensor(name):
            array = array.map(np.transpose)
        if array.like.ndim <= 2 and array.like.size:
            # Without its group where that is clear: a word before "time" changes its meaning.
            entries[_last(name) if lasts[_last(name)] == 1 else name] = array
    if not entries:
        raise InputError(f"{source} holds no arrays of numbers: save samples in it")
    return ArrayTable.of_entries(source, entries)


def _last(name: str) -> str:
    """A name without its groups or structures; a unit may have a stroke of its own."""
    plain = bare(name)
    return re.split("[./]", plain)[-1] + name[len(plain) :]
