"""Tables of Arrow, in memory or in files: pandas, polars, Parquet, Feather."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core import memory
from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.formats.arrays import check_usable, damage_named
from gmwm.readers.names import TIME, bare, meaning
from gmwm.readers.table import label

_INDEX = "__index_level_0__"
"""Name that Arrow gives to an index of pandas without one."""


@dataclass(frozen=True, eq=False)
class FrameTable:
    """Columns of an Arrow table.

    read: Index of a column -> its values, a `pyarrow.ChunkedArray`.
    parts: Indices of columns and a number of rows -> their values, so many rows at a time.
    """

    source: str
    names: tuple[str, ...]
    types: tuple[Any, ...]
    rows: int
    read: Callable[[int], Any]
    parts: Callable[[Sequence[int], int], Iterator[Sequence[Any]]]
    rate: float | None = None
    tentative: bool = False
    notices: tuple[Notice, ...] = ()

    def load(self, columns: Sequence[int]) -> dict[int, FloatArray]:
        """Read some columns; see `Table`.

        Raises InputError if a column holds no numbers, one is infinite, or there is not enough
            memory.
        """
        memory.require(tuning.BYTES_PER_SAMPLE * self.rows * len(columns), self.source)
        return {column: self._column(column, self._read(column), {}) for column in columns}

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[dict[int, FloatArray]]:
        """The same, ``rows`` or fewer at a time."""
        first: dict[int, int] = {}
        with damage_named(self.source):
            for part in self.parts(columns, rows):
                pairs = zip(columns, part, strict=True)
                yield {column: self._column(column, values, first) for column, values in pairs}

    def _read(self, column: int) -> Any:
        with damage_named(self.source):
            return self.read(column)

    def where(self, row: int) -> str:
        """Say which row."""
        return f"row {row} (counted from 0)"

    def _column(self, column: int, values: Any, first: dict[int, int]) -> FloatArray:
        """Values of a column; stamps are counted from the first, which is noted if it is new."""
        import pyarrow as pa

        kind = self.types[column]
        place = f"{self.source}, column {label(self.names, column)}"
        is_time = pa.types.is_timestamp(kind) or pa.types.is_duration(kind)
        if not (is_time or _is_number(kind)):
            raise InputError(f"{place} holds {kind}: give numbers, a column for each axis")
        with damage_named(self.source):
            is_stamp = pa.types.is_integer(kind) and meaning(self.names[column]).role == TIME
            if is_time or is_stamp:
                return _from_first(values, column, first)
            with np.errstate(invalid="ignore"):  # half floats may hold NaN that signal
                found = values.cast(pa.float64(), safe=False).to_numpy() + 0.0
        check_usable(place, found, self.where)
        return found


def _is_number(kind: Any) -> bool:
    import pyarrow as pa

    return bool(
        pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)
    )


def _from_first(values: Any, column: int, known: dict[int, int]) -> FloatArray:
    """Stamps less the first one, so that nanoseconds since 1970 keep their digits."""
    import pyarrow as pa

    missing = values.is_null().to_numpy()
    ticks = values.cast(pa.int64(), safe=False).fill_null(0).to_numpy()
    first = known.setdefault(column, int(ticks[np.argmin(missing)]) if ticks.size else 0)
    return np.where(missing, np.nan, (ticks - first).astype(float))


def is_frame(data: object) -> bool:
    """Whether it is a table of pandas, polars, Arrow, or what gives itself as one."""
    return not isinstance(data, type) and any(
        hasattr(data, name) for name in ("iloc", "to_arrow", "__arrow_c_stream__")
    )


def open_frame(data: Any) -> FrameTable:
    """A DataFrame of pandas or polars, an Arrow table, or what gives itself as one.

    Raises InputError if it cannot be turned into an Arrow table.
    """
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
    return _in_memory(source, table)


def open_parquet(path: Path) -> FrameTable:
    """Open a Parquet file.

    Raises InputError if it is damaged.
    """
    from pyarrow import parquet

    with damage_named(path.name):
        file = parquet.ParquetFile(path, memory_map=True)
        schema, rows = _flat_schema(file), file.metadata.num_rows
        return _table(
            path.name, schema, rows, partial(_parquet_column, path), partial(_parquet_parts, path)
        )


def _flat_schema(file: Any) -> Any:
    """With the fields of messages, ``angular_velocity.x``, as columns."""
    return file.schema_arrow.empty_table().flatten().schema


def _parquet_column(path: Path, column: int) -> Any:
    from pyarrow import parquet

    file = parquet.ParquetFile(path, memory_map=True)
    # By name, since a nested column has several leaves.
    return file.read(columns=[_flat_schema(file).names[column]]).flatten().column(0)


def _parquet_parts(path: Path, columns: Sequence[int], rows: int) -> Iterator[Sequence[Any]]:
    import pyarrow as pa
    from pyarrow import parquet

    file = parquet.ParquetFile(path)  # not mapped: what was read would stay in memory
    names = [_flat_schema(file).names[column] for column in columns]
    for batch in file.iter_batches(batch_size=rows, columns=names):
        part = pa.Table.from_batches([batch]).flatten()
        yield [part.column(name) for name in names]


def _slices(table: Any, columns: Sequence[int], rows: int) -> Iterator[Sequence[Any]]:
    for begin in range(0, table.num_rows, rows):
        yield [table.column(column).slice(begin, rows) for column in columns]


def open_feather(path: Path) -> FrameTable:
    """Open a Feather file, which is one of Arrow's.

    Raises InputError if it is damaged.
    """
    from pyarrow import feather

    with damage_named(path.name):
        return _in_memory(path.name, feather.read_table(path, memory_map=True))


def _in_memory(source: str, table: Any) -> FrameTable:
    flat = table.flatten()
    return _table(source, flat.schema, flat.num_rows, flat.column, partial(_slices, flat))


def _table(
    source: str,
    schema: Any,
    rows: int,
    read: Callable[[int], Any],
    parts: Callable[[Sequence[int], int], Iterator[Sequence[Any]]],
) -> FrameTable:
    names = tuple(_name(each.name, each.type) for each in schema)
    if not names:
        raise InputError(f"{source} holds no columns: save samples in it")
    # An index of pandas that only counts the rows is none of its columns.
    return FrameTable(source, names, tuple(each.type for each in schema), rows, read, parts)


def _name(name: str, kind: Any) -> str:
    """Name of a column; that of time stamps with their unit."""
    import pyarrow as pa

    if name == _INDEX:
        name = "time" if pa.types.is_timestamp(kind) or pa.types.is_duration(kind) else "index"
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
        known = bare(name) if meaning(bare(name)).role == TIME else name
        return f"{known} [{kind.unit}]"
    return name
