"""Flight logs of ArduPilot (DataFlash, binary).

`IMU` holds samples of the filtered sensors, `GYR` and `ACC` (raw logging) and the batches `ISBH`
and `ISBD` those at the sensor's own rate (ArduPilot, libraries/AP_InertialSensor/LogStructure.h).
The former are read in blocks: memory holds no more than the columns that are asked for.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gmwm._core import memory
from gmwm.errors import InputError
from gmwm.readers.formats.arrays import AnyArray, ArrayTable, array_of
from gmwm.readers.logs.topics import (
    MessageTable,
    Topic,
    choose_first,
    cut_off,
    end_of_content,
    left_out,
)
from gmwm.readers.names import AXES
from gmwm.readers.registry import Wanted
from gmwm.readers.table import Columns, Table, damage_named, damage_notice

if TYPE_CHECKING:
    from gmwm.readers.logs.dataflash import Extent, Messages

_RANKS = {"IMU": 0, "IMU2": 0, "IMU3": 0, "GYR": 1, "ACC": 1}
_HEADER, _DATA = "ISBH", "ISBD"
_SENSORS = {"gyro": ("Gyr", "rad/s"), "accel": ("Acc", "m/s^2")}
_OF_BATCH = ("accel", "gyro")  # IMU_SENSOR_TYPE_ACCEL, IMU_SENSOR_TYPE_GYRO
_TIME = "time [us]"
_SAMPLES = 32  # of a message of a batch
_MARKS = b"\xa3\x95"
_DAMAGE = "is no binary log of ArduPilot, or is damaged or cut off: get a whole copy"
_REMAINS = 528
"""Bytes at the end that may be remains of a page of the memory: pymavlink passes over as many."""


@dataclass(frozen=True)
class _Series:
    """Messages of a kind, of one instance if they have a number of it."""

    kind: str
    instance: int | None
    fields: tuple[str, ...]

    @property
    def name(self) -> str:
        return self.kind if self.instance is None else f"{self.kind}[{self.instance}]"

    def fields_of(self, sensor: str) -> list[str]:
        """Those of its axes."""
        names = [f"{_SENSORS[sensor][0]}{axis.upper()}" for axis in AXES]
        return [name for name in names if name in self.fields]

    @property
    def columns(self) -> dict[str, str]:
        """Stamps, axes and temperature: column -> field."""
        # The stamp of the sample where there is one: TimeUS is when it was logged.
        found = {_TIME: "SampleUS" if "SampleUS" in self.fields else "TimeUS"}
        for sensor, (_, unit) in _SENSORS.items():
            for field in self.fields_of(sensor):
                found[f"{sensor}_{field[-1].lower()} [{unit}]"] = field
        if "T" in self.fields:
            found["temperature [degC]"] = "T"
        return found


@dataclass(frozen=True, eq=False, kw_only=True)
class DataflashTable(MessageTable):
    """Messages of one IMU, or of one sensor of it: one a row."""

    path: Path
    series: _Series

    def parts(self, columns: Sequence[int]) -> Iterator[Columns]:
        """Columns of one block of messages after another."""
        from gmwm.readers.logs.dataflash import messages  # compiled

        fields = list(self.series.columns.values())
        with damage_named(self.source, _DAMAGE):
            for found in messages(self.path, (self.series.kind,)):
                part = {column: found[fields[column]].astype(float) for column in columns}
                if self.series.instance is not None:
                    mine = found["I"] == self.series.instance
                    part = {column: values[mine] for column, values in part.items()}
                yield part


def open_ardupilot(path: Path, wanted: Wanted) -> tuple[Table, ...]:
    """Open a binary log of ArduPilot.

    wanted: Topics as ``"IMU[1]"``, or ``"GYR[0]"`` and ``"ACC[0]"``; by default that of `IMU`, else
        those of `GYR` and `ACC`, else the batches, if there is one IMU.
    Raises InputError if it is damaged, holds no IMU or half of one, or topics have to be chosen.
    """
    with damage_named(path.name, _DAMAGE):
        counts, sensors, batches, damage = _contents(path)
    damaged = (damage_notice(path.name, damage, wanted.damaged),) if damage else ()
    ranks: list[list[Topic]] = [[], [], []]
    for series, count in counts.items():
        ranks[_RANKS[series.kind]].append(Topic(series.name, count, sensors[series]))
    for name, (sensor, columns) in batches.items():
        ranks[2].append(Topic(name, columns[_TIME].size, frozenset((sensor,))))
    if not any(ranks):
        raise InputError(
            f"{path.name} has no messages IMU, GYR, ACC or ISBD: set LOG_BITMASK to log the IMU"
        )
    chosen = choose_first(path.name, ranks, wanted)
    by_name = {series.name: series for series in counts}
    tables: list[Table] = []
    for topic in chosen:
        notices = () if tables else (*damaged, *left_out(ranks, chosen))
        if topic.name in by_name:
            series = by_name[topic.name]
            names = series.columns
            tables.append(
                DataflashTable(
                    source=path.name,
                    names=tuple(names),
                    notices=list(notices),
                    topic=topic,
                    path=path,
                    series=series,
                    stamps=f"{names[_TIME]} of {series.name}",
                    origin=f"messages {series.kind}",
                )
            )
        else:
            _, columns = batches[topic.name]
            entries = {name: array_of(values) for name, values in columns.items()}
            about = {"stamps": f"stamps of {topic.name}", "origin": "messages ISBH and ISBD"}
            tables.append(ArrayTable.of_entries(path.name, entries, notices, **about))
    return tuple(tables)


_Batches = dict[str, tuple[str, dict[str, AnyArray]]]


def _contents(
    path: Path,
) -> tuple[dict[_Series, int], dict[_Series, frozenset[str]], _Batches, str]:
    """How many messages there are of each series, its sensors, the batches, and what is damaged."""
    from gmwm.readers.logs.dataflash import Extent, messages  # compiled

    counts: Counter[_Series] = Counter()
    sensors: dict[_Series, frozenset[str]] = {}
    headers: list[Messages] = []
    data: list[Messages] = []
    held, extent, stamps = 0, Extent(), list[float]()
    for found in messages(path, (*_RANKS, _HEADER, _DATA), extent):
        if "TimeUS" in found.fields:
            stamps = [*stamps[:1], *found["TimeUS"][[0, -1]].tolist()]
        if found.kind in (_HEADER, _DATA):
            (headers if found.kind == _HEADER else data).append(found)
            held += 4 * found.rows.nbytes  # as float64
            memory.require(held, path.name)
        elif "TimeUS" in found.fields:
            for number in np.unique(found["I"]).tolist() if "I" in found.fields else [None]:
                mine = slice(None) if number is None else found["I"] == number
                series = _Series(found.kind, number, found.fields)
                counts[series] += found.rows[mine].size
                sensors[series] = sensors.get(series, frozenset()) | {
                    sensor
                    for sensor in _SENSORS
                    if any(np.any(found[field][mine]) for field in series.fields_of(sensor))
                }
    order = sorted(counts, key=lambda each: (list(_RANKS).index(each.kind), each.instance or 0))
    seconds = (stamps[-1] - stamps[0]) * 1e-6 if stamps else 0.0
    damage = _damage_of(path, extent, seconds)
    return {each: counts[each] for each in order}, sensors, _batches(headers, data), damage


def _damage_of(path: Path, extent: Extent, seconds: float) -> str:
    """What is wrong with a log of which messages were found, if anything is."""
    end = end_of_content(path)
    with path.open("rb") as stream:
        stream.seek(extent.end)
        rest = stream.read(max(min(end - extent.end, _REMAINS), 0))
    between = extent.between + (len(rest) if len(rest) == _REMAINS else 0)
    if between:
        return f"is damaged in places, where {between:,} bytes or more are no messages"
    return cut_off(seconds) if rest and rest[:2] == _MARKS[: len(rest)] else ""


def _batches(parts_of_header: Sequence[Messages], parts: Sequence[Messages]) -> _Batches:
    """Samples of each sensor from its batches: a header, then messages of 32 samples."""
    found: _Batches = {}
    if not parts_of_header or not parts:
        return found
    names = ("N", "type", "instance", "mul", "smp_cnt", "SampleUS", "smp_rate")
    headers, data = (
        {name: np.concatenate([part[name] for part in each]) for name in fields}
        for each, fields in ((parts_of_header, names), (parts, ("N", "seqno", *AXES)))
    )
    place, place_of_header = (
        np.concatenate([part.places for part in each]) for each in (parts, parts_of_header)
    )
    of = np.searchsorted(place_of_header, place) - 1
    known = (of >= 0) & (headers["N"][of] == data["N"])
    rate, scale = headers["smp_rate"].astype(float), headers["mul"].astype(float)
    for kind, number in np.unique(np.column_stack([headers["type"], headers["instance"]]), axis=0):
        if kind >= len(_OF_BATCH):
            continue
        mine = known & (headers["type"][of] == kind) & (headers["instance"][of] == number)
        header = of[mine]
        if not header.size:
            continue
        index = data["seqno"][mine].astype(np.int64)[:, None] * _SAMPLES + np.arange(_SAMPLES)
        there = index < headers["smp_cnt"][header][:, None]
        first = headers["SampleUS"][header].astype(float)[:, None]
        sensor = _OF_BATCH[kind]
        with np.errstate(all="ignore"):  # a rate of zero is refused with its stamps
            columns = {_TIME: (first + 1e6 * index / rate[header][:, None])[there]}
            for axis in AXES:
                values = data[axis][mine] / scale[header][:, None]
                columns[f"{sensor}_{axis} [{_SENSORS[sensor][1]}]"] = values[there]
        found[f"batch_{sensor}[{number}]"] = (sensor, columns)
    return found
