"""The true covariance of a filter whose model is not the truth, propagated along a trajectory.

The joint vector holds the navigation errors, the filter's estimates of its sensor states and the
true sensor states. It obeys linear equations along the true trajectory: the filter's estimates
enter the navigation errors with the sign turned round, and its gains come from its own covariance.
After Maybeck (1979), *Stochastic Models, Estimation, and Control* 1, sec. 6.8.
"""

from __future__ import annotations

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray
from gmwm.ins.filter import (
    IS_GNSS,
    Events,
    Kinematics,
    SensorTable,
    excess,
    measurement_update,
    new_scratch,
    new_transition,
    observe,
    propagate,
    tilt_squared,
    transition,
)
from gmwm.ins.geometry import gravity


@compiled()
def update_jointly(
    J: FloatArray, h: FloatArray, estimate: int, truth: int, variance: float, gain: FloatArray,
    m: int, a: FloatArray, k: FloatArray,
) -> None:  # fmt: skip
    """Update the joint second moments by a scalar measurement with a given gain, in place.

    J: (N, N).
    h: (9,), row of the navigation errors.
    estimate, truth: Places of the estimated and the true coloured noise of the measurement; -1 for
        none.
    variance: Of the measurement's white noise.
    gain: (9 + m,), the filter's.
    m: Number of the filter's sensor states.
    a, k: (N,), work space.
    """
    n = J.shape[0]
    for j in range(n):
        total = 0.0
        for i in range(9):
            total += h[i] * J[i, j]
        if estimate >= 0:
            total += J[estimate, j] - J[truth, j]
        a[j] = total
        k[j] = 0.0
    for i in range(9):
        k[i] = gain[i]
    for i in range(m):
        k[9 + i] = -gain[9 + i]
    s = variance
    for i in range(9):
        s += h[i] * a[i]
    if estimate >= 0:
        s += a[estimate] - a[truth]
    for i in range(n):
        for j in range(i, n):
            J[i, j] += s * k[i] * k[j] - k[i] * a[j] - a[i] * k[j]
            J[j, i] = J[i, j]


@compiled()
def run_both(
    epoch: IntArray, samples: IntArray, dt: float,
    mid_matrix: FloatArray, mid_v: FloatArray, mid_lla: FloatArray,
    end_matrix: FloatArray, end_v: FloatArray, end_rate: FloatArray,
    P: FloatArray, table: SensorTable, noise_states: IntArray,
    J: FloatArray, joint: SensorTable, j_noise_states: IntArray,
    events: Events, lever: FloatArray,
    second_order: bool,
    out_epoch: IntArray, out_before: IntArray, out_P: FloatArray, out_J: FloatArray,
) -> None:  # fmt: skip
    """Propagate a filter's covariance and the joint second moments through a scenario."""
    n, size, m = P.shape[0], J.shape[0], table.axis.size
    change, scratch, j_scratch = new_transition(), new_scratch(n), new_scratch(size)
    h, K, x = np.zeros(9), np.zeros(n), np.zeros(n)
    a, k = np.zeros(size), np.zeros(size)
    event = out = 0
    gathered = j_gathered = 0.0
    for s in range(epoch.size):
        count = samples[s]
        if count > 0:
            middle = Kinematics(mid_matrix[s], mid_v[s], mid_lla[s])
            transition(middle, count * dt, change)
            propagate(P, change, table, count, scratch)
            propagate(J, change, joint, count, j_scratch)
            if second_order:
                g = gravity(mid_lla[s, 0], mid_lla[s, 2])
                gathered = tilt_squared(P, g, count * dt, gathered)
                j_gathered = tilt_squared(J, g, count * dt, j_gathered)
        while out < out_epoch.size and out_epoch[out] == epoch[s] and out_before[out] == 1:
            out_P[out], out_J[out] = P, J
            out += 1
        attitude = P[6, 6] + P[7, 7] + P[8, 8] if second_order else 0.0
        j_attitude = J[6, 6] + J[7, 7] + J[8, 8] if second_order else 0.0
        end = Kinematics(end_matrix[s], end_v[s], mid_lla[s])
        while event < events.epoch.size and events.epoch[event] == epoch[s]:
            kind = events.kind[event]
            for component in range(3):
                sd = events.sd[event, component]
                if not sd > 0.0:
                    continue
                observe(kind, component, events.value[event], end, end_rate[s], lever, h)
                state = estimate = truth = -1
                if noise_states[kind, component] >= 0:
                    state = estimate = 9 + noise_states[kind, component]
                    truth = 9 + j_noise_states[kind, component]
                expected = sd * sd + excess(P, h, attitude)
                measurement_update(P, h, state, expected, 0.0, x, K)
                variance = sd * sd + excess(J, h, j_attitude)
                update_jointly(J, h, estimate, truth, variance, K, m, a, k)
            if IS_GNSS[kind]:
                gathered = j_gathered = 0.0
            event += 1
        while out < out_epoch.size and out_epoch[out] == epoch[s]:
            out_P[out], out_J[out] = P, J
            out += 1
