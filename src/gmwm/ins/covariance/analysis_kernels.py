"""The true covariance of a filter whose model is not the truth, propagated along a trajectory.

The joint vector holds the navigation errors, the filter's estimates of its sensor states and the
true sensor states. It obeys linear equations along the true trajectory: the filter's estimates
enter the navigation errors with the sign turned round, and its gains come from its own covariance.
After Maybeck (1979), *Stochastic Models, Estimation, and Control* 1, sec. 6.8.
"""

from __future__ import annotations

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
    P: FloatArray, axis: IntArray, partner: IntArray, phi: FloatArray, phi_off: FloatArray,
    gain: FloatArray, noise: FloatArray, noise_off: FloatArray, cross: FloatArray,
    integral: FloatArray, coloured: IntArray,
    J: FloatArray, j_axis: IntArray, j_partner: IntArray, j_phi: FloatArray,
    j_phi_off: FloatArray, j_gain: FloatArray, j_noise: FloatArray, j_noise_off: FloatArray,
    j_cross: FloatArray, j_integral: FloatArray, j_coloured: IntArray,
    event_epoch: IntArray, event_kind: IntArray, event_sd: FloatArray, lever: FloatArray,
    second_order: bool,
    out_epoch: IntArray, out_before: IntArray, out_P: FloatArray, out_J: FloatArray,
) -> None:  # fmt: skip
    """Propagate a filter's covariance and the joint second moments through a scenario.

    epoch, samples: (S + 1,) of int, epochs at which something is asked for or a step ends, and
        samples of the step that leads there (none to the first).
    mid_matrix, mid_v, mid_lla: True attitude, velocity and position in the middle of each step.
    end_matrix, end_v, end_rate: Attitude, velocity and angular rate (body axes, rad/s) at each
        epoch.
    P, axis, ..., coloured: Of the filter, as in `gmwm.ins.filter.filter_arrays`.
    J, j_axis, ..., j_coloured: Of the joint vector; ``j_coloured`` are the places of the true
        coloured noise.
    event_epoch, ..., out_before: As in `gmwm.ins.filter.filter_arrays`.
    out_P: (K, 9 + m, 9 + m), out_J : (K, N, N), results.
    """
    n, size, m = P.shape[0], J.shape[0], axis.size
    F, A, B = np.zeros((9, 9)), np.zeros((9, 9)), np.zeros((9, 6))
    S, T, U, row = np.zeros((6, n)), np.zeros((9, n)), np.zeros((9, 6)), np.zeros(n)
    j_S, j_T, j_row = np.zeros((6, size)), np.zeros((9, size)), np.zeros(size)
    h, K, x = np.zeros(9), np.zeros(n), np.zeros(n)
    a, k = np.zeros(size), np.zeros(size)
    event = out = 0
    gathered = j_gathered = 0.0
    for s in range(epoch.size):
        count = samples[s]
        if count > 0:
            transition(mid_v[s], mid_lla[s], mid_matrix[s], count * dt, F, A, B)
            propagate(P, A, B, axis, partner, phi[count], phi_off[count], gain[count], noise[count],
                  noise_off[count], cross[count], integral[count], S, T, U, row)  # fmt: skip
            propagate(J, A, B, j_axis, j_partner, j_phi[count], j_phi_off[count], j_gain[count],
                  j_noise[count], j_noise_off[count], j_cross[count], j_integral[count],
                  j_S, j_T, U, j_row)  # fmt: skip
            if second_order:
                g = gravity(mid_lla[s, 0], mid_lla[s, 2])
                gathered = tilt_squared(P, g, count * dt, gathered)
                j_gathered = tilt_squared(J, g, count * dt, j_gathered)
        while out < out_epoch.size and out_epoch[out] == epoch[s] and out_before[out] == 1:
            out_P[out], out_J[out] = P, J
            out += 1
        attitude = P[6, 6] + P[7, 7] + P[8, 8] if second_order else 0.0
        j_attitude = J[6, 6] + J[7, 7] + J[8, 8] if second_order else 0.0
        while event < event_epoch.size and event_epoch[event] == epoch[s]:
            kind = event_kind[event]
            for component in range(1 if kind == IS_HEIGHT else 3):
                sd = event_sd[event, component]
                if not sd > 0.0:
                    continue
                measurement_row(kind, component, end_matrix[s], end_v[s], end_rate[s], lever, h)
                state = estimate = truth = -1
                if noise_state(kind, component, coloured) >= 0:
                    state = estimate = 9 + noise_state(kind, component, coloured)
                    truth = 9 + noise_state(kind, component, j_coloured)
                expected = sd * sd + excess(P, h, attitude)
                measurement_update(P, h, state, expected, 0.0, x, K)
                variance = sd * sd + excess(J, h, j_attitude)
                update_jointly(J, h, estimate, truth, variance, K, m, a, k)
            if kind in (IS_POSITION, IS_VELOCITY):
                gathered = j_gathered = 0.0
            event += 1
        while out < out_epoch.size and out_epoch[out] == epoch[s]:
            out_P[out], out_J[out] = P, J
            out += 1
