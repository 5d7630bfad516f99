"""IMU logs: any recording of angular rates and specific forces, as increments on its clock."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gmwm._core.distributions import binom
from gmwm._core.spool import alike, release, windows
from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT
from gmwm.calibration import BiasCurve, compensated
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.geometry import STANDARD_GRAVITY
from gmwm.ins.increments import Imu
from gmwm.ins.sensors import AXES, require_axes
from gmwm.issues import Notice, Severity, notice
from gmwm.readers import Recording, read


@dataclass(frozen=True, eq=False)
class ImuLog:
    """An IMU record; ``start`` is the time of its first epoch, s, 0 without time stamps.

    noise: Axis -> size of its fast noise over that of its calibration, where curves show it.
    """

    imu: Imu
    start: float
    source: str
    notices: tuple[Notice, ...] = ()
    noise: Mapping[str, float] = field(default_factory=dict)


def read_imu(
    path: str | os.PathLike[str],
    rate: float | None = None,
    units: Mapping[str, str] | None = None,
    channels: Mapping[str, str | int] | None = None,
    time: str | int | bool | None = None,
    start: float | None = None,
    **reading: Any,
) -> Imu:
    """Read an IMU record as increments.

    A sample is the mean over the sampling interval that ends at its time stamp, so that the first
    epoch is one interval before the first stamp.

    Raises InputError if the file cannot be used, an axis or more than
    `gmwm.ins.tuning.LONGEST_FILLED` of samples is missing, or the specific force is far from
    gravity: most often a wrong unit.

    Parameters
    ----------
    path : str or path
        Any file that `gmwm.read` reads: angular rates and specific forces about and along the
        body's forward, right and down axes (at rest ``accel_z`` is -9.8 m/s^2).
    rate, units, channels, time : optional
        See `gmwm.read`. A minus sign before the name or number of a column of ``channels``, as in
        ``{"accel_z": "-az"}``, reverses its sign.
    start : float, optional
        Time of the first sample, s, of a record without time stamps.
    **reading
        ``format``, ``layout`` and ``damaged``; see `gmwm.read`.
    """
    return read_imu_log(path, channels, time, start, rate=rate, units=units, **reading).imu


def read_imu_log(
    path: str | os.PathLike[str],
    channels: Mapping[str, str | int] | None = None,
    time: str | int | bool | None = None,
    start: float | None = None,
    *,
    curves: Mapping[str, BiasCurve] | None = None,
    **reading: Any,
) -> ImuLog:
    """Read an IMU record with its clock, less curves of the biases; see `read_imu`."""
    columns, reversed_axes = dict(channels or {}), set[str]()
    for name, column in columns.items():
        if isinstance(column, str) and column.startswith("-") and len(column) > 1:
            reversed_axes.add(name)
            plain = column[1:]
            columns[name] = int(plain) if plain.isascii() and plain.isdigit() else plain
    named = None if channels is None else columns
    recording = read(path, channels=named, time=time, **reading).of_one_rate("navigation")
    require_axes(recording)
    recording, noise = _without_curves(recording, curves or {})
    dt, source = recording.dt, recording.source
    rotation = _joined(recording, AXES[:3], reversed_axes)
    velocity = _joined(recording, AXES[3:], reversed_axes)
    notices = list[Notice]()
    if recording.jitter is None:  # no time stamps
        first = dt if start is None else start
        notices += [notice("no-time-stamps")] * (start is None)
    elif start is not None:
        raise InputError(f"{source} has time stamps: leave out its start")
    else:
        first = recording.start
    notices += _fill(source, dt, rotation, velocity)
    mean = np.sum([np.sum(velocity[part], axis=0) for part in windows(len(velocity))], axis=0)
    mean /= len(velocity)
    force = float(np.linalg.norm(mean))
    least, most = tuning.SPECIFIC_FORCE
    if not least * STANDARD_GRAVITY < force < most * STANDARD_GRAVITY:
        raise InputError(
            f"{source}: the mean specific force is {force:.4g} m/s^2, far from gravity: check the "
            "unit of the accelerometers, and that gravity is not subtracted"
        )
    for axis, name in enumerate(AXES):
        samples = (rotation if axis < 3 else velocity)[:, axis % 3]
        notices += _wrong_samples(name, samples, dt, first)
    if mean[2] > 0.0:
        notices.append(notice("axis-up", "accel_z"))
    for each in (rotation, velocity):
        for part in windows(len(each)):
            each[part] *= dt
            release(each)
    imu = Imu(dt, rotation, velocity)
    return ImuLog(imu, first - dt, source, (*recording.notices, *notices), noise)


def _without_curves(
    recording: Recording, curves: Mapping[str, BiasCurve]
) -> tuple[Recording, dict[str, float]]:
    """See `compensated`; a notice says that the record lacks a covariate."""
    try:
        return compensated(recording, curves)
    except InputError as error:
        if error.code != "no-covariate":
            raise
        missing = notice("curve-not-subtracted", why=str(error))
        return replace(recording, notices=(*recording.notices, missing)), {}


def _joined(recording: Recording, axes: tuple[str, ...], reversed_axes: set[str]) -> FloatArray:
    """Samples of three axes, (n, 3); on disk if the recording is."""
    series = [recording[axis].values for axis in axes]
    sign = np.array([-1.0 if axis in reversed_axes else 1.0 for axis in axes])
    found = alike(series[0], 3 * series[0].size).reshape(-1, 3)
    for part in windows(len(found)):
        found[part] = np.column_stack([each[part] for each in series]) * sign
        for each in (*series, found):
            release(each)
    return found


def _fill(source: str, dt: float, *triads: FloatArray) -> list[Notice]:
    """Fill short gaps along straight lines, in place; rejects long ones and ones at an end."""
    most = max(round(tuning.LONGEST_FILLED / dt), 1)
    longest, filled = 0, set[int]()
    for name, samples in zip(AXES, (each[:, i] for each in triads for i in range(3)), strict=True):
        n = samples.size
        missing = np.concatenate(
            [p.start + np.flatnonzero(np.isnan(samples[p])) for p in windows(n)]
        )
        gaps = np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1)
        for gap in (gap for gap in gaps if gap.size):
            begin, end = int(gap[0]), int(gap[-1]) + 1
            if end - begin > most or begin == 0 or end == n:
                raise InputError(
                    f"{source}: {name} has a gap of length {end - begin:,} from sample "
                    f"{begin + 1:,} on, {begin * dt:.6g} s after the first: gaps of up to {most} "
                    "are filled; use the part before or after, or remove the jump from the time "
                    "stamps if a clock was set there"
                )
            longest = max(longest, end - begin)
            samples[begin:end] = np.interp(gap, [begin - 1, end], samples[[begin - 1, end]])
        filled.update(missing.tolist())
    if not filled:
        return []
    return [notice("samples-filled", values={"count": len(filled), "longest": longest})]


def _wrong_samples(name: str, samples: FloatArray, dt: float, first: float) -> Iterator[Notice]:
    """Samples that are cut off at the end of the range, or else held for long."""
    if cut := _cut_off(samples):
        share = sum(cut.values()) / len(samples)
        values = {"samples": sum(cut.values()), "share": share}
        ends = f"{' and '.join(f'{end:.5g}' for end in cut)} {SI_UNIT[name.partition('_')[0]]}"
        severity: Severity = "bad" if share > tuning.MOST_CUT_OFF else "warning"
        hint = "record with a wider range, or use a part of the log without them"
        yield notice("saturation", name, values, severity=severity, hint=hint, ends=ends)
        return
    at, count = longest_run(samples)
    if count > 1 and count * dt > tuning.LONGEST_HELD:
        values = {"start": first + at * dt, "length": count * dt}
        hint = "leave out that part of the log, or check the column"
        yield notice("stuck", name, values, variant="log", hint=hint)


def longest_run(samples: FloatArray) -> tuple[int, int]:
    """First sample, and number, of the most equal values in a row."""
    first, most, begin, last = 0, 0, 0, np.nan
    for part in windows(samples.size):
        own = samples[part]
        changes = part.start + np.flatnonzero(np.diff(own, prepend=last) != 0.0)
        starts = np.concatenate([[begin], changes])
        lengths = np.diff(np.append(starts, part.stop))
        longest = int(np.argmax(lengths))
        if lengths[longest] > most:
            first, most = int(starts[longest]), int(lengths[longest])
        begin, last = int(starts[-1]), own[-1]
        release(samples)
    return first, most


def _cut_off(samples: FloatArray) -> dict[float, int]:
    """Ends of the range at which samples stay more than others (binomial test) -> how many."""
    parts = list(windows(samples.size))
    ends = [min(np.min(samples[p]) for p in parts), max(np.max(samples[p]) for p in parts)]
    at, again, equal = np.zeros(2, dtype=int), np.zeros(2, dtype=int), 0
    for part in parts:
        own = samples[part]
        same = own[1:] == own[:-1]
        equal += int(np.count_nonzero(same))
        at += [np.count_nonzero(own == end) for end in ends]
        again += [np.count_nonzero(same & (own[1:] == end)) for end in ends]
        release(samples)
    usual = tuning.EQUAL * (equal - again.sum() + 1) / max(samples.size - at.sum(), 1)
    chance = binom.sf(again - 1, at, min(usual, 1.0))
    is_cut = (chance < tuning.GATE) & (at >= tuning.FEWEST_CUT_OFF)
    # A dead band is no end.
    return {float(ends[i]): int(at[i]) for i in np.flatnonzero(is_cut) if ends[i] != 0.0}
