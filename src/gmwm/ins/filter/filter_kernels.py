"""The loop of the navigation filter: mechanization, covariance, measurements, closed loop."""

from __future__ import annotations

import math

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray
from gmwm.ins import tuning
from gmwm.ins.filter.covariance_kernels import (
    excess,
    measurement_update,
    propagate,
    tilt_squared,
    transition,
)
from gmwm.ins.filter.measurements import IS_GNSS, IS_INFERRED, observe
from gmwm.ins.filter.mechanization import step
from gmwm.ins.filter.records import (
    Events,
    FilterState,
    Increments,
    Innovated,
    Kept,
    Kinematics,
    RunPlace,
    Samples,
    SensorTable,
    Settings,
    Workspace,
    new_workspace,
)
from gmwm.ins.geometry import gravity, orthonormalise, radii_at, turn_navigation

PAUSED = -2
"""Returned by `run` when it is to be called again."""

_LARGEST_POSITION_VARIANCE = 1e14  # m^2: beyond the Earth
_HIGHEST_LATITUDE, _LARGEST_HEIGHT = 1.5533, 1e7  # rad, m: the filter has diverged
_PATIENCE = tuning.GATE_PATIENCE
_CLEAN_EVERY = 1000  # steps of the covariance: the attitude matrix is brought back to a rotation


@compiled()
def correct(at: Kinematics, x: FloatArray) -> None:
    """Subtract estimated errors x from a solution, and set the nine of navigation to zero."""
    C, v, lla = at
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
def axis_sums(
    P: FloatArray, table: SensorTable, x: FloatArray, mean: FloatArray, covariance: FloatArray
) -> None:
    """Estimated error of each sensor (6,) and its covariance (6, 6) from those of its states."""
    first, output = table.first, table.output
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
    samples: Samples,
    settings: Settings,
    estimate: FilterState,
    events: Events,
    innovated: Innovated,
    kept: Kept,
    where: RunPlace,
    last: int,
) -> int:
    """Filter a record; returns the epoch at which it diverged, -1 at its end, or `PAUSED`.

    estimate: At the first epoch; that at the last one after the call.
    innovated, kept: Overwritten.
    last: Epoch from which on the filter pauses, to go on with the next call.
    """
    at, P, x = estimate
    lla = at.lla
    n, dt = samples.rotation.shape[0], samples.dt
    work = new_workspace(P.shape[0])
    place, carry = where.place, where.carry
    epoch, event, out, steps = place[0], place[1], place[2], place[3]
    while True:
        # What is asked for at this epoch: results before, measurements, results after.
        while out < kept.epoch.size and kept.epoch[out] == epoch and kept.before[out] == 1:
            _keep(out, estimate, settings.table, kept)
            out += 1
        if event < events.epoch.size and events.epoch[event] == epoch:
            attitude = P[6, 6] + P[7, 7] + P[8, 8] if settings.second_order else 0.0
            for i in range(3):
                turned = carry[i] if epoch > 0 or n == 0 else samples.rotation[0, i]
                work.rate[i] = turned / dt
            while event < events.epoch.size and events.epoch[event] == epoch:
                _measure(
                    event, samples, settings, estimate, events, innovated, where, attitude, work
                )
                event += 1
            for i in range(x.size):
                x[i] += work.estimated[9 + i]
                work.estimated[9 + i] = 0.0
            correct(at, work.estimated)
        while out < kept.epoch.size and kept.epoch[out] == epoch:
            _keep(out, estimate, settings.table, kept)
            out += 1
        if epoch >= n:
            return -1
        # One step of the covariance, cut short at the next epoch that something is asked for.
        stop = min(epoch + settings.stride, n)
        if event < events.epoch.size:
            stop = min(stop, events.epoch[event])
        if out < kept.epoch.size:
            stop = min(stop, kept.epoch[out])
        _advance(epoch, stop, samples, settings.table, at, x, carry, work)
        transition(work.middle, (stop - epoch) * dt, work.change)
        propagate(P, work.change, settings.table, stop - epoch, work.scratch)
        if settings.second_order:
            g = gravity(lla[0], lla[2])
            carry[6] = tilt_squared(P, g, (stop - epoch) * dt, carry[6])
        epoch = stop
        steps += 1
        if steps % _CLEAN_EVERY == 0:
            orthonormalise(at.C)
        if not (
            P[0, 0] + P[1, 1] + P[2, 2] < _LARGEST_POSITION_VARIANCE
            and abs(lla[0]) < _HIGHEST_LATITUDE
            and abs(lla[2]) < _LARGEST_HEIGHT
        ):
            return epoch
        if last <= epoch < n:
            place[0], place[1], place[2], place[3] = epoch, event, out, steps
            return PAUSED


@compiled()
def _measure(
    event: int,
    samples: Samples,
    settings: Settings,
    estimate: FilterState,
    events: Events,
    innovated: Innovated,
    where: RunPlace,
    attitude: float,
    work: Workspace,
) -> None:
    """Update the covariance and the estimated errors by a measurement, unless it is far off.

    attitude: Variance of the attitude, rad^2; 0 where products of errors are not allowed for.
    work: ``rate`` is the angular rate at the epoch, ``estimated`` holds the errors so far.
    """
    at, P, x = estimate
    rate, h = work.rate, work.h
    kind, gate = events.kind[event], events.gate[event]
    moved = events.offset[event] != 0.0 and samples.rotation.shape[0] > 0
    if moved:
        _look(samples, settings.table, estimate, events.epoch[event], events.offset[event], work)
        at, rate = work.there, work.rate_there
    rejected = where.rejected
    gated = gate < np.inf and (IS_INFERRED[kind] or rejected[kind] < _PATIENCE)
    if gated:
        _copy(P, work.estimated, work.P_held, work.estimated_held)
    squares = 0.0
    for component in range(3):
        sd = events.sd[event, component]
        if not sd > 0.0:
            continue
        z = observe(kind, component, events.value[event], at, rate, settings.lever, h)
        if moved:
            for j in range(9):
                work.h_there[j] = h[j]
            for j in range(9):
                h[j] = 0.0
                for k in range(9):
                    h[j] += work.h_there[k] * work.change.A[k, j]
        own = settings.noise_states[kind, component]
        if own >= 0:
            z += x[own]
            own += 9
        variance = sd * sd + excess(P, h, attitude)
        found, variance = measurement_update(P, h, own, variance, z, work.estimated, work.gain)
        innovated.value[event, component] = found
        innovated.sd[event, component] = math.sqrt(variance)
        squares += found * found / variance
    if not _is_accepted(squares, gate, gated, kind, rejected):
        innovated.used[event] = False
        _copy(work.P_held, work.estimated_held, P, work.estimated)
    elif IS_GNSS[kind]:
        where.carry[6] = 0.0


@compiled()
def _look(
    samples: Samples,
    table: SensorTable,
    estimate: FilterState,
    epoch: int,
    offset: float,
    work: Workspace,
) -> None:
    """Solution ``offset`` s from an epoch, and the transition of the errors to there.

    Noise and sensor errors over a part of a sampling interval are left out: they are far below the
    noise of any fix.
    """
    at, x = estimate.at, estimate.x
    there, rate, force, dt = work.there, work.rate_there, work.force_there, samples.dt
    i = min(max(epoch if offset > 0.0 else epoch - 1, 0), samples.rotation.shape[0] - 1)
    for a in range(3):
        rate[a], force[a] = samples.rotation[i, a] / dt, samples.velocity[i, a] / dt
    for k in range(x.size):
        a = table.axis[k]
        if 0 <= a < 3:
            rate[a] -= table.output[k] * x[k]
        elif a >= 3:
            force[a - 3] -= table.output[k] * x[k]
    for i in range(3):
        there.v[i], there.lla[i] = at.v[i], at.lla[i]
        for j in range(3):
            there.C[i, j] = at.C[i, j]
    ax, ay, az = rate[0] * offset, rate[1] * offset, rate[2] * offset
    fx, fy, fz = force[0] * offset, force[1] * offset, force[2] * offset
    now = Increments(ax, ay, az, fx, fy, fz)
    step(there, now, now, offset)
    transition(at, offset, work.change)


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
    epoch: int,
    stop: int,
    samples: Samples,
    table: SensorTable,
    at: Kinematics,
    x: FloatArray,
    carry: FloatArray,
    work: Workspace,
) -> None:
    """Mechanize the samples of a step of the covariance; fills the solution in its middle.

    Each sample is corrected for the sensor errors that the states x (m,) predict. Then the states
    are propagated: without it, estimates of Gauss-Markov processes would not decay.

    carry: Corrected increments of the sample before; then those of the last one.
    """
    rotation, velocity, dt = samples
    C_mid, v_mid, lla_mid = work.middle
    error, held, count = work.error, work.x_held, stop - epoch
    first, output, partner, paired = table.first, table.output, table.partner, table.paired
    decay, decay_off = table.phi[1], table.phi_off[1]
    C, v, lla = at
    now = Increments(carry[0], carry[1], carry[2], carry[3], carry[4], carry[5])
    for i in range(epoch, stop):
        if i - epoch == count // 2:
            for a in range(3):
                v_mid[a], lla_mid[a] = v[a], lla[a]
                for b in range(3):
                    C_mid[a, b] = C[a, b]
        for a in range(6):
            error[a] = 0.0
            for k in range(first[a], first[a + 1]):
                error[a] += output[k] * x[k]
        for k in range(x.size):
            held[k] = x[k]
            x[k] *= decay[k]
        if paired:
            for k in range(x.size):
                if partner[k] != k:
                    x[k] += decay_off[k] * held[partner[k]]
        before = now
        ax, ay = rotation[i, 0] - error[0] * dt, rotation[i, 1] - error[1] * dt
        az, fx = rotation[i, 2] - error[2] * dt, velocity[i, 0] - error[3] * dt
        fy, fz = velocity[i, 1] - error[4] * dt, velocity[i, 2] - error[5] * dt
        now = Increments(ax, ay, az, fx, fy, fz)
        step(at, now, now if i == 0 else before, dt)
        if 2 * (i - epoch) + 1 == count:
            # The middle of the step lies within this sample.
            for a in range(3):
                v_mid[a] = 0.5 * (v_mid[a] + v[a])
                lla_mid[a] = 0.5 * (lla_mid[a] + lla[a])
                for b in range(3):
                    C_mid[a, b] = 0.5 * (C_mid[a, b] + C[a, b])
    for a in range(6):
        carry[a] = now[a]


@compiled()
def _keep(k: int, estimate: FilterState, table: SensorTable, kept: Kept) -> None:
    at, P, x = estimate
    for i in range(3):
        kept.nav[k, i], kept.nav[k, 3 + i] = at.lla[i], at.v[i]
        for j in range(3):
            kept.C[k, i, j] = at.C[i, j]
    for i in range(9):
        for j in range(9):
            kept.P[k, i, j] = P[i, j]
    axis_sums(P, table, x, kept.sensor[k], kept.sensor_covariance[k])
