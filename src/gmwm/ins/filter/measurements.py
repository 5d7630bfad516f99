"""Kinds of measurements: each a class beside its kernel, registered in one table at the end.

A new kind takes a kernel and a class here, its line in `MEASUREMENTS` and `observe`, and its
paragraph in docs/navigation.md.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray
from gmwm.errors import InputError
from gmwm.ins.filter.records import Keyframe, Kinematics, set_kinematics
from gmwm.ins.geometry import (
    matrix_from_rotation_vector,
    matrix_from_rpy,
    ned_difference,
    offset,
    radii_at,
    rpy_from_matrix,
)
from gmwm.ins.increments import Imu
from gmwm.ins.trajectory.trajectory import Trajectory

if TYPE_CHECKING:
    from gmwm.ins.filter.aiding import Aiding


class Instrument(NamedTuple):
    """What measures on a simulated vehicle: at some epochs, on an arm (3,) from the IMU, m.

    imu: Error-free, for the antenna's velocity about the IMU.
    """

    trajectory: Trajectory
    epochs: IntArray
    arm: FloatArray
    imu: Imu | None

    @property
    def before(self) -> IntArray:
        """Epoch of the keyframe before each."""
        return np.append(0, self.epochs[:-1])


class Measurement:
    """A kind of measurement of up to three components.

    Its kernel fills the row h (9,) of the navigation errors and returns estimate less measurement.

    name: Of the kind, in `Fixes` and in files.
    is_gnss: Whether an outage removes it: GNSS, poses and odometry.
    is_relative: Whether it relates the pose to that at the one before, the keyframe.
    is_inferred: Whether it is inferred rather than measured: it is always gated, and never used
        against the filter.
    components: How many of the three columns of values it has.
    slow_names: States of its slow noise, one a component, if it can have any.
    """

    name: ClassVar[str]
    is_gnss: ClassVar[bool] = False
    is_inferred: ClassVar[bool] = False
    is_relative: ClassVar[bool] = False
    components: ClassVar[int] = 3
    slow_names: ClassVar[tuple[str, ...]] = ()

    @staticmethod
    def slow_noise(aiding: Aiding) -> tuple[FloatArray, float]:
        """Standard deviation (3,) and correlation time (s) of its Gauss-Markov noise."""
        return np.zeros(3), 1.0

    @staticmethod
    def moved(value: FloatArray, by: FloatArray) -> FloatArray:
        """Values moved by errors ``by``, (E, 3), in their unit: m, m/s or rad along three axes."""
        return value + by

    @staticmethod
    def along(where: Instrument) -> FloatArray:
        """Error-free values, (E, 3)."""
        return np.zeros((where.epochs.size, 3))


@compiled()
def observe_position(
    component: int, value: FloatArray, at: Kinematics, lever: FloatArray, h: FloatArray
) -> float:
    """Latitude, longitude and height of the antenna, as metres to the north, east and down."""
    lla = at.lla
    arm = _to_navigation(at.C, lever[0], lever[1], lever[2])
    h[component] = 1.0
    _add_turned(component, arm, h)
    if component == 2:
        return arm[2] - (lla[2] - value[2])
    meridian, transverse = radii_at(math.sin(lla[0]))
    if component == 0:
        return (meridian + lla[2]) * (lla[0] - value[0]) + arm[0]
    east = lla[1] - value[1]
    east -= 2.0 * math.pi * math.floor(east / (2.0 * math.pi) + 0.5)
    return (transverse + lla[2]) * math.cos(lla[0]) * east + arm[1]


class Position(Measurement):
    """GNSS position: latitude, longitude (rad) and height (m) of the antenna."""

    name = "position"
    is_gnss = True
    slow_names = ("GNSS north", "GNSS east", "GNSS down")

    @staticmethod
    def slow_noise(aiding: Aiding) -> tuple[FloatArray, float]:
        return np.asarray(aiding.coloured_sd), aiding.coloured_tau

    @staticmethod
    def moved(value: FloatArray, by: FloatArray) -> FloatArray:
        return offset(value, by)

    @staticmethod
    def along(where: Instrument) -> FloatArray:
        truth, index = where.trajectory, where.epochs
        return offset(truth.lla[index], matrix_from_rpy(truth.rpy[index]) @ where.arm)


@compiled()
def observe_velocity(
    component: int,
    value: FloatArray,
    at: Kinematics,
    rate: FloatArray,
    lever: FloatArray,
    h: FloatArray,
) -> float:
    """Velocity of a point on the lever, which turns about the IMU."""
    x = rate[1] * lever[2] - rate[2] * lever[1]
    y = rate[2] * lever[0] - rate[0] * lever[2]
    z = rate[0] * lever[1] - rate[1] * lever[0]
    a, b, c = _to_navigation(at.C, x, y, z)
    v = (at.v[0] + a, at.v[1] + b, at.v[2] + c)
    h[3 + component] = 1.0
    _add_turned(component, v, h)
    return v[component] - value[component]


class Velocity(Measurement):
    """GNSS velocity of the antenna to the north, east and down, m/s."""

    name = "velocity"
    is_gnss = True

    @staticmethod
    def along(where: Instrument) -> FloatArray:
        truth, index, arm, imu = where
        velocity = truth.velocity[index]
        if not np.any(arm):
            return velocity
        if imu is None:
            raise InputError("velocity fixes with a lever arm need rates: give imu, without errors")
        matrix, rate = matrix_from_rpy(truth.rpy[index]), imu.rotation[index - 1] / imu.dt
        return np.asarray(velocity + np.einsum("kij,kj->ki", matrix, np.cross(rate, arm)))


class Height(Measurement):
    """Height of a barometer, m, in the first column; its slow noise is that of the weather."""

    name = "height"
    components = 1
    slow_names = ("barometer",)

    @staticmethod
    def slow_noise(aiding: Aiding) -> tuple[FloatArray, float]:
        return np.array([aiding.barometer_sd, 0.0, 0.0]), aiding.barometer_tau

    @staticmethod
    def moved(value: FloatArray, by: FloatArray) -> FloatArray:
        return value + np.where(np.arange(3) == 0, by, 0.0)

    @staticmethod
    def along(where: Instrument) -> FloatArray:
        return np.where(np.arange(3) == 0, where.trajectory.lla[where.epochs, 2:], 0.0)


class Standstill(Measurement):
    """Zero velocity of a vehicle at rest; values are zero, or how much a simulated one shakes."""

    name = "standstill"
    is_inferred = True


@compiled()
def _turned(component: int, C: FloatArray, rpy: FloatArray) -> float:
    """Component of the small rotation by which C (3, 3) is off measured roll, pitch and yaw."""
    sr, sp, sy = math.sin(rpy[0]), math.sin(rpy[1]), math.sin(rpy[2])
    cr, cp, cy = math.cos(rpy[0]), math.cos(rpy[1]), math.cos(rpy[2])
    rows = (
        (cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy),
        (cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy),
        (-sp, sr * cp, cr * cp),
    )
    i, j = (component + 1) % 3, (component + 2) % 3
    total = 0.0
    for k in range(3):
        total += C[i, k] * rows[j][k] - C[j, k] * rows[i][k]
    return 0.5 * total


class Attitude(Measurement):
    """Roll, pitch and yaw of an absolute pose, rad; errors are turns about north, east, down."""

    name = "attitude"
    is_gnss = True

    @staticmethod
    def moved(value: FloatArray, by: FloatArray) -> FloatArray:
        return rpy_from_matrix(matrix_from_rotation_vector(-by) @ matrix_from_rpy(value))

    @staticmethod
    def along(where: Instrument) -> FloatArray:
        return where.trajectory.rpy[where.epochs]


class Odometer(Measurement):
    """Velocity of the IMU forward, right and down, m/s: wheels that roll and do not slip."""

    name = "odometer"
    is_gnss = True

    @staticmethod
    def along(where: Instrument) -> FloatArray:
        matrix = matrix_from_rpy(where.trajectory.rpy[where.epochs])
        return np.einsum("kji,kj->ki", matrix, where.trajectory.velocity[where.epochs])


class Displacement(Measurement):
    """Way since the keyframe, in its body axes, m; short against the Earth."""

    name = "displacement"
    is_gnss = is_relative = True

    @staticmethod
    def along(where: Instrument) -> FloatArray:
        truth = where.trajectory
        matrix = matrix_from_rpy(truth.rpy[where.before])
        way = ned_difference(truth.lla[where.epochs], truth.lla[where.before])
        return np.einsum("kji,kj->ki", matrix, way)


class Rotation(Measurement):
    """Turn since the keyframe, as roll, pitch and yaw, rad; errors are about its body axes."""

    name = "rotation"
    is_gnss = is_relative = True
    moved = Attitude.moved

    @staticmethod
    def along(where: Instrument) -> FloatArray:
        before, now = (
            matrix_from_rpy(where.trajectory.rpy[k]) for k in (where.before, where.epochs)
        )
        return rpy_from_matrix(np.swapaxes(before, 1, 2) @ now)


@compiled()
def observe_since(
    kind: int, component: int, value: FloatArray, at: Kinematics, since: Keyframe, h: FloatArray
) -> float:
    """Fill the row h (n,) of a relative measurement; returns estimate less measurement.

    The pose at the keyframe has states of its own, a stochastic clone (Roumeliotis & Burdick 2002,
    "Stochastic cloning", *IEEE ICRA*): position and attitude errors from ``since.first`` on.
    """
    C, first = since.pose.C, since.first
    x, y, z = C[0, component], C[1, component], C[2, component]
    h[:] = 0.0
    if kind == _ROTATION:
        turn = np.zeros((3, 3))
        for i in range(3):
            for j in range(3):
                for k in range(3):
                    turn[i, j] += C[k, i] * at.C[k, j]
        h[6], h[7], h[8] = x, y, z
        h[first + 3], h[first + 4], h[first + 5] = -x, -y, -z
        return _turned(component, turn, value)
    lla = since.pose.lla
    meridian, transverse = radii_at(math.sin(lla[0]))
    north = (meridian + lla[2]) * (at.lla[0] - lla[0])
    east = (transverse + lla[2]) * math.cos(lla[0]) * (at.lla[1] - lla[1])
    down = lla[2] - at.lla[2]
    h[0], h[1], h[2] = x, y, z
    h[first], h[first + 1], h[first + 2] = -x, -y, -z
    h[first + 3], h[first + 4] = z * east - y * down, x * down - z * north
    h[first + 5] = y * north - x * east
    return x * north + y * east + z * down - value[component]


@compiled()
def new_keyframe(P: FloatArray, at: Kinematics, since: Keyframe, sign: float) -> None:
    """Make a pose the keyframe: its states are copies of the navigation errors, times a sign."""
    set_kinematics(since.pose, at, 1.0)
    for i in range(6):
        own = i if i < 3 else i + 3
        for j in range(P.shape[0]):
            P[since.first + i, j] = sign * P[own, j]
    for i in range(6):
        own = i if i < 3 else i + 3
        for j in range(P.shape[0]):
            P[j, since.first + i] = sign * P[j, own]


@compiled()
def _to_navigation(C: FloatArray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Components of a vector of the body to the north, east and down."""
    a = C[0, 0] * x + C[0, 1] * y + C[0, 2] * z
    b = C[1, 0] * x + C[1, 1] * y + C[1, 2] * z
    return a, b, C[2, 0] * x + C[2, 1] * y + C[2, 2] * z


@compiled()
def _add_turned(component: int, v: tuple[float, float, float], h: FloatArray) -> None:
    """Add the effect of an attitude error phi on a vector, which it moves by v x phi."""
    i, j = (component + 1) % 3, (component + 2) % 3
    h[6 + i], h[6 + j] = -v[j], v[i]


# -- table of all kinds ----------------------------------------------------------------------------

MEASUREMENTS: tuple[type[Measurement], ...] = (
    *(Position, Velocity, Height, Standstill, Attitude, Odometer, Displacement, Rotation),
)
"""All kinds; a kind's place is its code in the kernels."""

KINDS = {each.name: code for code, each in enumerate(MEASUREMENTS)}
"""Name of a kind -> its code."""

IS_GNSS = np.array([each.is_gnss for each in MEASUREMENTS])  # by code
IS_INFERRED = np.array([each.is_inferred for each in MEASUREMENTS])
IS_RELATIVE = np.array([each.is_relative for each in MEASUREMENTS])
_ROTATION = KINDS["rotation"]


@compiled()
def observe(
    kind: int,
    component: int,
    value: FloatArray,
    at: Kinematics,
    rate: FloatArray,
    lever: FloatArray,
    h: FloatArray,
) -> float:
    """Fill the row h (n,) of one component of a measurement; returns estimate less measurement.

    kind: Code of `KINDS`; relative ones: `observe_since`.
    rate, lever: (3,), angular rate, rad/s, and antenna from the IMU, m, body axes.
    """
    h[:] = 0.0
    if kind == 0:
        return observe_position(component, value, at, lever, h)
    if kind == 1:
        return observe_velocity(component, value, at, rate, lever, h)
    if kind == 2:
        h[2] = -1.0  # errors are counted downwards
        return at.lla[2] - value[0]
    if kind == 4:
        h[6 + component] = 1.0
        return _turned(component, at.C, value)
    if kind == 5:
        # The attitude error turns the velocity along: the modified velocity error alone shows.
        h[3], h[4], h[5] = at.C[0, component], at.C[1, component], at.C[2, component]
        return h[3] * at.v[0] + h[4] * at.v[1] + h[5] * at.v[2] - value[component]
    return observe_velocity(component, value, at, np.zeros(3), lever, h)
