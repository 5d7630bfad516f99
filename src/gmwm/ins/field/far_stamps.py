"""Stamps of fixes that are off by many seconds, as those of GPS time for UTC are."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.field.measured import Measured
from gmwm.ins.field.replay import Replay, alignment_of
from gmwm.ins.imu import Imu


@dataclass(frozen=True, eq=False)
class FarStamps:
    """An offset of the stamps, near enough that the rest shows in the innovations.

    offset: By how much the fixes are stamped too late, s.
    replay: The log without it, aligned anew.
    start: Where its filter starts, s since the first epoch of the IMU.
    """

    offset: float
    replay: Replay
    start: float

    @classmethod
    def of(cls, measured: Measured) -> FarStamps | None:
        """Look for the smallest innovations; ``None`` if no offset makes them as small as expected.

        Level, heading and velocity at the start are as wrong as the stamps, so that nothing near
        the filter of the stamps as they are tells the way: the filter is aligned and run with
        offsets all over, then nearer and nearer to the best.
        """
        measured = _begun(measured)
        step = tuning.FAR_STEP
        steps = round(tuning.FARTHEST_OFFSET / step)
        sizes = {each * step: _size(measured, each * step) for each in range(-steps, steps + 1)}
        best = min(sizes, key=sizes.__getitem__)
        while step > tuning.FAR_NEAR:
            step *= 0.5
            sizes |= {each: _size(measured, each) for each in (best - step, best + step)}
            best = min(sizes, key=sizes.__getitem__)
        if not sizes[best] < min(tuning.FAR_BETTER * sizes[0.0], tuning.LOST):
            return None  # as lost as before, or nearly
        earlier = _earlier(measured, best)
        alignment = alignment_of(earlier)
        return cls(best, Replay.of(earlier, alignment), alignment.epoch * measured.imu.dt)


def _size(measured: Measured, offset: float) -> float:
    """Square of the innovations, by a mean to which a few outliers add little; infinite if the
    filter cannot start, or diverges.
    """
    earlier = _earlier(measured, offset)
    try:
        replay = Replay.of(earlier, alignment_of(earlier))
    except InputError:
        return np.inf
    replay = replay.within(0.0, tuning.DIAGNOSED)  # no fix is rejected
    fixes = sum(each.time.size for each in measured.aiding.fixes)
    if replay.standard.shape[0] < tuning.FAR_LEFT * fixes:
        return np.inf  # a part that shows less is explained by anything
    if not np.isfinite(replay.log_likelihood):
        return np.inf
    return float(np.expm1(np.nanmean(np.log1p(replay.standard**2))))


def _begun(measured: Measured) -> Measured:
    """The part in which faults are looked for; what follows would be read for each offset."""
    imu = measured.imu
    n = min(imu.n, round(tuning.DIAGNOSED / imu.dt))
    part = Imu(imu.dt, imu.rotation[:n], imu.velocity[:n])
    return _earlier(replace(measured, imu=part), 0.0)


def _earlier(measured: Measured, offset: float) -> Measured:
    """Fixes with earlier stamps, those in the time of the IMU."""
    imu, fixes = measured.imu, []
    for each in measured.aiding.fixes:
        time = each.time - offset
        inside = (time > 0.0) & (time < imu.n * imu.dt)
        fixes.append(replace(each.part(inside), time=time[inside]))
    return replace(measured, aiding=replace(measured.aiding, fixes=tuple(fixes)))
