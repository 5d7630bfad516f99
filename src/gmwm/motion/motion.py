"""`motion`: the noise of each IMU in motion, from several on one rigid body."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.spatial.transform import Rotation

from gmwm._core import checks
from gmwm._core.typing import QUARTILE, BoolArray, FloatArray, Progress
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.issues import Notice, notice
from gmwm.motion import tuning
from gmwm.motion.clocks import Clock, join, means
from gmwm.motion.curves import Curves, Flight, curves_of
from gmwm.motion.mapping import (
    Mounting,
    Signals,
    arms_of,
    bridged,
    far_out,
    map_onto,
    rotation_to,
    tilt_error,
    vibration_of,
)
from gmwm.motion.reference import over_samples, rates_of, read_attitude, without_reference
from gmwm.motion.result import InMotion, MotionCurve, VibrationClass, static_variance
from gmwm.readers import Recording, require_recording

_AXES = "xyz"


@dataclass(frozen=True)
class _Imu:
    """An IMU in a flight.

    dt: Sampling interval, s.
    samples: (n, 3) by sensor, SI.
    lost: (n,), whether a sample within 0.1 s is missing: those beside one are often wrong.
    """

    label: str
    dt: float
    samples: Mapping[str, FloatArray]
    lost: BoolArray

    @cached_property
    def vibration(self) -> FloatArray:
        """(n,) m/s^2 rms; NaN without accelerometers."""
        forces = self.samples.get("accel")
        return np.full(len(self.lost), np.nan) if forces is None else vibration_of(forces, self.dt)

    @property
    def time(self) -> FloatArray:
        return np.asarray(np.arange(len(self.samples["gyro"])) * self.dt, dtype=float)


def motion(
    sources: Sequence[Any] | Mapping[str, Recording],
    *,
    static: Mapping[str, Any] | None = None,
    limits: Sequence[float] | None = None,
    reference: Any = None,
    progress: Progress | None = None,
) -> InMotion:
    """Measure the noise of IMUs in motion, from three or more on one rigid body.

    Each IMU in turn is the target. The others are mapped onto it: clocks are joined by the rates,
    and rotation, scale, misalignment, lag and lever arm are estimated together. The difference of
    the target and a mapped IMU has the errors of both. What two such differences have in common
    is the error of the target, whose samples no filter has changed.

    Parameters
    ----------
    sources : sequence of Recording, or of sequences of them
        The IMUs of one flight, or the IMUs, in one order, of each of several flights. Keys of a
        mapping name the IMUs.
    static : Calibration, or mapping of str to each, optional
        At rest: of the kind of sensor, or by the name of the IMU.
    limits : (float, float), optional
        Vibration (accelerometer from 20 to 60 Hz, rms over a second, m/s^2) between the classes
        low, middle and high, such as idle, hover and manoeuvres; by default each has a third of
        the time.
    reference : path or (times, quaternions), or a sequence with one for each flight, optional
        Attitude of the body from motion capture or a better INS: s, and (n, 4) x y z w of the
        rotations from the body to a fixed frame, or a text file with them. Then ``sources`` is one
        IMU, or the recording of one in each flight, and its gyros are measured.
    progress : callable, optional
        Called as ``progress(done, total, flight)``.

    Raises
    ------
    InputError
        If the noise of a reference dominates at all averaging times, there are fewer than two IMUs,
        one lacks a gyro axis, they are not on one rigid body, or a clock wanders.

    Notes
    -----
    Instruments in place of least squares keep noise from biasing the mapping, and the noise that
    the fits remove is added back: on simulated errors over real flights the variances are within
    1.8 % of the truth, for three and four IMUs (`benchmarks/motion.py`). Errors common to all IMUs
    are not measured. A three-cornered hat would use mapped sensors as targets, whose noise the
    mapping may filter.
    """
    if reference is not None:
        return _against(sources, reference, static)
    flights, filled = _flights(sources)
    notices = [notice("motion-filled", values={"samples": filled})] if filled else []
    labels = tuple(imu.label for imu in flights[0])
    clocks: list[Clock] = []
    mountings: list[Mounting] = []
    differences: dict[tuple[str, str], list[Flight]] = {}
    events: dict[int, int] = {}
    for number, imus in enumerate(flights, start=1):
        if progress is not None:
            progress(number - 1, len(flights), f"flight {number}")
        joined = [_joined(number, imus[0], imu) for imu in imus[1:]]
        moving = [clock for clock in joined if clock is not None]
        if len(moving) < len(joined):
            notices.append(notice("motion-at-rest", f"flight {number}"))
            moving = []
        clocks += moving
        for k in range(len(imus)):
            found, mounted, count = _of_target(number, imus, k, moving)
            mountings += mounted
            events[number] = max(events.get(number, 0), count)
            for sensor, own in found.items():
                differences.setdefault((labels[k], sensor), []).append(own)
    curves = _curves(differences, flights[0][0].dt, static)
    _check_copies(curves, labels)
    classes = _classes(differences, flights[0][0].dt, static, limits)
    if count := sum(events.values()):
        notices.append(notice("motion-events", values={"events": count}))
    notices += [*_notices(curves, len(labels)), *_together(labels, flights, clocks)]
    durations = tuple(float(imus[0].time[-1]) for imus in flights)
    joints = tuple(clocks), tuple(mountings), tuple(notices)
    return InMotion(labels, durations, curves, *joints, classes, _history(flights))


def _history(flights: Sequence[Sequence[_Imu]]) -> FloatArray:
    """(n, 3) flight, time and vibration of the first IMU, every second."""
    rows = []
    for number, (imu, *_) in enumerate(flights, start=1):
        levels = imu.vibration[:: max(1, round(tuning.VIBRATION_OVER / imu.dt))]
        rows += [(number, tuning.VIBRATION_OVER * k, each) for k, each in enumerate(levels)]
    return np.array(rows)


def _against(sources: Any, references: Any, static: Mapping[str, Any] | None) -> InMotion:
    """The gyros of one IMU against an attitude."""
    single = isinstance(sources, Recording)
    recordings, attitudes = ([each] if single else list(each) for each in (sources, references))
    if not recordings or len(recordings) != len(attitudes):
        counts = f"{len(recordings)} recordings and {len(attitudes)} references"
        raise InputError(f"{counts}: give one for each")
    clocks, mountings, own, durations, intervals, events = [], [], [], [], [], 0
    for number, (recording, given) in enumerate(zip(recordings, attitudes, strict=True), start=1):
        imu, _ = _imu(f"flight {number}", "imu", recording)
        imu = replace(imu, samples={"gyro": imu.samples["gyro"]})
        attitude = read_attitude(given) if isinstance(given, str | os.PathLike) else given
        dt, rates, gaps = rates_of(*map(np.asarray, attitude))
        other = _Imu("reference", dt, {"gyro": rates}, gaps)
        times = max(1, round(dt / imu.dt))
        imu = replace(imu, samples={"gyro": over_samples(imu.samples["gyro"], times, imu.dt)})
        clock = _joined(number, imu, other)
        if clock is None:
            raise InputError(
                f"flight {number}: the reference does not move like the IMU: check both"
            )
        found, mounted, count = _of_target(number, [imu, other], 0, [clock])
        mountings += mounted
        step = imu.dt
        if times > 1:
            found, mounted, count = _of_target(number, [imu, other], 1, [clock])
            back, step = Rotation.from_rotvec(-mounted[0].rotation), dt
            seen = [back.apply(each) for each in found["gyro"].differences]
            found["gyro"] = replace(found["gyro"], differences=seen)
        # Of an even number of samples, the middle is between two.
        # And rates of the reference stand in the middle of two attitudes.
        late = 0.5 * dt - 0.5 * (1 - times % 2) * imu.dt
        clocks.append(replace(clock, offset=clock.offset + late))
        own.append(found["gyro"])
        durations.append(float(imu.time[-1]))
        intervals.append(dt)
        events += count
    sums = curves_of(own, step, max(len(each.vibration) for each in own))
    curves, angle = without_reference(sums, max(intervals), "the gyros")
    notices = [notice("motion-reference", values={"angle": 1e3 * angle})]
    notices += [notice("motion-events", values={"events": events})] if events else []
    joints = tuple(clocks), tuple(mountings), tuple(notices)
    by_axis = tuple(_by_axis("imu", "gyro", curves, [static]))
    return InMotion(("imu",), tuple(durations), by_axis, *joints)


def _flights(sources: Any) -> tuple[list[list[_Imu]], int]:
    """The IMUs of each flight, and the number of samples that were filled."""
    if isinstance(sources, Recording | str) or not isinstance(sources, Sequence | Mapping):
        raise InputError(
            f"{checks.shown(sources)} is not a list of recordings: give two IMUs or more"
        )
    single = isinstance(sources, Mapping) or not sources or isinstance(sources[0], Recording | str)
    given = [sources] if single else list(sources)
    named = [
        flight
        if isinstance(flight, Mapping)
        else {f"imu {k}": each for k, each in enumerate(flight, start=1)}
        for flight in given
    ]
    if any([*flight] != [*named[0]] for flight in named):
        raise InputError("flights have different IMUs: give the same IMUs, in the same order")
    if len(named[0]) < 2:
        raise InputError("motion needs two IMUs on one body, better three: give more recordings")
    filled = 0
    flights: list[list[_Imu]] = []
    for number, own in enumerate(named, start=1):
        flights.append([])
        for label, recording in own.items():
            imu, gone = _imu(f"flight {number}, {label}", label, recording)
            if any(np.array_equal(imu.samples["gyro"], o.samples["gyro"]) for o in flights[-1]):
                raise InputError(f"flight {number}: {label} is a copy: give each IMU once")
            flights[-1].append(imu)
            filled += gone
    with_accel = all("accel" in imu.samples for flight in flights for imu in flight)
    sensors = ("gyro", "accel") if with_accel else ("gyro",)
    rates = [1.0 / imu.dt for flight in flights for imu in flight]
    if max(rates) > 1.01 * min(rates):
        raise InputError(
            f"the recordings have {min(rates):.6g} to {max(rates):.6g} Hz: give IMUs of one rate"
        )
    return [
        [replace(imu, samples={s: imu.samples[s] for s in sensors}) for imu in flight]
        for flight in flights
    ], filled


def _imu(where: str, label: str, given: Any) -> tuple[_Imu, int]:
    """Samples of a recording, and how many are missing: they lie on lines between others."""
    require_recording(given)
    recording = given.of_one_rate("motion")
    samples, lost = {}, np.zeros(recording.n, dtype=bool)
    for sensor in ("gyro", "accel"):
        names = [f"{sensor}_{axis}" for axis in _AXES]
        if missing := [name for name in names if name not in recording]:
            if sensor == "gyro" or len(missing) < len(names):
                raise InputError(f"{where}: there is no {missing[0]}: give all three axes")
            continue
        values = np.array(np.stack([recording[name].values for name in names], axis=1))
        for name, column in zip(names, values.T, strict=True):
            fault = _fault(column, recording.dt)
            if fault:
                raise InputError(
                    f"{where}: {name} {fault}: leave this IMU out, or give a part without"
                )
            # Less the cubic through four neighbours, which follows a motion.
            first, second, fourth, last = (column[k : len(column) - 4 + k] for k in (0, 1, 3, 4))
            away = np.abs(column[2:-2] - (4.0 * (second + fourth) - first - last) / 6.0)
            least = tuning.SPIKE * max(np.nanmedian(away) / QUARTILE, np.finfo(float).tiny)
            column[2:-2][(away > least) & (away == maximum_filter1d(away, 5))] = np.nan
        gone = np.isnan(values)
        for axis in np.flatnonzero(gone.any(axis=0)):
            there = np.flatnonzero(~gone[:, axis])
            values[:, axis] = np.interp(np.arange(len(values)), there, values[there, axis])
        lost |= gone.any(axis=1)
        samples[sensor] = values
    filled = int(lost.sum())
    if filled > tuning.MOST_FILLED * recording.n:
        raise InputError(
            f"{where}: {filled} of {recording.n} samples are missing: give one without gaps"
        )
    near = 2 * round(tuning.BESIDE_LOST / recording.dt) + 1
    lost = np.convolve(lost, np.ones(near), "same") > 0.5
    return _Imu(label, recording.dt, samples, lost), filled


def _fault(column: FloatArray, dt: float) -> str:
    """In words, why a channel (n,) is of no use; empty if it may be used."""
    changes = np.flatnonzero(np.diff(column, prepend=np.inf, append=np.inf) != 0.0)
    stuck = (np.max(np.diff(changes)) - 1) * dt
    if stuck > tuning.STUCK:
        return f"stays at one value for {stuck:.3g} s"
    levels, counts = np.unique(column, return_counts=True)
    end = 0 if counts[0] > counts[-1] else -1
    is_cut = levels.size > tuning.FEWEST_LEVELS and counts[end] > tuning.CLIPPED * column.size
    return f"is cut off at {levels[end]:.4g}" if is_cut else ""


def _joined(flight: int, first: _Imu, imu: _Imu) -> Clock | None:
    rates = first.samples["gyro"], imu.samples["gyro"]
    return join(flight, imu.label, rates, (first.dt, imu.dt))


def _of_target(
    flight: int, imus: Sequence[_Imu], k: int, clocks: Sequence[Clock]
) -> tuple[dict[str, Flight], list[Mounting], int]:
    """By sensor, differences of one IMU and each other, their mountings, and how many events.

    At rest its own samples are in place of differences.

    clocks: Of all IMUs but the first; none at rest.
    """
    target, others = imus[k], [imu for j, imu in enumerate(imus) if j != k]
    if not clocks:
        whole = {s: v - v.mean(axis=0) for s, v in target.samples.items()}
        return {s: Flight([v] * len(others), target.vibration) for s, v in whole.items()}, [], 0
    own, inside, good = _instants(target, others, imus[0].label, clocks)
    size = max(1, round(tuning.MEAN_OVER / target.dt))
    found: dict[str, Flight] = {}
    mountings, events = [], 0
    turns: list[FloatArray] = []
    tilts: list[float] = []
    arms: list[FloatArray | None] = [None] * len(others)
    for sensor, samples in target.samples.items():
        wanted, signals = samples[inside], []
        for j, (imu, at) in enumerate(zip(others, own, strict=True)):
            spline = CubicSpline(imu.time, imu.samples[sensor])
            behind2, behind, values, ahead, ahead2 = (
                spline(at + k * imu.dt) for k in (-2, -1, 0, 1, 2)
            )
            # Of fourth order: the second order takes 2 % of a lever arm at a fifteenth of the rate.
            slopes = (8.0 * (ahead - behind) - ahead2 + behind2) / (12.0 * imu.dt)
            if sensor == "gyro":
                sure = means(good.astype(float), size) == 1.0
                both = [means(each, size)[sure] for each in (wanted, values)]
                turns.append(rotation_to(*both))
                tilts.append(tilt_error(both[0], both[1] @ turns[j].T))
            values, slopes = values @ turns[j].T, slopes @ turns[j].T
            # A lag times the slopes of vibration, beyond the means that give it, would be noise.
            steady = uniform_filter1d(slopes, size, axis=0)
            signals.append(Signals(values, steady, arms[j]))
            if sensor == "gyro":
                arms[j] = arms_of(values, slopes)
        mapped, parameters, errors, absorbed = map_onto(wanted, signals, good, target.dt)
        for imu, signal, found_one in zip(others, signals, parameters, strict=True):
            if not signal.is_close(wanted, found_one, size):
                raise InputError(
                    f"flight {flight}: {sensor} of {imu.label} and {target.label} differ by more "
                    "than IMUs do: check units, order and signs of axes, and for clipped or stuck "
                    "channels or a noisy reference"
                )
        if max(tilts) > tuning.MOST_TILT:
            raise InputError(
                f"flight {flight}: the IMUs turn about one axis only, which leaves their rotation "
                "about it unknown: give a motion about two axes"
            )
        if np.any(away := far_out(mapped, target.dt)):
            good = good & ~away
            events += int(np.count_nonzero(np.diff(away, prepend=False) & away))
            mapped, parameters, errors, absorbed = map_onto(wanted, signals, good, target.dt)
        own_differences = [bridged(each, good, target.dt) for each in mapped]
        found[sensor] = Flight(own_differences, target.vibration[inside], absorbed)
        for imu, turn, value, error in zip(others, turns, parameters, errors, strict=True):
            rotation = Rotation.from_matrix(turn).as_rotvec()
            parts = (value[:9], error[:9], float(value[9]), float(error[9]), value[10:], error[10:])
            mountings.append(Mounting(flight, sensor, imu.label, target.label, rotation, *parts))
    return found, mountings, events


def _instants(
    target: _Imu, others: Sequence[_Imu], first: str, clocks: Sequence[Clock]
) -> tuple[list[FloatArray], BoolArray, BoolArray]:
    """Times of the others' clocks (m,) at the target's samples, which these are, and the good ones.

    Samples are those (n,) at which every IMU has some on both sides; good ones (m,) are those where
    none is lost nearby.
    """
    by_imu = {clock.imu: clock for clock in (Clock(0, first, 0.0, 0.0, 0.0, 0.0), *clocks)}
    time = by_imu[target.label].of_first(target.time)
    own = [by_imu[imu.label].own(time) for imu in others]
    inside, good = np.ones(len(time), dtype=bool), ~target.lost
    for at, imu in zip(own, others, strict=True):
        edge = tuning.EDGE * imu.dt
        inside &= (at > edge) & (at < imu.time[-1] - edge)
        good &= ~imu.lost[np.clip(np.round(at / imu.dt).astype(int), 0, len(imu.lost) - 1)]
    return [at[inside] for at in own], inside, good[inside]


def _curves(
    differences: Mapping[tuple[str, str], Sequence[Flight]],
    dt: float,
    static: Mapping[str, Any] | None,
    within: tuple[float, float] | None = None,
) -> tuple[MotionCurve, ...]:
    """Curve of each IMU and sensor, at all instants, or those with vibration within limits."""
    longest = min(max(len(each.vibration) for each in own) for own in differences.values())
    found, labels = [], list(dict.fromkeys(label for label, _ in differences))
    for (label, sensor), own in differences.items():
        if within is not None:
            own = [each.within(*within) for each in own]
        # Of two, the variance is the sum of both.
        summed = labels if len(labels) == 2 else [label]
        at_rest = [static.get(each, static) if static is not None else None for each in summed]
        found += _by_axis(label, sensor, curves_of(own, dt, longest), at_rest)
    return tuple(found)


def _classes(
    differences: Mapping[tuple[str, str], Sequence[Flight]],
    dt: float,
    static: Mapping[str, Any] | None,
    limits: Sequence[float] | None,
) -> tuple[VibrationClass, ...]:
    """Low, middle and high vibration; none where it is not seen, or some IMU has too little."""
    levels = [np.concatenate([each.vibration for each in own]) for own in differences.values()]
    every = np.concatenate(levels)
    if np.any(np.isnan(every)):
        return ()
    given = np.quantile(every, [1 / 3, 2 / 3]) if limits is None else np.asarray(limits)
    if given.shape != (2,) or not 0.0 < given[0] < given[1]:
        raise InputError(f"limits = {checks.shown(limits)}: give two rising levels in m/s^2")
    ends = np.array([0.0, *given, np.inf])
    found = []
    for name, low, high in zip(tuning.CLASSES, ends[:-1], ends[1:], strict=True):
        shares = [np.mean((own >= low) & (own < high)) for own in levels]
        if min(shares) * min(map(len, levels)) * dt > tuning.SHORTEST_CLASS:
            own = _curves(differences, dt, static, (float(low), float(high)))
            start, stop = np.clip([low, high], every.min(), every.max()).tolist()
            found.append(VibrationClass(name, start, stop, float(np.mean(shares)), own))
    return tuple(found)


def _by_axis(
    label: str, sensor: str, curves: Curves, static: Sequence[Mapping[str, Fit] | None]
) -> list[MotionCurve]:
    pairs, differences = (each.swapaxes(0, 1) for each in (curves.pairs, curves.differences))
    parts = curves.variance, curves.lower, curves.upper, pairs, differences, curves.agree
    found = []
    for name, *own in zip(_AXES, *parts, strict=True):
        channel = f"{sensor}_{name}"
        at_rest = np.sum([static_variance(s, channel, curves.tau) for s in static], axis=0)
        own += [at_rest, curves.exponent, curves.exponent_error]
        found.append(MotionCurve(label, channel, sensor, curves.tau, *own))
    return found


def _check_copies(curves: Sequence[MotionCurve], labels: Sequence[str]) -> None:
    """Raise InputError if the gyros of two IMUs hardly differ while others do."""
    gyros = [each for each in curves if each.quantity == "gyro"]
    for label in labels:
        first = [each.differences[:, 0] for each in gyros if each.imu == label]
        share = np.max(first, axis=0) / np.max(
            [each.differences[:, 0] for each in gyros], axis=None
        )
        others = [each for each in labels if each != label]
        for other, small in zip(others, share < tuning.COPY, strict=True):
            if small:
                raise InputError(f"{label} and {other} have the same errors: give each IMU once")


def _together(
    labels: Sequence[str], flights: Sequence[Sequence[_Imu]], clocks: Sequence[Clock]
) -> list[Notice]:
    """Which IMUs sample at one instant most of the time, so that their aliases are the same."""
    dt, apart = flights[0][0].dt, list[FloatArray]()
    for number in dict.fromkeys(each.flight for each in clocks):
        own = [each for each in clocks if each.flight == number]
        time = np.linspace(0.0, flights[number - 1][0].time[-1], tuning.INSTANTS)
        late = np.stack([0.0 * time, *(each.own(time) - time for each in own)])
        away = (late[:, None] - late[None, :]) / dt
        apart.append(np.abs(away - np.rint(away)))
    if not apart:
        return []
    share = np.mean(np.concatenate(apart, axis=2) < tuning.TOGETHER, axis=2)
    pairs = [(labels[i], labels[j]) for i, j in np.argwhere(np.triu(share > 0.5, 1))]
    which = ", ".join(" and ".join(pair) for pair in pairs)
    return [notice("motion-together", pairs=which)] if pairs else []


def _notices(curves: Sequence[MotionCurve], imus: int) -> list[Notice]:
    """What cannot be seen, and where the pairs of others contradict each other."""
    if imus == 2:
        return [notice("motion-two-imus")]
    found = [notice("motion-common", values={"imus": imus})]
    found += [notice("motion-neighbours")] * (imus == 3)
    unseen = [each for each in curves if np.any(each.variance <= 0.0)]
    if unseen:
        times = [each.tau[each.variance <= 0.0].min() for each in unseen]
        values = {"curves": len(unseen), "all": len(curves), "tau": float(min(times))}
        found.append(notice("motion-unseen", values=values))
    apart = [each for each in curves if np.any(each.agree < tuning.CONTRADICT)]
    if apart:
        longest = max(each.tau[each.agree < tuning.CONTRADICT].max() for each in apart)
        values = {"curves": len(apart), "all": len(curves), "tau": float(longest)}
        found.append(notice("motion-pairs-differ", values=values))
    return found
