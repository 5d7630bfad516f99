"""Arrays saved by numpy: NPY and NPZ."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from gmwm._core import memory
from gmwm.errors import InputError
from gmwm.readers.formats.arrays import AnyArray, Array, ArrayTable, array_of, damage_named

_NPY_MAGIC = b"\x93NUMPY"
_ZIP_MAGIC = b"PK"

_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0}

# Stands for an entry of an NPZ file that is not a plain array: it does no harm unless it is wanted.
_OBJECTS = np.empty(0, dtype=object)


def open_numpy(path: Path) -> ArrayTable:
    """Open an NPY or NPZ file.

    Raises InputError if it is damaged, or its arrays are not columns.
    """
    if path.suffix.lower() == ".npz":
        return ArrayTable.of_entries(path.name, _load_npz(path))
    return ArrayTable.of_array(path.name, _load_npy(path))


def _load_npy(path: Path) -> Array:
    with damage_named(path.name):
        with path.open("rb") as stream:
            magic = stream.read(len(_NPY_MAGIC))
        if magic == _NPY_MAGIC:
            # Mapped: a header that promises more than there is asks for no memory.
            array: AnyArray = np.load(path, mmap_mode="r", allow_pickle=False)
            return array_of(array)
    raise InputError(f"{path.name} is not an NPY file: write it with numpy.save")


def _load_npz(path: Path) -> dict[str, Array]:
    with damage_named(path.name):
        with path.open("rb") as stream:
            magic = stream.read(len(_ZIP_MAGIC))
        if magic == _ZIP_MAGIC:
            # The columns of an entry are asked for one after another.
            read = lru_cache(maxsize=1)(partial(_read_entry, path))
            with zipfile.ZipFile(path) as archive:
                return {
                    info.filename.removesuffix(".npy"): _entry(archive, info, read)
                    for info in archive.infolist()
                }
    raise InputError(f"{path.name} is not an NPZ file: write it with numpy.savez")


def _entry(
    archive: zipfile.ZipFile, info: zipfile.ZipInfo, read: Callable[[str], AnyArray]
) -> Array:
    """An entry of which the header is read."""
    with archive.open(info) as stream:
        if stream.read(len(_NPY_MAGIC)) != _NPY_MAGIC:
            return array_of(_OBJECTS)
    with archive.open(info) as stream:
        version = np.lib.format.read_magic(stream)
        header = _HEADERS.get(version, np.lib.format.read_array_header_2_0)(stream)
    shape, _, dtype = header
    if dtype.hasobject:
        return array_of(_OBJECTS)
    if math.prod(shape) * dtype.itemsize > info.file_size:
        raise ValueError("a header that promises more than there is")
    return Array(np.broadcast_to(np.empty((), dtype), shape), lambda: read(info.filename))


def _read_entry(path: Path, name: str) -> AnyArray:
    with zipfile.ZipFile(path) as archive:
        memory.require(archive.getinfo(name).file_size, path.name)
        with archive.open(name) as stream:
            array: AnyArray = np.lib.format.read_array(stream, allow_pickle=False)
    return array
