"""Records of arrays that the kernels of the filter take."""

from typing import NamedTuple

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import BoolArray, FloatArray, IntArray


@compiled()
def set_vector(into: FloatArray, of: FloatArray) -> None:
    """Copy the first elements; numba takes seconds to compile assignments of arrays."""
    for i in range(into.size):
        into[i] = of[i]


@compiled()
def set_matrix(into: FloatArray, of: FloatArray) -> None:
    """Copy the upper left corner."""
    for i in range(into.shape[0]):
        for j in range(into.shape[1]):
            into[i, j] = of[i, j]


class Kinematics(NamedTuple):
    """Attitude C_bn (3, 3), velocity (3,) and position (3,): latitude, longitude, height."""

    C: FloatArray
    v: FloatArray
    lla: FloatArray


@compiled()
def set_kinematics(into: Kinematics, of: Kinematics, share: float) -> None:
    """Go a share of the way from one to another, in place."""
    rest = 1.0 - share
    for i in range(3):
        into.v[i] = rest * into.v[i] + share * of.v[i]
        into.lla[i] = rest * into.lla[i] + share * of.lla[i]
        for j in range(3):
            into.C[i, j] = rest * into.C[i, j] + share * of.C[i, j]


class Keyframe(NamedTuple):
    """Pose that relative measurements begin at, and the first of its six states in a covariance.

    first: -1 if there are none.
    """

    pose: Kinematics
    first: int


class Increments(NamedTuple):
    """Integrals of angular rate (rad) and specific force (m/s) over an interval, body axes."""

    ax: float
    ay: float
    az: float
    fx: float
    fy: float
    fz: float


class Samples(NamedTuple):
    """Increments of an IMU, (N, 3), rad and m/s, and its sampling interval, s."""

    rotation: FloatArray
    velocity: FloatArray
    dt: float


class SensorTable(NamedTuple):
    """m sensor states, and what k samples do to them, for k = 0..k_max.

    paired: Whether there are blocks of two states.
    axis: (m,), sensor that each state adds to; -1 for none.
    output: (m,), fraction of the state in the error of its sensor.
    partner: (m,), the other state of its block; itself if there is none.
    phi, phi_off: (k_max + 1, m), ``x_i <- phi_i x_i + phi_off_i x_partner`` over k samples.
    gain: (k_max + 1, m), integral of the sensor's error over k samples per unit of the state, s.
    noise, noise_off: (k_max + 1, m), variance of the noise added over k samples, and its
        covariance with the partner.
    cross: (k_max + 1, m), covariance of that noise with the noise in the integral.
    integral: (k_max + 1, 6), variance of the noise in the integral of each sensor's error, white
        noise included.
    """

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


class Transition(NamedTuple):
    """Equation of the navigation errors and its solution over a step.

    F: (9, 9), the equation's matrix.
    A: (9, 9), transition of the navigation errors.
    B: (9, 6), navigation error per unit of integrated sensor error (rad, m/s).
    """

    F: FloatArray
    A: FloatArray
    B: FloatArray


@compiled()
def new_transition() -> Transition:
    """Room for a transition."""
    return Transition(np.zeros((9, 9)), np.zeros((9, 9)), np.zeros((9, 6)))


class FilterState(NamedTuple):
    """Solution, covariance (9 + m, 9 + m) and sensor states (m,) of a filter at one epoch."""

    at: Kinematics
    P: FloatArray
    x: FloatArray


class Settings(NamedTuple):
    """How a filter is set up.

    noise_states: (kinds, 3), sensor state of the slow noise of each component of each kind of
        measurement; -1 for none.
    lever: (3,), m.
    second_order: Whether products of errors are allowed for. Without it the filter is linear: too
        sure of its vertical channel where gyros are poor and accelerometers good, and of what
        precise fixes say after a long outage; see `tilt_squared` and `excess`.
    stride: Samples per step of the covariance.
    """

    table: SensorTable
    noise_states: IntArray
    lever: FloatArray
    second_order: bool
    stride: int


class Events(NamedTuple):
    """Measurements of all kinds in order of time.

    epoch: (E,), nearest epoch of the IMU.
    kind: (E,), codes of `KINDS`.
    offset: (E,), time of the measurement less that of its epoch, s.
    value, sd: (E, 3).
    gate: (E,), normalised innovation squared beyond which it is rejected; infinite for none.
    """

    epoch: IntArray
    kind: IntArray
    offset: FloatArray
    value: FloatArray
    sd: FloatArray
    gate: FloatArray


class Innovated(NamedTuple):
    """What comes of each measurement, overwritten.

    value, sd: (E, 3), innovation of each component given those before it.
    used: (E,), False where it was rejected.
    """

    value: FloatArray
    sd: FloatArray
    used: BoolArray


class Kept(NamedTuple):
    """Epochs that are kept, see `Outputs`, and the estimates there; zeros at first.

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


class RunPlace(NamedTuple):
    """Where a run is, so that it can pause and go on; zeros at first.

    place: (4,), epoch, event, kept epoch, steps of the covariance.
    rejected: (kinds,), measurements of each kind that were rejected in a row.
    carry: (7,), increments of the sample before, and root mean square of `tilt_squared`.
    since: The last keyframe, overwritten.
    """

    place: IntArray
    rejected: IntArray
    carry: FloatArray
    since: Keyframe
