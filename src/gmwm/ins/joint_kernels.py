"""The true covariance of a filter whose model is not the truth, in compiled code.

The joint vector holds the errors of n integrals (of navigation: nine), the filter's estimates of
its sensor states and the true sensor states. It obeys linear equations: the estimates enter the
integrals with the sign turned round, and the gains come from the filter's own covariance. After
Maybeck (1979), *Stochastic Models, Estimation, and Control* 1, sec. 6.8.

`aid_jointly` is for a system that does not change with time, `run_jointly` for one along a
trajectory. P is the filter's covariance, (n + q, n + q); J has the joint second moments.
"""

from typing import NamedTuple

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray
from gmwm.ins.filter.covariance_kernels import (
    excess,
    measurement_update,
    propagate,
    tilt_squared,
    transition,
)
from gmwm.ins.filter.measurements import IS_GNSS, IS_RELATIVE, new_keyframe, observe, observe_since
from gmwm.ins.filter.records import (
    Events,
    Keyframe,
    Kinematics,
    SensorTable,
    Settings,
    new_transition,
    set_matrix,
)
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
    middle, end: Arrays of the true motion in the middle of each step, and at its end.
    rate: (S + 1, 3), angular rate at the end, body axes, rad/s.
    """

    epoch: IntArray
    samples: IntArray
    dt: float
    middle: Kinematics
    end: Kinematics
    rate: FloatArray


class JointFilter(NamedTuple):
    """A navigation filter beside the truth.

    joint: Sensor states of the joint vector.
    estimate, truth: (kinds, 3), places in the joint vector of the estimated and the true slow noise
        of each measurement; -1 for none.
    since: The last keyframe, overwritten.
    """

    settings: Settings
    joint: SensorTable
    estimate: IntArray
    truth: IntArray
    since: Keyframe


class KeptCovariances(NamedTuple):
    """Epochs that are kept; P and J there are overwritten.

    before: (K,), 1 for those before the measurements of the epoch, which come first, 0 after them.
    """

    epoch: IntArray
    before: IntArray
    P: FloatArray
    J: FloatArray


@compiled()
def update_jointly(J: FloatArray, h: FloatArray, n: int, variance: float, gain: FloatArray) -> None:
    """Update the joint second moments by a scalar measurement with a given gain, in place.

    h: Row of the n integrals, and of states whose estimates are their errors with the sign turned;
        with -1 for the estimated and 1 for the true slow noise of the measurement.
    gain: (n + q,), the filter's.
    """
    size = J.shape[0]
    a, k = np.zeros(size), np.zeros(size)
    for i in range(h.size):
        if h[i] != 0.0:
            factor = h[i] if i < n else -h[i]
            for j in range(size):
                a[j] += factor * J[i, j]
    # Feedback: the integrals are corrected, and the estimates take what their errors lose.
    for i in range(gain.size):
        k[i] = gain[i] if i < n else -gain[i]
    s = variance
    for i in range(h.size):
        s += h[i] * a[i] if i < n else -h[i] * a[i]
    for i in range(size):
        for j in range(i, size):
            J[i, j] += s * k[i] * k[j] - k[i] * a[j] - a[i] * k[j]
            J[j, i] = J[i, j]


@compiled()
def _propagated(P: FloatArray, A: FloatArray, Q: FloatArray) -> FloatArray:
    """A P A' + Q, symmetric; by loops, for numba takes seconds to compile a product."""
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

    is_relative: Whether the last integral starts anew at each fix.
    out_P, out_J: (K, n, n), covariances of the integrals after the first K fixes, overwritten.
    Returns: P and J after the last fix.
    """
    last = n - 1
    h, gain, x = np.zeros(n), np.zeros(P.shape[0]), np.zeros(P.shape[0])
    h[last] = 1.0
    for fix in range(fixes):
        P = _propagated(P, step.A, step.Q)
        J = _propagated(J, step.B, step.R)
        measurement_update(P, h, variance, 0.0, x, gain)
        update_jointly(J, h, n, variance, gain)
        if is_relative:
            P[last] = P[:, last] = J[last] = J[:, last] = 0.0
        if fix < out_P.shape[0]:
            set_matrix(out_P[fix], P)
            set_matrix(out_J[fix], J)
    return P, J


@compiled()
def run_jointly(
    track: Track, events: Events, about: JointFilter, P: FloatArray, J: FloatArray,
    kept: KeptCovariances,
) -> None:  # fmt: skip
    """Propagate P and J of a navigation filter along a trajectory."""
    change, h, settings, since = new_transition(), np.zeros(J.shape[0]), about.settings, about.since
    m, n = P.shape[0], change.A.shape[0]  # a number written here would be compiled for anew
    gain, x = np.zeros(m), np.zeros(m)
    event = out = 0
    gathered = j_gathered = 0.0
    for s in range(track.epoch.size):
        epoch, count = track.epoch[s], track.samples[s]
        if count > 0:
            middle = Kinematics(track.middle.C[s], track.middle.v[s], track.middle.lla[s])
            step = count * track.dt
            transition(middle, step, change)
            propagate(P, change, settings.table, count)
            propagate(J, change, about.joint, count)
            if settings.second_order:
                g = gravity(middle.lla[0], middle.lla[2])
                gathered = tilt_squared(P, g, step, gathered)
                j_gathered = tilt_squared(J, g, step, j_gathered)
        while out < kept.epoch.size and kept.epoch[out] == epoch and kept.before[out] == 1:
            set_matrix(kept.P[out], P)
            set_matrix(kept.J[out], J)
            out += 1
        attitude = P[6, 6] + P[7, 7] + P[8, 8] if settings.second_order else 0.0
        j_attitude = J[6, 6] + J[7, 7] + J[8, 8] if settings.second_order else 0.0
        end, is_keyframe = Kinematics(track.end.C[s], track.end.v[s], track.end.lla[s]), False
        while event < events.epoch.size and events.epoch[event] == epoch:
            kind, value = events.kind[event], events.value[event]
            for component in range(3):
                sd = events.sd[event, component]
                if not sd > 0.0:
                    continue
                expected = actual = sd * sd
                if IS_RELATIVE[kind]:
                    observe_since(kind, component, value, end, since, h)
                else:
                    observe(kind, component, value, end, track.rate[s], settings.lever, h)
                    if about.estimate[kind, component] >= 0:
                        h[about.estimate[kind, component]] = -1.0
                        h[about.truth[kind, component]] = 1.0
                    expected += excess(P, h, attitude)
                    actual += excess(J, h, j_attitude)
                measurement_update(P, h[:m], expected, 0.0, x, gain)
                update_jointly(J, h, n, actual, gain)
            if IS_GNSS[kind]:
                gathered = j_gathered = 0.0
            is_keyframe |= IS_RELATIVE[kind]
            event += 1
        if is_keyframe:
            new_keyframe(P, end, since, 1.0)
            new_keyframe(J, end, since, -1.0)
        while out < kept.epoch.size and kept.epoch[out] == epoch:
            set_matrix(kept.P[out], P)
            set_matrix(kept.J[out], J)
            out += 1
