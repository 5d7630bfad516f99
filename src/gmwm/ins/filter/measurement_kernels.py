"""Measurements of the navigation filter: what they depend on, and their residuals."""

from __future__ import annotations

import math

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.ins.filter.states import IntArray
from gmwm.ins.geometry import radii_at

KINDS = (0, 1, 2, 3)
IS_POSITION, IS_VELOCITY, IS_HEIGHT, IS_STANDSTILL = KINDS
"""Kinds of measurements."""


@compiled()
def measurement_row(
    kind: int, component: int, C: FloatArray, v: FloatArray, rate: FloatArray, lever: FloatArray,
    h: FloatArray,
) -> None:  # fmt: skip
    """Fill the row h (9,) of one component of a measurement.

    C, v: Attitude and velocity.
    rate: (3,), angular rate, body axes, rad/s.
    lever: (3,), from the IMU to the antenna, body axes, m.
    """
    for i in range(9):
        h[i] = 0.0
    if kind == IS_HEIGHT:
        h[2] = -1.0
        return
    if kind == IS_POSITION:
        h[component] = 1.0
        x, y, z = lever[0], lever[1], lever[2]
        base = 0.0
    else:
        h[3 + component] = 1.0
        base = 1.0
        x = rate[1] * lever[2] - rate[2] * lever[1]
        y = rate[2] * lever[0] - rate[0] * lever[2]
        z = rate[0] * lever[1] - rate[1] * lever[0]
        if kind == IS_STANDSTILL:
            x = y = z = 0.0
    # An error phi of the attitude moves a vector a by a x phi.
    a = base * v[0] + C[0, 0] * x + C[0, 1] * y + C[0, 2] * z
    b = base * v[1] + C[1, 0] * x + C[1, 1] * y + C[1, 2] * z
    c = base * v[2] + C[2, 0] * x + C[2, 1] * y + C[2, 2] * z
    if component == 0:
        h[7], h[8] = -c, b
    elif component == 1:
        h[6], h[8] = c, -a
    else:
        h[6], h[7] = -b, a


@compiled()
def residual(
    kind: int, component: int, value: FloatArray, C: FloatArray, v: FloatArray, lla: FloatArray,
    rate: FloatArray, lever: FloatArray,
) -> float:  # fmt: skip
    """Estimate less measurement, of one component, m or m/s."""
    if kind == IS_HEIGHT:
        return lla[2] - value[0]
    if kind == IS_STANDSTILL:
        return v[component] - value[component]
    if kind == IS_VELOCITY:
        x = rate[1] * lever[2] - rate[2] * lever[1]
        y = rate[2] * lever[0] - rate[0] * lever[2]
        z = rate[0] * lever[1] - rate[1] * lever[0]
        moved = C[component, 0] * x + C[component, 1] * y + C[component, 2] * z
        return v[component] + moved - value[component]
    arm = 0.0
    for i in range(3):
        arm += C[component, i] * lever[i]
    if component == 2:
        return arm - (lla[2] - value[2])
    meridian, transverse = radii_at(math.sin(lla[0]))
    if component == 0:
        return (meridian + lla[2]) * (lla[0] - value[0]) + arm
    east = lla[1] - value[1]
    east -= 2.0 * math.pi * math.floor(east / (2.0 * math.pi) + 0.5)
    return (transverse + lla[2]) * math.cos(lla[0]) * east + arm


@compiled()
def noise_state(kind: int, component: int, coloured: IntArray) -> int:
    """State of the coloured noise of a component of a measurement; -1 for none."""
    if kind == IS_POSITION:
        return coloured[component]
    if kind == IS_HEIGHT:
        return coloured[3]
    return -1
