"""Columns of arrays that are not read yet, whatever file they are in.

A two-dimensional array has its samples along the rows. The fields of a structured array and the
one-dimensional arrays of a file are columns with names; an ``(n, 3)`` array under a sensor's
name (``gyro``) is its three axes. A single number named ``rate`` or ``dt`` gives the sampling
rate.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gmwm._core import memory
from gmwm._core.notices import Notice
from gmwm._core.spool import is_spooled, release
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.names import AXES, CANONICAL, bare, meaning
from gmwm.readers.table import LARGEST, label, usable

AnyArray = npt.NDArray[Any]

_RATES = ("rate", "fs", "sampling_rate", "sample_rate")
_INTERVALS = ("dt", "sampling_interval")
_LAST_PART = re.compile(r"[./]")

_KINDS = {
    "O": "Python objects",
    "c": "complex numbers",
    "b": "booleans",
    "S": "text",
    "U": "text",
    "M": "dates",
    "m": "time spans",
}


@dataclass(frozen=True, eq=False)
class Array:
    """An array, or a part of one, that is not read yet.

    like: Of its shape and type, without its content: one element in memory.
    read: Gives the array itself.
    """

    like: AnyArray
    read: Callable[[], AnyArray]

    def __getitem__(self, part: Any) -> Array:
        return Array(self.like[part], lambda: self.read()[part])

    def map(self, view: Callable[[AnyArray], AnyArray]) -> Array:
        """The array in another shape."""
        return Array(view(self.like), lambda: view(self.read()))


_Column = tuple[str, Array]


@dataclass(frozen=True)
class ArrayTable:
    """Columns of arrays."""

    source: str
    names: tuple[str, ...]
    arrays: tuple[Array, ...]
    rate: float | None = None
    tentative: bool = False
    notices: tuple[Notice, ...] = ()
    before: int = 0  # rows of a file of which this is a part
    stamps: str = ""  # of messages: what messages of the reader call these,
    message_type: str = ""  # and what says the units

    @classmethod
    def of_entries(
        cls, source: str, entries: Mapping[str, Array], notices: Sequence[Notice] = ()
    ) -> ArrayTable:
        """Columns of the arrays of a file by their names.

        Raises InputError if there are none, or a sampling rate among them is not positive.
        """
        rate = _stated_rate(source, entries)
        return cls._of(source, _columns_of_entries(source, entries), rate, notices)

    @classmethod
    def of_array(cls, source: str, array: Array) -> ArrayTable:
        """Columns of a single array.

        Raises InputError if it has none.
        """
        return cls._of(source, _columns_of_array(source, array), None, ())

    @classmethod
    def _of(
        cls, source: str, columns: Sequence[_Column], rate: float | None, notices: Sequence[Notice]
    ) -> ArrayTable:
        if not columns:
            raise InputError(
                f"{source} holds no column of more than one sample: save arrays of samples in it"
            )
        names, arrays = tuple(name for name, _ in columns), tuple(a for _, a in columns)
        return cls(source, names, arrays, rate, notices=tuple(notices))

    def load(self, columns: Sequence[int]) -> dict[int, FloatArray]:
        """Read some columns; see `Table`.

        Raises InputError if a column is not made of real numbers, one is infinite, or lengths
            differ; if there is not enough memory for them.
        """
        samples = sum(self.arrays[column].like.size for column in columns)
        memory.require(tuning.BYTES_PER_SAMPLE * samples, self.source)
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

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[dict[int, FloatArray]]:
        """The same, ``rows`` at a time; of what is not mapped, a column at a time."""
        shown = [self.arrays[column].like for column in columns]
        if not all(map(is_spooled, shown)) and len({each.shape for each in shown}) == 1:
            for column in columns:
                yield self.load([column])
            return
        longest = max(each.shape[0] for each in shown)
        for begin in range(0, longest, rows):
            arrays = tuple(array[begin : begin + rows] for array in self.arrays)
            yield replace(self, arrays=arrays, before=begin).load(columns)
            for column in columns:
                release(self.arrays[column].like)

    def where(self, row: int) -> str:
        """Say which row."""
        return f"row {self.before + row} (counted from 0)"

    def _column(self, index: int) -> FloatArray:
        like, place = self.arrays[index].like, f"{self.source}, column {label(self.names, index)}"
        _check_real(place, like.dtype)
        if like.ndim != 1:
            raise InputError(f"{place} has shape {like.shape}: save one axis as one column")
        with damage_named(self.source):
            array = self.arrays[index].read()
        _check_real(place, array.dtype)  # a damaged file may hold other numbers than it declares
        with np.errstate(all="ignore"):  # what leaves the range of float64 is refused below
            values = np.array(array, dtype=np.float64)
        check_usable(place, values, self.where)
        return values


def _check_real(place: str, dtype: np.dtype[Any]) -> None:
    if dtype.kind not in "iuf":
        kind = _KINDS.get(dtype.kind, "something else than numbers")
        raise InputError(f"{place} holds {kind}: save real numbers")


def check_usable(place: str, values: FloatArray, where: Callable[[int], str]) -> None:
    """Refuse infinite values and those too large for use.

    Raises InputError at the first of them.
    """
    if not usable(values):
        rows = np.flatnonzero(np.abs(values) >= LARGEST)
        others = f", and {rows.size - 1:,} more such" if rows.size > 1 else ""
        raise InputError(
            f"{place}, {where(int(rows[0]))}: {values[rows[0]]} is not a usable number{others}: "
            "cut the array before that row, or save NaN if the sample is missing"
        )


def _damage(error: Exception) -> str:
    return "is damaged or cut off: save it again"


@contextmanager
def damage_named(source: str, say: Callable[[Exception], str] = _damage) -> Iterator[None]:
    """Say what is wrong with a file in a sentence, whatever its library raises.

    source: Name of the file.
    say: What its library raised -> the end of the sentence.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy's, about headers of old versions
            yield
    except InputError:
        raise
    except MemoryError as error:
        raise InputError(f"{source}: {memory.OUT_OF_MEMORY}", "memory") from error
    except PermissionError as error:
        raise InputError(f"{source} cannot be read: check its permissions") from error
    except Exception as error:  # libraries raise a dozen types for damaged bytes
        if isinstance(error, ValueError) and "object" in str(error).lower():
            raise InputError(
                f"{source} holds Python objects, which are not loaded: save arrays of numbers"
            ) from error
        raise InputError(f"{source} {say(error)}") from error


def array_of(array: AnyArray) -> Array:
    """An array that is in memory."""
    return Array(array, lambda: array)


def _stated_rate(source: str, entries: Mapping[str, Array]) -> float | None:
    """The rate that a single number states; that of a group or a structure too."""
    rates: dict[str, float] = {}
    for name, array in entries.items():
        key, like = _LAST_PART.split(bare(name).lower())[-1], array.like
        if key not in (*_RATES, *_INTERVALS) or like.size != 1 or like.dtype.kind not in "iuf":
            continue
        with damage_named(source):
            value = float(array.read().reshape(-1)[0])
        if not 0.0 < value < LARGEST:
            raise InputError(f"{source}: {name} = {value} is not positive: correct it")
        rates[name] = value if key in _RATES else 1.0 / value
    if len({round(rate, 9) for rate in rates.values()}) > 1:
        raise InputError(f"{source} states several rates, {', '.join(rates)}: keep one of them")
    return next(iter(rates.values()), None)


def _columns_of_array(source: str, array: Array) -> list[_Column]:
    if array.like.dtype.names and array.like.ndim == 1:
        return _columns_of_fields(array)
    if array.like.ndim == 1:
        return [("", array)]
    if array.like.ndim == 2:
        return _unnamed(source, array)
    raise InputError(
        f"{source} has shape {array.like.shape}: save samples along rows, one column for each "
        "channel"
    )


def _columns_of_fields(array: Array) -> list[_Column]:
    return [
        pair for name in array.like.dtype.names or () for pair in _axes_or_itself(name, array[name])
    ]


def _columns_of_entries(source: str, entries: Mapping[str, Array]) -> list[_Column]:
    """Columns of all arrays with more than one value; those without a name first."""
    named: list[_Column] = []
    matrices: list[_Column] = []
    for name, array in entries.items():
        if array.like.dtype.names and array.like.ndim == 1:
            named += _columns_of_fields(array)
        elif array.like.ndim == 2 and not _is_triad(name, array):
            matrices.append((name, array))
        elif array.like.size != 1:
            named += _axes_or_itself(name, array)
    if len(matrices) == 1:
        return _unnamed(source, matrices[0][1]) + named
    return named + matrices


def _unnamed(source: str, array: Array) -> list[_Column]:
    rows, width = array.like.shape
    if width > rows and width >= tuning.FEWEST_SAMPLES:
        raise InputError(
            f"{source} has shape {array.like.shape}: samples run along the rows here, save array.T"
        )
    return [("", array[:, i]) for i in range(width)]


def is_sensor(name: str) -> bool:
    """Whether the name of an array is that of a gyro or an accelerometer without its axis."""
    return meaning(_of_axis(name, AXES[0])).role in CANONICAL


def _of_axis(name: str, axis: str) -> str:
    """The name with an axis before its unit."""
    unit = name[len(bare(name)) :].strip()
    return f"{bare(name)}_{axis} {unit}".rstrip()


def _is_triad(name: str, array: Array) -> bool:
    """Whether an array holds the three axes of a sensor, by its name."""
    return array.like.ndim == 2 and array.like.shape[1] == 3 and is_sensor(name)


def _axes_or_itself(name: str, array: Array) -> list[_Column]:
    if _is_triad(name, array):
        return [(_of_axis(name, axis), array[:, i]) for i, axis in enumerate(AXES)]
    return [(name, array)]
