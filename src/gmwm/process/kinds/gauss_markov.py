"""Gauss-Markov processes of first and second order.

Both are sums of exponential autocovariances, of real or complex rates. The sampled process
with autocovariance exp(-a |k|) at lag k (a = dt/tau for Gauss-Markov) has

    S(f)  = dt coth(a/2) / (1 + sin^2(pi f dt) / sinh^2(a/2)),
    nu2_m = [2 m (sinh a - a) + h(m a)] / (8 m^2 sinh^2(a/2)),
    h(x)  = 2 x - 3 + 4 exp(-x) - exp(-2 x),

which is the AR(1) form of Zhang (2008, *Metrologia* 45, 549-561) rearranged into positive terms.
The textbook form subtracts numbers of order m a from each other and loses all digits as a -> 0;
here both terms are of third order in a and computed as such.
"""

import cmath
import math
from math import factorial
from typing import Any, ClassVar, Self

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.process.base import Process, Shape
from gmwm.process.parameter import parameter
from gmwm.process.spectral import squared_sine
from gmwm.process.state_space import StateSpace, first_order, from_state_space

_SERIES_BELOW = 0.5
_SINH_ARRAY = np.array([1.0 / factorial(2 * k + 1) for k in range(1, 9)])
_H_ARRAY = np.array([-((-1) ** k) * (2.0**k - 4.0) / factorial(k) for k in range(3, 22)])
_SLOW_BELOW = 1e-3
_WHITE_ABOVE = 40.0  # exp(-a) is below rounding: white noise
_SLOPE_STEP = 1e-5  # of a logarithm, for a central difference
_GRID_PER_DECADE = 8
_PEAK, _PEAK_AT = 0.618, 1.89  # of sigma and of tau: the top of the Allan deviation, IEEE Std 952


class GaussMarkov(Process):
    """First-order Gauss-Markov process, sampled exactly.

    Parameters
    ----------
    sigma : float, optional
        Stationary standard deviation, u.
    tau : float, optional
        Correlation time, s. At sampling interval dt it is an AR(1) with phi = exp(-dt/tau).
    """

    sigma: float = parameter("u", "scale", meaning="Gauss-Markov standard deviation")
    tau: float = parameter("s", meaning="Gauss-Markov correlation time")
    label: ClassVar[str] = "Gauss-Markov"
    short_name: ClassVar[str] = "GM"
    is_candidate: ClassVar[bool] = True
    ordered_by: ClassVar[str] = "tau"
    is_exponential: ClassVar[bool] = True
    _examples = (
        (0.5, 125.0),
        (1.5811388e-3, 125.0),
        (1.0, 0.5),
        (1.0, 20.0),
        (1.0, 1e5),
        (1.0, 1e7),
        (1.0, 1e9),
    )

    def __init__(self, sigma: float | None = None, tau: float | None = None) -> None:
        super().__init__(sigma, tau)

    @classmethod
    def of_peak(cls, deviation: float, averaging: float) -> Self:
        """The process whose Allan deviation has its top at a height (u) and a place (s)."""
        return cls(deviation / _PEAK, averaging / _PEAK_AT)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        return self.sigma**2 * _exponential_psd(dt / self.tau, f, dt)

    def unit_haar_variance(self, shape: Shape, tau: FloatArray, dt: float) -> FloatArray:
        return np.asarray(real_haar(dt / shape[0], tau / dt))

    def unit_haar_slopes(self, shape: Shape, tau: FloatArray, dt: float) -> FloatArray:
        return np.asarray(_real_slope(dt / shape[0], tau / dt))[:, None]

    def autocovariance(self, lag: FloatArray, dt: float) -> FloatArray:
        return self.sigma**2 * np.exp(-np.asarray(lag) * dt / self.tau)

    def state_space(self, dt: float) -> StateSpace:
        variance = self.sigma**2
        q = -variance * np.expm1(-2.0 * dt / self.tau)
        return StateSpace.scalar("Gauss-Markov", float(np.exp(-dt / self.tau)), float(q), variance)

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        series = rng.standard_normal(n)
        driving = self.sigma * np.sqrt(-np.expm1(-2.0 * dt / self.tau))
        first_order(series, float(np.exp(-dt / self.tau)), float(driving), self.sigma)
        return series

    def shape_grid(self, dt: float, n: int) -> list[Shape]:
        # Below a third of dt it is white noise; beyond a third of the record a random walk.
        low, high = np.log10(0.3 * dt), np.log10(max(n * dt / 3.0, dt))
        points = max(int(np.ceil((high - low) * _GRID_PER_DECADE)), 2)
        return [(float(tau),) for tau in np.logspace(low, high, points)]


class Resonance(Process):
    """Second-order Gauss-Markov process with complex poles (a damped resonance).

    Parameters
    ----------
    sigma : float, optional
        Stationary standard deviation, u.
    frequency : float, optional
        Undamped natural frequency f0, Hz.
    damping : float, optional
        Damping ratio zeta, between 0 and 1.

    Notes
    -----
    Autocovariance sigma^2 exp(-zeta w0 t) [cos(wd t) + (zeta w0/wd) sin(wd t)] for t >= 0 with
    w0 = 2 pi f0, wd = w0 sqrt(1 - zeta^2) (Gelb, *Applied Optimal Estimation*, 1974, sec. 2.2): two
    exponentials of complex rate, to which the formulas of the first order apply.
    """

    sigma: float = parameter("u", "scale", meaning="resonance standard deviation")
    frequency: float = parameter("Hz", meaning="resonance frequency")
    damping: float = parameter("-", upper=1.0, meaning="resonance damping ratio")
    label: ClassVar[str] = "resonance"
    prefix: ClassVar[str] = "resonance_"
    _examples = ((0.4, 0.2, 0.05), (2e-3, 0.01, 0.5), (1.0, 1e-4, 0.3), (1.0, 0.45, 0.9))

    def __init__(
        self,
        sigma: float | None = None,
        frequency: float | None = None,
        damping: float | None = None,
    ) -> None:
        super().__init__(sigma, frequency, damping)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        rate, weight = _exponential(self.frequency, self.damping, dt)
        return self.sigma**2 * np.real(weight * _exponential_psd(rate, f, dt))

    def unit_haar_variance(self, shape: Shape, tau: FloatArray, dt: float) -> FloatArray:
        return np.asarray(resonance_haar(*shape, dt, tau / dt))

    def autocovariance(self, lag: FloatArray, dt: float) -> FloatArray:
        rate, weight = _exponential(self.frequency, self.damping, dt)
        return self.sigma**2 * np.real(weight * np.exp(-rate * np.asarray(lag)))

    def state_space(self, dt: float) -> StateSpace:
        """States are the output and its derivative divided by 2 pi f0."""
        zeta, w0 = self.damping, 2.0 * np.pi * self.frequency
        wd = w0 * np.sqrt(1.0 - zeta**2)
        sine = np.sin(wd * dt) * w0 / wd
        cosine = np.cos(wd * dt)
        decay = np.exp(-zeta * w0 * dt)
        transition = decay * np.array([[cosine + zeta * sine, sine], [-sine, cosine - zeta * sine]])
        stationary = self.sigma**2 * np.eye(2)
        noise = stationary - transition @ stationary @ transition.T
        names = ("resonance", "resonance rate")
        return StateSpace.of(names, transition, 0.5 * (noise + noise.T), stationary)

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        return from_state_space(self.state_space(dt), n, rng)

    def shape_grid(self, dt: float, n: int) -> list[Shape]:
        low, high = np.log10(4.0 / (n * dt)), np.log10(0.45 / dt)
        points = max(int(np.ceil((high - low) * _GRID_PER_DECADE)), 2)
        return [
            (float(frequency), damping)
            for frequency in np.logspace(low, high, points)
            for damping in (0.01, 0.1, 0.5)
        ]


def _exponential_psd(rate: complex, f: FloatArray, dt: float) -> Any:
    """Two-sided spectrum of the unit-variance process, same shape as ``f``, in s."""
    half = 0.5 * rate
    if np.real(half) > 300.0:
        return np.full(np.shape(f), dt, dtype=np.result_type(half, float))
    s = np.sinh(half)
    return dt * np.cosh(half) * s / (s * s + squared_sine(f, dt))


@compiled()
def _exponential(frequency: float, damping: float, dt: float) -> tuple[complex, complex]:
    """Rate per sample and weight of one of the two conjugate exponentials of a resonance."""
    root = math.sqrt(1.0 - damping**2)
    rate = 2.0 * math.pi * frequency * dt * complex(damping, -root)
    return rate, complex(1.0, -damping / root)


@compiled()
def _sinh_excess(rate: Any) -> Any:
    """sinh(a) - a, real or complex."""
    if abs(rate) >= _SERIES_BELOW:
        return np.sinh(rate) - rate
    total = 0.0 * rate
    for k in range(_SINH_ARRAY.size - 1, -1, -1):
        total = total * rate * rate + _SINH_ARRAY[k]
    return total * (rate * rate * rate)


@compiled()
def _h(x: Any) -> Any:
    """2 x - 3 + 4 exp(-x) - exp(-2 x), real or complex."""
    if abs(x) >= _SERIES_BELOW:
        return 2.0 * x - 3.0 + 4.0 * np.exp(-x) - np.exp(-2.0 * x)
    total = 0.0 * x
    for k in range(_H_ARRAY.size - 1, -1, -1):
        total = total * x + _H_ARRAY[k]
    return total * (x * x * x)


@compiled()
def real_haar(rate: float, m: FloatArray) -> FloatArray:
    """Haar wavelet variance of the process of unit variance and a real rate, for inner loops.

    rate: a > 0.
    m: (J,), averaging times in samples.
    """
    result = np.empty(m.size)
    if rate > _WHITE_ABOVE:
        for i in range(m.size):
            result[i] = 0.5 / m[i]
        return result
    excess, scale = _sinh_excess(rate), 8.0 * math.sinh(0.5 * rate) ** 2
    for i in range(m.size):
        result[i] = (2.0 * m[i] * excess + _h(m[i] * rate)) / (m[i] * m[i] * scale)
    return result


@compiled()
def _real_slope(rate: float, m: FloatArray) -> FloatArray:
    """Derivative of `real_haar` by the logarithm of the correlation time, (J,)."""
    step = math.exp(_SLOPE_STEP)
    longer, shorter = real_haar(rate / step, m), real_haar(rate * step, m)
    for i in range(m.size):
        longer[i] = (longer[i] - shorter[i]) / (2.0 * _SLOPE_STEP)
    return longer


@compiled()
def resonance_haar(frequency: float, damping: float, dt: float, m: FloatArray) -> FloatArray:
    """Haar wavelet variance of a resonance of unit variance: of its conjugate exponentials.

    For m |rate| << 1, where their linear terms cancel, it is a polynomial in m by Faulhaber's sums,
    with the variogram v2 k^2 + v3 k^3 + v4 k^4 at lag k.
    """
    rate, weight = _exponential(frequency, damping, dt)
    result = np.empty(m.size)
    if rate.real > _WHITE_ABOVE:
        for i in range(m.size):
            result[i] = 0.5 * weight.real / m[i]
        return result
    excess, scale = _sinh_excess(rate), 8.0 * cmath.sinh(0.5 * rate) ** 2
    v2 = -(weight * rate**2).real
    v3 = (weight * rate**3).real / 3.0
    v4 = -(weight * rate**4).real / 12.0
    for i in range(m.size):
        if m[i] * abs(rate) < _SLOW_BELOW:
            cubic = 2.8 * m[i] ** 3 - 2.0 / 3.0 * m[i] - 2.0 / (15.0 * m[i])
            quartic = 4.0 * m[i] ** 4 - 2.0 * m[i] ** 2
            result[i] = v2 * m[i] ** 2 / 4.0 + (v3 * cubic + v4 * quartic) / 8.0
        else:
            whole = weight * (2.0 * m[i] * excess + _h(m[i] * rate))
            result[i] = (whole / (m[i] * m[i] * scale)).real
    return result
