"""A long recording, a block at a time: what does not fit into memory."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol, cast

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.clock import agree, is_time_of_day, seconds_of_day
from gmwm.readers.formats import has_sensors
from gmwm.readers.reader import part_of, tables_of
from gmwm.readers.recording import Recording
from gmwm.readers.roles import Given, Reference, roles_of
from gmwm.readers.table import Table


class _Divisible(Table, Protocol):
    """A table that gives some rows at a time."""

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[dict[int, FloatArray]]: ...


@dataclass(frozen=True)
class _Segment:
    """Some rows of a table, as a table: they are read already."""

    whole: Table
    arrays: Mapping[int, FloatArray]
    before: int

    source = property(lambda self: self.whole.source)
    names = property(lambda self: self.whole.names)
    tentative = property(lambda self: self.whole.tentative)
    rate = property(lambda self: self.whole.rate)
    notices = property(lambda self: self.whole.notices)

    def load(self, columns: Sequence[int]) -> dict[int, FloatArray]:
        return {column: self.arrays[column] for column in columns}

    def where(self, row: int) -> str:
        return self.whole.where(self.before + row)


def read_blocks(
    path: str | os.PathLike[str] | Any,
    rate: float | None = None,
    units: Mapping[str, str] | None = None,
    channels: Mapping[str, Reference] | Collection[str] | None = None,
    time: Reference | Literal[False] | None = None,
    layout: str | None = None,
    *,
    topic: str | Sequence[str] = (),
    clock: str = "header",
    format: str | None = None,
    rows: int = tuning.ROWS_OF_BLOCK,
) -> Iterator[Recording]:
    """Read a static recording a block at a time, as `gmwm.read` does as a whole.

    Parameters
    ----------
    path, rate, units, channels, time, layout, topic, clock, format
        As in `gmwm.read`, of delimited text, NPY, Parquet, Feather, a bag, `IMU`, `GYR` or `ACC` of
        ArduPilot, a binary layout or a table in memory; of one topic. Temperatures with stamps of
        their own are left out.
    rows : int, optional
        Of a block, about.

    Yields
    ------
    Recording
        Consecutive parts on one grid of the sampling interval of the first; rows that are missing
        between two of them are NaN at the beginning of the second.

    Raises
    ------
    InputError
        If the file cannot be used, or not a block at a time.
    """
    opened = tables_of(path, layout, topic, clock, format)
    tables = [table for table in opened if has_sensors(table)] or opened
    if not all(hasattr(table, "segments") for table in tables):
        raise InputError(
            f"{tables[0].source} cannot be read a block at a time: convert it to Parquet, CSV or "
            "NPY, or read fewer channels",
            "not-divisible",
        )
    if len(tables) > 1:
        raise InputError(
            f"{tables[0].source}: {len(tables)} topics cannot be read a block at a time together: "
            "choose one",
            "topic",
        )
    table = cast(_Divisible, tables[0])
    first: Recording | None = None
    since: FloatArray | None = None  # time stamps of a part and the last one before it
    end: FloatArray | None = None
    of_day = False
    done = 0
    given = Given(rate, units or {}, channels, time)
    for arrays, stamps in _segments(table, given, rows):
        # Later parts may hold no samples at all.
        fewest = 0 if done else tuning.FEWEST_SAMPLES
        found = part_of(_Segment(table, arrays, done), given, fewest).recording
        if first is None:
            first = found
        if stamps is not None:
            of_day = of_day or is_time_of_day(stamps)
            since = None if end is None else np.append(end, stamps)
            since = seconds_of_day(since) if of_day and since is not None else since
            end = stamps[-1:]
        found = _on_the_grid(found, first, since, done)
        done += _size(arrays)
        yield found


def _segments(
    table: _Divisible, given: Given, rows: int
) -> Iterator[tuple[dict[int, FloatArray], FloatArray | None]]:
    """Columns of some rows after others; a rest of less than half as many is joined to the last."""
    roles = roles_of(table, given)
    wanted = sorted({*roles.columns, *(column.index for column in roles.auxiliary)})
    held: dict[int, FloatArray] | None = None
    for arrays in table.segments(wanted, rows):
        if held is not None and _is_rest(_size(arrays), _size(held), rows):
            arrays = {i: np.concatenate([held[i], values]) for i, values in arrays.items()}
            held = None
        if held is not None:
            yield held, None if roles.time is None else held[roles.time]
        held = arrays
    if held is None:
        raise InputError(f"{table.source} holds no samples: record longer")
    yield held, None if roles.time is None else held[roles.time]


def _is_rest(size: int, held: int, rows: int) -> bool:
    """Whether so few rows go with those before them, which may not become many for it."""
    return size < tuning.FEWEST_OF_BLOCK or (2 * size < rows and held <= rows)


def _size(arrays: Mapping[int, FloatArray]) -> int:
    return next(iter(arrays.values())).size


def _on_the_grid(
    found: Recording, first: Recording, since: FloatArray | None, rows: int
) -> Recording:
    """A part with the rows that are missing between it and the one before."""
    if not agree(found.rate, first.rate):
        raise InputError(
            f"{first.source}: the sampling rate changes, from {first.rate:.6g} to "
            f"{found.rate:.6g} Hz about row {rows:,}: cut the file there"
        )
    missing = 0
    if since is not None:
        step = (since[-1] - since[1]) / (found.n - 1)
        missing = round((since[1] - since[0]) / step) - 1
        if missing < -tuning.ROWS_BACK_OF_BLOCK:
            raise InputError(
                f"{first.source}: time stamps go back about row {rows:,}: cut the file there"
            )
        if missing > tuning.LONGEST_GAP_OF_BLOCK:
            raise InputError(
                f"{first.source}: time stamps go forward by {since[1] - since[0]:.6g} about row "
                f"{rows:,}, as if the clock was set: cut the file there"
            )
    gone = np.full(max(missing, 0), np.nan)
    return replace(
        found,
        channels=tuple(
            replace(c, values=np.concatenate([gone, c.values]) if gone.size else c.values,
                    dt=first.dt)
            for c in found.channels
        ),
    )  # fmt: skip


def notices_of_blocks(first: Recording, missing: Mapping[str, int], n: int) -> tuple[Notice, ...]:
    """Those of the first block that hold for all, and how much is missing in all of them."""
    kept = [notice for notice in first.notices if notice.code != "missing-samples"]
    for name, count in missing.items():
        if count:
            text = f"{count:,} of {n:,} samples missing"
            values = {"missing": count}
            kept.append(Notice("missing-samples", "note", name, text, values))
    return tuple(kept)
