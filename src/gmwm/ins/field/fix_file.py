"""GNSS logs: positions and velocities in a delimited text, one row an epoch."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.field.calendar import in_seconds
from gmwm.ins.filter import Aiding, Fixes
from gmwm.ins.geometry import ned_difference
from gmwm.ins.logs import (
    POSITION_WORDS,
    angle_factor,
    angle_unit,
    check_angles,
    check_rising,
    find_columns,
    is_time,
    length_factor,
    open_log,
    place,
    unit_of,
    words_of,
)
from gmwm.readers import TIME, CsvTable, label, stated_seconds

_POSITION = ("latitude", "longitude", "height")
_VELOCITY = ("velocity north", "velocity east", "velocity down")
_DIRECTIONS = {"north": "north", "n": "north", "east": "east", "e": "east", "down": "down",
               "d": "down", "up": "up", "u": "up"}  # fmt: skip
_OF_POSITION = {"latitude": "north", "longitude": "east", "height": "down"}
_OF_VELOCITY = frozenset({"velocity", "vel", "v", "speed"})
_OF_SD = frozenset({"sd", "std", "stdev", "sigma", "accuracy", "acc"})
_SPEED_UNIT = frozenset({"m", "s", "mps", "ms", "per", "sec"})
_SPEEDS = {"km/h": 1.0 / 3.6, "knots": 1852.0 / 3600.0, "ft/s": 0.3048, "cm/s": 0.01, "mm/s": 0.001}
_TINY = float(np.finfo(float).tiny)
_BOTH = {"horizontal": ("north", "east"), "vertical": ("down",)}
_PASSED_OVER = frozenset({"gps", "gnss", "fix", "position", "pos", "ned", "enu"})


@dataclass(frozen=True, eq=False)
class FixLog:
    """GNSS fixes as a file says them.

    time: (E,), on the receiver's clock, s.
    position, velocity: (E, 3) or None, latitude, longitude (rad), height (m); to the north, east
        and down (m/s); NaN where there is none.
    position_sd, velocity_sd: (E, 3) or None, to the north, east and down; ``None`` where the file
        has none.
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray | None
    position_sd: FloatArray | None
    velocity_sd: FloatArray | None
    source: str
    notices: tuple[Notice, ...] = ()

    def aiding(
        self,
        start: float = 0.0,
        position_sd: Sequence[float] = tuning.POSITION_SD,
        velocity_sd: Sequence[float] = tuning.VELOCITY_SD,
        lever_arm: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> Aiding:
        """The fixes on the clock of an IMU.

        start: Time of the IMU's first epoch, s.
        position_sd, velocity_sd: Where the file says none, m and m/s.
        lever_arm: From the IMU to the antenna, body axes, m.
        """
        fixes = []
        for kind, value, own, usual in (
            ("position", self.position, self.position_sd, position_sd),
            ("velocity", self.velocity, self.velocity_sd, velocity_sd),
        ):
            if value is None:
                continue
            there = np.all(np.isfinite(value), axis=1)
            sd = np.tile(np.asarray(usual, dtype=float), (len(value), 1)) if own is None else own
            fixes.append(Fixes(kind, self.time[there] - start, value[there], sd[there]))
        return Aiding(tuple(fixes), lever_arm)


def read_fixes(
    path: str | os.PathLike[str],
    *,
    start: float = 0.0,
    position_sd: Sequence[float] = tuning.POSITION_SD,
    velocity_sd: Sequence[float] = tuning.VELOCITY_SD,
    lever_arm: Sequence[float] = (0.0, 0.0, 0.0),
) -> Aiding:
    """Read GNSS fixes.

    Parameters
    ----------
    path : str or path
        Delimited text, plain or gzip, or a solution of RTKLIB (.pos), with columns time (seconds,
        or dates in ISO 8601), latitude, longitude and height, and where there are any
        ``velocity_north``, ``velocity_east``, ``velocity_down`` (or ``_up``), and standard
        deviations: ``sd_north``, ``sd_east``, ``sd_down`` (m; or ``latitude_sd`` ...) and
        ``sd_velocity_north`` ... (m/s). Units stand at the end (``latitude_deg``); without one,
        angles are in degrees if a latitude is beyond pi/2. Empty fields are epochs without a fix.
    start : float, optional
        Time of the IMU's first epoch on the same clock, s.
    position_sd, velocity_sd : three floats, optional
        To the north, east and down, where the file says none, m and m/s.
    lever_arm : three floats, optional
        From the IMU to the antenna, body axes, m.

    Returns
    -------
    Aiding

    Raises
    ------
    InputError
        If the file cannot be used; the message names the line.
        If positions and velocities go together with two columns exchanged only.
    """
    return read_fix_log(path).aiding(start, position_sd, velocity_sd, lever_arm)


def read_fix_log(path: str | os.PathLike[str]) -> FixLog:
    """Read GNSS fixes on the receiver's own clock; see `read_fixes`."""
    with in_seconds(Path(path)) as (numbers, scale):
        return _read(open_log(numbers), scale)


def _read(table: CsvTable, scale: str) -> FixLog:
    columns, unused = _columns(table)
    values = table.load(sorted(set(columns.values())))
    found = {name: values[column] for name, column in columns.items()}
    _check_clock(table, columns[TIME], found[TIME])
    position = _position(table, columns, found)
    velocity = None
    if all(name in found for name in _VELOCITY):
        velocity = np.stack([found[name] for name in _VELOCITY], axis=1)
    notices = []
    if scale:
        text = f"dates ({scale}) are counted in seconds since 1970-01-01, without leap seconds"
        notices.append(Notice("dates", "note", "", text, {"scale": scale}))
    if unused:
        text = f"columns not used: {', '.join(unused)}"
        notices.append(Notice("columns-unused", "note", "", text, {"columns": ", ".join(unused)}))
    no_fix = (position[:, 0] == 0.0) & (position[:, 1] == 0.0)
    if np.any(no_fix):
        position[no_fix] = np.nan
        count = int(np.count_nonzero(no_fix))
        text = f"{count} positions at 0, 0 are counted as missing"
        notices.append(Notice("positions-at-zero", "warning", "", text, {"count": count}))
    time = found[TIME] * (stated_seconds(table.source, table.names[columns[TIME]]) or 1.0)
    if velocity is not None:
        _check_axes(table.source, time, position, velocity)
    return FixLog(
        time=time,
        position=position,
        velocity=velocity,
        position_sd=_deviations(table, columns, found, "sd ", position),
        velocity_sd=None
        if velocity is None
        else _deviations(table, columns, found, "sd velocity ", velocity),
        source=table.source,
        notices=tuple(notices),
    )


def read_heights(path: str | os.PathLike[str]) -> tuple[str, FloatArray, FloatArray]:
    """Read heights of a barometer.

    path: Delimited text with columns time and height.
    Returns: source; time, height (E,), s and m; NaN where there is none.
    Raises InputError if the file cannot be used.
    """
    with in_seconds(Path(path)) as (numbers, _):
        table = open_log(numbers)
        columns, _ = find_columns(table, _quantities, (TIME, "height"), "time_s,height_m")
        values = table.load(sorted({columns[TIME], columns["height"]}))
    _check_clock(table, columns[TIME], values[columns[TIME]])
    unit = stated_seconds(table.source, table.names[columns[TIME]]) or 1.0
    height = values[columns["height"]] * length_factor(table, columns["height"], "height")
    return table.source, values[columns[TIME]] * unit, height


def _quantities(name: str) -> tuple[str, ...]:
    """What a column holds; two for a horizontal standard deviation."""
    if is_time(name):
        return (TIME,)
    words = words_of(name)
    if not _OF_VELOCITY.isdisjoint(words) or words[:1] in (["vn"], ["ve"], ["vd"], ["vu"]):
        while len(words) > 1 and words[-1] in _SPEED_UNIT:
            words.pop()
    is_sd = not _OF_SD.isdisjoint(words)
    words = [word for word in words if word not in _OF_SD | _PASSED_OVER]
    if len(words) == 1 and words[0] in ("vn", "ve", "vd", "vu"):
        words = ["v", words[0][1]]
    is_velocity = not _OF_VELOCITY.isdisjoint(words)
    words = [word for word in words if word not in _OF_VELOCITY]
    if len(words) != 1:
        return ()
    prefix = ("sd " if is_sd else "") + ("velocity " if is_velocity else "")
    if words[0] in _BOTH and is_sd:
        return tuple(prefix + each for each in _BOTH[words[0]])
    position = POSITION_WORDS.get(words[0])
    if position is not None and not is_velocity:
        return (prefix + _OF_POSITION[position],) if is_sd else (position,)
    direction = _DIRECTIONS.get(words[0])
    if direction is None or not prefix:
        return ()
    return (prefix + ("down" if is_sd and direction == "up" else direction),)


def _columns(table: CsvTable) -> tuple[dict[str, int], list[str]]:
    """The column of each quantity, and the names of those that are none."""
    columns, unused = find_columns(
        table, _quantities, (TIME, *_POSITION), "time_s,latitude_deg,longitude_deg,height_m"
    )
    for group in (_VELOCITY, tuple(f"sd {each}" for each in ("north", "east", "down")),
                  tuple(f"sd {each}" for each in _VELOCITY)):  # fmt: skip
        _check_all(table, columns, group)
    return columns, unused


def _check_all(table: CsvTable, columns: Mapping[str, int], group: Sequence[str]) -> None:
    """Of three components all or none."""
    there = [name for name in group if name in columns or _turned(name) in columns]
    if there and len(there) < len(group):
        lacking = next(name for name in group if name not in there)
        raise InputError(
            f"{table.source} has a column for {there[0]} and none for {lacking}: add it, or leave "
            "out all three"
        )


def _turned(name: str) -> str:
    return name.replace("down", "up")


def _check_clock(table: CsvTable, column: int, stamps: FloatArray) -> None:
    bad = np.flatnonzero(np.isnan(stamps))
    if bad.size:
        raise InputError(f"{place(table, column, int(bad[0]))}: no time: take the row out")
    if not stamps.size:
        raise InputError(f"{table.source} has no fixes: check the file")
    check_rising(table, column, stamps)


def _position(
    table: CsvTable, columns: Mapping[str, int], found: dict[str, FloatArray]
) -> FloatArray:
    """Latitude, longitude, height in SI units, (E, 3); turns an upward velocity down."""
    common = angle_unit(table.names[columns["latitude"]], found["latitude"])
    for name in ("latitude", "longitude"):
        column = columns[name]
        found[name] = found[name] * angle_factor(table, column, name, common)
        limit = 0.5 * np.pi if name == "latitude" else 2.0 * np.pi
        check_angles(table, column, name, found[name], limit * (1.0 + 1e-9))
    found["height"] = found["height"] * length_factor(table, columns["height"], "height")
    if "velocity up" in found:
        found["velocity down"] = -found["velocity up"]
    return np.stack([found[name] for name in _POSITION], axis=1)


def _deviations(
    table: CsvTable,
    columns: Mapping[str, int],
    found: Mapping[str, FloatArray],
    prefix: str,
    value: FloatArray,
) -> FloatArray | None:
    """Standard deviations of three components, or ``None`` if the file has none."""
    names = [prefix + each for each in ("north", "east", "down")]
    if names[0] not in found:
        return None
    there = np.all(np.isfinite(value), axis=1)
    for name in names:
        column = columns[name]
        if unit_of(table.names[column]) in ("deg", "rad", "ft"):
            raise InputError(
                f"{table.source}, column {label(table.names, column)}: give standard deviations "
                "in metres"
            )
        bad = np.flatnonzero(there & ~(found[name] > 0.0))
        if bad.size:
            raise InputError(
                f"{place(table, column, int(bad[0]))}: a standard deviation of "
                f"{found[name][bad[0]]:g}: give a number above zero for each fix"
            )
    return np.stack([found[name] for name in names], axis=1)


def _check_axes(source: str, time: FloatArray, position: FloatArray, velocity: FloatArray) -> None:
    """Refuse positions and velocities that go together with another column or unit only.

    A filter would blame the sensors. How far the vehicle went by the positions is compared with the
    integral of the velocities.

    time: (E,), s.
    position, velocity: (E, 3), latitude, longitude (rad), height (m); north, east, down (m/s); NaN
        where there is none.
    Raises InputError if the way by the velocities fits far better with an exchange, a sign turned
        or a factor between units.
    """
    there = np.all(np.isfinite(position) & np.isfinite(velocity), axis=1)
    time, position, velocity = time[there], position[there], velocity[there]
    if time.size < 2:
        return
    step = np.diff(time)[:, None]
    gone = np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * step, axis=0)
    gone = np.concatenate([np.zeros((1, 3)), gone])
    holes = np.concatenate([[0], np.cumsum(step[:, 0] > tuning.CHORD)])
    marks = np.searchsorted(time, np.arange(time[0], time[-1], 0.5 * tuning.WAY))
    first, last = marks[:-2], marks[2:]
    whole = holes[first] == holes[last]
    first, last = first[whole], last[whole]
    if first.size < tuning.FEWEST_WAYS:
        return
    by_velocity = gone[last] - gone[first]

    def apart(here: FloatArray, way: FloatArray, part: slice) -> float:
        off = (ned_difference(here[last], here[first]) - way)[:, part]
        # Of the way itself, for a smaller unit makes everything smaller.
        size = max(float(np.median(np.sum(way[:, part] ** 2, axis=1))), _TINY)
        return float(np.median(np.sum(off**2, axis=1))) / size

    better = dict[str, float]()
    for what, part, here, way in _misread(position, by_velocity):
        if np.all(np.abs(here[:, 0]) < 0.5 * np.pi):
            left, now = apart(here, way, part), apart(position, by_velocity, part)
            if now > tuning.MIXED_UP**2 * left:
                better[what] = left / now
    if better:
        what = min(better, key=better.__getitem__)
        raise InputError(f"{source}: positions go with velocities only if {what}")


def _misread(
    position: FloatArray, way: FloatArray
) -> Iterator[tuple[str, slice, FloatArray, FloatArray]]:
    """What may be wrong and the hint, what of the way shows it, and what is right then."""
    level, vertical = slice(0, 2), slice(2, 3)
    which = "check which column is which"
    swap, degrees = [1, 0, 2], np.array([np.degrees(1.0), np.degrees(1.0), 1.0])
    yield f"velocity north and east are exchanged: {which}", level, position, way[:, swap]
    yield f"velocity down and up are exchanged: {which}", vertical, position, -way
    yield f"latitude and longitude are exchanged: {which}", level, position[:, swap], way
    for i, name, axis in ((0, "latitude", "north"), (1, "longitude", "east")):
        sign = np.where(np.arange(3) == i, -1.0, 1.0)
        text = f"the sign of {name}, or of velocity {axis}, is turned: check it"
        yield text, level, position, way * sign
    yield "latitude and longitude are in rad: give that unit", level, position * degrees, way
    for unit, factor in _SPEEDS.items():
        yield f"velocities are in {unit}: convert them to m/s", level, position, way * factor
