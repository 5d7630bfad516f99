"""A long recording, a block at a time: what does not fit into memory."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, Literal, Protocol, cast

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.blocks.written import Written
from gmwm.readers.clock import (
    CLOCK_CODES,
    agree,
    change_notice,
    check_rates,
    jumps_of_all,
    repeated_notice,
)
from gmwm.readers.formats import has_sensors
from gmwm.readers.missing import Missing, missing_notices
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

    def __getattr__(self, name: str) -> Any:
        return getattr(self.whole, name)

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
    damaged: bool = False,
    rows: int = tuning.ROWS_OF_BLOCK,
) -> Iterator[Recording]:
    """Read a static recording a block at a time, as `gmwm.read` does as a whole.

    path, rate, units, channels, time, layout, topic, clock, format, damaged: As in `gmwm.read`, of
        delimited text, NPY, Parquet, Feather, a bag, `IMU`, `GYR` or `ACC` of ArduPilot, a binary
        layout or a table in memory; of one topic. Temperatures with stamps of their own are left
        out.
    rows: Of a block, about.
    Yields: consecutive parts on one grid of the sampling interval of the first; rows that are
        missing between two of them are NaN at the beginning of the second.
    Raises InputError if the file cannot be used, or not a block at a time.
    """
    opened = tables_of(path, layout, topic, clock, format, channels, damaged)
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
    done, elapsed, since = 0, 0.0, 0.0
    given = Given(rate, units or {}, channels, time)
    for arrays, own, copies in _segments(table, given, rows):
        part = part_of(_Segment(table, arrays, done - own.start), given, done, own, since)
        found = part.recording
        if copies:
            found = replace(found, notices=(*found.notices, repeated_notice(copies)))
        first = first or found
        if not agree(found.rate, first.rate):
            where = table.where(done)
            check_rates(first.rate, found.rate, f"{first.source}, near {where}")
            changes = change_notice((first.rate, found.rate), first.rate, where)
            found = replace(found, notices=(changes, *found.notices))
        samples = part.samples(own)
        cut = [replace(c, values=c.values[samples], dt=first.dt) for c in found.channels]
        done += own.stop - own.start + copies
        elapsed += cut[0].n * first.dt
        seen = part.samples(slice(max(own.stop - tuning.ROWS_BESIDE, 0), own.stop))
        since = elapsed - (seen.stop - seen.start) * first.dt
        yield replace(found, channels=tuple(cut))


def _segments(
    table: _Divisible, given: Given, rows: int
) -> Iterator[tuple[dict[int, FloatArray], slice, int]]:
    """Columns of some rows after others, which rows these are, and how many among them were written
    before and are not there. Those on either side of them are there too, so that a clock is
    followed across the seams. A rest of less than half as many is joined to the last.
    """
    roles = roles_of(table, given)
    beside = 0 if roles.time is None else tuning.ROWS_BESIDE
    wanted = sorted({*roles.columns, *(column.index for column in roles.auxiliary)})
    before: dict[int, FloatArray] = {}
    held: dict[int, FloatArray] = {}
    copies = 0
    written = None if roles.time is None else Written(roles.time)
    for some in chain(table.segments(wanted, rows), [{}]):
        arrays, again = written.fresh(some) if written is not None and some else (some, 0)
        copies += again
        if again == _size(some) > 0:
            continue
        if held and arrays and _is_rest(_size(arrays), _size(held), rows):
            arrays = _joined(held, arrays)
        elif held:
            after = {i: values[:beside] for i, values in arrays.items()}
            start, stop = _size(before), _size(before) + _size(held)
            found = _joined(before, held, after)
            before = {i: values[max(stop - beside, 0) : stop] for i, values in found.items()}
            yield found, slice(start, stop), copies - again
            copies = again
        held = arrays
    if not before:
        raise InputError(f"{table.source} holds no samples: record longer")


def _joined(*parts: dict[int, FloatArray]) -> dict[int, FloatArray]:
    some = [part for part in parts if part]
    return {i: np.concatenate([part[i] for part in some]) for i in some[0]}


def _is_rest(size: int, held: int, rows: int) -> bool:
    """Whether so few rows go with those before them, which may not become many for it."""
    return size < tuning.FEWEST_OF_BLOCK or (2 * size < rows and held <= rows)


def _size(arrays: Mapping[int, FloatArray]) -> int:
    return len(next(iter(arrays.values()), ()))


def notices_of_blocks(
    noticed: Iterable[Notice], missing: Mapping[str, Missing]
) -> tuple[Notice, ...]:
    """The first of each kind that blocks have, and what is missing in all of them."""
    kinds: dict[tuple[str, str], list[Notice]] = {}
    for notice in noticed:
        kinds.setdefault((notice.code, notice.where), []).append(notice)
    kept = [_of_all(alike) for (code, _), alike in kinds.items() if code != "missing-samples"]
    return (*kept, *missing_notices(missing))


def _of_all(alike: Sequence[Notice]) -> Notice:
    """The first of one kind, with what there is in all blocks where that is counted."""
    first = alike[0]
    if len(alike) == 1 or first.code not in CLOCK_CODES or "count" not in first.values:
        return first
    if first.code == "clock-jumps":
        return jumps_of_all(alike)
    count = sum(float(each.values["count"]) for each in alike)
    if first.code == "rows-repeated":
        return repeated_notice(int(count))
    text = f"{first.text} ({count:,.0f} in all, in {len(alike)} stretches)"
    return replace(first, text=text, values={**first.values, "count": count})
