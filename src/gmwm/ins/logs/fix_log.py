"""GNSS logs: positions and velocities in a delimited text, one row an epoch."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import median_filter

from gmwm._core.files import existing_file, opened
from gmwm._core.typing import BoolArray, FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.aiding import Aiding, Fixes
from gmwm.ins.geometry import ned_difference
from gmwm.ins.trajectory.trajectory import POSITION_WORDS, LogColumns, is_time, words_of
from gmwm.issues import Notice, notice
from gmwm.readers import DATE, TIME

_POSITION = ("latitude", "longitude", "height")
_NED = ("north", "east", "down")
_LIMITS = {"latitude": 0.5 * np.pi, "longitude": 2.0 * np.pi}
_DIRECTIONS = {short: name for name in (*_NED, "up") for short in (name, name[0])}
_AXIS_OF_POSITION = dict(zip(_POSITION, _NED, strict=True))
_AXES_OF_ACCURACY = {"horizontal": ("north", "east"), "vertical": ("down",)}
_VELOCITY_WORDS = frozenset({"velocity", "vel", "v", "speed"})
_SD_WORDS = frozenset({"sd", "std", "stdev", "sigma", "accuracy", "acc"})
_SPEED_UNIT = frozenset({"m", "s", "mps", "ms", "per", "sec"})
_OTHER_WORDS = frozenset({"gps", "gnss", "fix", "position", "pos", "ned", "enu"})
_SHORT = re.compile(r"(sd)?(v)?([nedu])")  # vn, sdn, sdvn
_SPEEDS = {"km/h": 1.0 / 3.6, "knots": 1852.0 / 3600.0, "ft/s": 0.3048, "cm/s": 0.01, "mm/s": 0.001}

_HEAD = 1 << 16  # bytes that are searched for dates
_RTKLIB = re.compile(r"^%\s*(GPST|UTC|JST)(\s.*)", re.MULTILINE)
_WEEK = re.compile(r"^\s*(\d{4})\s+(\d{1,6}\.\d+)(?=\s)", re.MULTILINE)
_DAY = re.compile(r"^\s*(\d{4})/(\d\d)/(\d\d)\s+", re.MULTILINE)
_GPS_EPOCH = 315964800  # s from 1970-01-01 to 1980-01-06, on one calendar
_WEEK_LENGTH = 604800


@dataclass(frozen=True, eq=False)
class FixLog:
    """GNSS fixes on the receiver's own clock.

    time: (E,), s.
    position, velocity: (E, 3) or None, latitude, longitude (rad), height (m); to the north, east
        and down (m/s); NaN where there is none.
    position_sd, velocity_sd: (E, 3), to the north, east and down, or ``None`` where the file has
        none.
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
        start: float,
        position_sd: Sequence[float],
        velocity_sd: Sequence[float],
        lever_arm: Sequence[float],
    ) -> Aiding:
        """The fixes on the clock of an IMU; see `read_fixes`."""
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

    Raises InputError if the file cannot be used; the message names the line, or if positions
    and velocities agree only with two columns exchanged, a sign or another unit.

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
        To the north, east and down, where the file has none, m and m/s.
    lever_arm : three floats, optional
        From the IMU to the antenna, body axes, m.
    """
    return read_fix_log(path).aiding(start, position_sd, velocity_sd, lever_arm)


def read_fix_log(path: str | os.PathLike[str]) -> FixLog:
    """Read GNSS fixes on the receiver's own clock; see `read_fixes`."""
    with _as_table(Path(path)) as (file, scale):
        header = "time_s,latitude_deg,longitude_deg,height_m"
        log = LogColumns.find(file, _quantities, (TIME, *_POSITION), header)
        source = log.table.source
        for prefix in ("velocity ", "sd ", "sd velocity "):
            group = [prefix + axis for axis in _NED]
            there = [n for n in group if {n, n.replace("down", "up")} & log.columns.keys()]
            if there and len(there) < len(group):
                lacking = next(name for name in group if name not in there)
                raise InputError(
                    f"{source} has a column for {there[0]} but none for {lacking}: add it, or "
                    "leave out all three"
                )
        values = log.load()
    time = _times(log, values[TIME])
    found = log.radians(values, _LIMITS) | {"height": log.metres("height", values["height"])}
    position = np.stack([found[name] for name in _POSITION], axis=1)
    if "velocity up" in values:
        values["velocity down"] = -values["velocity up"]
    velocity = None
    if "velocity down" in values:
        velocity = np.stack([values[f"velocity {axis}"] for axis in _NED], axis=1)
    notices = []
    if scale:
        notices.append(notice("dates", values={"scale": scale}, variant="fixes"))
    if log.unused:
        names = ", ".join(log.unused)
        notices.append(notice("columns-unused", values={"columns": names}))
    no_fix = (position[:, 0] == 0.0) & (position[:, 1] == 0.0)
    if np.any(no_fix):
        position[no_fix] = np.nan
        values_at_zero = {"count": int(np.count_nonzero(no_fix))}
        notices.append(notice("positions-at-zero", values=values_at_zero))
    again = _repeated(time, position)
    if np.any(again):
        position[again] = np.nan
        if velocity is not None:
            velocity[1:][again[1:] & np.all(velocity[1:] == velocity[:-1], axis=1)] = np.nan
        notices.append(notice("fixes-repeated", values={"count": int(np.count_nonzero(again))}))
    if velocity is not None:
        _check_axes(source, time, position, velocity)
    position_sd = _deviations(log, values, "sd ", position)
    velocity_sd = None if velocity is None else _deviations(log, values, "sd velocity ", velocity)
    return FixLog(time, position, velocity, position_sd, velocity_sd, source, tuple(notices))


def read_heights(path: str | os.PathLike[str]) -> tuple[str, FloatArray, FloatArray]:
    """Source, time (s) and height (m) of a barometer, NaN where there is none."""
    log = LogColumns.find(Path(path), _quantities, (TIME, "height"), "time_s,height_m")
    values = log.load()
    return log.table.source, _times(log, values[TIME]), log.metres("height", values["height"])


@contextmanager
def _as_table(path: Path) -> Iterator[tuple[Path, str]]:
    """A file with a header, and the time scale of its dates; "" without dates.

    A solution of RTKLIB (dates or GPS weeks) becomes a table of the same line numbers in seconds
    since 1970-01-01 on its own calendar: GPS time is ahead of UTC by the leap seconds.
    """
    existing_file(path)
    with opened(path) as stream:
        head = stream.read(_HEAD).decode(errors="replace")
    scale = next((found[1] for line in head.splitlines() if (found := _RTKLIB.match(line))), "")
    if not scale:
        yield path, "UTC" if DATE.search(head) else ""
        return

    def seconds(week: re.Match[str]) -> str:
        return f"{_GPS_EPOCH + int(week[1]) * _WEEK_LENGTH + float(week[2]):.6f}"

    with opened(path) as stream:
        text = stream.read().decode(errors="replace")
    text = _RTKLIB.sub(lambda head: "time_s" + head[2].replace(" ns ", " satellites "), text)
    text = _DAY.sub(r"\1-\2-\3T", _WEEK.sub(seconds, re.sub("(?m)^%.*", "#", text)))
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / path.name
        table.write_text(text)
        yield table, scale


def _quantities(name: str) -> tuple[str, ...]:
    """Quantities of a column; two for a horizontal standard deviation."""
    if is_time(name):
        return (TIME,)
    words = [part for word in words_of(name) for part in _parts(word)]
    is_sd = not _SD_WORDS.isdisjoint(words)
    is_velocity = not _VELOCITY_WORDS.isdisjoint(words)
    while is_velocity and len(words) > 1 and words[-1] in _SPEED_UNIT:
        words.pop()
    words = [word for word in words if word not in _SD_WORDS | _VELOCITY_WORDS | _OTHER_WORDS]
    if len(words) != 1:
        return ()
    prefix = ("sd " if is_sd else "") + ("velocity " if is_velocity else "")
    if words[0] in _AXES_OF_ACCURACY and is_sd:
        return tuple(prefix + each for each in _AXES_OF_ACCURACY[words[0]])
    position = POSITION_WORDS.get(words[0])
    if position is not None and not is_velocity:
        return (prefix + _AXIS_OF_POSITION[position],) if is_sd else (position,)
    direction = _DIRECTIONS.get(words[0])
    if direction is None or not prefix:
        return ()
    return (prefix + ("down" if is_sd and direction == "up" else direction),)


def _parts(word: str) -> list[str]:
    """Words of a short name: vn is v n, sdvn is sd v n."""
    found = _SHORT.fullmatch(word)
    return [part for part in found.groups() if part] if found else [word]


def _times(log: LogColumns, stamps: FloatArray) -> FloatArray:
    """Time stamps in s; rejects missing ones, and ones that do not rise."""
    bad = np.flatnonzero(np.isnan(stamps))
    if bad.size:
        raise InputError(f"{log.place(TIME, int(bad[0]))}: no time: delete the row")
    if not stamps.size:
        raise InputError(f"{log.table.source} has no fixes: check the file")
    log.check_rising(stamps)
    return stamps * log.seconds_per_stamp()


def _deviations(
    log: LogColumns, values: Mapping[str, FloatArray], prefix: str, measured: FloatArray
) -> FloatArray | None:
    """Standard deviations of three components, or ``None`` if the file has none."""
    names = [prefix + axis for axis in _NED]
    if names[0] not in values:
        return None
    there = np.all(np.isfinite(measured), axis=1)
    for name in names:
        if log.unit(name) in ("deg", "rad", "ft"):
            raise InputError(f"{log.place(name)}: give standard deviations in metres")
        bad = np.flatnonzero(there & ~(values[name] > 0.0))
        if bad.size:
            raise InputError(
                f"{log.place(name, int(bad[0]))}: a standard deviation of "
                f"{values[name][bad[0]]:g}: give a number above zero for each fix"
            )
    return np.stack([values[name] for name in names], axis=1)


def _repeated(time: FloatArray, position: FloatArray) -> BoolArray:
    """Whether each position is the one before, written again, of a vehicle that moves."""
    again = np.zeros(time.size, dtype=bool)
    again[1:] = np.all(position[1:] == position[:-1], axis=1)
    new = np.flatnonzero(~again & np.isfinite(position[:, 0]))
    if new.size < 2:
        return np.zeros_like(again)
    first, last = new[:-1], new[1:]
    way = np.linalg.norm(ned_difference(position[last], position[first])[:, :2], axis=1)
    moved = (way > tuning.REPEATED_WAY) & (time[last] - time[first] <= tuning.CHORD)
    held = again[np.minimum(first + 1, time.size - 1)]
    return again & (np.count_nonzero(moved & held) >= tuning.REPEATS)


def height_steps(aiding: Aiding, start: float) -> list[Notice]:
    """Steps of the heights that stay, and that climbs before and after do not explain."""
    position = aiding.of("position")
    if position is None or position.time.size < tuning.CLIMB:
        return []
    time, height, sd = position.time, position.value[:, 2], position.sd[:, 2]
    step, rise = np.diff(time), np.diff(height)
    off = rise - step * median_filter(rise / step, tuning.CLIMB)
    # An outlier comes back.
    stays = np.convolve(off, np.ones(3), "same")
    sigmas, by = tuning.STEP
    limit = sigmas * np.hypot(sd[1:], sd[:-1]) + by * step**2
    found = np.flatnonzero(np.minimum(off * np.sign(stays), np.abs(stays)) > limit)
    found = found[step[found] <= tuning.CHORD]
    if not found.size:
        return []
    values = {"up": float(off[found[0]]), "time": float(time[found[0] + 1] + start)}
    return [notice("heights-step", "position", {**values, "count": int(found.size)})]


# -- axes and units -------------------------------------------------------------------------------


def _check_axes(source: str, time: FloatArray, position: FloatArray, velocity: FloatArray) -> None:
    """Reject velocities that agree with positions only with another column, sign or unit."""
    there = np.all(np.isfinite(position) & np.isfinite(velocity), axis=1)
    time, position, velocity = time[there], position[there], velocity[there]
    if time.size < 2:
        return
    step = np.diff(time)[:, None]

    def gone(velocity: FloatArray) -> FloatArray:
        steps = 0.5 * (velocity[1:] + velocity[:-1]) * step
        return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])

    gaps = np.concatenate([[0], np.cumsum(step[:, 0] > tuning.CHORD)])
    marks = np.searchsorted(time, np.arange(time[0], time[-1], 0.5 * tuning.WAY))
    first, last = marks[:-2], marks[2:]
    whole = gaps[first] == gaps[last]
    first, last = first[whole], last[whole]
    if first.size < tuning.FEWEST_WAYS:
        return

    def mismatch(here: FloatArray, way: FloatArray, part: slice) -> float:
        """Median square of the difference over that of the way, which has the same unit."""
        off = (ned_difference(here[last], here[first]) - way)[:, part]
        size = max(float(np.median(np.sum(way[:, part] ** 2, axis=1))), np.finfo(float).tiny)
        return float(np.median(np.sum(off**2, axis=1))) / size

    better: dict[str, float] = {}
    by_velocity = gone(velocity)[last] - gone(velocity)[first]
    north, east = np.gradient(ned_difference(position, position[0])[:, :2], time, axis=0).T
    course = np.arctan2(east, north)
    for what, part, here, factor in _misreadings(position, course):
        if np.all(np.abs(here[:, 0]) < 0.5 * np.pi):
            turned = gone((velocity[:, None] @ factor)[:, 0])
            left = mismatch(here, turned[last] - turned[first], part)
            now = mismatch(position, by_velocity, part)
            if now > tuning.MIXED_UP**2 * left:
                better[what] = left / now
    if better:
        what = min(better, key=better.__getitem__)
        raise InputError(f"{source}: positions agree with velocities only if {what}")


def _misreadings(
    position: FloatArray, course: FloatArray
) -> Iterator[tuple[str, slice, FloatArray, FloatArray]]:
    """Each possible mistake with its hint, the axes that show it, right positions and velocities.

    The velocities are those of the file times a matrix, or one for each fix. The course is that of
    the positions, rad.
    """
    level, vertical = slice(0, 2), slice(2, 3)
    same, which = np.eye(3), "check which column is which"
    swap, degrees = [1, 0, 2], np.array([np.degrees(1.0), np.degrees(1.0), 1.0])
    yield f"velocity north and east are exchanged: {which}", level, position, same[swap]
    yield f"velocity down and up are exchanged: {which}", vertical, position, -same
    yield f"latitude and longitude are exchanged: {which}", level, position[:, swap], same
    for name, axis, signs in (("latitude", "north", (-1, 1, 1)), ("longitude", "east", (1, -1, 1))):
        text = f"the sign of {name}, or of velocity {axis}, is reversed: check it"
        yield text, level, position, np.diag(signs)
    yield "latitude and longitude are in rad: give that unit", level, position * degrees, same
    for unit, factor in _SPEEDS.items():
        yield f"velocities are in {unit}: convert them to m/s", level, position, factor * same
    turn = np.tile(same, (course.size, 1, 1))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(course)
    turn[:, 0, 1] = np.sin(course)
    turn[:, 1, 0] = -turn[:, 0, 1]
    text = "velocities are forward, right, down: turn them to north, east, down, or leave them out"
    yield text, level, position, turn
