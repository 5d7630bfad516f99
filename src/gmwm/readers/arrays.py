"""Arrays saved by numpy: NPY and NPZ.

A two-dimensional array has its samples along the rows. The fields of a structured array and the
one-dimensional arrays of an NPZ file are columns with names; an ``(n, 3)`` array under a sensor's
name (``gyro``) is its three axes. A single number named ``rate`` or ``dt`` gives the sampling
rate.
"""

from __future__ import annotations

import warnings
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.names import AXES, CANONICAL, meaning
from gmwm.readers.table import LARGEST, label, usable

_AnyArray = npt.NDArray[Any]
_Column = tuple[str, _AnyArray]

_NPY_MAGIC = b"\x93NUMPY"
_ZIP_MAGIC = b"PK"
_RATES = ("rate", "fs", "sampling_rate", "sample_rate")
_INTERVALS = ("dt", "sampling_interval")

# Stands for an entry of an NPZ file that is not a plain array: it does no harm unless it is wanted.
_OBJECTS = np.empty(0, dtype=object)
_KINDS = {
    "O": "Python objects",
    "c": "complex numbers",
    "b": "booleans",
    "S": "text",
    "U": "text",
    "M": "dates",
    "m": "time spans",
}


@dataclass(frozen=True)
class ArrayTable:
    """Columns of arrays."""

    source: str
    names: tuple[str, ...]
    arrays: tuple[_AnyArray, ...]
    rate: float | None = None
    tentative: bool = False
    notices: tuple[Notice, ...] = ()

    @classmethod
    def open(cls, path: Path) -> ArrayTable:
        """Open an NPY or NPZ file.

        Raises
        ------
        InputError
            If it is damaged, or its arrays are not columns.
        """
        source, rate = path.name, None
        if path.suffix.lower() == ".npz":
            entries = _load_npz(path)
            rate = _stated_rate(source, entries)
            columns = _columns_of_entries(source, entries)
        else:
            columns = _columns_of_array(source, _load_npy(path))
        if not columns:
            raise InputError(f"{source} holds no columns: save arrays of samples in it")
        return cls(source, tuple(name for name, _ in columns), tuple(a for _, a in columns), rate)

    def load(self, columns: Sequence[int]) -> dict[int, FloatArray]:
        """Read some columns.

        Parameters
        ----------
        columns : sequence of int
            Their indices.

        Returns
        -------
        dict of int to (n,) ndarray
            NaN where a sample is missing.

        Raises
        ------
        InputError
            If a column is not made of real numbers, one is infinite, or lengths differ.
        """
        found = {column: self._column(column) for column in columns}
        longest = max(columns, key=lambda column: found[column].size)
        for column, values in found.items():
            if values.size != found[longest].size:
                raise InputError(
                    f"{self.source}, column {label(self.names, column)}: {values.size:,} samples "
                    f"where column {label(self.names, longest)} has {found[longest].size:,}: "
                    "give every column the same length"
                )
        return found

    def where(self, row: int) -> str:
        """Say which row."""
        return f"row {row} (counted from 0)"

    def _column(self, index: int) -> FloatArray:
        array, place = self.arrays[index], f"{self.source}, column {label(self.names, index)}"
        if array.dtype.kind not in "iuf":
            kind = _KINDS.get(array.dtype.kind, "something else than numbers")
            raise InputError(f"{place} holds {kind}: save real numbers")
        if array.ndim != 1:
            raise InputError(f"{place} has shape {array.shape}: save one axis as one column")
        with np.errstate(all="ignore"):  # what leaves the range of float64 is refused below
            values = np.array(array, dtype=np.float64)
        if not usable(values):
            rows = np.flatnonzero(np.abs(values) >= LARGEST)
            others = f", and {rows.size - 1:,} more such" if rows.size > 1 else ""
            raise InputError(
                f"{place}, {self.where(int(rows[0]))}: {array[rows[0]]} is not a usable "
                f"number{others}: cut the array before that row, or save NaN if the sample is "
                "missing"
            )
        return values


@contextmanager
def _damage_named(source: str) -> Iterator[None]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy's, about headers of old versions
            yield
    except PermissionError as error:
        raise InputError(f"{source} cannot be read: check its permissions") from error
    except Exception as error:  # numpy, zipfile and zlib raise a dozen types for damaged bytes
        if _is_about_objects(error):
            raise InputError(
                f"{source} holds Python objects, which are not loaded: save arrays of numbers"
            ) from error
        raise InputError(f"{source} is damaged or cut off: save it again") from error


def _is_about_objects(error: Exception) -> bool:
    return isinstance(error, ValueError) and "object" in str(error).lower()


def _load_npy(path: Path) -> _AnyArray:
    with _damage_named(path.name):
        with path.open("rb") as stream:
            magic = stream.read(len(_NPY_MAGIC))
        if magic == _NPY_MAGIC:
            # Mapped: a header that promises more than there is asks for no memory.
            array: _AnyArray = np.load(path, mmap_mode="r", allow_pickle=False)
            return array
    raise InputError(f"{path.name} is not an NPY file: write it with numpy.save")


def _load_npz(path: Path) -> dict[str, _AnyArray]:
    # Opened here: numpy leaves a damaged archive open.
    with _damage_named(path.name), path.open("rb") as stream:
        magic = stream.read(len(_ZIP_MAGIC))
        # Without the magic number at the beginning, numpy would read it as pickled objects.
        if magic == _ZIP_MAGIC and zipfile.is_zipfile(stream):
            stream.seek(0)
            with np.load(stream, allow_pickle=False) as archive:
                return {name: _entry(archive, name) for name in archive.files}
    raise InputError(f"{path.name} is not an NPZ file: write it with numpy.savez")


def _entry(archive: Mapping[str, Any], name: str) -> _AnyArray:
    try:
        entry = archive[name]
    except ValueError as error:
        if not _is_about_objects(error):
            raise
        return _OBJECTS
    return entry if isinstance(entry, np.ndarray) else _OBJECTS


def _stated_rate(source: str, entries: Mapping[str, _AnyArray]) -> float | None:
    for name, array in entries.items():
        key = name.lower()
        if key not in (*_RATES, *_INTERVALS) or array.size != 1 or array.dtype.kind not in "iuf":
            continue
        value = float(array.reshape(-1)[0])
        if not 0.0 < value < LARGEST:
            raise InputError(f"{source}: {name} = {value} is not positive: correct it")
        return value if key in _RATES else 1.0 / value
    return None


def _columns_of_array(source: str, array: _AnyArray) -> list[_Column]:
    if array.dtype.names and array.ndim == 1:
        return _columns_of_fields(array)
    if array.ndim == 1:
        return [("", array)]
    if array.ndim == 2:
        return _unnamed(source, array)
    raise InputError(
        f"{source} has shape {array.shape}: save samples along rows, one column for each channel"
    )


def _columns_of_fields(array: _AnyArray) -> list[_Column]:
    return [pair for name in array.dtype.names or () for pair in _axes_or_itself(name, array[name])]


def _columns_of_entries(source: str, entries: Mapping[str, _AnyArray]) -> list[_Column]:
    """Columns of all arrays with more than one value; those without a name first."""
    named: list[_Column] = []
    matrices: list[_Column] = []
    for name, array in entries.items():
        if array.dtype.names and array.ndim == 1:
            named += _columns_of_fields(array)
        elif array.ndim == 2 and not _is_triad(name, array):
            matrices.append((name, array))
        elif array.size != 1:
            named += _axes_or_itself(name, array)
    if len(matrices) == 1:
        return _unnamed(source, matrices[0][1]) + named
    return named + matrices


def _unnamed(source: str, array: _AnyArray) -> list[_Column]:
    rows, width = array.shape
    if width > rows and width >= tuning.FEWEST_SAMPLES:
        raise InputError(
            f"{source} has shape {array.shape}: samples run along the rows here, save array.T"
        )
    return [("", array[:, i]) for i in range(width)]


def _is_triad(name: str, array: _AnyArray) -> bool:
    """Whether an array holds the three axes of a sensor, by its name."""
    return array.ndim == 2 and array.shape[1] == 3 and meaning(f"{name}_x").role in CANONICAL


def _axes_or_itself(name: str, array: _AnyArray) -> list[_Column]:
    if _is_triad(name, array):
        return [(f"{name}_{axis}", array[:, i]) for i, axis in enumerate(AXES)]
    return [(name, array)]
