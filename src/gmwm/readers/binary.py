"""Binary files without a header: records of a time and six numbers.

A layout says how one record is laid out. Those with a name are the formats of some IMUs as their
users write them (increments over the sampling interval, native order), and that of KF-GINS.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gmwm._core import memory
from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.names import CANONICAL
from gmwm.readers.table import LARGEST, usable


@dataclass(frozen=True)
class BinaryLayout:
    """How a record is laid out: time (float64), then six numbers, gyro and accelerometer x, y, z.

    kind: numpy type of the six numbers.
    gyro, accel: What one is worth: rad and m/s if they are increments, rad/s and m/s^2 if they are
        rates.
    order: {"=", "<", ">"}, native, little- or big-endian.
    """

    kind: str
    gyro: float
    accel: float
    increments: bool = True
    order: str = "="

    @property
    def record(self) -> np.dtype[np.void]:
        """Numpy type of a record."""
        return np.dtype([("time", f"{self.order}f8"), ("values", f"{self.order}{self.kind}", (6,))])


_ARC_SECOND = math.pi / 180.0 / 3600.0
LAYOUTS = {
    "IMAR": BinaryLayout("i4", 0.1 * _ARC_SECOND, 0.00152588 / 1000.0),
    "LN200": BinaryLayout("i4", 2.0**-21, 2.0**-14),
    "LN200IG": BinaryLayout("i4", 2.0**-19, 2.0**-14),
    "IXSEA": BinaryLayout("f8", _ARC_SECOND, 0.001),
    "NAVCHIP_INT": BinaryLayout("i4", 6.25e-6, 3.90625e-5),
    "NAVCHIP_FLT": BinaryLayout("f8", 2.0 * math.pi / (3600.0 * 360.0), 0.001),
    "KF-GINS": BinaryLayout("f8", 1.0, 1.0, order="<"),
}
"""Layouts with a name."""

_KINDS = {"int16": "i2", "int32": "i4", "int64": "i8", "float32": "f4", "float64": "f8"}
_ORDERS = {"native": "=", "little": "<", "big": ">"}
_FORM = "TYPE,GYRO_SCALE,ACCEL_SCALE[,rates][,little|big]"


def layout_of(text: str) -> BinaryLayout:
    """A layout by its name, or as ``TYPE,GYRO_SCALE,ACCEL_SCALE[,rates][,little|big]``.

    Raises InputError if it is neither.
    """
    if text.upper() in LAYOUTS:
        return LAYOUTS[text.upper()]
    parts = [part.strip() for part in text.split(",")]
    number = re.compile(r"[0-9.]+(?:[eE][+-]?[0-9]+)?")
    if len(parts) < 3 or parts[0] not in _KINDS or not all(map(number.fullmatch, parts[1:3])):
        raise InputError(
            f"layout {text!r} is unknown: give one of {', '.join(LAYOUTS)}, or {_FORM} with a type "
            f"of {', '.join(_KINDS)}",
            "layout",
        )
    try:
        found = BinaryLayout(_KINDS[parts[0]], float(parts[1]), float(parts[2]))
    except ValueError:
        raise InputError(
            f"layout {text!r}: a scale is no number: write {_FORM}", "layout"
        ) from None
    for word in parts[3:]:
        if word in _ORDERS:
            found = replace(found, order=_ORDERS[word])
        elif word in ("rates", "increments"):
            found = replace(found, increments=word == "increments")
        else:
            raise InputError(f"layout {text!r}: {word!r} is unknown: write {_FORM}", "layout")
    if not (0.0 < found.gyro < math.inf and 0.0 < found.accel < math.inf):
        raise InputError(f"layout {text!r}: give positive scales: {_FORM}", "layout")
    return found


@dataclass(frozen=True)
class BinaryTable:
    """Records of a binary file."""

    path: Path
    layout: BinaryLayout
    count: int
    notices: tuple[Notice, ...] = ()
    rate: float | None = None
    tentative: bool = False

    @classmethod
    def open(cls, path: Path, layout: BinaryLayout) -> BinaryTable:
        """Look at the size of a file and its first times.

        Raises InputError if it is too short, or its times are not those of this layout.
        """
        size, record = path.stat().st_size, layout.record.itemsize
        count, rest = divmod(size, record)
        if count < tuning.FEWEST_SAMPLES:
            raise InputError(
                f"{path.name} has {size:,} bytes, {count} records of {record}, where at least "
                f"{tuning.FEWEST_SAMPLES} are needed: check the layout, or record longer",
                "layout",
            )
        notices: tuple[Notice, ...] = ()
        if rest:
            text = f"the last record is cut off, {rest} of its {record} bytes are there: left out"
            notices = (Notice("partial-record", "warning", "", text, {"bytes": rest}),)
        table = cls(path, layout, count, notices)
        first = table._read(0, tuning.FEWEST_SAMPLES)["time"]
        with np.errstate(all="ignore"):
            steps = np.diff(first)
            even = np.all(np.isfinite(first)) and np.count_nonzero(steps > 0.0) > steps.size // 2
            median = float(np.median(steps)) if even else 0.0
        if not tuning.LEAST_STEP <= median < tuning.LARGEST_OF_BINARY:
            raise InputError(
                f"{path.name}: its first times, {first[0]:.6g} and {first[1]:.6g}, are no seconds "
                "of a clock: give the layout of this file",
                "layout",
            )
        return table

    @property
    def source(self) -> str:
        """Name of the file."""
        return self.path.name

    @property
    def names(self) -> tuple[str, ...]:
        """Time in seconds, and the channels in SI units."""
        units = ("rad/s", "m/s^2")
        return ("time [s]", *(f"{c} [{units[c.startswith('accel')]}]" for c in CANONICAL))

    def _read(self, start: int, count: int) -> np.ndarray:
        record = self.layout.record
        return np.fromfile(self.path, record, count, offset=start * record.itemsize)

    def load(self, columns: Sequence[int]) -> dict[int, FloatArray]:
        """Read some columns, block by block.

        Raises InputError if a number is infinite, or there is not enough memory.
        """
        memory.require(tuning.BYTES_PER_SAMPLE * self.count * (len(columns) + 1), self.source)
        found = {column: np.empty(self.count) for column in {0, *columns}}
        for start in range(0, self.count, tuning.RECORDS_AT_ONCE):
            part = self._columns(start, tuning.RECORDS_AT_ONCE, tuple(found))
            for column, values in part.items():
                found[column][start : start + values.size] = values
        interval = self._interval(found[0])
        return {column: self._scaled(column, found.pop(column), interval, 0) for column in columns}

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[dict[int, FloatArray]]:
        """The same, ``rows`` at a time."""
        starts = range(0, self.count, rows)
        interval = 1.0
        if self.layout.increments:
            times = [self._columns(start, rows, (0,))[0] for start in starts]
            interval = self._interval(np.concatenate(times))
        for start in starts:
            found = self._columns(start, rows, tuple({0, *columns}))
            yield {c: self._scaled(c, found[c], interval, start) for c in columns}

    def _columns(self, start: int, rows: int, columns: Sequence[int]) -> dict[int, FloatArray]:
        """Numbers of some records as they are."""
        block = self._read(start, rows)[: self.count - start]
        found = {0: block["time"]} | {i: block["values"][:, i - 1] for i in columns if i}
        return {column: found[column].astype(float) for column in columns}

    def _interval(self, times: FloatArray) -> float:
        """Seconds between records that follow each other; 1 where numbers are rates."""
        if not self.layout.increments:
            return 1.0
        with np.errstate(all="ignore"):
            steps = np.diff(times)
            usual = float(np.median(steps))
            near = steps[np.abs(steps / usual - 1.0) < 0.5]
        if not (near.size and usual > 0.0):
            raise InputError(f"{self.source}: its times do not advance: check the layout", "layout")
        return float(np.mean(near))

    def _scaled(self, column: int, raw: FloatArray, interval: float, start: int) -> FloatArray:
        """In seconds or SI units; ``start`` is the record of the first."""
        unit = (1.0, *(self.layout.gyro,) * 3, *(self.layout.accel,) * 3)[column]
        with np.errstate(all="ignore"):
            values = raw * (unit / interval if column else unit)
        if not usable(values):
            row = int(np.flatnonzero(np.abs(values) >= LARGEST)[0])
            raise InputError(
                f"{self.source}, {self.where(start + row)}: {values[row]} is not a usable number: "
                "check the layout"
            )
        return values

    def where(self, row: int) -> str:
        """Say which record."""
        return f"record {row} (counted from 0)"
