"""Flight logs of ArduPilot (DataFlash, binary).

A message is two marks, the number of its kind and a body, whose length and fields a message FMT
before it states (ArduPilot, libraries/AP_Logger/README.md). `IMU` holds samples of the filtered
sensors, `GYR` and `ACC` (raw logging) and the batches `ISBH` and `ISBD` those at the sensor's own
rate (libraries/AP_InertialSensor/LogStructure.h). All but batches are read in blocks.
"""

from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gmwm._core import memory
from gmwm._core.compiled import compiled
from gmwm._core.files import opened
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.readers.formats.arrays import AnyArray
from gmwm.readers.logs import topics
from gmwm.readers.logs.topics import MessageTable, Topic, topic_table
from gmwm.readers.names import AXES
from gmwm.readers.registry import Wanted
from gmwm.readers.table import Columns, Table, damage_named, damage_notice

_FMT, _BEGIN = 0x80, 3  # number of the kind that states the others, bytes before a body
_FORM = np.dtype("u1, u1, S4, S16, S64")
_FORM.names = ("type", "length", "name", "letters", "columns")
_TYPES = {
    "a": "(32,)<i2", "b": "i1", "B": "u1", "g": "<f2", "h": "<i2", "H": "<u2", "i": "<i4",
    "I": "<u4", "f": "<f4", "n": "S4", "N": "S16", "Z": "S64", "d": "<f8", "M": "u1", "q": "<i8",
    "Q": "<u8",
}  # fmt: skip
"""By the letter of a field; no message of an IMU has those that stand for a hundredth."""

_BLOCK = 1 << 22  # bytes read at a time

_RANKS = {"IMU": 0, "IMU2": 0, "IMU3": 0, "GYR": 1, "ACC": 1}
_HEADER, _DATA = "ISBH", "ISBD"
_SENSORS = {"gyro": "Gyr", "accel": "Acc"}
_OF_BATCH = ("accel", "gyro")  # IMU_SENSOR_TYPE_ACCEL, IMU_SENSOR_TYPE_GYRO
_TIME = "time [us]"
_SAMPLES = 32  # of a message of a batch
_MARKS = b"\xa3\x95"
_DAMAGE = "is not a binary log of ArduPilot, or is damaged or cut off: get a whole copy"
_REMAINS = 528  # bytes at the end that may be remains of a page: pymavlink passes over as many


@compiled()
def _walk(
    data: npt.NDArray[np.uint8],
    at: int,
    end: int,
    lengths: npt.NDArray[np.int64],
    is_wanted: npt.NDArray[np.bool_],
    kinds: npt.NDArray[np.int64],
    places: npt.NDArray[np.int64],
) -> tuple[int, int, int, int]:
    """Kinds and places of wanted messages up to an FMT: count, next place, odd bytes, last end."""
    count = between = 0
    while at + 3 <= data.size:
        kind = data[at + 2]
        if data[at] != 0xA3 or data[at + 1] != 0x95 or lengths[kind] < 3:
            at += 1
            continue
        if at + lengths[kind] > data.size:
            break
        if is_wanted[kind]:
            kinds[count], places[count] = kind, at
            count += 1
        between += at - end
        at += lengths[kind]
        end = at
        if kind == 0x80:
            break
    return count, at, between, end


class Messages(NamedTuple):
    """Messages of one kind that follow each other, and where each begins in the file."""

    kind: str
    rows: AnyArray
    places: AnyArray


class Log:
    """Messages of some kinds, block by block, whose statements FMT are followed.

    KeyError, ValueError if the statement of a wanted kind is damaged.
    """

    def __init__(self, path: Path, wanted: Collection[str]):
        self.path, self.wanted = path, wanted
        self.between = self.end = 0  # bytes that are no messages, and the end of the last message
        self._types: dict[int, tuple[str, np.dtype[np.void]]] = {}
        self._lengths = np.zeros(256, np.int64)
        self._lengths[_FMT] = _BEGIN + _FORM.itemsize
        self._is_wanted = np.zeros(256, np.bool_)
        self._is_wanted[_FMT] = True

    def _add(self, body: npt.NDArray[np.uint8]) -> None:
        form = np.frombuffer(body.tobytes(), _FORM)[0]
        number, name = int(form["type"]), form["name"].decode("latin-1")
        if number == _FMT:
            return
        self._lengths[number] = form["length"]
        self._is_wanted[number] = name in self.wanted
        if name not in self.wanted:
            return
        fields = form["columns"].decode("latin-1").split(",")
        pairs = zip(fields, form["letters"].decode("latin-1"), strict=True)
        kind = np.dtype([(field, _TYPES[letter]) for field, letter in pairs])
        if kind.itemsize + _BEGIN != form["length"]:
            raise ValueError(f"the fields of {name} do not have its length")
        self._types[number] = name, kind

    def __iter__(self) -> Iterator[Messages]:
        before, rest, end = 0, b"", 0
        with opened(self.path) as stream:
            while fresh := stream.read(_BLOCK):
                data = np.frombuffer(rest + fresh, np.uint8)
                at, count = 0, 1
                kinds, places = np.empty((2, data.size // _BEGIN + 1), np.int64)
                while count:
                    count, at, between, end = _walk(
                        data, at, end, self._lengths, self._is_wanted, kinds, places
                    )
                    self.between += between
                    is_form = bool(count) and kinds[count - 1] == _FMT
                    own = slice(count - is_form)
                    for kind in np.unique(kinds[own]):
                        mine, (name, dtype) = places[own][kinds[own] == kind], self._types[kind]
                        inside = _BEGIN + np.arange(dtype.itemsize)
                        rows = data[mine[:, None] + inside].view(dtype)[:, 0]
                        yield Messages(name, rows, before + mine)
                    if is_form:
                        self._add(data[at - _FORM.itemsize : at])
                    else:
                        count = 0
                self.end = before + end
                before += at
                end -= at
                rest = data[at:].tobytes()


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
        names = [f"{_SENSORS[sensor]}{axis.upper()}" for axis in AXES]
        return [name for name in names if name in self.fields]

    @property
    def columns(self) -> dict[str, str]:
        """Stamps, axes and temperature: column -> field."""
        # The stamp of the sample where there is one: TimeUS is when it was logged.
        found = {_TIME: "SampleUS" if "SampleUS" in self.fields else "TimeUS"}
        for sensor, unit in SI_UNIT.items():
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
        fields = list(self.series.columns.values())
        with damage_named(self.source, _DAMAGE):
            for _, found, _ in Log(self.path, (self.series.kind,)):
                part = {column: found[fields[column]].astype(float) for column in columns}
                if self.series.instance is not None:
                    mine = found["I"] == self.series.instance
                    part = {column: values[mine] for column, values in part.items()}
                yield part


def open_ardupilot(path: Path, wanted: Wanted) -> tuple[Table, ...]:
    """Open a binary log of ArduPilot.

    Topics are ``"IMU[1]"``, or ``"GYR[0]"`` and ``"ACC[0]"``; by default that of `IMU`, else of
    `GYR` and `ACC`, else the batches, if there is one IMU.
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
    chosen = topics.choose(path.name, ranks, wanted)
    by_name = {series.name: series for series in counts}
    tables: list[Table] = []
    for topic in chosen:
        notices = () if tables else (*damaged, *topics.left_out(ranks, chosen))
        if topic.name in by_name:
            series = by_name[topic.name]
            table = DataflashTable(
                source=path.name,
                names=tuple(series.columns),
                notices=list(notices),
                topic=topic,
                imu=topic.imu,
                rows=topic.count,
                path=path,
                series=series,
                stamps=f"{series.columns[_TIME]} of {series.name}",
                origin=f"messages {series.kind}",
            )
            tables.append(table)
        else:
            _, columns = batches[topic.name]
            tables.append(topic_table(path.name, topic, columns, "messages ISBH and ISBD", notices))
    return tuple(tables)


_Batches = dict[str, tuple[str, dict[str, AnyArray]]]


def _contents(
    path: Path,
) -> tuple[dict[_Series, int], dict[_Series, frozenset[str]], _Batches, str]:
    """How many messages there are of each series, its sensors, the batches, and what is damaged."""
    counts, sensors = Counter[_Series](), defaultdict[_Series, frozenset[str]](frozenset)
    headers, data = list[Messages](), list[Messages]()
    held, log, stamps = 0, Log(path, (*_RANKS, _HEADER, _DATA)), list[float]()
    for found in log:
        kind, rows, _ = found
        fields = rows.dtype.names or ()
        if "TimeUS" in fields:
            stamps = [*stamps[:1], *rows["TimeUS"][[0, -1]].tolist()]
        if kind in (_HEADER, _DATA):
            (headers if kind == _HEADER else data).append(found)
            held += 4 * rows.nbytes  # as float64
            memory.require(held, path.name)
        elif "TimeUS" in fields:
            for number in np.unique(rows["I"]).tolist() if "I" in fields else [None]:
                mine = rows if number is None else rows[rows["I"] == number]
                series = _Series(kind, number, fields)
                counts[series] += mine.size
                sensors[series] |= {
                    sensor
                    for sensor in _SENSORS
                    if any(np.any(mine[field]) for field in series.fields_of(sensor))
                }
    order = sorted(counts, key=lambda each: (list(_RANKS).index(each.kind), each.instance or 0))
    seconds = (stamps[-1] - stamps[0]) * 1e-6 if stamps else 0.0
    end = topics.end_of_content(path)
    with opened(path) as stream:
        stream.seek(log.end)
        rest = stream.read(max(min(end - log.end, _REMAINS), 0))
    is_cut = bool(rest) and rest[:2] == _MARKS[: len(rest)]
    damage = topics.cut_off(seconds) if is_cut else ""
    if between := log.between + (len(rest) if len(rest) == _REMAINS else 0):
        damage = f"is damaged in places, where {between:,} bytes or more are not messages"
    return {each: counts[each] for each in order}, sensors, _batches(headers, data), damage


def _batches(parts_of_header: Sequence[Messages], parts: Sequence[Messages]) -> _Batches:
    """Samples of each sensor from its batches: a header, then messages of 32 samples."""
    found: _Batches = {}
    if not parts_of_header or not parts:
        return found
    names = ("N", "type", "instance", "mul", "smp_cnt", "SampleUS", "smp_rate")
    headers, data = (
        {name: np.concatenate([part.rows[name] for part in each]) for name in fields}
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
                columns[f"{sensor}_{axis} [{SI_UNIT[sensor]}]"] = values[there]
        found[f"batch_{sensor}[{number}]"] = (sensor, columns)
    return found
