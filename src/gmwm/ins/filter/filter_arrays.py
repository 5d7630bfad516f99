"""Arrays that the loop of the filter works on, by name."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.ins.filter.states import IntArray


class Sampled(NamedTuple):
    """IMU increments (N, 3), rad and m/s; s between them; samples per step of the covariance."""

    rotation: FloatArray
    velocity: FloatArray
    dt: float
    stride: int


class State(NamedTuple):
    """Attitude (3, 3), velocity, position, covariance (9 + m, 9 + m), sensor states (m,)."""

    C: FloatArray
    v: FloatArray
    lla: FloatArray
    P: FloatArray
    x: FloatArray


class Sensors(NamedTuple):
    """Of `gmwm.ins.filter.states.SensorStates`; the first state of each sensor (7,), any pairs."""

    first: IntArray
    paired: bool
    axis: IntArray
    output: FloatArray
    partner: IntArray
    phi: FloatArray
    phi_off: FloatArray
    gain: FloatArray
    noise: FloatArray
    noise_off: FloatArray
    cross: FloatArray
    integral: FloatArray


class Measured(NamedTuple):
    """Measurements in order of time, how they are taken, and what comes of each.

    epoch, kind: (E,).
    offset: (E,), their times less those of their epochs, s.
    value, sd: (E, 3).
    gate: (E,), normalised innovation squared beyond which one is rejected.
    coloured: (4,), state of the coloured noise of the north, east and down position and of the
        barometric height; -1 for none.
    lever: (3,), m.
    second_order: Whether products of errors are allowed for; see
        `gmwm.ins.filter.covariance_kernels.tilt_squared` and ``excess``.
    innovation, innovation_sd: (E, 3), overwritten; of each component given those before it.
    used: (E,), set to False where one was rejected.
    """

    epoch: IntArray
    kind: IntArray
    offset: FloatArray
    value: FloatArray
    sd: FloatArray
    gate: FloatArray
    coloured: IntArray
    lever: FloatArray
    second_order: bool
    innovation: FloatArray
    innovation_sd: FloatArray
    used: npt.NDArray[np.bool_]


class Kept(NamedTuple):
    """Epochs whose state is kept, in order of time, and that state, overwritten.

    before: (K,), 1 for the state before the measurements of the epoch, 0 for that after them; at
        one epoch those before come first.
    nav: (K, 6), position and velocity.
    C, P: (K, 3, 3), (K, 9, 9).
    sensor, sensor_covariance: (K, 6), (K, 6, 6), sums of sensor states and their covariance.
    """

    epoch: IntArray
    before: IntArray
    nav: FloatArray
    C: FloatArray
    P: FloatArray
    sensor: FloatArray
    sensor_covariance: FloatArray


class Room(NamedTuple):
    """Work space."""

    F: FloatArray
    A: FloatArray
    B: FloatArray
    S: FloatArray
    T: FloatArray
    U: FloatArray
    row: FloatArray
    C_mid: FloatArray
    v_mid: FloatArray
    lla_mid: FloatArray
    C_at: FloatArray
    v_at: FloatArray
    lla_at: FloatArray
    rate_at: FloatArray
    force_at: FloatArray
    h: FloatArray
    h_at: FloatArray
    gain: FloatArray
    error: FloatArray
    x_held: FloatArray
    P_held: FloatArray
    estimated_held: FloatArray


@compiled()
def room_for(n: int) -> Room:
    """Work space for n states, of which nine are those of navigation."""
    return Room(
        np.zeros((9, 9)), np.zeros((9, 9)), np.zeros((9, 6)),
        np.zeros((6, n)), np.zeros((9, n)), np.zeros((9, 6)), np.zeros(n),
        np.zeros((3, 3)), np.zeros(3), np.zeros(3),
        np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3),
        np.zeros(9), np.zeros(9), np.zeros(n),
        np.zeros(6), np.zeros(n - 9), np.zeros((n, n)), np.zeros(n),
    )  # fmt: skip
