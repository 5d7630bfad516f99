"""Tables of Arrow, in memory or in files: pandas, polars, Parquet, Feather."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers.names import TIME, bare, meaning
from gmwm.readers.registry import Wanted
from gmwm.readers.table import Columns, Table, damage_named, label

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
        first, row = dict[int, int](), 0
        with damage_named(self.source):
            for part in self.parts(columns, rows):
                found = {}
                for column, values in zip(columns, part, strict=True):
                    found[column] = self._floats(column, values, first)
                    self.check_usable(column, found[column], row)
                row += len(part[0]) if part else 0
                yield found

    def _floats(self, column: int, values: Any, first: dict[int, int]) -> FloatArray:
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
        start = first.setdefault(column, int(ticks[np.argmin(missing)]) if ticks.size else 0)
        return np.where(missing, np.nan, (ticks - start).astype(float))


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
