"""Flight logs of ArduPilot (DataFlash, binary) by pymavlink.

pymavlink finds the messages; their bytes are decoded here, all of a kind at once. `IMU` holds
samples of the filtered sensors, `GYR` and `ACC` (raw logging) and the batches `ISBH`/`ISBD` those
at the sensor's own rate (ArduPilot, libraries/AP_InertialSensor/LogStructure.h).
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gmwm.errors import InputError
from gmwm.readers.formats.arrays import AnyArray, ArrayTable, array_of, damage_named
from gmwm.readers.formats.extras import library
from gmwm.readers.formats.topics import Topic, choose_first, left_out
from gmwm.readers.names import AXES

_TYPES = {
    "a": "(32,)<i2", "b": "i1", "B": "u1", "g": "<f2", "h": "<i2", "H": "<u2", "i": "<i4",
    "I": "<u4", "f": "<f4", "n": "S4", "N": "S16", "Z": "S64", "c": "<i2", "C": "<u2", "e": "<i4",
    "E": "<u4", "L": "<i4", "d": "<f8", "M": "u1", "q": "<i8", "Q": "<u8",
}  # fmt: skip
"""Letters of a format (ArduPilot, libraries/AP_Logger/README.md) as types of numpy."""

_SENSORS = {"gyro": ("Gyr", "rad/s"), "accel": ("Acc", "m/s^2")}
_OF_BATCH = ("accel", "gyro")  # IMU_SENSOR_TYPE_ACCEL, IMU_SENSOR_TYPE_GYRO
_HEADER = 3  # bytes before a message
_ROWS = 1 << 16
_TIME = "time [us]"

_Columns = dict[str, AnyArray]


def open_ardupilot(path: Path, topics: Sequence[str], clock: str) -> tuple[ArrayTable, ...]:
    """Open a binary log of ArduPilot.

    Parameters
    ----------
    path : path
    topics : sequence of str
        Those to read, e.g. ``"IMU[1]"``, or ``"GYR[0]"`` and ``"ACC[0]"``; by default that of
        `IMU`, else those of `GYR` and `ACC`, else the batches, if there is one IMU.
    clock : str
        Not used: messages have one stamp.

    Raises
    ------
    InputError
        If it is damaged, holds no IMU, or topics have to be chosen.
    """
    with _opened(path) as log:
        ranks: list[list[Topic]] = [[], [], []]
        open_topic: dict[str, Callable[[], _Columns]] = {}
        for rank, kind in ((0, "IMU"), (0, "IMU2"), (0, "IMU3"), (1, "GYR"), (1, "ACC")):
            for name, rows in _instances(log, kind):
                sensors = frozenset(s for s, (part, _) in _SENSORS.items() if f"{part}X" in rows)
                ranks[rank].append(Topic(name, rows["TimeUS"].size, sensors))
                open_topic[name] = partial(_columns, rows)
        for name, sensor, columns in _batches(log):
            ranks[2].append(Topic(name, columns[_TIME].size, frozenset((sensor,))))
            open_topic[name] = partial(dict, columns)
        if not any(ranks):
            raise InputError(
                f"{path.name} has no messages IMU, GYR, ACC or ISBD: set LOG_BITMASK to log the IMU"
            )
        chosen = choose_first(path.name, ranks, topics)
        notices = left_out(ranks, chosen)
        return tuple(
            ArrayTable.of_entries(
                path.name,
                {name: array_of(values) for name, values in open_topic[topic.name]().items()},
                notices if i == 0 else (),
            )
            for i, topic in enumerate(chosen)
        )


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    reader = library("pymavlink.DFReader", "ardupilot", path.name).DFReader_binary
    quiet = io.StringIO()  # for what pymavlink prints of damaged bytes
    with damage_named(path.name, _damage):
        with redirect_stdout(quiet), redirect_stderr(quiet):
            log = reader(str(path))
        try:
            yield log
        finally:
            log.filehandle.close()


def _damage(error: Exception) -> str:
    return "is no binary log of ArduPilot, or is damaged or cut off: get a whole copy"


def _rows(log: Any, kind: str) -> _Columns | None:
    """Messages of a kind as columns."""
    number = log.name_to_id.get(kind)
    if number is None or not len(log.offsets[number]):
        return None
    form = log.formats[number]
    dtype = np.dtype([(n, _TYPES[c]) for n, c in zip(form.columns, form.msg_fmts, strict=True)])
    data = np.frombuffer(log.data_map, np.uint8)
    offsets = np.asarray(log.offsets[number], np.int64)
    offsets = offsets[offsets + _HEADER + dtype.itemsize <= data.size]
    inside = _HEADER + np.arange(dtype.itemsize)
    rows = np.concatenate(
        [
            data[offsets[i : i + _ROWS, None] + inside].view(dtype)[:, 0]
            for i in range(0, max(offsets.size, 1), _ROWS)
        ]
    )
    found: _Columns = {"offset": offsets}
    for name, factor in zip(form.columns, form.msg_mults, strict=True):
        found[name] = rows[name] if factor is None else rows[name] * factor
    return found


def _instances(log: Any, kind: str) -> Iterator[tuple[str, _Columns]]:
    """Messages of a kind by the number of the sensor, if they have one."""
    rows = _rows(log, kind)
    if rows is None or "TimeUS" not in rows:
        return
    if "I" not in rows:
        yield kind, rows
        return
    for number in np.unique(rows["I"]):
        mine = rows["I"] == number
        yield f"{kind}[{number}]", {name: values[mine] for name, values in rows.items()}


def _columns(rows: _Columns) -> _Columns:
    """Stamps, axes and temperature of messages."""
    # That of the sample where there is one: TimeUS is when it was logged.
    found = {_TIME: rows.get("SampleUS", rows["TimeUS"])}
    for sensor, (part, unit) in _SENSORS.items():
        for axis in AXES:
            if f"{part}{axis.upper()}" in rows:
                found[f"{sensor}_{axis} [{unit}]"] = rows[f"{part}{axis.upper()}"]
    if "T" in rows:
        found["temperature [degC]"] = rows["T"]
    return found


def _batches(log: Any) -> Iterator[tuple[str, str, _Columns]]:
    """Samples of each sensor from its batches: a header, then messages of 32 samples."""
    headers, data = _rows(log, "ISBH"), _rows(log, "ISBD")
    if headers is None or data is None:
        return
    of = np.searchsorted(headers["offset"], data["offset"]) - 1
    known = (of >= 0) & (headers["N"][of] == data["N"])
    rate, scale = headers["smp_rate"].astype(float), headers["mul"].astype(float)
    for kind, number in np.unique(np.column_stack([headers["type"], headers["instance"]]), axis=0):
        if kind >= len(_OF_BATCH):
            continue
        mine = known & (headers["type"][of] == kind) & (headers["instance"][of] == number)
        header = of[mine]
        if not header.size:
            continue
        index = data["seqno"][mine].astype(np.int64)[:, None] * 32 + np.arange(32)
        there = index < headers["smp_cnt"][header][:, None]
        first = headers["SampleUS"][header].astype(float)[:, None]
        sensor = _OF_BATCH[kind]
        columns = {_TIME: (first + 1e6 * index / rate[header][:, None])[there]}
        for axis in AXES:
            values = data[axis][mine] / scale[header][:, None]
            columns[f"{sensor}_{axis} [{_SENSORS[sensor][1]}]"] = values[there]
        yield f"batch_{sensor}[{number}]", sensor, columns
