"""Flight logs of PX4 (ULog) by pyulog.

`sensor_combined` holds every sample that the estimator gets, the FIFO topics every sample of the
sensor, `vehicle_imu` the increments of each IMU; this one, `sensor_gyro` and `sensor_accel` are
thinned to about 1 Hz unless one asks for more (docs.px4.io, Logging; msg/SensorCombined.msg,
SensorGyroFifo.msg, SensorAccelFifo.msg, VehicleImu.msg).
"""

import io
import re
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
from gmwm.readers import tuning
from gmwm.readers.formats.arrays import AnyArray, ArrayTable
from gmwm.readers.logs import topics
from gmwm.readers.logs.topics import Topic, topic_table
from gmwm.readers.names import AXES
from gmwm.readers.registry import Wanted
from gmwm.readers.table import damage_named, damage_notice, library

_COMBINED = "sensor_combined"
_FIELDS = {"gyro": "gyro_rad", "accel": "accelerometer_m_s2"}
_FIFO = {"sensor_gyro_fifo": "gyro", "sensor_accel_fifo": "accel"}
_INTEGRATED = "vehicle_imu"
_INCREMENTS = {"gyro": "delta_angle", "accel": "delta_velocity"}
_SINGLE = {"sensor_gyro": "gyro", "sensor_accel": "accel"}
_RANKS = ((_COMBINED,), _FIFO, (_INTEGRATED,), _SINGLE)
_TIME = "time [us]"
_NO_TIME = 2**31 - 1  # RELATIVE_TIMESTAMP_INVALID of SensorCombined.msg
_HEAD = 3  # bytes of a message before its content
_FORMAT = ord("F")  # kind of the messages that define others
_PLAIN = re.compile(r"(?:u?int(?:8|16|32|64)_t|float|double|bool|char)(?:\[(\d{1,5})\])?")
_MOST_NUMBERS = 1 << 16
_PADDING = (b"\0" * _HEAD, b"\xff" * _HEAD)
_HINT = "log sensor_combined, which the default SDLOG_PROFILE has, or the raw FIFO topics"
_HINT += " (bits 8 and 9 of SDLOG_PROFILE)"
_DAMAGE = "is not a ULog, or is damaged or cut off: get a whole copy"
_Columns = dict[str, AnyArray]


def open_ulog(path: Path, wanted: Wanted) -> tuple[ArrayTable, ...]:
    """The topics wanted (``"sensor_gyro_fifo[1]"``), or the first of `_RANKS` that is there."""
    with damage_named(path.name, _DAMAGE):  # formats that are damaged lack fields
        return _tables(path, wanted)


def _tables(path: Path, wanted: Wanted) -> tuple[ArrayTable, ...]:
    sets, notices = _data_sets(path, wanted.damaged)
    by_name = {_name(each): each for each in sets}
    ranks: list[list[Topic]] = [[], [], [], []]
    for each in sets:
        rank = next(i for i, names in enumerate(_RANKS) if each.name in names)
        only = (_FIFO | _SINGLE).get(each.name)
        not_zero = [
            sensor
            for sensor, field in (_FIELDS if rank == 0 else _INCREMENTS).items()
            if not only and any(np.any(each.data[f"{field}[{i}]"]) for i in range(3))
        ]
        sensors = frozenset([only] if only else not_zero)
        ranks[rank].append(Topic(_name(each), each.data["timestamp"].size, sensors))
    if not any(ranks):
        raise InputError(f"{path.name} has no samples of an IMU: {_HINT}")
    chosen = topics.choose(path.name, ranks, wanted)
    notices += topics.left_out(ranks[:2], chosen)
    found: list[tuple[Topic, _Columns]] = []
    for topic in chosen:
        kind, data = by_name[topic.name].name, by_name[topic.name].data
        if kind == _COMBINED:
            covered = data.get("gyro_integral_dt", np.zeros(1))
            _check_every_sample(path.name, kind, covered, data["timestamp"])
            found += [(topic, columns) for columns in _combined(data)]
        elif kind == _INTEGRATED:
            found.append((topic, _from_increments(path.name, data)))
        elif kind in _FIFO:
            found.append((topic, _from_fifo(data, _FIFO[kind])))
        else:
            _check_not_thinned(path.name, topic, data)
            axes = [data[axis] for axis in AXES]
            found.append((topic, _columns(data["timestamp"], _SINGLE[kind], axes)))
    for each in sets:
        if each.name in _SINGLE and each.multi_id == 0 and "temperature" in each.data:
            stamps, name = each.data["timestamp"], f"{each.name}_temperature [degC]"
            columns = {_TIME: stamps, name: each.data["temperature"]}
            found.append((Topic("thermometers", stamps.size), columns))
    tables: list[ArrayTable] = []
    for topic, columns in found:
        reported, origin = () if tables else notices, f"the definition of {topic.name}"
        tables.append(topic_table(path.name, topic, columns, origin, reported))
    return tuple(tables)


class _Stream(io.BufferedReader):
    """A log that remembers whether it was read to an end inside a message, without its padding."""

    def __init__(self, path: Path):
        super().__init__(io.FileIO(path))
        self.is_cut, self._kind = False, 0
        self._end = topics.end_of_content(path)

    def read(self, size: int | None = -1) -> bytes:
        found = super().read(size)
        if self._kind == _FORMAT:
            _check_format(found)
        self._kind = found[-1] if size == _HEAD == len(found) else 0
        if found in _PADDING or len(found) < (size or 0):
            if size == _HEAD and self.tell() - len(found) >= self._end:
                return b""
            self.is_cut |= len(found) < (size or 0)
        return found


def _check_format(text: bytes) -> None:
    """Raise ValueError if IMU messages have more numbers than bytes; pyulog writes out each."""
    name, _, fields = text.decode(errors="replace").partition(":")
    if any(name in names for names in _RANKS):
        types = [field.split(" ")[0] for field in fields.split(";") if field]
        plain = [_PLAIN.fullmatch(each) for each in types]
        if not all(plain) or sum(int(each[1] or 1) for each in plain if each) > _MOST_NUMBERS:
            raise ValueError(f"{name} is not a message of an IMU")


def _data_sets(path: Path, is_taken: bool) -> tuple[list[Any], tuple[Notice, ...]]:
    """Topics about an IMU, and what was noticed."""
    reader = library("pyulog", "px4", path.name).ULog
    # pyulog prints what is damaged.
    quiet = redirect_stdout(io.StringIO())
    with damage_named(path.name, _DAMAGE), quiet, _Stream(path) as stream:
        log = reader(stream, [name for names in _RANKS for name in names])
    sets = [each for each in log.data_list if each.data["timestamp"].size]
    notices = []
    if log.file_corruption or stream.is_cut:
        first = min((int(each.data["timestamp"][0]) for each in sets), default=log.last_timestamp)
        what = topics.cut_off((log.last_timestamp - first) * 1e-6)
        what = "is damaged in places" if log.file_corruption else what
        notices.append(damage_notice(path.name, what, is_taken))
    lost = sum(dropout.duration for dropout in log.dropouts) / 1e3
    if lost > 0.0:
        notices.append(notice("log-dropouts", "", {"duration": lost}, count=len(log.dropouts)))
    return sets, tuple(notices)


def _name(data_set: Any) -> str:
    if data_set.name == _COMBINED and data_set.multi_id == 0:
        return _COMBINED
    return f"{data_set.name}[{data_set.multi_id}]"


def _columns(stamps: AnyArray, sensor: str, axes: Sequence[AnyArray]) -> _Columns:
    names = [f"{sensor}_{axis} [{SI_UNIT[sensor]}]" for axis in AXES]
    return {_TIME: stamps, **dict(zip(names, axes, strict=True))}


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


def _from_increments(source: str, data: Mapping[str, AnyArray]) -> _Columns:
    """Rates and specific forces, by the times that angles and velocities were summed over."""
    stamps, found = data["timestamp_sample"], _Columns()
    _check_every_sample(source, _INTEGRATED, data["delta_angle_dt"], stamps)
    for sensor, field in _INCREMENTS.items():
        seconds = np.maximum(data[f"{field}_dt"], 1) * 1e-6
        found |= _columns(stamps, sensor, [data[f"{field}[{i}]"] / seconds for i in range(3)])
    return found


def _check_every_sample(source: str, name: str, integral: AnyArray, stamps: AnyArray) -> None:
    """Reject rows farther apart than the time each sample covers: the logger left out others."""
    covered, steps = float(np.median(integral)), np.diff(stamps.astype(float))
    if steps.size and 0.0 < covered * tuning.APART < (step := float(np.quantile(steps, 0.05))):
        raise InputError(
            f"{source}: each row of {name} covers {covered / 1e3:.3g} ms, and rows are "
            f"{step / 1e3:.3g} ms apart, so that the noise would be too large: {_HINT}"
        )


def _from_fifo(data: Mapping[str, AnyArray], sensor: str) -> _Columns:
    """Messages hold several samples; the stamp belongs to the last."""
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
            f"{source}: {topic.name} is logged at {rate:.3g} Hz, thinned from hundreds, which "
            f"does not show the sensor's noise: {_HINT}"
        )
