"""Navigation by an IMU alone, with the steps of the filter."""

import numpy as np
from numba import njit

from gmwm._core.typing import FloatArray
from gmwm.ins import Imu, NavState, Trajectory
from gmwm.ins.filter.filter_kernels import step
from gmwm.ins.filter.records import Increments, Kinematics, Samples, set_matrix, set_vector
from gmwm.ins.geometry import matrix_from_rpy, orthonormalise, rpy_from_matrix


@njit
def _run(
    samples: Samples, at: Kinematics, lla: FloatArray, velocity: FloatArray, C: FloatArray
) -> None:
    """Fill the epochs after the first one, where the solution is ``at``."""
    a, f = samples.rotation, samples.velocity
    now = Increments(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(a.shape[0]):
        before = now
        now = Increments(a[i, 0], a[i, 1], a[i, 2], f[i, 0], f[i, 1], f[i, 2])
        step(at, now, now if i == 0 else before, samples.dt)
        if (i + 1) % 1000 == 0:
            orthonormalise(at.C)
        set_vector(lla[i + 1], at.lla)
        set_vector(velocity[i + 1], at.v)
        set_matrix(C[i + 1], at.C)


def integrate(imu: Imu, initial: NavState) -> Trajectory:
    """Free inertial navigation: nothing but an IMU and where it started."""
    lla, velocity = np.empty((imu.n + 1, 3)), np.empty((imu.n + 1, 3))
    matrix = np.empty((imu.n + 1, 3, 3))
    lla[0], velocity[0], matrix[0] = initial.lla, initial.velocity, matrix_from_rpy(initial.rpy)
    at = Kinematics(matrix[0].copy(), initial.velocity.copy(), initial.lla.copy())
    _run(Samples(imu.rotation, imu.velocity, imu.dt), at, lla, velocity, matrix)
    rpy = rpy_from_matrix(matrix)
    rpy[0] = initial.rpy
    return Trajectory(imu.dt, lla, velocity, rpy)
