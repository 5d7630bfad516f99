"""Motion: stretches in which a recording is not static, and those in which it is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from itertools import pairwise
from typing import TypeVar
from weakref import ref

import numpy as np

from gmwm._core.distributions import norm
from gmwm._core.typing import BoolArray, FloatArray
from gmwm._core.units import SI_UNIT, factor
from gmwm.diagnosis import tuning
from gmwm.diagnosis.innovations import Spans
from gmwm.readers import AXES, Channel, Recording, block_means, turning_gravity

T = TypeVar("T")

_GRAVITY = factor("g", SI_UNIT["accel"])
_LISTED = 3
_LEAST_CONE = 0.01  # rad by which gravity leaves its mean where a sensor turns; at rest, 0.3 deg
_LAGS, _FEWEST_LAGS = (1, 4, 16), 20  # blocks between which changes count; how many at least
_LIMIT = {"gyro": tuning.TURNS, "accel": tuning.TILTS * _GRAVITY}


@dataclass(frozen=True)
class Move:
    """One stretch that is not static."""

    start: float  # s
    stop: float  # s
    length: float  # without missing samples, s
    rate: float  # largest angular rate beyond that at rest, rad/s; 0 without gyros
    tilt: float  # angle between gravity before and after, rad; 0 where either is unknown

    @property
    def is_tilt(self) -> bool:
        """Whether the sensor was static before and after, in another attitude."""
        return self.tilt > tuning.TILTS and self.length < tuning.LONGEST_TILT

    def touches(self, start: int, stop: int, dt: float) -> bool:
        """Whether it has samples of an interval."""
        return self.start <= stop * dt and start * dt <= self.stop


@dataclass(frozen=True)
class Motion:
    """When a recording moves, and when it does not.

    static: Begin and end of each static stretch, s.
    turns_steadily: Whether gravity turns at one rate from the first sample to the last.
    """

    moves: tuple[Move, ...]
    static: tuple[tuple[float, float], ...]
    turns_steadily: bool = False

    def joined(self, events: Spans, dt: float) -> Spans:
        """Sample intervals, those of one tilt made one: its begin and its end are shocks."""
        found: list[tuple[int, int]] = []
        tilt: Move | None = None
        for start, stop in events:
            now = next((m for m in self.moves if m.is_tilt and m.touches(start, stop, dt)), None)
            if now is not None and now is tilt:
                start = found.pop()[0]
            found.append((start, stop))
            tilt = now
        return tuple(found)

    def outside(self, events: Spans, dt: float) -> Spans:
        """Sample intervals that do not touch a move: a move is not a shock."""
        if not self.static:
            return events
        return tuple(e for e in events if not any(m.touches(*e, dt) for m in self.moves))


def remembered(examine: Callable[[Recording], T]) -> Callable[[Recording], T]:
    """Keep the result for the recording that was examined last, as long as that lives."""
    latest: list[tuple[ref[Recording], T]] = []

    @wraps(examine)
    def found(recording: Recording) -> T:
        known = next(iter(latest), None)  # one look: threads may examine others meanwhile
        if known is None or known[0]() is not recording:
            known = ref(recording, lambda _: latest.clear()), examine(recording)
            latest[:] = [known]
        return known[1]

    return found


@remembered
def find_motion(recording: Recording) -> Motion:
    """Find the stretches in which a recording is static.

    Means of a second, without shocks by a running median, move where they change within seconds by
    more than sensors at rest and their own noise do. Between two changes the level is static if its
    rate is the one nearest to zero. Slow motion turns gravity as the gyros predict.
    """
    size = max(round(tuning.MOTION_BLOCK / recording.dt), tuning.FEWEST_OF_MOTION)
    whole = ((0.0, recording.duration),)
    if recording.n < tuning.FEWEST_BLOCKS * size:
        return Motion((), whole)
    means = {}
    for sensor in SI_UNIT:
        found = [channel.values for channel in _channels(recording, sensor)]
        means[sensor] = block_means(found, size) if found else np.empty((recording.n // size, 0))
    known = np.flatnonzero(np.all(~np.isnan(np.hstack(list(means.values()))), axis=1))
    if known.size < tuning.FEWEST_BLOCKS:
        return Motion((), whole)
    level = {sensor: _smooth(values[known]) for sensor, values in means.items()}
    changing = np.zeros(known.size, dtype=bool)
    for sensor, values in level.items():
        for channel, series in zip(_channels(recording, sensor), values.T, strict=True):
            white = _white(channel.values, size)
            for row in np.flatnonzero(level_changes(series, _LIMIT[sensor], white)[1]):
                changing[row : row + tuning.MEDIAN_BLOCKS + 1] = True
    turn = _steady_turn(recording, size)
    if turn > 0.0:
        still = []
    elif np.any(changing):
        long = [run for run in runs_of(~changing) if run[1] - run[0] >= tuning.SHORTEST_STATIC]
        still = _still(level["gyro"], long)
    else:
        still = [] if _never_rests(recording, level["gyro"], size) else [(0, known.size)]
    still = [run for run in still if not _tilts_slowly(level["accel"][slice(*run)])]
    # From block to block of those that are known; the ends are those of the record.
    begins, ends = known * size * recording.dt, (known + 1) * size * recording.dt
    begins[0], ends[-1] = 0.0, recording.duration
    static = tuple((float(begins[a]), float(ends[b - 1])) for a, b in still)
    moves = []
    for (_, last), (first, _) in pairwise([(0, 0), *still, (known.size, known.size)]):
        if first > last:  # a move from one static run to the next
            rate = max(_fastest(level["gyro"], still, slice(last, first)), turn)
            around = slice(max(last - tuning.SHORTEST_STATIC, 0), first + tuning.SHORTEST_STATIC)
            tilt = _angle(level["accel"][around])
            span = float(begins[last]), float(ends[first - 1])
            moves.append(Move(*span, (first - last) * size * recording.dt, rate, tilt))
    return Motion(tuple(moves), static, turn > 0.0)


def _channels(recording: Recording, sensor: str) -> list[Channel]:
    """Channels of a sensor with most samples present and within the range of sensors."""
    return [c for c in recording.inertial if c.quantity == sensor and is_moved_with(c)]


def is_moved_with(channel: Channel) -> bool:
    """Whether motion can be seen in a channel, which needs half of its samples in range."""
    largest = np.fmax.reduce(np.abs(channel.values), initial=0.0)
    return 2 * channel.missing <= channel.n and bool(largest < tuning.LARGEST_OF_SENSOR)


def _smooth(means: FloatArray) -> FloatArray:
    """Running median, which keeps steps and drops what is shorter than half of it."""
    half = tuning.MEDIAN_BLOCKS // 2
    means = means.copy()
    for end, beside in ((0, means[1 : 2 * half + 2]), (-1, means[-2 * half - 2 : -1])):
        # It stands for those beyond the end: a shock in it would be no short one.
        low, high = np.fmin.reduce(beside), np.fmax.reduce(beside)
        means[end] = np.clip(means[end], 2.0 * low - high, 2.0 * high - low)
    padded = np.pad(means, ((half, half), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, tuning.MEDIAN_BLOCKS, axis=0)
    smooth: FloatArray = np.median(windows, axis=-1)
    return smooth


def _white(values: FloatArray, size: int) -> float:
    """Standard deviation of a mean of ``size`` samples if their fast noise is all there is."""
    steps = np.diff(values)
    # Equal neighbours are of a channel that is dead for a while, or coarse: not of its noise.
    steps = steps[~np.isnan(steps) & (steps != 0.0)]
    if not steps.size:
        return 0.0
    return float(np.median(np.abs(steps))) / (norm.ppf(0.75) * np.sqrt(2.0 * size))


def level_changes(
    series: FloatArray, limit: float, least: float = 0.0, unsure: float = 1.0
) -> tuple[FloatArray, BoolArray]:
    """Changes of a level over some blocks, and which are larger than a limit and than noise."""
    lag = tuning.MEDIAN_BLOCKS
    change = series[lag:] - series[:-lag]
    # Most blocks may move: a low quantile knows the noise all the same.
    scale = float(np.quantile(np.abs(change), tuning.QUIET)) / norm.ppf(0.5 + 0.5 * tuning.QUIET)
    far = norm.isf(0.5 * tuning.FALSE_ALARM / series.size) * tuning.BEYOND_NOISE * unsure
    return change, np.abs(change) > max(limit, far * max(scale, least))


def runs_of(chosen: BoolArray) -> list[tuple[int, int]]:
    """Begin and end of each run of marked places."""
    edges = np.flatnonzero(np.diff(chosen, prepend=False, append=False)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def _still(rate: FloatArray, runs: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Runs with the rate of the run nearest to zero."""
    if not rate.shape[1] or not runs:
        return runs
    levels = np.array([np.median(rate[a:b], axis=0) for a, b in runs])
    rest = levels[np.argmin(np.linalg.norm(levels, axis=1))]
    away = np.max(np.abs(levels - rest), axis=1)
    return [run for run, far in zip(runs, away, strict=True) if far < tuning.TURNS]


def _fastest(rate: FloatArray, still: Sequence[tuple[int, int]], where: slice) -> float:
    """Largest angular rate of some blocks, from that of the static ones."""
    if not rate.shape[1]:
        return 0.0
    rest = np.concatenate([rate[a:b] for a, b in still]) if still else rate
    away = np.linalg.norm(rate[where] - np.median(rest, axis=0), axis=1)
    return float(np.max(away))


def _angle(force: FloatArray) -> float:
    """Angle between gravity in the first and in the last blocks; 0 where it is not seen."""
    if force.shape[1] < len(AXES) or force.shape[0] < 2 * tuning.SHORTEST_STATIC:
        return 0.0
    before = np.median(force[: tuning.SHORTEST_STATIC], axis=0)
    after = np.median(force[-tuning.SHORTEST_STATIC :], axis=0)
    product = float(np.linalg.norm(before) * np.linalg.norm(after))
    if product < (0.5 * _GRAVITY) ** 2:
        return 0.0
    return float(np.arccos(np.clip(before @ after / product, -1.0, 1.0)))


def _tilts_slowly(force: FloatArray) -> bool:
    """Whether gravity ends elsewhere than it began, by more than a random walk explains."""
    angle = _angle(force)
    if angle < tuning.SLOW_TILT:
        return False
    change = force[tuning.MEDIAN_BLOCKS :] - force[: -tuning.MEDIAN_BLOCKS]
    # About their median: a steady tilt is in all of them.
    spread = np.median(np.abs(change - np.median(change, axis=0)), axis=0) / norm.ppf(0.75)
    walk = float(np.max(spread)) * np.sqrt(force.shape[0] / tuning.MEDIAN_BLOCKS)
    return bool(angle * _GRAVITY > norm.isf(0.5 * tuning.FALSE_ALARM) * walk)


def _never_rests(recording: Recording, rate: FloatArray, size: int) -> bool:
    """Whether gravity turns all the time, as the gyros say, or rates are not those of a bias."""
    # A straight drift is not motion, however steep.
    straight = np.vander(np.linspace(-1.0, 1.0, rate.shape[0]), 2)
    rest = rate - straight @ np.linalg.lstsq(straight, rate, rcond=None)[0]
    spread = np.ptp(np.quantile(rest, [tuning.QUIET, 1.0 - tuning.QUIET], axis=0), axis=0)
    noise = [_white(channel.values, size) for channel in _channels(recording, "gyro")]
    if np.any((spread > tuning.WILD) & (spread > tuning.BEYOND_WHITE * np.array(noise))):
        return True
    found = turning_gravity(recording, size, tuning.PARTS_OF_MOTION)
    return (
        found is not None
        and found.explained > tuning.EXPLAINED
        and found.change > tuning.SWAYS * _GRAVITY
        and 1.0 / tuning.AS_PREDICTED < found.factor < tuning.AS_PREDICTED
    )


def _steady_turn(recording: Recording, size: int) -> float:
    """Constant rate at which gravity turns in the frame of a sensor, rad/s; 0 if there is none.

    The w of da/dt = -w x a by least squares. It counts if it explains most of the changes and turns
    by a radian in all, which noise and drifts do not.
    """
    names = [f"accel_{axis}" for axis in AXES]
    if not set(names) <= set(recording):
        return 0.0
    means = block_means([recording[name].values for name in names], size)
    if np.all(np.any(np.isnan(means), axis=1)):
        return 0.0
    wander = np.linalg.norm(means - np.nanmean(means, axis=0), axis=1)
    if not np.nanmax(wander) > _LEAST_CONE * np.linalg.norm(np.nanmean(means, axis=0)):
        return 0.0
    for lag in _LAGS:
        if means.shape[0] < _FEWEST_LAGS * lag:
            break
        change = means[lag:] - means[:-lag]
        known = ~np.any(np.isnan(change), axis=1)
        x, y, z = 0.5 * (means[lag:] + means[:-lag])[known].T
        none = np.zeros(x.size)
        # -w x a, by the components of w.
        turned = np.array([[none, z, -y], [-z, none, x], [y, -x, none]])
        design, wanted = turned.reshape(3, -1).T, change[known].T.ravel()
        rate, *_ = np.linalg.lstsq(design, wanted, rcond=None)
        rest, total = wanted - design @ rate, float(wanted @ wanted)
        speed = float(np.linalg.norm(rate)) / (lag * size * recording.dt)
        if rest @ rest < 0.5 * total and speed * recording.duration > 1.0:
            return speed
    return 0.0


def times_of(stretches: Sequence[tuple[float, float]]) -> str:
    """Some stretches, the longest ones of many."""
    longest = sorted(stretches, key=lambda each: each[0] - each[1])[:_LISTED]
    parts = [f"{start:.4g} to {stop:.4g} s" for start, stop in sorted(longest)]
    rest = len(stretches) - _LISTED
    more = f", and {rest} shorter one{'s' if rest > 1 else ''}" if rest > 0 else ""
    return ", ".join(parts) + more
