"""The loop of the navigation filter: mechanization, covariance, measurements, closed loop."""

from __future__ import annotations

import math

import numpy as np

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
from gmwm.ins.filter.filter_arrays import Kept, Measured, Room, Sampled, Sensors, State, room_for
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
    imu: Sampled, state: State, sensors: Sensors, measured: Measured, kept: Kept,
    last: int, place: IntArray, carry: FloatArray,
) -> int:  # fmt: skip
    """Filter a record; returns the epoch at which it diverged, -1 at its end, or `PAUSED`.

    state: At the first epoch; that at the last one after the call.
    last: Epoch from which on the filter pauses, to go on with the next call.
    place, carry: (4 + kinds,) of int and (7,), where it is and what it needs of the samples before:
        zeros at first.
    """
    C, v, lla, P, x = state
    # Tuples are for what is rare: numba counts references to each of their arrays when they pass.
    rotation, velocity, dt, _ = imu
    first, paired, axis, output, partner, phi, phi_off, gain, noise, noise_off, cross, integral = (
        sensors
    )
    n = rotation.shape[0]
    room = room_for(P.shape[0])
    F, A, B, S, T, U, row = room.F, room.A, room.B, room.S, room.T, room.U, room.row
    C_mid, v_mid, lla_mid = room.C_mid, room.v_mid, room.lla_mid
    held, error, decay, decay_off = room.x_held, room.error, phi[1], phi_off[1]
    rate, estimated = np.zeros(3), np.zeros(P.shape[0])
    epoch, event, out, steps = place[0], place[1], place[2], place[3]
    while True:
        # What is asked for at this epoch: results before, measurements, results after.
        while out < kept.epoch.size and kept.epoch[out] == epoch and kept.before[out] == 1:
            _keep(out, state, sensors, kept)
            out += 1
        if event < measured.epoch.size and measured.epoch[event] == epoch:
            attitude = P[6, 6] + P[7, 7] + P[8, 8] if measured.second_order else 0.0
            for i in range(3):
                rate[i] = carry[i] / dt if epoch > 0 or n == 0 else imu.rotation[0, i] / dt
            while event < measured.epoch.size and measured.epoch[event] == epoch:
                if _measure(
                    event, imu, state, sensors, measured, attitude, rate, estimated, place[4:], room
                ):
                    carry[6] = 0.0
                event += 1
            for i in range(x.size):
                x[i] += estimated[9 + i]
                estimated[9 + i] = 0.0
            correct(C, v, lla, estimated)
        while out < kept.epoch.size and kept.epoch[out] == epoch:
            _keep(out, state, sensors, kept)
            out += 1
        if epoch >= n:
            return -1
        # One step of the covariance, cut short at the next epoch that something is asked for.
        stop = min(epoch + imu.stride, n)
        if event < measured.epoch.size:
            stop = min(stop, measured.epoch[event])
        if out < kept.epoch.size:
            stop = min(stop, kept.epoch[out])
        samples = stop - epoch
        _advance(epoch, stop, rotation, velocity, dt, C, v, lla, x, first, output, decay, decay_off,
                 partner, paired, held, error, C_mid, v_mid, lla_mid, carry)  # fmt: skip
        transition(v_mid, lla_mid, C_mid, samples * dt, F, A, B)
        propagate(P, A, B, axis, partner, phi[samples], phi_off[samples], gain[samples],
                  noise[samples], noise_off[samples], cross[samples], integral[samples],
                  S, T, U, row)  # fmt: skip
        if measured.second_order:
            g = gravity(lla[0], lla[2])
            carry[6] = tilt_squared(P, g, samples * dt, carry[6])
        epoch = stop
        steps += 1
        if steps % _CLEAN_EVERY == 0:
            orthonormalise(C)
        if not (
            P[0, 0] + P[1, 1] + P[2, 2] < _LARGEST_POSITION_VARIANCE
            and abs(lla[0]) < 1.5533
            and abs(lla[2]) < 1e7
        ):
            return epoch
        if last <= epoch < n:
            place[0], place[1], place[2], place[3] = epoch, event, out, steps
            return PAUSED


@compiled()
def _measure(
    event: int, imu: Sampled, state: State, sensors: Sensors, measured: Measured, attitude: float,
    rate: FloatArray, estimated: FloatArray, rejected: IntArray, room: Room,
) -> bool:  # fmt: skip
    """Update the covariance and the estimated errors by a measurement, unless it is far off.

    attitude: Variance of the attitude, rad^2; 0 where products of errors are not allowed for.
    rate: (3,), at the epoch, rad/s.
    estimated: (9 + m,), errors estimated at the epoch so far.
    rejected: (kinds,), measurements that were rejected in a row.
    Returns: whether a position or velocity was used.
    """
    C, v, lla, P, x = state
    h, h_at = room.h, room.h_at
    kind, gate = measured.kind[event], measured.gate[event]
    moved = measured.offset[event] != 0.0 and imu.rotation.shape[0] > 0
    if moved:
        _look(event, imu, state, sensors, measured, room)
        C, v, lla, rate = room.C_at, room.v_at, room.lla_at, room.rate_at
    gated = gate < np.inf and (kind == IS_STANDSTILL or rejected[kind] < _PATIENCE)
    if gated:
        _copy(P, estimated, room.P_held, room.estimated_held)
    squares = 0.0
    for component in range(1 if kind == IS_HEIGHT else 3):
        sd = measured.sd[event, component]
        if not sd > 0.0:
            continue
        measurement_row(kind, component, C, v, rate, measured.lever, h)
        z = residual(kind, component, measured.value[event], C, v, lla, rate, measured.lever)
        if moved:
            for j in range(9):
                h_at[j] = h[j]
            for j in range(9):
                h[j] = 0.0
                for k in range(9):
                    h[j] += h_at[k] * room.A[k, j]
        own = noise_state(kind, component, measured.coloured)
        if own >= 0:
            z += x[own]
            own += 9
        variance = sd * sd + excess(P, h, attitude)
        found, variance = measurement_update(P, h, own, variance, z, estimated, room.gain)
        measured.innovation[event, component] = found
        measured.innovation_sd[event, component] = math.sqrt(variance)
        squares += found * found / variance
    if _is_accepted(squares, gate, gated, kind, rejected):
        return kind in (IS_POSITION, IS_VELOCITY)
    measured.used[event] = False
    _copy(room.P_held, room.estimated_held, P, estimated)
    return False


@compiled()
def _look(
    event: int, imu: Sampled, state: State, sensors: Sensors, measured: Measured, room: Room
) -> None:
    """Solution at the time of a measurement between two epochs, and the transition to there."""
    x, epoch, offset = state.x, measured.epoch[event], measured.offset[event]
    rate, force = room.rate_at, room.force_at
    i = min(max(epoch if offset > 0.0 else epoch - 1, 0), imu.rotation.shape[0] - 1)
    for a in range(3):
        rate[a], force[a] = imu.rotation[i, a] / imu.dt, imu.velocity[i, a] / imu.dt
    for k in range(x.size):
        a = sensors.axis[k]
        if 0 <= a < 3:
            rate[a] -= sensors.output[k] * x[k]
        elif a >= 3:
            force[a - 3] -= sensors.output[k] * x[k]
    propagated(
        state.C, state.v, state.lla, rate, force, offset, room.C_at, room.v_at, room.lla_at,
        room.F, room.A, room.B,
    )  # fmt: skip


@compiled()
def _copy(P: FloatArray, x: FloatArray, P_to: FloatArray, x_to: FloatArray) -> None:
    for j in range(x.size):
        x_to[j] = x[j]
        for k in range(x.size):
            P_to[j, k] = P[j, k]


@compiled()
def _is_accepted(squares: float, gate: float, gated: bool, kind: int, rejected: IntArray) -> bool:
    """Whether a measurement is used; counts those of its kind that were rejected in a row."""
    if squares <= gate:
        # As many must agree in a row before an open gate is closed again.
        rejected[kind] = rejected[kind] - 1 if rejected[kind] > _PATIENCE else 0
        return True
    if not gated:
        rejected[kind] = 2 * _PATIENCE
        return True
    rejected[kind] += 1
    if rejected[kind] == _PATIENCE:
        rejected[kind] = 2 * _PATIENCE
    return False


@compiled()
def _advance(
    epoch: int, stop: int, rotation: FloatArray, velocity: FloatArray, dt: float,
    C: FloatArray, v: FloatArray, lla: FloatArray, x: FloatArray,
    first: IntArray, output: FloatArray, decay: FloatArray, decay_off: FloatArray,
    partner: IntArray, paired: bool, held: FloatArray, error: FloatArray,
    C_mid: FloatArray, v_mid: FloatArray, lla_mid: FloatArray, carry: FloatArray,
) -> None:  # fmt: skip
    """Mechanize the samples of a step of the covariance; the solution in its middle.

    carry: (6,) at least, increments of the sample before, corrected; then those of the last one.
    """
    samples = stop - epoch
    ax, ay, az, fx, fy, fz = carry[0], carry[1], carry[2], carry[3], carry[4], carry[5]
    for j in range(samples):
        if j == samples // 2:
            for a in range(3):
                v_mid[a], lla_mid[a] = v[a], lla[a]
                for b in range(3):
                    C_mid[a, b] = C[a, b]
        sample_error(first, output, decay, decay_off, partner, paired, x, held, error)
        i = epoch + j
        bx, by, bz, gx, gy, gz = ax, ay, az, fx, fy, fz
        ax, ay = rotation[i, 0] - error[0] * dt, rotation[i, 1] - error[1] * dt
        az, fx = rotation[i, 2] - error[2] * dt, velocity[i, 0] - error[3] * dt
        fy, fz = velocity[i, 1] - error[4] * dt, velocity[i, 2] - error[5] * dt
        if i == 0:
            bx, by, bz, gx, gy, gz = ax, ay, az, fx, fy, fz
        step(C, v, lla, ax, ay, az, fx, fy, fz, bx, by, bz, gx, gy, gz, dt)
        if 2 * j + 1 == samples:
            # The middle of the step lies within this sample.
            for a in range(3):
                v_mid[a] = 0.5 * (v_mid[a] + v[a])
                lla_mid[a] = 0.5 * (lla_mid[a] + lla[a])
                for b in range(3):
                    C_mid[a, b] = 0.5 * (C_mid[a, b] + C[a, b])
    carry[0], carry[1], carry[2], carry[3], carry[4], carry[5] = ax, ay, az, fx, fy, fz


@compiled()
def _keep(k: int, state: State, sensors: Sensors, kept: Kept) -> None:
    for i in range(3):
        kept.nav[k, i], kept.nav[k, 3 + i] = state.lla[i], state.v[i]
        for j in range(3):
            kept.C[k, i, j] = state.C[i, j]
    for i in range(9):
        for j in range(9):
            kept.P[k, i, j] = state.P[i, j]
    axis_sums(
        state.P, sensors.first, sensors.output, kept.sensor[k], state.x, kept.sensor_covariance[k]
    )
