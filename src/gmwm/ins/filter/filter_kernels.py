"""The loop of the navigation filter: mechanization, covariance, measurements, closed loop."""

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
from gmwm.ins.filter.measurements import (
    IS_GNSS,
    IS_INFERRED,
    IS_RELATIVE,
    new_keyframe,
    observe,
    observe_since,
)
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
    Transition,
    new_transition,
    set_kinematics,
    set_matrix,
    set_vector,
)
from gmwm.ins.geometry import (
    RATE,
    SEMI_MAJOR_AXIS,
    gravity,
    gravity_at,
    orthonormalise,
    radii_at,
    rotate,
    rotation_coefficients,
    turn_navigation,
)


@compiled()
def step(
    at: Kinematics, now: Increments, before: Increments, dt: float
) -> tuple[float, float, float]:
    """Propagate attitude, velocity and position over one sampling interval, in place.

    Coning and sculling are corrected with the increments of the interval before, as if rate and
    specific force changed linearly; on the first interval, give its own increments as those before.
    Returns the integral of the specific force over the interval, m/s, north, east and down.

    Savage (1998), Strapdown inertial navigation integration algorithm design, J. Guid. Control
    Dyn. 21: coning from Part 1, rotation and sculling of the velocity from Part 2, both with the
    interval before instead of subintervals. Rotation of the frame, Coriolis and gravity are those
    at the middle of the interval (Groves 2013, ch. 5); the position follows the trapezoidal rule.
    """
    C, v, lla = at
    ax, ay, az, fx, fy, fz = now
    ax_before, ay_before, az_before, fx_before, fy_before, fz_before = before
    # Rotation vector of the body.
    rx = ax + (ay_before * az - az_before * ay) / 12.0
    ry = ay + (az_before * ax - ax_before * az) / 12.0
    rz = az + (ax_before * ay - ay_before * ax) / 12.0

    # Integrated specific force in the body axes of the beginning.
    sine, half, sixth = rotation_coefficients(rx * rx + ry * ry + rz * rz)
    px, py, pz = ay * fz - az * fy, az * fx - ax * fz, ax * fy - ay * fx
    sx = ay_before * fz - az_before * fy + fy_before * az - fz_before * ay
    sy = az_before * fx - ax_before * fz + fz_before * ax - fx_before * az
    sz = ax_before * fy - ay_before * fx + fx_before * ay - fy_before * ax
    bx = fx + half * px + sixth * (ay * pz - az * py) + sx / 12.0
    by = fy + half * py + sixth * (az * px - ax * pz) + sy / 12.0
    bz = fz + half * pz + sixth * (ax * py - ay * px) + sz / 12.0
    un = C[0, 0] * bx + C[0, 1] * by + C[0, 2] * bz
    ue = C[1, 0] * bx + C[1, 1] * by + C[1, 2] * bz
    ud = C[2, 0] * bx + C[2, 1] * by + C[2, 2] * bz

    # The middle of the interval; on a sphere, and without acceleration, is good enough for it.
    half_dt = 0.5 * dt
    lat = lla[0] + half_dt * v[0] / SEMI_MAJOR_AXIS
    h = lla[2] - half_dt * v[2]
    s, c = math.sin(lat), math.cos(lat)
    meridian, transverse = radii_at(s)
    to_lat = 1.0 / (meridian + h)
    to_east = 1.0 / (transverse + h)
    per_c = 1.0 / c
    g = gravity_at(s, h) * dt
    vn, ve, vd = v[0] + 0.5 * un, v[1] + 0.5 * ue, v[2] + 0.5 * (ud + g)

    # Rotation of the navigation frame over the interval, and the Earth's part of it.
    en, ed = RATE * c * dt, -RATE * s * dt
    zn = en + ve * to_east * dt
    ze = -vn * to_lat * dt
    zd = ed - ve * to_east * s * per_c * dt

    # The frame has turned by half of it when the specific force is resolved.
    fn = un - 0.5 * (ze * ud - zd * ue)
    fe = ue - 0.5 * (zd * un - zn * ud)
    fd = ud - 0.5 * (zn * ue - ze * un)
    end_n = v[0] + fn - (ze * vd - (zd + ed) * ve)
    end_e = v[1] + fe - ((zd + ed) * vn - (zn + en) * vd)
    end_d = v[2] + fd + g - ((zn + en) * ve - ze * vn)

    lla[0] += half_dt * (v[0] + end_n) * to_lat
    lla[1] += half_dt * (v[1] + end_e) * to_east * per_c
    lla[2] -= half_dt * (v[2] + end_d)
    v[0], v[1], v[2] = end_n, end_e, end_d
    rotate(C, rx, ry, rz, sine, half)
    turn_navigation(C, zn, ze, zd)
    return fn, fe, fd


PAUSED = -2  # returned by `run` when it is to be called again
_LARGEST_POSITION_VARIANCE = 1e14  # m^2: beyond the Earth
_HIGHEST_LATITUDE, _LARGEST_HEIGHT = 1.5533, 1e7  # rad, m: the filter has diverged
_PATIENCE = tuning.GATE_PATIENCE
_CLEAN_EVERY = 1000  # steps: rounding errors of the attitude matrix stay below 1e-13


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
    x[:9] = 0.0


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
    lla, table, carry = at.lla, settings.table, where.carry
    n, dt = samples.rotation.shape[0], samples.dt
    change, middle = new_transition(), Kinematics(np.zeros((3, 3)), np.zeros(3), np.zeros(3))
    place = where.place
    epoch, event, out, steps = place[0], place[1], place[2], place[3]
    while True:
        # What is asked for at this epoch: results before, measurements, results after.
        while out < kept.epoch.size and kept.epoch[out] == epoch and kept.before[out] == 1:
            _keep(out, estimate, table, kept)
            out += 1
        if event < events.epoch.size and events.epoch[event] == epoch:
            event = _aid(event, samples, settings, estimate, events, innovated, where)
        while out < kept.epoch.size and kept.epoch[out] == epoch:
            _keep(out, estimate, table, kept)
            out += 1
        if epoch >= n:
            return -1
        # One step of the covariance, cut short at the next epoch that something is asked for.
        stop = min(epoch + settings.stride, n)
        if event < events.epoch.size:
            stop = min(stop, events.epoch[event])
        if out < kept.epoch.size:
            stop = min(stop, kept.epoch[out])
        _advance(epoch, stop, samples, table, at, x, carry, middle)
        transition(middle, (stop - epoch) * dt, change)
        propagate(P, change, table, stop - epoch)
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
def _aid(
    event: int,
    samples: Samples,
    settings: Settings,
    estimate: FilterState,
    events: Events,
    innovated: Innovated,
    where: RunPlace,
) -> int:
    """Correct the estimate by all measurements of an epoch; returns the event after them."""
    at, P, x = estimate
    epoch, n, rejected = events.epoch[event], samples.rotation.shape[0], where.rejected
    attitude = P[6, 6] + P[7, 7] + P[8, 8] if settings.second_order else 0.0
    errors, gain = np.zeros(P.shape[0]), np.zeros(P.shape[0])
    h, rate, change, since = np.zeros(P.shape[0]), np.empty(3), new_transition(), where.since
    is_keyframe = False
    for i in range(3):
        turned = where.carry[i] if epoch > 0 or n == 0 else samples.rotation[0, i]
        rate[i] = turned / samples.dt
    while event < events.epoch.size and events.epoch[event] == epoch:
        kind, gate, offset = events.kind[event], events.gate[event], events.offset[event]
        seen, seen_rate, moved = at, rate, offset != 0.0 and n > 0
        if moved:
            seen, seen_rate = _look(samples, settings.table, estimate, epoch, offset, change)
        gated = gate < np.inf and (IS_INFERRED[kind] or rejected[kind] < _PATIENCE)
        P_before, errors_before = P.copy(), errors.copy()
        squares = 0.0
        for component in range(3):
            sd = events.sd[event, component]
            if not sd > 0.0:
                continue
            value, variance = events.value[event], sd * sd
            if IS_RELATIVE[kind]:
                z = observe_since(kind, component, value, at, since, h)
            else:
                z = observe(kind, component, value, seen, seen_rate, settings.lever, h)
                if moved:
                    _moved(h, change.A)
                own = settings.noise_states[kind, component]
                if own >= 0:
                    h[9 + own] = -1.0
                variance += excess(P, h, attitude)
            # What is known of slow noise, and of the errors at the keyframe since it was taken.
            for i in range(x.size):
                z -= h[9 + i] * x[i]
            found, variance = measurement_update(P, h, variance, z, errors, gain)
            innovated.value[event, component] = found
            innovated.sd[event, component] = math.sqrt(variance)
            squares += found * found / variance
        if not _is_accepted(squares, gate, gated, kind, rejected):
            innovated.used[event] = False
            set_matrix(P, P_before)
            set_vector(errors, errors_before)
        elif IS_GNSS[kind]:
            where.carry[6] = 0.0
        is_keyframe |= IS_RELATIVE[kind]
        event += 1
    for i in range(x.size):
        x[i] += errors[9 + i]
    correct(at, errors)
    if is_keyframe:
        new_keyframe(P, at, since, 1.0)
        x[since.first - 9 : since.first - 3] = 0.0
    return event


@compiled()
def _moved(h: FloatArray, A: FloatArray) -> None:
    """Map a row for the errors at another time to the errors now, by a transition to that time."""
    there = h[:9].copy()
    for j in range(9):
        h[j] = 0.0
        for i in range(9):
            h[j] += A[i, j] * there[i]


@compiled()
def _look(
    samples: Samples,
    table: SensorTable,
    estimate: FilterState,
    epoch: int,
    offset: float,
    change: Transition,
) -> tuple[Kinematics, FloatArray]:
    """Solution ``offset`` s from an epoch, and angular rate; fills the transition to there."""
    at, _, x = estimate
    i = min(max(epoch if offset > 0.0 else epoch - 1, 0), samples.rotation.shape[0] - 1)
    sensed = np.empty(6)
    for k in range(3):
        sensed[k] = samples.rotation[i, k] / samples.dt
        sensed[3 + k] = samples.velocity[i, k] / samples.dt
    for k in range(x.size):
        if table.axis[k] >= 0:
            sensed[table.axis[k]] -= table.output[k] * x[k]
    there = Kinematics(at.C.copy(), at.v.copy(), at.lla.copy())
    a, b, c = sensed[0] * offset, sensed[1] * offset, sensed[2] * offset
    now = Increments(a, b, c, sensed[3] * offset, sensed[4] * offset, sensed[5] * offset)
    step(there, now, now, offset)
    transition(at, offset, change)
    return there, sensed[:3]


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
    middle: Kinematics,
) -> None:
    """Mechanize the samples of a step of the covariance; fills the solution in its middle.

    Each sample is corrected for the sensor errors that the states x (m,) predict. Then the states
    are propagated: without it, estimates of Gauss-Markov processes would not decay.

    carry: Corrected increments of the sample before; then those of the last one.
    """
    rotation, velocity, dt = samples
    axis, output, partner, paired = table.axis, table.output, table.partner, table.paired
    decay, decay_off = table.phi[1], table.phi_off[1]
    error, held, count = np.empty(6), np.empty(x.size), stop - epoch
    now = Increments(carry[0], carry[1], carry[2], carry[3], carry[4], carry[5])
    for i in range(epoch, stop):
        if i - epoch == count // 2:
            set_kinematics(middle, at, 1.0)
        error[:] = 0.0
        for k in range(x.size):
            if axis[k] >= 0:
                error[axis[k]] += output[k] * x[k]
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
            set_kinematics(middle, at, 0.5)
    for a in range(6):
        carry[a] = now[a]


@compiled()
def _keep(k: int, estimate: FilterState, table: SensorTable, kept: Kept) -> None:
    at, P, x = estimate
    set_vector(kept.nav[k, :3], at.lla)
    set_vector(kept.nav[k, 3:], at.v)
    set_matrix(kept.C[k], at.C)
    set_matrix(kept.P[k], P)
    for i in range(x.size):
        for j in range(x.size):
            a, b = table.axis[i], table.axis[j]
            if a >= 0 and b >= 0:
                product = table.output[i] * table.output[j]
                kept.sensor_covariance[k, a, b] += product * P[9 + i, 9 + j]
                if i == j:
                    kept.sensor[k, a] += table.output[i] * x[i]
