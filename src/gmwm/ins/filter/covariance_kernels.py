"""Kernels that propagate and update the covariance of navigation and sensor errors.

The navigation errors are, in this order: position to the north, east and down (m), modified
velocity error (m/s) and attitude (rad), estimate less truth. The modified velocity error is
``u = dv - v x phi``: that which is left when the error of the velocity's direction, which the
attitude error makes, is subtracted. In its equations gravity stands where the specific force would,
so that they do not depend on how the vehicle manoeuvres between two steps (Scherzinger & Reid 1994,
"Modified strapdown inertial navigator error models", *IEEE PLANS*). The errors of the sensor states
follow, truth less estimate.
"""

import math

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.ins.filter.records import Kinematics, SensorTable, Transition
from gmwm.ins.geometry import RATE, gravity_at, radii_at

VELOCITY, ATTITUDE, NAVIGATION = 3, 6, 9  # first of each kind of error, and how many there are
_FAST = {"contract", "reassoc", "nsz"}


@compiled()
def error_rates(v: FloatArray, lla: FloatArray, F: FloatArray) -> None:
    """Fill F (9, 9) of the navigation errors' equation ``dx/dt = F x + ...``."""
    vn, ve, vd = v[0], v[1], v[2]
    sine, cosine = math.sin(lla[0]), math.cos(lla[0])
    tangent = sine / cosine
    meridian, transverse = radii_at(sine)
    north, east = 1.0 / (meridian + lla[2]), 1.0 / (transverse + lla[2])
    wn, wd = RATE * cosine, -RATE * sine
    rn, re, rd = ve * east, -vn * north, -ve * tangent * east
    g = gravity_at(sine, lla[2])
    F[:] = 0.0
    # Position.
    F[0, 0], F[0, 2] = -vd * north, vn * north
    F[1, 0], F[1, 1], F[1, 2] = ve * tangent * north, -vd * east - vn * tangent * north, ve * east
    F[0, 3] = F[1, 4] = F[2, 5] = 1.0
    F[0, 7], F[0, 8] = -vd, ve
    F[1, 6], F[1, 8] = vd, -vn
    F[2, 6], F[2, 7] = -ve, vn
    # Velocity: Coriolis, gravity with height, Earth rate with latitude, gravity with tilt, Earth
    # rate with attitude.
    an, ae, ad = 2.0 * wn + rn, re, 2.0 * wd + rd
    F[3, 4], F[3, 5] = ad, -ae
    F[4, 3], F[4, 5] = -ad, an
    F[5, 3], F[5, 4] = ae, -an
    F[5, 2] = 2.0 * g * math.sqrt(north * east)
    F[3, 0], F[4, 0], F[5, 0] = -ve * wn * north, (vd * wd + vn * wn) * north, -ve * wd * north
    F[3, 6], F[3, 7], F[3, 8] = vd * wd, g - ve * wn, -vd * wn
    F[4, 6], F[4, 7] = -g, vd * wd + vn * wn
    F[5, 6], F[5, 7], F[5, 8] = -vn * wd, -ve * wd, vn * wn
    # Attitude; its velocity error is u + v x phi.
    F[6, 4], F[7, 3], F[8, 4] = east, -north, -tangent * east
    F[6, 0], F[6, 2] = wd * north, ve * east * east
    F[7, 2] = -vn * north * north
    F[8, 0] = -wn * north - ve * east * north / (cosine * cosine)
    F[8, 2] = -ve * tangent * east * east
    F[6, 6], F[6, 7], F[6, 8] = vd * east, wd + rd, -re - vn * east
    F[7, 6], F[7, 7], F[7, 8] = -wd - rd, vd * north, wn + rn - ve * north
    F[8, 6], F[8, 7] = re - tangent * vd * east, -wn - rn
    F[8, 8] = tangent * vn * east


@compiled(fastmath=_FAST)
def transition(at: Kinematics, step: float, into: Transition) -> None:
    """Fill the transition of the navigation errors over a step, and the effect of the sensors.

    into: Overwritten; A is ``I + F step + F^2 step^2 / 2``, and sensor errors act as if made in the
        middle of the step.
    """
    C, v, lla = at
    F, A, B = into
    error_rates(v, lla, F)
    half = 0.5 * step
    for i in range(9):
        for j in range(9):
            A[i, j] = F[i, j] * step
        for k in range(9):
            factor = F[i, k] * (half * step)
            if factor != 0.0:
                for j in range(9):
                    A[i, j] += factor * F[k, j]
        A[i, i] += 1.0
    vn, ve, vd = v[0], v[1], v[2]
    for j in range(3):
        a, b, c = C[0, j], C[1, j], C[2, j]
        p, q, r = ve * c - vd * b, vd * a - vn * c, vn * b - ve * a
        for i in range(9):
            B[i, j] = half * (
                F[i, 3] * p + F[i, 4] * q + F[i, 5] * r - F[i, 6] * a - F[i, 7] * b - F[i, 8] * c
            )
            B[i, 3 + j] = half * (F[i, 3] * a + F[i, 4] * b + F[i, 5] * c)
        B[3, j] += p
        B[4, j] += q
        B[5, j] += r
        B[6, j] -= a
        B[7, j] -= b
        B[8, j] -= c
        B[3, 3 + j] += a
        B[4, 3 + j] += b
        B[5, 3 + j] += c


@compiled(fastmath=_FAST)
def propagate(P: FloatArray, change: Transition, table: SensorTable, samples: int) -> None:
    """Propagate a covariance (9 + m, 9 + m) over a step of some samples, in place."""
    A, B = change.A, change.B
    axis, partner, paired = table.axis, table.partner, table.paired
    phi, phi_off, gain = table.phi[samples], table.phi_off[samples], table.gain[samples]
    noise, noise_off = table.noise[samples], table.noise_off[samples]
    cross, integral = table.cross[samples], table.integral[samples]
    n = P.shape[0]
    m = n - 9
    S, T, U, row = np.zeros((6, n)), np.empty((9, n)), np.empty((9, 6)), np.empty(m)
    for i in range(m):
        a = axis[i]
        if a >= 0:
            factor = gain[i]
            for j in range(n):
                S[a, j] += factor * P[9 + i, j]
    for i in range(9):
        # Sums of fixed length are unrolled, and the loop about them is vectorised.
        for j in range(n):
            total = 0.0
            for k in range(9):
                total += A[i, k] * P[k, j]
            for a in range(6):
                total += B[i, a] * S[a, j]
            T[i, j] = total
        for a in range(6):
            U[i, a] = B[i, a] * integral[a]
    for k in range(m):
        a = axis[k]
        if a >= 0:
            for i in range(9):
                U[i, a] += T[i, 9 + k] * gain[k]
    # Sensor states among themselves: rows, then columns, of the upper half; partners are
    # neighbours, so that what a pair needs below the diagonal is done with it.
    for i in range(m):
        p = partner[i]
        if p == i:
            for j in range(i, m):
                P[9 + i, 9 + j] *= phi[i]
        elif i < p:
            for j in range(i, m):
                a, b = P[9 + i, 9 + j], P[9 + p, 9 + j]
                P[9 + i, 9 + j] = phi[i] * a + phi_off[i] * b
                P[9 + p, 9 + j] = phi[p] * b + phi_off[p] * a
    for i in range(m):
        if paired:
            for j in range(m):
                row[j] = P[9 + i, 9 + j]
        for j in range(i, m):
            P[9 + i, 9 + j] *= phi[j]
        if paired:
            for j in range(i, m):
                if partner[j] != j:
                    P[9 + i, 9 + j] += row[partner[j]] * phi_off[j]
        P[9 + i, 9 + i] += noise[i]
        if partner[i] > i:
            P[9 + i, 9 + partner[i]] += noise_off[i]
        # Copied, because products in another order differ in their last digit.
        for j in range(i):
            P[9 + i, 9 + j] = P[9 + j, 9 + i]
    # Navigation errors with sensor states, and among themselves.
    for i in range(9):
        for j in range(m):
            P[i, 9 + j] = T[i, 9 + j] * phi[j]
        if paired:
            for j in range(m):
                if partner[j] != j:
                    P[i, 9 + j] += T[i, 9 + partner[j]] * phi_off[j]
        for j in range(m):
            if axis[j] >= 0:
                P[i, 9 + j] += B[i, axis[j]] * cross[j]
            P[9 + j, i] = P[i, 9 + j]
    for i in range(9):
        for j in range(i, 9):
            total = 0.0
            for k in range(9):
                total += T[i, k] * A[j, k]
            for a in range(6):
                total += U[i, a] * B[j, a]
            P[i, j] = total
            P[j, i] = total


@compiled()
def tilt_squared(P: FloatArray, g: float, step: float, gathered: float) -> float:
    """Add the square of the tilt error over a step, which a linear filter does not know.

    Specific force resolved with a tilt error phi falls short of gravity by ``g phi^2 / 2``. With
    poor gyros and good accelerometers that exceeds the vertical error of a linear filter. The
    filter linearises about its estimate: given the horizontal errors it predicts ``g phi^2``, twice
    the shortfall. The rest is ``-g phi^2 / 2`` given them and ``+g phi^2 / 2`` without, so no mean
    is subtracted; its mean square is the same in both cases and follows from the covariance of the
    tilt (Jazwinski 1970, *Stochastic Processes and Filtering Theory*, sec. 9.3). The tilt hardly
    changes from step to step, so root mean squares add up, not squares, until a GNSS fix corrects
    it; heights and standstills do not show it.

    P: (n, n), changed in place: variance of the vertical velocity error.
    gathered: Root mean square of the velocity error of this kind since the last GNSS fix, m/s.
    Returns: ``gathered`` after the step.
    """
    north, east, both = P[6, 6], P[7, 7], P[6, 7]
    fourth = (north + east) ** 2 + 2.0 * (north * north + east * east) + 4.0 * both * both
    after = gathered + 0.5 * g * math.sqrt(fourth) * step
    P[5, 5] += after * after - gathered * gathered
    return after


@compiled()
def excess(P: FloatArray, h: FloatArray, attitude: float) -> float:
    """Variance to add to a measurement for the products of errors a linear filter leaves out.

    A linear filter leaves out the second term of the rotation by phi, ``phi x (phi x f)/2`` after
    ``phi x f``: its position and velocity errors are wrong by half an attitude error times
    themselves. After a long outage that is far more than the noise of a precise fix; after a few
    fixes, little is left of it.

    attitude: Variance of the three axes together before the measurements of the epoch, rad^2.
    """
    total = 0.0
    for i in range(9):
        if h[i] != 0.0:
            for j in range(9):
                total += h[i] * P[i, j] * h[j]
    return 0.25 * attitude * total


@compiled(fastmath=_FAST)
def measurement_update(
    P: FloatArray, h: FloatArray, variance: float, z: float, x: FloatArray, K: FloatArray
) -> tuple[float, float]:
    """Update by one scalar measurement ``z = h x + noise``, in place.

    P: (n, n).
    h: (n,), with -1 for a state of coloured measurement noise.
    variance: Of the white noise of the measurement.
    z: Estimate less measurement.
    x: (n,), errors estimated so far at this epoch.
    K: (n,), work space; holds the gain after the call.
    Returns: innovation, variance.
    """
    n = P.shape[0]
    K[:] = 0.0
    for i in range(h.size):
        factor = h[i]
        if factor != 0.0:
            for j in range(n):
                K[j] += factor * P[i, j]
    total = variance
    innovation = z
    for i in range(h.size):
        total += h[i] * K[i]
        innovation -= h[i] * x[i]
    # By its root, so that the product of two gains is the same both ways: P stays symmetric.
    # Joseph's form costs twice as much and adds nothing: rounding errors are 1e-16 of the variance
    # before, and after a long time without fixes `excess` keeps that after it far above them.
    root = 1.0 / math.sqrt(total)
    for i in range(n):
        K[i] *= root
    for i in range(n):
        for j in range(n):
            P[i, j] -= K[i] * K[j]
    for i in range(n):
        K[i] *= root
        x[i] += K[i] * innovation
    return innovation, total
