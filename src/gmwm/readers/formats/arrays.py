"""Columns of arrays that are not read yet, whatever file they are in.

A two-dimensional array has its samples along the rows. The fields of a structured array and the
one-dimensional arrays of a file are columns with names; an ``(n, 3)`` array under a sensor's
name (``gyro``) is its three axes. A single number named ``rate`` or ``dt`` gives the rate.
"""

from __future__ import annotations

import math
import re
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gmwm._core import memory
from gmwm._core.files import opened
from gmwm._core.spool import is_spooled, release
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.issues import Notice
from gmwm.readers import tuning
from gmwm.readers.names import AXES, CANONICAL, TIME, bare, meaning
from gmwm.readers.registry import Wanted
from gmwm.readers.table import LARGEST, Columns, Table, damage_named, label

AnyArray = npt.NDArray[Any]

_NPY_MAGIC = b"\x93NUMPY"
_RATES = ("rate", "fs", "sampling_rate", "sample_rate")
_INTERVALS = ("dt", "sampling_interval")
_KINDS = {"O": "Python objects", "c": "complex numbers", "b": "booleans"}
_KINDS |= {"S": "text", "U": "text", "M": "dates", "m": "time spans"}


def open_numpy(path: Path, wanted: Wanted) -> tuple[ArrayTable, ...]:
    """Open an NPY or NPZ file."""
    is_archive = path.suffix.lower() == ".npz"
    with damage_named(path.name), opened(path) as stream:
        head = stream.read(len(_NPY_MAGIC))
    if not head.startswith(b"PK" if is_archive else _NPY_MAGIC):
        kind, writer = ("NPZ", "savez") if is_archive else ("NPY", "save")
        raise InputError(f"{path.name} is not an {kind} file: write it with numpy.{writer}")
    with damage_named(path.name):
        if is_archive:
            return (ArrayTable.of_entries(path.name, _entries(path)),)
        # Mapped: a header that promises more than there is asks for no memory.
        size = path.stat().st_size
        array: AnyArray = np.load(path, mmap_mode="r", allow_pickle=False)

    def read() -> AnyArray:
        if path.stat().st_size < size:  # the system ends a process that reads on in a map
            raise InputError(f"{path.name} became shorter while it was read: get a whole copy")
        return array

    return (ArrayTable.of_array(path.name, Array(array, read)),)


def _entries(path: Path) -> dict[str, Array]:
    """Entries of an NPZ file, whose headers are read."""
    found = {}

    @lru_cache(maxsize=1)  # the columns of an entry are asked for one after another
    def read(name: str) -> AnyArray:
        with zipfile.ZipFile(path) as archive:
            memory.require(archive.getinfo(name).file_size, path.name)
            with archive.open(name) as stream:
                array: AnyArray = np.lib.format.read_array(stream, allow_pickle=False)
        return array

    with zipfile.ZipFile(path) as archive:
        for info in archive.infolist():
            name = info.filename.removesuffix(".npy")
            # What is not a plain array does no harm unless it is wanted.
            found[name] = array_of(np.empty(0, dtype=object))
            with archive.open(info) as stream:
                if stream.read(len(_NPY_MAGIC)) != _NPY_MAGIC:
                    continue
            with archive.open(info) as stream:
                form = np.lib.format
                is_first = form.read_magic(stream) == (1, 0)
                read_header = form.read_array_header_1_0 if is_first else form.read_array_header_2_0
                shape, _, dtype = read_header(stream)
            if dtype.hasobject:
                continue
            if math.prod(shape) * dtype.itemsize > info.file_size:
                raise ValueError("a header that promises more than there is")
            like = np.broadcast_to(np.empty((), dtype), shape)
            found[name] = Array(like, partial(read, info.filename))
    return found


@dataclass(frozen=True, eq=False)
class Array:
    """An array, or a part of one, that is not read yet."""

    like: AnyArray  # an array of its shape and type, without its content
    read: Callable[[], AnyArray]  # gives the array itself

    def __getitem__(self, part: Any) -> Array:
        return Array(self.like[part], lambda: self.read()[part])

    def map(self, view: Callable[[AnyArray], AnyArray]) -> Array:
        """The array in another shape."""
        return Array(view(self.like), lambda: view(self.read()))


def array_of(array: AnyArray) -> Array:
    """An array that is in memory."""
    return Array(array, lambda: array)


_Named = tuple[str, Array]


@dataclass(frozen=True, eq=False, kw_only=True)
class ArrayTable(Table):
    """Columns of arrays."""

    arrays: tuple[Array, ...] = field(default=())

    @classmethod
    def of_entries(
        cls, source: str, entries: Mapping[str, Array], notices: Sequence[Notice] = (), **about: Any
    ) -> ArrayTable:
        """Columns of the arrays of a file by their names; ``about`` has `stamps` and `origin`."""
        named, matrices = list[_Named](), list[_Named]()
        for name, array in entries.items():
            if array.like.dtype.names and array.like.ndim == 1:
                for field_name in array.like.dtype.names:
                    named += _axes_or_itself(field_name, array[field_name])
            elif array.like.ndim == 2 and not (array.like.shape[1] == 3 and is_sensor(name)):
                matrices.append((name, array))
            elif array.like.size != 1:
                named += _axes_or_itself(name, array)
        # Columns without names come first.
        is_one = len(matrices) == 1
        triads = [pair for name, array in matrices for pair in _axes_or_itself(name, array)]
        columns = _unnamed(source, matrices[0][1]) + named if is_one else named + triads
        if not columns:
            text = f"{source} holds no column of more than one sample"
            raise InputError(f"{text}: save arrays of samples in it")
        names, arrays = zip(*columns, strict=True)
        rate, own = _stated_rate(source, entries), list(notices)
        return cls(source=source, names=names, arrays=arrays, rate=rate, notices=own, **about)

    @classmethod
    def of_array(cls, source: str, array: Array) -> ArrayTable:
        """Columns of a single array, which need no names."""
        if array.like.ndim == 1 and array.like.dtype.names is None:
            return cls(source=source, names=("",), arrays=(array,))
        if array.like.ndim not in (1, 2):
            hint = "save samples along rows, one column for each channel"
            raise InputError(f"{source} has shape {array.like.shape}: {hint}")
        return cls.of_entries(source, {"": array})

    def load(self, columns: Sequence[int]) -> Columns:
        """Read some columns, which must have one length."""
        samples = sum(self.arrays[column].like.size for column in columns)
        memory.require(tuning.BYTES_PER_SAMPLE * samples, self.source)
        found = {column: self._column(column, slice(None)) for column in columns}
        longest = max(columns, key=lambda column: found[column].size)
        for column, values in found.items():
            if values.size != found[longest].size:
                raise InputError(
                    f"{self.source}, column {label(self.names, column)}: {values.size:,} samples "
                    f"where column {label(self.names, longest)} has {found[longest].size:,}: "
                    "give every column the same length"
                )
        return found

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[Columns]:
        """Some rows at a time of arrays that are mapped; others a column at a time."""
        shown = [self.arrays[column].like for column in columns]
        if not all(map(is_spooled, shown)) and len({each.shape for each in shown}) == 1:
            for column in columns:
                yield {column: self._column(column, slice(None))}
            return
        for begin in range(0, max(each.shape[0] for each in shown), rows):
            part = slice(begin, begin + rows)
            yield {column: self._column(column, part) for column in columns}
            for each in shown:
                release(each)

    def _column(self, index: int, part: slice) -> FloatArray:
        like, place = self.arrays[index].like, f"{self.source}, column {label(self.names, index)}"
        _check_real(place, like.dtype)
        if like.ndim != 1:
            raise InputError(f"{place} has shape {like.shape}: save one axis as one column")
        with damage_named(self.source):
            array = self.arrays[index].read()[part]
        _check_real(place, array.dtype)  # a damaged file may hold other numbers than it declares
        with np.errstate(all="ignore"):  # what leaves the range of float64 is rejected below
            values = np.array(array, dtype=np.float64)
        self.check_usable(index, values, part.start or 0)
        return values


def _check_real(place: str, dtype: np.dtype[Any]) -> None:
    if dtype.kind not in "iuf":
        kind = _KINDS.get(dtype.kind, "something else than numbers")
        raise InputError(f"{place} holds {kind}: save real numbers")


def _stated_rate(source: str, entries: Mapping[str, Array]) -> float | None:
    """The rate that a single number states, in a group or a structure too."""
    rates: dict[str, float] = {}
    for name, array in entries.items():
        key, like = re.split("[./]", bare(name).lower())[-1], array.like
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


def _unnamed(source: str, array: Array) -> list[_Named]:
    rows, width = array.like.shape
    if width > rows and width >= tuning.FEWEST_SAMPLES:
        text = f"{source} has shape {array.like.shape}"
        raise InputError(f"{text}: samples run along the rows here, save array.T")
    return [("", array[:, i]) for i in range(width)]


def is_sensor(name: str) -> bool:
    """Whether the name of an array is that of a gyro or an accelerometer without its axis."""
    return meaning(_of_axis(name, AXES[0])).role in CANONICAL


def _of_axis(name: str, axis: str) -> str:
    """The name with an axis before its unit."""
    unit = name[len(bare(name)) :].strip()
    return f"{bare(name)}_{axis} {unit}".rstrip()


def _axes_or_itself(name: str, array: Array) -> list[_Named]:
    if array.like.ndim == 2 and array.like.shape[1] == len(AXES):
        return [(_of_axis(name, axis), array[:, i]) for i, axis in enumerate(AXES)]
    return [(name, array)]


_INDEX = "__index_level_0__"  # name that Arrow gives to an index of pandas without one
_Parts = Callable[[Sequence[int], int], Iterator[Sequence[Any]]]


@dataclass(frozen=True, eq=False, kw_only=True)
class FrameTable(Table):
    """Columns of an Arrow table."""

    types: tuple[Any, ...]
    parts: _Parts  # indices of columns and a number of rows -> their values, so many rows at a time

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[Columns]:
        from pyarrow import types

        are_numbers = (types.is_integer, types.is_floating, types.is_decimal, _is_time)
        for column in columns:
            kind = self.types[column]
            if not any(each(kind) for each in are_numbers):
                text = f"{self.source}, column {label(self.names, column)} holds {kind}"
                raise InputError(f"{text}: give numbers, a column for each axis")
        row = 0
        with damage_named(self.source):
            for part in self.parts(columns, rows):
                found = {}
                for column, values in zip(columns, part, strict=True):
                    found[column] = self._floats(column, values)
                    self.check_usable(column, found[column], row)
                row += len(part[0]) if part else 0
                yield found

    def _floats(self, column: int, values: Any) -> FloatArray:
        """Values of a column; stamps less the first one, so that nanoseconds keep their digits."""
        import pyarrow as pa

        kind = self.types[column]
        is_stamp = pa.types.is_integer(kind) and self.meanings[column].role == TIME
        if not (is_stamp or _is_time(kind)):
            with np.errstate(invalid="ignore"):  # half floats may hold NaN that signal
                numbers: FloatArray = values.cast(pa.float64(), safe=False).to_numpy() + 0.0
            return numbers
        missing = values.is_null().to_numpy()
        ticks = values.cast(pa.int64(), safe=False).fill_null(0).to_numpy()
        origin = self.origins.setdefault(
            column, int(ticks[np.argmin(missing)]) if ticks.size else 0
        )
        return np.where(missing, np.nan, (ticks - origin).astype(float))


def _is_time(kind: Any) -> bool:
    from pyarrow import types

    return bool(types.is_timestamp(kind) or types.is_duration(kind))


def open_frame(data: Any, wanted: Wanted) -> tuple[FrameTable, ...]:
    """A DataFrame of pandas or polars, an Arrow table, or what gives itself as one."""
    import pyarrow as pa

    source = f"the {type(data).__module__.partition('.')[0]} {type(data).__name__}"
    try:
        if isinstance(data, pa.Table):
            table = data
        elif hasattr(data, "iloc"):
            names = getattr(data, "columns", None)
            if names is None:
                raise InputError(f"{source} is a single column: give a DataFrame with names")
            table = pa.Table.from_pandas(data.rename(columns=str))
            unnamed = {str(name) for name in names if not isinstance(name, str)}
            table = table.rename_columns(["" if n in unnamed else n for n in table.column_names])
        else:
            table = data.to_arrow() if hasattr(data, "to_arrow") else pa.table(data)
    except (pa.ArrowException, TypeError, AttributeError, ValueError) as error:
        raise InputError(f"{source} is not a table of numbers: {error}") from error
    return (_in_memory(source, table),)


def open_parquet(path: Path, wanted: Wanted) -> tuple[FrameTable, ...]:
    """Open a Parquet file."""
    import pyarrow as pa
    from pyarrow import parquet

    def parts(columns: Sequence[int], rows: int) -> Iterator[Sequence[Any]]:
        names = [schema.names[column] for column in columns]
        # Not mapped: what was read would stay in memory.
        for batch in parquet.ParquetFile(path).iter_batches(batch_size=rows, columns=names):
            part = pa.Table.from_batches([batch]).flatten()
            yield [part.column(name) for name in names]

    with damage_named(path.name):
        file = parquet.ParquetFile(path, memory_map=True)
        # With the fields of messages, ``angular_velocity.x``, as columns.
        schema = file.schema_arrow.empty_table().flatten().schema
        return (_table(path.name, schema, file.metadata.num_rows, parts),)


def open_feather(path: Path, wanted: Wanted) -> tuple[FrameTable, ...]:
    """Open a Feather file, which is one of Arrow's."""
    from pyarrow import feather

    with damage_named(path.name):
        return (_in_memory(path.name, feather.read_table(path, memory_map=True)),)


def _in_memory(source: str, table: Any) -> FrameTable:
    flat = table.flatten()

    def parts(columns: Sequence[int], rows: int) -> Iterator[Sequence[Any]]:
        for begin in range(0, flat.num_rows, rows):
            yield [flat.column(column).slice(begin, rows) for column in columns]

    return _table(source, flat.schema, flat.num_rows, parts)


def _table(source: str, schema: Any, rows: int, parts: _Parts) -> FrameTable:
    if not schema.names:
        raise InputError(f"{source} holds no columns: save samples in it")
    names, types = [], tuple(each.type for each in schema)
    for name, kind in zip(schema.names, types, strict=True):
        if name == _INDEX:  # an index of pandas that only counts the rows is none of its columns
            name = "time" if _is_time(kind) else "index"
        if _is_time(kind):
            name = bare(name) if meaning(bare(name)).role == TIME else name
            name = f"{name} [{kind.unit}]"
        names.append(name)
    return FrameTable(source=source, names=tuple(names), types=types, rows=rows, parts=parts)
