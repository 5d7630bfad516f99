"""The loop of the navigation filter: mechanization, covariance, measurements, closed loop."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.ins import tuning
from gmwm.ins.filter.covariance_kernels import (
    excess,
    measurement_update,
    propagate,
    tilt_squared,
    transition,
)
from gmwm.ins.filter.measurement_kernels import (
    IS_HEIGHT,
    IS_POSITION,
    IS_STANDSTILL,
    IS_VELOCITY,
    measurement_row,
    noise_state,
    residual,
)
from gmwm.ins.filter.mechanization import step
from gmwm.ins.filter.states import IntArray
from gmwm.ins.geometry import gravity, orthonormalise, radii_at, turn_navigation

PAUSED = -2
"""What `run` returns where it is to be called again."""

_LARGEST_POSITION_VARIANCE = 1e14  # m^2: beyond the Earth
_PATIENCE = tuning.GATE_PATIENCE
_CLEAN_EVERY = 1000  # steps of the covariance: the attitude matrix is brought back to a rotation


@compiled()
def correct(C: FloatArray, v: FloatArray, lla: FloatArray, x: FloatArray) -> None:
    """Take estimated errors x off the navigation solution, and set them to zero, in place."""
    meridian, transverse = radii_at(math.sin(lla[0]))
    lla[0] -= x[0] / (meridian + lla[2])
    lla[1] -= x[1] / ((transverse + lla[2]) * math.cos(lla[0]))
    lla[2] += x[2]
    # The velocity less u is the true one, turned by the attitude error as the attitude is; to the
    # second order, for a fast vehicle with a poorly known heading.
    a, b, c = v[0] - x[3], v[1] - x[4], v[2] - x[5]
    p, q, r = x[7] * c - x[8] * b, x[8] * a - x[6] * c, x[6] * b - x[7] * a
    v[0] = a + p + 0.5 * (x[7] * r - x[8] * q)
    v[1] = b + q + 0.5 * (x[8] * p - x[6] * r)
    v[2] = c + r + 0.5 * (x[6] * q - x[7] * p)
    turn_navigation(C, -x[6], -x[7], -x[8])
    orthonormalise(C)
    for i in range(9):
        x[i] = 0.0


@compiled()
def propagated(
    C: FloatArray, v: FloatArray, lla: FloatArray, rate: FloatArray, force: FloatArray,
    offset: float, C_at: FloatArray, v_at: FloatArray, lla_at: FloatArray, F: FloatArray,
    A: FloatArray, B: FloatArray,
) -> None:  # fmt: skip
    """Fill the solution some time from an epoch, and the transition of its errors to there.

    Noise and sensor errors that gather over a part of a sampling interval are left out: they are
    far below the noise of any fix.

    C, v, lla: Attitude, velocity and position at the epoch.
    rate, force: (3,), angular rate and specific force about it, rad/s and m/s^2.
    offset: s; negative for back in time.
    C_at, v_at, lla_at: Overwritten by the solution there.
    F, A, B: As in `transition`; A is overwritten by the transition.
    """
    for i in range(3):
        v_at[i], lla_at[i] = v[i], lla[i]
        for j in range(3):
            C_at[i, j] = C[i, j]
    ax, ay, az = rate[0] * offset, rate[1] * offset, rate[2] * offset
    fx, fy, fz = force[0] * offset, force[1] * offset, force[2] * offset
    step(C_at, v_at, lla_at, ax, ay, az, fx, fy, fz, ax, ay, az, fx, fy, fz, offset)
    transition(v, lla, C, offset, F, A, B)


@compiled()
def sample_error(
    first: IntArray, output: FloatArray, phi: FloatArray, phi_off: FloatArray, partner: IntArray,
    paired: bool, x: FloatArray, held: FloatArray, error: FloatArray,
) -> None:  # fmt: skip
    """Sensor errors (6,) that the states x (m,) predict for a sample; then propagate the states.

    Gauss-Markov estimates decay between measurements; without it, they would be believed for ever.
    """
    for a in range(6):
        total = 0.0
        for i in range(first[a], first[a + 1]):
            total += output[i] * x[i]
        error[a] = total
    if not paired:
        for i in range(x.size):
            x[i] *= phi[i]
        return
    for i in range(x.size):
        held[i] = x[i]
    for i in range(x.size):
        x[i] = phi[i] * held[i]
        if partner[i] != i:
            x[i] += phi_off[i] * held[partner[i]]


@compiled()
def axis_sums(
    P: FloatArray, first: IntArray, output: FloatArray, mean: FloatArray, x: FloatArray,
    covariance: FloatArray,
) -> None:  # fmt: skip
    """Estimated error of each sensor (6,) and its covariance (6, 6) from those of its states."""
    for a in range(6):
        mean[a] = 0.0
        for i in range(first[a], first[a + 1]):
            mean[a] += output[i] * x[i]
        for b in range(6):
            total = 0.0
            for i in range(first[a], first[a + 1]):
                for j in range(first[b], first[b + 1]):
                    total += output[i] * output[j] * P[9 + i, 9 + j]
            covariance[a, b] = total


@compiled()
def run(
    rotation: FloatArray, increment: FloatArray, dt: float, stride: int,
    C: FloatArray, v: FloatArray, lla: FloatArray, P: FloatArray, x: FloatArray,
    first: IntArray, axis: IntArray, output: FloatArray, partner: IntArray,
    phi: FloatArray, phi_off: FloatArray, gain: FloatArray, noise: FloatArray,
    noise_off: FloatArray, cross: FloatArray, integral: FloatArray, coloured: IntArray,
    event_epoch: IntArray, event_kind: IntArray, event_offset: FloatArray,
    event_value: FloatArray, event_sd: FloatArray, event_gate: FloatArray, lever: FloatArray,
    second_order: bool, out_epoch: IntArray, out_before: IntArray,
    out_nav: FloatArray, out_C: FloatArray, out_P: FloatArray, out_sensor: FloatArray,
    out_sensor_P: FloatArray, innovation: FloatArray, innovation_sd: FloatArray,
    used: npt.NDArray[np.bool_], last: int, place: IntArray, carry: FloatArray,
) -> int:  # fmt: skip
    """Filter a record; returns the epoch at which it diverged, -1 at its end, or `PAUSED`.

    rotation, increment: (N, 3), IMU increments, rad and m/s.
    dt: s.
    stride: Samples per step of the covariance.
    C, v, lla, P, x: Attitude, velocity, position, covariance (9 + m, 9 + m) and sensor states (m,)
        at the first epoch; those at the last one after the call.
    first: (7,) of int, range of the states of each sensor.
    axis, ..., integral: As in `gmwm.ins.filter.states.SensorStates`.
    coloured: (4,) of int, state of the coloured noise of the north, east and down position and of
        the barometric height; -1 for none.
    event_epoch, event_kind: (E,) of int, measurements in order of time.
    event_offset: (E,), times of the measurements less those of their epochs, s.
    event_value, event_sd: (E, 3).
    event_gate: (E,), normalised innovation squared beyond which a measurement is rejected.
    lever: (3,).
    second_order: Whether products of errors are allowed for; see
        `gmwm.ins.filter.covariance_kernels.tilt_squared` and ``excess``.
    out_epoch: (K,) of int, epochs to be kept, in order of time.
    out_before: (K,) of int, 1 for the state before the measurements of the epoch, 0 for that after
        them; at one epoch those before come first.
    out_nav: out_sensor_P : (K, 6, 6), innovation, innovation_sd : (E, 3) ndarray Results; position
        and velocity, attitude, covariance, sums of sensor states and their covariance; innovations
        of the components, each given those before it, with their standard deviation.
    used: (E,) of bool, set to False where a measurement was rejected.
    last: Epoch from which on the filter pauses, to go on with the next call.
    place: (4 + kinds,) of int, carry : (7,) ndarray, where it is and what it needs of the samples
        before: zeros at first.
    """
    n, m = P.shape[0], x.size
    n_samples, n_events, n_out = rotation.shape[0], event_epoch.size, out_epoch.size
    paired = False
    for i in range(m):
        paired = paired or partner[i] != i
    F, A, B = np.zeros((9, 9)), np.zeros((9, 9)), np.zeros((9, 6))
    S, T, U = np.zeros((6, n)), np.zeros((9, n)), np.zeros((9, 6))
    row, K, h, error = np.zeros(n), np.zeros(n), np.zeros(9), np.zeros(6)
    estimated, held = np.zeros(n), np.zeros(m)
    P_held, estimated_held = np.zeros((n, n)), np.zeros(n)
    rejected = place[4:]
    C_mid, v_mid, lla_mid = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    C_at, v_at, lla_at = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    rate, rate_at, force_at, h_at = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(9)
    ax, ay, az, fx, fy, fz = carry[0], carry[1], carry[2], carry[3], carry[4], carry[5]
    gathered = carry[6]
    epoch, event, out, steps = place[0], place[1], place[2], place[3]
    while True:
        # What is asked for at this epoch: results before, measurements, results after.
        while out < n_out and out_epoch[out] == epoch and out_before[out] == 1:
            _keep(out, C, v, lla, P, x, first, output, out_nav, out_C, out_P, out_sensor,
                  out_sensor_P)  # fmt: skip
            out += 1
        measured = of_gnss = False
        attitude = P[6, 6] + P[7, 7] + P[8, 8] if second_order else 0.0
        if event < n_events and event_epoch[event] == epoch:
            measured = True
            if epoch > 0:
                rate[0], rate[1], rate[2] = ax / dt, ay / dt, az / dt
            elif n_samples > 0:
                for i in range(3):
                    rate[i] = rotation[0, i] / dt
        while event < n_events and event_epoch[event] == epoch:
            kind = event_kind[event]
            offset = event_offset[event]
            moved = offset != 0.0 and n_samples > 0
            if moved:
                i = min(max(epoch if offset > 0.0 else epoch - 1, 0), n_samples - 1)
                for a in range(3):
                    rate_at[a], force_at[a] = rotation[i, a] / dt, increment[i, a] / dt
                for k in range(m):
                    if 0 <= axis[k] < 3:
                        rate_at[axis[k]] -= output[k] * x[k]
                    elif axis[k] >= 3:
                        force_at[axis[k] - 3] -= output[k] * x[k]
                propagated(C, v, lla, rate_at, force_at, offset, C_at, v_at, lla_at, F, A, B)
            gated = event_gate[event] < np.inf and (
                kind == IS_STANDSTILL or rejected[kind] < _PATIENCE
            )
            if gated:
                for j in range(n):
                    estimated_held[j] = estimated[j]
                    for k in range(n):
                        P_held[j, k] = P[j, k]
            squares = 0.0
            components = 1 if kind == IS_HEIGHT else 3
            for component in range(components):
                sd = event_sd[event, component]
                if not sd > 0.0:
                    continue
                if moved:
                    measurement_row(kind, component, C_at, v_at, rate_at, lever, h_at)
                    z = residual(
                        kind, component, event_value[event], C_at, v_at, lla_at, rate_at, lever
                    )
                    for j in range(9):
                        h[j] = 0.0
                        for k in range(9):
                            h[j] += h_at[k] * A[k, j]
                else:
                    measurement_row(kind, component, C, v, rate, lever, h)
                    z = residual(kind, component, event_value[event], C, v, lla, rate, lever)
                state = noise_state(kind, component, coloured)
                if state >= 0:
                    z += x[state]
                    state += 9
                variance = sd * sd + excess(P, h, attitude)
                found, variance = measurement_update(P, h, state, variance, z, estimated, K)
                innovation[event, component] = found
                innovation_sd[event, component] = math.sqrt(variance)
                squares += found * found / variance
            if squares <= event_gate[event]:
                # As many must agree in a row before an open gate is closed again.
                rejected[kind] = rejected[kind] - 1 if rejected[kind] > _PATIENCE else 0
            elif not gated:
                rejected[kind] = 2 * _PATIENCE
            else:
                used[event] = False
                rejected[kind] += 1
                if rejected[kind] == _PATIENCE:
                    rejected[kind] = 2 * _PATIENCE
                for j in range(n):
                    estimated[j] = estimated_held[j]
                    for k in range(n):
                        P[j, k] = P_held[j, k]
            if used[event] and kind in (IS_POSITION, IS_VELOCITY):
                of_gnss = True
            event += 1
        if measured:
            for i in range(m):
                x[i] += estimated[9 + i]
                estimated[9 + i] = 0.0
            correct(C, v, lla, estimated)
            if of_gnss:
                gathered = 0.0
        while out < n_out and out_epoch[out] == epoch:
            _keep(out, C, v, lla, P, x, first, output, out_nav, out_C, out_P, out_sensor,
                  out_sensor_P)  # fmt: skip
            out += 1
        if epoch >= n_samples:
            return -1
        # One step of the covariance, cut short at the next epoch that something is asked for.
        stop = min(epoch + stride, n_samples)
        if event < n_events:
            stop = min(stop, event_epoch[event])
        if out < n_out:
            stop = min(stop, out_epoch[out])
        samples = stop - epoch
        for j in range(samples):
            if j == samples // 2:
                for a in range(3):
                    v_mid[a], lla_mid[a] = v[a], lla[a]
                    for b in range(3):
                        C_mid[a, b] = C[a, b]
            sample_error(first, output, phi[1], phi_off[1], partner, paired, x, held, error)
            i = epoch + j
            bx, by, bz, gx, gy, gz = ax, ay, az, fx, fy, fz
            ax, ay = rotation[i, 0] - error[0] * dt, rotation[i, 1] - error[1] * dt
            az, fx = rotation[i, 2] - error[2] * dt, increment[i, 0] - error[3] * dt
            fy, fz = increment[i, 1] - error[4] * dt, increment[i, 2] - error[5] * dt
            if i == 0:
                bx, by, bz, gx, gy, gz = ax, ay, az, fx, fy, fz
            step(C, v, lla, ax, ay, az, fx, fy, fz, bx, by, bz, gx, gy, gz, dt)
            if 2 * j + 1 == samples:
                # The middle of the step lies within this sample.
                for a in range(3):
                    v_mid[a], lla_mid[a] = 0.5 * (v_mid[a] + v[a]), 0.5 * (lla_mid[a] + lla[a])
                    for b in range(3):
                        C_mid[a, b] = 0.5 * (C_mid[a, b] + C[a, b])
        epoch = stop
        transition(v_mid, lla_mid, C_mid, samples * dt, F, A, B)
        propagate(P, A, B, axis, partner, phi[samples], phi_off[samples], gain[samples],
              noise[samples], noise_off[samples], cross[samples], integral[samples],
              S, T, U, row)  # fmt: skip
        if second_order:
            gathered = tilt_squared(P, gravity(lla[0], lla[2]), samples * dt, gathered)
        steps += 1
        if steps % _CLEAN_EVERY == 0:
            orthonormalise(C)
        if not (
            P[0, 0] + P[1, 1] + P[2, 2] < _LARGEST_POSITION_VARIANCE
            and abs(lla[0]) < 1.5533
            and abs(lla[2]) < 1e7
        ):
            return epoch
        if last <= epoch < n_samples:
            place[0], place[1], place[2], place[3] = epoch, event, out, steps
            carry[0], carry[1], carry[2], carry[3], carry[4], carry[5] = ax, ay, az, fx, fy, fz
            carry[6] = gathered
            return PAUSED


@compiled()
def _keep(
    k: int, C: FloatArray, v: FloatArray, lla: FloatArray, P: FloatArray, x: FloatArray,
    first: IntArray, output: FloatArray, out_nav: FloatArray, out_C: FloatArray,
    out_P: FloatArray, out_sensor: FloatArray, out_sensor_P: FloatArray,
) -> None:  # fmt: skip
    for i in range(3):
        out_nav[k, i], out_nav[k, 3 + i] = lla[i], v[i]
        for j in range(3):
            out_C[k, i, j] = C[i, j]
    for i in range(9):
        for j in range(9):
            out_P[k, i, j] = P[i, j]
    axis_sums(P, first, output, out_sensor[k], x, out_sensor_P[k])
