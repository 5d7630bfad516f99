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

from gmwm._core.files import existing_file
from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.issues import notice
from gmwm.readers import tuning
from gmwm.readers.names import CANONICAL
from gmwm.readers.registry import Wanted
from gmwm.readers.table import Columns, Table


@dataclass(frozen=True)
class BinaryLayout:
    """A record: time (float64), then six numbers, gyro and accelerometer x, y, z."""

    kind: str  # numpy type of the six numbers
    # gyro, accel: scales of the numbers: rad and m/s of increments, rad/s and m/s^2 of rates.
    gyro: float
    accel: float
    increments: bool = True
    order: str = "="  # {"=", "<", ">"}, native, little- or big-endian

    @property
    def record(self) -> np.dtype[np.void]:
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
_KINDS = {"int16": "i2", "int32": "i4", "int64": "i8", "float32": "f4", "float64": "f8"}
_ORDERS = {"native": "=", "little": "<", "big": ">"}
_FORM = "TYPE,GYRO_SCALE,ACCEL_SCALE[,rates][,little|big]"


def layout_of(text: str) -> BinaryLayout:
    """A layout by its name, or of the form `_FORM`."""
    if text.upper() in LAYOUTS:
        return LAYOUTS[text.upper()]
    parts = [part.strip() for part in text.split(",")]
    number = re.compile(r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
    if len(parts) < 3 or parts[0] not in _KINDS or not all(map(number.fullmatch, parts[1:3])):
        known = f"{', '.join(LAYOUTS)}, or {_FORM} with a type of {', '.join(_KINDS)}"
        raise InputError(f"layout {text!r} is unknown: give one of {known}", "layout")
    found = BinaryLayout(_KINDS[parts[0]], float(parts[1]), float(parts[2]))
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


@dataclass(frozen=True, eq=False, kw_only=True)
class BinaryTable(Table):
    """Records of a binary file: time in seconds, and the channels in SI units."""

    path: Path
    layout: BinaryLayout

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[Columns]:
        interval = self._interval(rows) if self.layout.increments else 1.0
        scales = (1.0, *(self.layout.gyro / interval,) * 3, *(self.layout.accel / interval,) * 3)
        for start in range(0, int(self.rows), rows):
            raw, found = self.raw(start, rows), {}
            for column in columns:
                with np.errstate(all="ignore"):
                    found[column] = raw[column] * scales[column]
                self.check_usable(column, found[column], start)
            yield found

    def raw(self, start: int, rows: int) -> list[FloatArray]:
        """Time and six numbers of some records as they are."""
        record = self.layout.record
        block = np.fromfile(self.path, record, rows, offset=start * record.itemsize)
        block = block[: int(self.rows) - start]
        return [block["time"].astype(float), *block["values"].T.astype(float)]

    def _interval(self, rows: int) -> float:
        """Seconds between records that follow each other."""
        times = [self.raw(start, rows)[0] for start in range(0, int(self.rows), rows)]
        with np.errstate(all="ignore"):
            steps = np.diff(np.concatenate(times))
            usual = float(np.median(steps))
            near = steps[np.abs(steps / usual - 1.0) < 0.5]
        if not (near.size and usual > 0.0):
            raise InputError(f"{self.source}: stamps do not increase: check the layout", "layout")
        return float(np.mean(near))

    def where(self, row: int) -> str:
        return f"record {row} (counted from 0)"


def open_records(path: Path, wanted: Wanted) -> tuple[BinaryTable]:
    """Look at the size of a file of the layout that is wanted, and at its first times."""
    size, layout = existing_file(path).stat().st_size, layout_of(str(wanted.layout))
    record = layout.record.itemsize
    count, rest = divmod(size, record)
    if count < tuning.FEWEST_SAMPLES:
        raise InputError(
            f"{path.name} has {size:,} bytes, {count} records of {record}, but needs at least "
            f"{tuning.FEWEST_SAMPLES} records: check the layout, or record longer",
            "layout",
        )
    notices = [notice("partial-record", "", {"bytes": rest}, size=record)] if rest else []
    names = ("time [s]", *(f"{name} [{SI_UNIT[name.partition('_')[0]]}]" for name in CANONICAL))
    table = BinaryTable(
        source=path.name, names=names, notices=notices, path=path, layout=layout, rows=count
    )
    first = table.raw(0, tuning.FEWEST_SAMPLES)[0]
    with np.errstate(all="ignore"):
        steps = np.diff(first)
        even = np.all(np.isfinite(first)) and np.count_nonzero(steps > 0.0) > steps.size // 2
        median = float(np.median(steps)) if even else 0.0
    if not tuning.LEAST_STEP <= median < tuning.LARGEST_OF_BINARY:
        times = f"{path.name}: its first times, {first[0]:.6g} and {first[1]:.6g}"
        hint = "give the layout of this file"
        raise InputError(f"{times}, are not seconds of a clock: {hint}", "layout")
    return (table,)
