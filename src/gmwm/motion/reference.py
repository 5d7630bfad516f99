"""Attitude from motion capture or a better INS, in place of other IMUs."""

from __future__ import annotations

import os
import re
from dataclasses import replace

import numpy as np
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation, Slerp

from gmwm._core.text import brief, per_cent
from gmwm._core.typing import BoolArray, FloatArray
from gmwm.errors import InputError
from gmwm.motion import tuning
from gmwm.motion.curves import Curves
from gmwm.readers import Wanted, bare, load_columns, meaning, open_tables

_PART = re.compile(r"(?:^|[^a-z])(?:q|quat|quaternion|orientation|rotation)(?:[^a-z].*?)?([wxyz])$")
_TUM = 8  # columns without names: time, position, qx, qy, qz, qw


def read_attitude(path: str | os.PathLike[str]) -> tuple[FloatArray, FloatArray]:
    """Times (s) and quaternions (n, 4), x y z w, of a text file, such as those of EuRoC and TUM.

    Raises InputError if there are no columns of time and of a quaternion.
    """
    (table,) = open_tables(path, Wanted())
    names = [bare(name).lower() for name in table.names]
    places = {part[1]: i for i, name in enumerate(names) if (part := _PART.search(name))}
    time = next((i for i, n in enumerate(table.names) if meaning(n).role == "time"), None)
    if not any(names) and len(names) == _TUM:
        time, places = 0, dict(zip("xyzw", range(4, 8), strict=True))
    if time is None or len(places) < 4:
        raise InputError(f"{table.source} has no attitude: name columns time, qw, qx, qy, qz")
    wanted = [time, *(places[part] for part in "xyzw")]
    columns = load_columns(table, wanted)
    rows = np.stack([columns[i] for i in wanted], axis=1)
    rows = rows[np.all(np.isfinite(rows), axis=1)]
    seconds = (rows[:, 0] - rows[0, 0]) * (meaning(table.names[time]).seconds or 1.0)
    return seconds, rows[:, 1:]


def rates_of(time: FloatArray, quaternions: FloatArray) -> tuple[float, FloatArray, BoolArray]:
    """Sampling interval (s), rates (n, 3) in the body's axes, and whether a sample is filled.

    quaternions: Of rotations from the body to a fixed frame.
    """
    good = quaternions.shape == (len(time), 4) and np.all(np.isfinite(time))
    if not good or not np.all(abs(np.linalg.norm(quaternions, axis=1) - 1.0) < tuning.UNIT_LENGTH):
        raise InputError("the reference: quaternions do not have a length of 1: check the columns")
    time, first = np.unique(time - time.min(), return_index=True)
    steps = np.diff(time)
    if steps.size < 20:
        raise InputError("the reference has fewer than 20 attitudes: record longer")
    dt = float(np.median(steps))
    # The mean step where stamps are even but for rounding and gaps.
    dt = float(np.mean(steps[np.abs(steps - dt) < 0.5 * dt]))
    grid = np.arange(int(time[-1] / dt)) * dt
    turned = Slerp(time, Rotation.from_quat(quaternions[first]))(grid)
    gap = steps[np.clip(np.searchsorted(time, grid, "right") - 1, 0, steps.size - 1)] > 1.5 * dt
    if gap.mean() > tuning.MOST_FILLED:
        raise InputError(
            f"the reference has gaps, {gap.sum() * dt:.3g} s in all: give a part without"
        )
    return dt, (turned[:-1].inv() * turned[1:]).as_rotvec() / dt, gap[1:]


def over_samples(rates: FloatArray, times: int, dt: float) -> FloatArray:
    """(n, 3) Rotations over so many samples by their time: all that a slow reference has too."""
    steps, count = Rotation.from_rotvec(rates * dt), len(rates) - times + 1
    turned, found = steps[:count], rates.copy()
    for k in range(1, times):
        turned = turned * steps[k : k + count]
    found[(times - 1) // 2 :][:count] = turned.as_rotvec() / (times * dt)
    return found


def without_reference(curves: Curves, dt: float, where: str) -> tuple[Curves, float]:
    """The curves of an IMU from those of its difference to a reference, and its angle noise, rad.

    The noise of the reference's angle adds 3 Q^2/tau^2 to the Allan variance. It is estimated
    together with white noise and a walk (least squares weighted by the intervals), and subtracted.
    Bounded angles of the IMU itself are of the same form, and go with it. Where half of a variance
    is of that form, and where tau is below two intervals of the reference, it is not known.

    dt: Of the reference, s.
    Raises InputError if that is so at all times, with the Fisher information that is left.
    """
    tau, total = curves.tau, curves.variance
    used = tau >= 2.0 * dt * (1.0 - 1e-9)
    lower, upper, variance = np.zeros_like(total), curves.upper.copy(), np.full_like(total, np.nan)
    pairs, angles = variance.copy(), []
    for axis in range(3):
        error = np.maximum(curves.upper - curves.lower, 1e-3 * total)[axis, used] / 4.0
        terms = np.column_stack([3.0 / tau**2, 1.0 / tau, tau / 3.0])[used] / error[:, None]
        size = np.linalg.norm(terms, axis=0)
        found = nnls(terms / size, total[axis, used] / error)[0] / size
        spread = np.sqrt(np.linalg.pinv((terms / size).T @ (terms / size))[0, 0]) / size[0]
        own = 3.0 * found[0] / tau**2
        seen = used & (own < 0.5 * total[axis])
        left, unsure = total[axis] - own, 2.0 * 3.0 * spread / tau**2
        variance[axis, seen], pairs[axis, used] = left[seen], left[used]
        for end, sign, given in ((lower, -1.0, curves.lower), (upper, 1.0, curves.upper)):
            reach = np.hypot(given[axis] - total[axis], unsure)
            end[axis, seen] = np.maximum(left + sign * reach, 0.0)[seen]
        angles.append(float(np.sqrt(found[0])))
    if np.max(np.sum(np.isfinite(variance), axis=1)) < tuning.FEWEST_OCTAVES:
        known = np.max(np.maximum(pairs / total, 0.0) ** 2, axis=0)
        by_octave = ", ".join(
            f"{per_cent(share, 1)} at {brief(t)} s"
            for share, t in zip(known[used], tau[used], strict=True)
        )
        raise InputError(
            f"{where}: the noise of the reference's angle, {1e3 * max(angles):.2g} mrad, dominates "
            f"up to {tau[-1]:.2g} s: record longer, or use a better reference (Fisher information "
            f"relative to a perfect reference: {by_octave})"
        )
    ends = {"lower": lower, "upper": upper}
    return replace(curves, variance=variance, pairs=pairs[None], **ends), max(angles)
