"""Arrays saved by numpy: NPY and NPZ."""

from __future__ import annotations

import math
import zipfile
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from gmwm._core import memory
from gmwm.errors import InputError
from gmwm.readers.formats.arrays import AnyArray, Array, ArrayTable, array_of
from gmwm.readers.registry import Wanted
from gmwm.readers.table import damage_named

_NPY_MAGIC = b"\x93NUMPY"
_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0}

# Stands for an entry of an NPZ file that is not a plain array: it does no harm unless it is wanted.
_OBJECTS = np.empty(0, dtype=object)


def open_numpy(path: Path, wanted: Wanted) -> tuple[ArrayTable, ...]:
    """Open an NPY or NPZ file.

    Raises InputError if it is damaged, or its arrays are not columns.
    """
    is_archive = path.suffix.lower() == ".npz"
    with damage_named(path.name), path.open("rb") as stream:
        head = stream.read(len(_NPY_MAGIC))
    if not head.startswith(b"PK" if is_archive else _NPY_MAGIC):
        kind, writer = ("NPZ", "savez") if is_archive else ("NPY", "save")
        raise InputError(f"{path.name} is not an {kind} file: write it with numpy.{writer}")
    with damage_named(path.name):
        if is_archive:
            entries = _entries(path)
        else:  # mapped: a header that promises more than there is asks for no memory
            array: AnyArray = np.load(path, mmap_mode="r", allow_pickle=False)
    if is_archive:
        return (ArrayTable.of_entries(path.name, entries),)
    return (ArrayTable.of_array(path.name, array_of(array)),)


def _entries(path: Path) -> dict[str, Array]:
    """Entries of an NPZ file, whose headers are read."""
    # The columns of an entry are asked for one after another.
    read = lru_cache(maxsize=1)(partial(_read_entry, path))
    found = {}
    with zipfile.ZipFile(path) as archive:
        for info in archive.infolist():
            name = info.filename.removesuffix(".npy")
            found[name] = array_of(_OBJECTS)
            with archive.open(info) as stream:
                if stream.read(len(_NPY_MAGIC)) != _NPY_MAGIC:
                    continue
            with archive.open(info) as stream:
                version = np.lib.format.read_magic(stream)
                header = _HEADERS.get(version, np.lib.format.read_array_header_2_0)(stream)
            shape, _, dtype = header
            if dtype.hasobject:
                continue
            if math.prod(shape) * dtype.itemsize > info.file_size:
                raise ValueError("a header that promises more than there is")
            like = np.broadcast_to(np.empty((), dtype), shape)
            found[name] = Array(like, partial(read, info.filename))
    return found


def _read_entry(path: Path, name: str) -> AnyArray:
    with zipfile.ZipFile(path) as archive:
        memory.require(archive.getinfo(name).file_size, path.name)
        with archive.open(name) as stream:
            array: AnyArray = np.lib.format.read_array(stream, allow_pickle=False)
    return array
