"""MAT files (version 5 by scipy, 7.3 by h5py) and HDF5.

Their arrays are columns as those of an NPZ file are. A structure or a group stands before the names
of what it holds, ``imu.gyro`` or ``imu/gyro``, where these alone are not clear; the attribute
``units`` of a data set is its unit.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from gmwm.errors import InputError
from gmwm.readers.formats import trial
from gmwm.readers.formats.arrays import AnyArray, Array, ArrayTable, array_of, is_sensor
from gmwm.readers.names import bare, meaning
from gmwm.readers.registry import Wanted
from gmwm.readers.table import damage_named, library

_MAT_73 = b"MATLAB 7.3"
_TOGETHER = 256 << 20  # bytes of arrays that are read together
_UNITS = ("units", "unit", "Units", "Unit")
_NO_NUMBERS = ("char", "cell", "object", "function", "opaque", "sparse", "logical")


def open_hdf5(path: Path, wanted: Wanted) -> tuple[ArrayTable, ...]:
    """Open an HDF5 file, or a MAT file of version 7.3, whose arrays are stored transposed.

    Raises InputError if it is damaged or holds no columns, or h5py is not installed.
    """
    return (trial.tried(read_hdf5, path),)


def open_mat(path: Path, wanted: Wanted) -> tuple[ArrayTable, ...]:
    """Open a MAT file of version 4 to 7.

    Raises InputError if it is damaged or holds no columns.
    """
    return (trial.tried(read_mat, path),)


def read_hdf5(path: Path) -> ArrayTable:
    """Columns of a file that does no harm to its library."""
    h5py = library("h5py", "hdf5", path.name)
    found: dict[str, Array] = {}

    @lru_cache(maxsize=1)
    def read(name: str) -> AnyArray:
        with h5py.File(path, "r") as file:
            array: AnyArray = file[name][()]
        return array

    with damage_named(path.name), path.open("rb") as stream, h5py.File(path, "r") as file:
        is_mat = stream.read(len(_MAT_73)) == _MAT_73

        def add(name: str, item: Any) -> None:
            # What MATLAB refers to, cells and structure arrays, hides in #refs#.
            if name.startswith("#") or not isinstance(item, h5py.Dataset):
                return
            if item.external:
                raise InputError(
                    f"{path.name}: {name} is in another file, {item.external[0][0]!r}, which is "
                    "not opened: save its samples in this one"
                )
            if item.dtype.kind in "iufV" and item.shape:
                like = np.broadcast_to(np.empty((), item.dtype), item.shape)
                full = name if is_mat else _with_unit(name, item.attrs)
                found[full] = Array(like, partial(read, name))
            elif item.dtype.kind in "iuf" and item.shape == ():
                found[name] = array_of(np.asarray(item[()]))

        file.visititems(add)
    return _table(path.name, found, is_transposed=is_mat)


def _with_unit(name: str, attributes: Mapping[str, Any]) -> str:
    for key in _UNITS:
        unit = attributes.get(key)
        unit = unit.decode(errors="replace") if isinstance(unit, bytes) else unit
        if isinstance(unit, str) and unit and meaning(name).unit is None:
            return f"{name} [{unit}]"
    return name


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
