"""Flight logs of PX4 (ULog) by pyulog.

`sensor_combined` holds every sample that the estimator gets, the FIFO topics every sample of the
sensor; `sensor_gyro` and `sensor_accel` are thinned to about 1 Hz unless one asks for more
(docs.px4.io, Logging; msg/SensorCombined.msg, SensorGyroFifo.msg, SensorAccelFifo.msg).
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.notices import Notice
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.formats.arrays import AnyArray, ArrayTable, array_of, damage_named
from gmwm.readers.formats.extras import library
from gmwm.readers.formats.messages.endings import cut_off, end_of_content
from gmwm.readers.formats.messages.topics import Topic, Wanted, choose_first, left_out
from gmwm.readers.names import AXES
from gmwm.readers.table import damage_notice

_COMBINED = "sensor_combined"
_FIELDS = {"gyro": "gyro_rad", "accel": "accelerometer_m_s2"}
_FIFO = {"sensor_gyro_fifo": "gyro", "sensor_accel_fifo": "accel"}
_SINGLE = {"sensor_gyro": "gyro", "sensor_accel": "accel"}
_UNITS = {"gyro": "rad/s", "accel": "m/s^2"}
_TIME = "time [us]"
_NO_TIME = 2**31 - 1
"""RELATIVE_TIMESTAMP_INVALID of SensorCombined.msg."""

_HEAD = 3
"""Bytes of a message before its content."""

_PADDING = (b"\0" * _HEAD, b"\xff" * _HEAD)

_MEND = (
    "log sensor_combined, which the default SDLOG_PROFILE has, or the raw FIFO topics (bits 8 and "
    "9 of SDLOG_PROFILE)"
)

_Columns = dict[str, AnyArray]


def open_ulog(path: Path, wanted: Wanted) -> tuple[ArrayTable, ...]:
    """Open a ULog.

    wanted: Topics as ``"sensor_gyro_fifo[1]"``; by default `sensor_combined`, else the FIFO topics.
    Raises InputError if it is damaged, holds no IMU at its own rate or half of one, or topics have
        to be chosen.
    """
    with damage_named(path.name, _damage):  # formats that are damaged lack fields
        return _tables(path, wanted)


def _tables(path: Path, wanted: Wanted) -> tuple[ArrayTable, ...]:
    sets, notices = _data_sets(path, wanted.damaged)
    ranks = [
        [_topic(each, _not_zero(each.data)) for each in sets if each.name == _COMBINED],
        [_topic(each, frozenset((_FIFO[each.name],))) for each in sets if each.name in _FIFO],
        [_topic(each, frozenset((_SINGLE[each.name],))) for each in sets if each.name in _SINGLE],
    ]
    if not any(ranks):
        raise InputError(f"{path.name} has no samples of an IMU: {_MEND}")
    chosen = choose_first(path.name, ranks, wanted)
    notices += left_out(ranks[:2], chosen)
    by_name = {_name(each): each for each in sets}
    tables: list[tuple[str, _Columns]] = []
    for topic in chosen:
        data = by_name[topic.name].data
        if topic.name.startswith(_COMBINED):
            found = _combined(data)
        elif by_name[topic.name].name in _FIFO:
            found = [_from_fifo(data, _FIFO[by_name[topic.name].name])]
        else:
            sensor = _SINGLE[by_name[topic.name].name]
            _check_not_thinned(path.name, topic, data)
            found = [_columns(data["timestamp"], sensor, [data[axis] for axis in AXES])]
        tables += [(topic.name, columns) for columns in found]
    tables += [("thermometers", columns) for columns in _thermometers(sets)]
    return tuple(
        replace(
            ArrayTable.of_entries(
                path.name,
                {name: array_of(values) for name, values in columns.items()},
                notices if i == 0 else (),
            ),
            stamps=f"stamps of {topic}",
            message_type=f"the definition of {topic}",
        )
        for i, (topic, columns) in enumerate(tables)
    )


class _Stream(io.BufferedReader):
    """A log that remembers whether it was read to an end inside a message, without its padding."""

    def __init__(self, path: Path):
        super().__init__(io.FileIO(path))
        self.is_cut = False
        self._end = end_of_content(path)

    def read(self, size: int | None = -1) -> bytes:
        found = super().read(size)
        if found in _PADDING or len(found) < (size or 0):
            if size == _HEAD and self.tell() - len(found) >= self._end:
                return b""
            self.is_cut |= len(found) < (size or 0)
        return found


def _data_sets(path: Path, is_taken: bool) -> tuple[list[Any], tuple[Notice, ...]]:
    """Topics about an IMU, and what was noticed."""
    wanted = [_COMBINED, *_FIFO, *_SINGLE]
    reader = library("pyulog", "px4", path.name).ULog
    # pyulog prints what is damaged.
    quiet = redirect_stdout(io.StringIO())
    with damage_named(path.name, _damage), quiet, _Stream(path) as stream:
        log = reader(stream, wanted)
    sets = [each for each in log.data_list if each.data["timestamp"].size]
    notices = []
    if log.file_corruption or stream.is_cut:
        first = min((int(each.data["timestamp"][0]) for each in sets), default=log.last_timestamp)
        what = cut_off((log.last_timestamp - first) * 1e-6)
        what = "is damaged in places" if log.file_corruption else what
        notices.append(damage_notice(path.name, what, is_taken))
    lost = sum(dropout.duration for dropout in log.dropouts) / 1e3
    if lost > 0.0:
        text = f"the logger dropped {len(log.dropouts)} stretches, {lost:.3g} s in all"
        notices.append(Notice("log-dropouts", "note", "", text, {"duration": lost}))
    return sets, tuple(notices)


def _damage(error: Exception) -> str:
    return "is no ULog, or is damaged or cut off: get a whole copy"


def _name(data_set: Any) -> str:
    if data_set.name == _COMBINED and data_set.multi_id == 0:
        return _COMBINED
    return f"{data_set.name}[{data_set.multi_id}]"


def _topic(data_set: Any, sensors: frozenset[str]) -> Topic:
    return Topic(_name(data_set), int(data_set.data["timestamp"].size), sensors)


def _not_zero(data: Mapping[str, AnyArray]) -> frozenset[str]:
    """Sensors of which `sensor_combined` holds something else than zeros."""
    return frozenset(
        sensor
        for sensor, field in _FIELDS.items()
        if any(np.any(data[f"{field}[{i}]"]) for i in range(3))
    )


def _columns(stamps: AnyArray, sensor: str, axes: Sequence[AnyArray]) -> _Columns:
    named = {
        f"{sensor}_{axis} [{_UNITS[sensor]}]": values
        for axis, values in zip(AXES, axes, strict=True)
    }
    return {_TIME: stamps, **named}


def _combined(data: Mapping[str, AnyArray]) -> list[_Columns]:
    """Gyros, and accelerometers by their own stamps if these do not advance with each row."""
    rates, axes = ([data[f"{field}[{i}]"] for i in range(3)] for field in _FIELDS.values())
    gyro = _columns(data["timestamp"], "gyro", rates)
    offset = data["accelerometer_timestamp_relative"].astype(np.int64)
    stamps = data["timestamp"].astype(np.int64) + offset
    valid = offset != _NO_TIME
    is_new = valid & np.append(True, np.diff(stamps) != 0)
    if np.all(is_new) or np.count_nonzero(is_new) < tuning.FEWEST_SAMPLES:
        return [gyro | _columns(data["timestamp"], "accel", axes)]
    return [gyro, _columns(stamps[is_new], "accel", [axis[is_new] for axis in axes])]


def _from_fifo(data: Mapping[str, AnyArray], sensor: str) -> _Columns:
    """Samples of messages of some each, of which the last has the stamp."""
    count = data["samples"].astype(np.int64)
    most = sum(name.startswith("x[") for name in data)
    index = np.arange(most)
    there = index < count[:, None]
    ago = (count[:, None] - 1 - index) * data["dt"].astype(float)[:, None]
    stamps = (data["timestamp_sample"].astype(float)[:, None] - ago)[there]
    scale = np.repeat(data["scale"].astype(float), np.count_nonzero(there, axis=1))
    axes = [
        np.column_stack([data[f"{axis}[{i}]"] for i in range(most)])[there] * scale for axis in AXES
    ]
    return _columns(stamps, sensor, axes)


def _check_not_thinned(source: str, topic: Topic, data: Mapping[str, AnyArray]) -> None:
    step = float(np.median(np.diff(data["timestamp"].astype(float)))) if topic.count > 1 else 1e6
    if not 0.0 < step * 1e-6 * tuning.THINNED < 1.0:
        rate = 1e6 / step if step > 0.0 else 0.0
        raise InputError(
            f"{source}: {topic.name} is logged at {rate:.3g} Hz, thinned from hundreds, so that "
            f"its noise is not that of the sensor: {_MEND}"
        )


def _thermometers(sets: Sequence[Any]) -> list[_Columns]:
    found = []
    for each in sets:
        if each.name in _SINGLE and each.multi_id == 0 and "temperature" in each.data:
            name = f"{each.name}_temperature [degC]"
            found.append({_TIME: each.data["timestamp"], name: each.data["temperature"]})
    return found
