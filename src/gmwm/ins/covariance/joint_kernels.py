"""The true covariance of a filter whose model is not the truth, in compiled code.

The joint vector holds the errors of n integrals (of navigation: nine), the filter's estimates of
its sensor states and the true sensor states. It obeys linear equations: the estimates enter the
integrals with the sign turned round, and the gains come from the filter's own covariance. After
Maybeck (1979), *Stochastic Models, Estimation, and Control* 1, sec. 6.8.

`aid_jointly` is for a system that does not change with time, `run_jointly` for one along a
trajectory. P is the filter's covariance, (n + q, n + q); J has the joint second moments.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.ins.filter import (
    IS_HEIGHT,
    IS_POSITION,
    IS_VELOCITY,
    IntArray,
    excess,
    measurement_row,
    measurement_update,
    noise_state,
    propagate,
    tilt_squared,
    transition,
)
from gmwm.ins.filter.filter_arrays import Sensors
from gmwm.ins.geometry import gravity


class LinearStep(NamedTuple):
    """Transition and noise of a step: A, Q of the filter, B, R of the joint vector."""

    A: FloatArray
    Q: FloatArray
    B: FloatArray
    R: FloatArray


class Track(NamedTuple):
    """A trajectory cut into S steps.

    epoch, samples: (S + 1,), epoch at the end of each step, and samples of the step that leads
        there (none to the first).
    dt: Sampling interval, s.
    mid_matrix, mid_v, mid_lla: Attitude, velocity and position in the middle of each step.
    end_matrix, end_v, end_rate: Attitude, velocity and angular rate (body axes, rad/s) at its end.
    """

    epoch: IntArray
    samples: IntArray
    dt: float
    mid_matrix: FloatArray
    mid_v: FloatArray
    mid_lla: FloatArray
    end_matrix: FloatArray
    end_v: FloatArray
    end_rate: FloatArray


class Aids(NamedTuple):
    """Measurements in order of time, and how the filter takes them.

    epoch, kind, sd: (E,), (E,), (E, 3).
    coloured, true_coloured: (4,), places in the joint vector of the estimated and the true coloured
        noise of the north, east and down position and of the height; -1 for none.
    lever: (3,), m.
    second_order: Whether products of errors are allowed for.
    """

    epoch: IntArray
    kind: IntArray
    sd: FloatArray
    coloured: IntArray
    true_coloured: IntArray
    lever: FloatArray
    second_order: bool


class KeptCovariances(NamedTuple):
    """Epochs that are kept; P and J there are overwritten.

    before: (K,), 1 for those before the measurements of the epoch, which come first, 0 after them.
    """

    epoch: IntArray
    before: IntArray
    P: FloatArray
    J: FloatArray


@compiled()
def update_jointly(
    J: FloatArray, h: FloatArray, estimate: int, truth: int, variance: float, gain: FloatArray,
) -> None:  # fmt: skip
    """Update the joint second moments by a scalar measurement with a given gain, in place.

    h: (n,), row of the integrals.
    estimate, truth: Places of the estimated and the true coloured noise of the measurement; -1 for
        none.
    variance: Of the measurement's white noise.
    gain: (n + q,), the filter's.
    """
    size, n = J.shape[0], h.size
    a, k = np.zeros(size), np.zeros(size)
    for i in range(n):
        if h[i] != 0.0:
            for j in range(size):
                a[j] += h[i] * J[i, j]
    if estimate >= 0:
        for j in range(size):
            a[j] += J[estimate, j] - J[truth, j]
    # Feedback: the integrals are corrected, and the estimates take what their errors lose.
    for i in range(gain.size):
        k[i] = gain[i] if i < n else -gain[i]
    s = variance
    for i in range(n):
        s += h[i] * a[i]
    if estimate >= 0:
        s += a[estimate] - a[truth]
    for i in range(size):
        for j in range(i, size):
            J[i, j] += s * k[i] * k[j] - k[i] * a[j] - a[i] * k[j]
            J[j, i] = J[i, j]


@compiled()
def _propagated(P: FloatArray, A: FloatArray, Q: FloatArray) -> FloatArray:
    """A P A' + Q, symmetric: nothing damps what rounding leaves of an asymmetry.

    Loops, for a product of matrices takes numba seconds to compile.
    """
    size = P.shape[0]
    left, result = np.zeros((size, size)), Q.copy()
    for i in range(size):
        for k in range(size):
            if A[i, k] != 0.0:
                for j in range(size):
                    left[i, j] += A[i, k] * P[k, j]
    for i in range(size):
        for j in range(i + 1):
            for k in range(size):
                result[i, j] += left[i, k] * A[j, k]
            result[j, i] = result[i, j]
    return result


@compiled()
def aid_jointly(
    P: FloatArray, J: FloatArray, step: LinearStep, n: int, variance: float, is_relative: bool,
    fixes: int, out_P: FloatArray, out_J: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Propagate over equal steps, each of which ends with a fix of the last integral.

    variance: Of a fix.
    is_relative: Whether the last integral starts anew at each fix.
    out_P, out_J: (K, n, n), covariances of the integrals after the first K fixes, overwritten.
    Returns: P and J after the last fix.
    """
    last = n - 1
    h, gain = np.zeros(n), np.zeros(P.shape[0])
    h[last] = 1.0
    for fix in range(fixes):
        P = _propagated(P, step.A, step.Q)
        J = _propagated(J, step.B, step.R)
        total = P[last, last] + variance
        for i in range(gain.size):
            gain[i] = P[i, last] / total
        for i in range(gain.size):
            for j in range(i, gain.size):
                P[i, j] -= gain[i] * gain[j] * total
                P[j, i] = P[i, j]
        update_jointly(J, h, -1, -1, variance, gain)
        if is_relative:
            P[last] = P[:, last] = 0.0
            J[last] = J[:, last] = 0.0
        if fix < out_P.shape[0]:
            out_P[fix], out_J[fix] = P[:n, :n], J[:n, :n]
    return P, J


@compiled()
def run_jointly(
    track: Track, P: FloatArray, table: Sensors, J: FloatArray, joint: Sensors, aids: Aids,
    kept: KeptCovariances,
) -> None:  # fmt: skip
    """Propagate a navigation filter's covariance and the joint second moments along a trajectory.

    table, joint: Sensor states of the filter, and of the joint vector.
    """
    n, size = P.shape[0], J.shape[0]
    F, A, B = np.zeros((9, 9)), np.zeros((9, 9)), np.zeros((9, 6))
    S, T, U, row = np.zeros((6, n)), np.zeros((9, n)), np.zeros((9, 6)), np.zeros(n)
    j_S, j_T, j_row = np.zeros((6, size)), np.zeros((9, size)), np.zeros(size)
    h, gain, x = np.zeros(9), np.zeros(n), np.zeros(n)
    event = out = 0
    gathered = j_gathered = 0.0
    for s in range(track.epoch.size):
        epoch, c = track.epoch[s], track.samples[s]
        if c > 0:
            step, lla = c * track.dt, track.mid_lla[s]
            transition(track.mid_v[s], lla, track.mid_matrix[s], step, F, A, B)
            t, j = table, joint
            propagate(P, A, B, t.axis, t.partner, t.phi[c], t.phi_off[c], t.gain[c], t.noise[c],
                  t.noise_off[c], t.cross[c], t.integral[c], S, T, U, row)  # fmt: skip
            propagate(J, A, B, j.axis, j.partner, j.phi[c], j.phi_off[c], j.gain[c], j.noise[c],
                  j.noise_off[c], j.cross[c], j.integral[c], j_S, j_T, U, j_row)  # fmt: skip
            if aids.second_order:
                g = gravity(lla[0], lla[2])
                gathered = tilt_squared(P, g, step, gathered)
                j_gathered = tilt_squared(J, g, step, j_gathered)
        while out < kept.epoch.size and kept.epoch[out] == epoch and kept.before[out] == 1:
            kept.P[out], kept.J[out] = P, J
            out += 1
        attitude = P[6, 6] + P[7, 7] + P[8, 8] if aids.second_order else 0.0
        j_attitude = J[6, 6] + J[7, 7] + J[8, 8] if aids.second_order else 0.0
        while event < aids.epoch.size and aids.epoch[event] == epoch:
            kind = aids.kind[event]
            for component in range(1 if kind == IS_HEIGHT else 3):
                sd = aids.sd[event, component]
                if not sd > 0.0:
                    continue
                measurement_row(kind, component, track.end_matrix[s], track.end_v[s],
                                track.end_rate[s], aids.lever, h)  # fmt: skip
                estimate = noise_state(kind, component, aids.coloured)
                truth = noise_state(kind, component, aids.true_coloured)
                expected = sd * sd + excess(P, h, attitude)
                measurement_update(P, h, estimate, expected, 0.0, x, gain)
                update_jointly(J, h, estimate, truth, sd * sd + excess(J, h, j_attitude), gain)
            if kind in (IS_POSITION, IS_VELOCITY):
                gathered = j_gathered = 0.0
            event += 1
        while out < kept.epoch.size and kept.epoch[out] == epoch:
            kept.P[out], kept.J[out] = P, J
            out += 1
