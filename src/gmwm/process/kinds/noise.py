"""The terms of IEEE Std 952: white, quantization, walk, ramp, bias instability, sinusoid.

Letters and definitions follow IEEE Std 952-2020, annex C. The spectra are those of the sampled
processes, so that closed forms and simulations agree at every averaging time, not only in the
limit of many samples.
"""

from typing import ClassVar

import numpy as np
from scipy.special import digamma

from gmwm._core.typing import FloatArray
from gmwm.process.base import Process, Shape
from gmwm.process.parameter import parameter
from gmwm.process.spectral import circulant, squared_sine
from gmwm.process.state_space import StateSpace
from gmwm.process.wavelets import wavelet as filters

_LINES_PER_DECADE = 100


class WhiteNoise(Process):
    """White noise (angle or velocity random walk).

    Parameters
    ----------
    N : float, optional
        Root power spectral density, u/sqrt(Hz). At sampling interval dt the variance is N^2/dt.
    """

    N: float = parameter("u/sqrt(Hz)", "scale", meaning="white noise")
    label: ClassVar[str] = "white noise"
    short_name: ClassVar[str] = "N"
    is_candidate: ClassVar[bool] = True
    is_white: ClassVar[bool] = True
    _examples = ((0.2,), (1e-4,))

    def __init__(self, N: float | None = None) -> None:
        super().__init__(N)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        return np.full_like(f, self.N**2)

    def haar_variance(self, tau: FloatArray, dt: float) -> FloatArray:
        return 0.5 * self.N**2 / np.asarray(tau, dtype=float)

    def autocovariance(self, lag: FloatArray, dt: float) -> FloatArray:
        return np.where(np.asarray(lag) == 0, self.N**2 / dt, 0.0)

    def state_space(self, dt: float) -> StateSpace:
        return StateSpace.white(self.N**2 / dt)

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        series = rng.standard_normal(n)
        series *= self.N / np.sqrt(dt)
        return series


class QuantizationNoise(Process):
    """Quantization noise: the first difference of a white sequence.

    Parameters
    ----------
    Q : float, optional
        Root mean square of the quantized angle or velocity, u s. The series is Q/dt times the
        first difference of sqrt(12) U(0, 1); its Allan variance is 3 Q^2/tau^2.
    """

    Q: float = parameter("u s", "scale", meaning="quantization noise")
    label: ClassVar[str] = "quantization noise"
    short_name: ClassVar[str] = "Q"
    is_candidate: ClassVar[bool] = True
    _examples = ((0.7,), (3e-5,))

    def __init__(self, Q: float | None = None) -> None:
        super().__init__(Q)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        return 4.0 * self.Q**2 / dt * squared_sine(f, dt)

    def haar_variance(self, tau: FloatArray, dt: float) -> FloatArray:
        return 1.5 * self.Q**2 / np.asarray(tau, dtype=float) ** 2

    def autocovariance(self, lag: FloatArray, dt: float) -> FloatArray:
        lag = np.asarray(lag)
        return (self.Q / dt) ** 2 * np.where(lag == 0, 2.0, np.where(lag == 1, -1.0, 0.0))

    def state_space(self, dt: float) -> StateSpace:
        names = ("quantization", "quantization, previous")
        shift, noise = np.array([[0.0, 0.0], [1.0, 0.0]]), np.diag([1.0, 0.0])
        output = np.array([1.0, -1.0]) * self.Q / dt
        return StateSpace.of(names, shift, noise, np.eye(2), output=output)

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        return np.sqrt(12.0) * self.Q / dt * np.diff(rng.random(n + 1))


class RandomWalk(Process):
    """Random walk (rate or acceleration random walk); starts at zero.

    Parameters
    ----------
    K : float, optional
        u/s/sqrt(Hz). The variance of the increment over dt is K^2 dt.
    """

    K: float = parameter("u/s/sqrt(Hz)", "scale", meaning="random walk")
    label: ClassVar[str] = "random walk"
    short_name: ClassVar[str] = "K"
    is_candidate: ClassVar[bool] = True
    is_walk: ClassVar[bool] = True
    _examples = ((0.02,), (5e-7,))

    def __init__(self, K: float | None = None) -> None:
        super().__init__(K)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        return 0.25 * (self.K * dt) ** 2 / squared_sine(f, dt)

    def haar_variance(self, tau: FloatArray, dt: float) -> FloatArray:
        tau = np.asarray(tau, dtype=float)
        return self.K**2 * (tau / 6.0 + dt * (dt / tau) / 12.0)

    def state_space(self, dt: float) -> StateSpace:
        return StateSpace.scalar("random walk", 1.0, self.K**2 * dt, 0.0)

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        steps = rng.standard_normal(n)
        steps[0] = 0.0
        return self.K * np.sqrt(dt) * np.cumsum(steps)


class RateRamp(Process):
    """Rate ramp: a deterministic drift, zero at the first sample.

    Parameters
    ----------
    R : float, optional
        Slope, u/s, signed.
    """

    R: float = parameter("u/s", "slope", lower=-np.inf, meaning="rate ramp")
    label: ClassVar[str] = "rate ramp"
    short_name: ClassVar[str] = "R"
    is_drift: ClassVar[bool] = True
    _examples = ((0.003,), (-1e-8,))

    def __init__(self, R: float | None = None) -> None:
        super().__init__(R)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        return np.zeros_like(f)

    def drift_rate(self) -> float:
        return float(self.R)

    def haar_variance(self, tau: FloatArray, dt: float) -> FloatArray:
        return 0.25 * (self.R * np.asarray(tau, dtype=float)) ** 2

    def wavelet_variance(self, tau: FloatArray, dt: float, wavelet: str = "haar") -> FloatArray:
        if wavelet == "haar" or filters(wavelet).vanishing_moments == 1:
            return self.haar_variance(tau, dt)
        return np.zeros(np.shape(tau))

    def state_space(self, dt: float) -> StateSpace:
        transition = np.array([[1.0, dt], [0.0, 1.0]])
        return StateSpace.of(("ramp", "ramp rate"), transition, mean=[0.0, self.R])

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        return self.R * dt * np.arange(n, dtype=float)


class BiasInstability(Process):
    """Bias instability: flicker noise, S(f) = B^2/(2 pi f) at low frequencies; starts at zero.

    Parameters
    ----------
    B : float, optional
        u. The Allan variance levels off at (2 ln 2/pi) B^2.

    Notes
    -----
    The sampled process is fractionally integrated white noise of order 1/2 (Hosking 1981,
    *Biometrika* 68, 165-176; Kasdin 1995, *Proc. IEEE* 83, 802-827), S(f) = B^2 dt / (2 sin(pi f
    dt)). Its variogram is the finite sum (4 B^2/pi) O(k), O(k) = 1 + 1/3 + ... + 1/(2k - 1), from
    which the wavelet variance of averaging time m dt follows as (B^2/pi) [2 (O(2m) - O(m)) +
    (4 O(m) - O(2m))/(8 m^2)]: B^2/pi at m = 1, (ln 2/pi) B^2 in the limit.
    """

    B: float = parameter("u", "scale", meaning="bias instability")
    label: ClassVar[str] = "bias instability"
    short_name: ClassVar[str] = "B"
    is_flicker: ClassVar[bool] = True
    has_finite_state_space: ClassVar[bool] = False

    states_per_decade: ClassVar[int] = 2
    """Density of the Gauss-Markov bank in the state-space form."""
    _examples = ((0.3,), (2e-5,))

    def __init__(self, B: float | None = None) -> None:
        super().__init__(B)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        return 0.5 * self.B**2 * dt / np.sin(np.pi * f * dt)

    def haar_variance(self, tau: FloatArray, dt: float) -> FloatArray:
        m = np.asarray(tau, dtype=float) / dt
        single, double = _odd_harmonic(m), _odd_harmonic(2.0 * m)
        bracket = 2.0 * (double - single) + (4.0 * single - double) / (8.0 * m**2)
        return self.B**2 / np.pi * bracket

    def state_space(self, dt: float, *, span: float = 1e6) -> StateSpace:
        """A bank of Gauss-Markov processes that stands for 1/f over ``span * dt``.

        Flicker noise has no finite state space. A continuum of Gauss-Markov processes with
        variance B^2/pi per unit of ln(tau) has exactly its low-frequency spectrum; here it is
        sampled at ``states_per_decade`` correlation times per decade.
        """
        n_states = int(np.ceil(np.log10(span) * self.states_per_decade)) + 1
        tau = dt * np.logspace(-0.5, np.log10(span), n_states)
        variance = self.B**2 / np.pi * np.log(tau[1] / tau[0])
        phi, noise = np.exp(-dt / tau), -variance * np.expm1(-2.0 * dt / tau)
        names = [f"flicker {value:.3g} s" for value in tau]
        initial, output = variance * np.eye(n_states), np.ones(n_states)
        return StateSpace.of(names, np.diag(phi), np.diag(noise), initial, output=output)

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        # Exact: the increments are stationary with autocovariance -(4 B^2/pi)/(4 k^2 - 1).
        if n == 1:
            return np.zeros(1)
        lag = np.arange(n + 1)
        covariance = -4.0 / np.pi / (4.0 * lag**2 - 1.0)
        eigenvalues = np.fft.rfft(np.concatenate([covariance, covariance[-2:0:-1]])).real
        path = np.cumsum(circulant(np.maximum(eigenvalues, 0.0), n, rng))
        return self.B * (path - path[0])


class Sinusoid(Process):
    """A periodic line of constant amplitude and random phase (IEEE Std 952, sinusoidal noise).

    Parameters
    ----------
    amplitude : float, optional
        u.
    frequency : float, optional
        Hz; what lies above 1/(2 dt) is aliased.
    """

    amplitude: float = parameter("u", "scale", meaning="line amplitude")
    frequency: float = parameter("Hz", meaning="line frequency")
    label: ClassVar[str] = "sinusoid"
    prefix: ClassVar[str] = "sinusoid_"
    is_line: ClassVar[bool] = True
    _examples = ((1.0, 0.00565), (0.1, 0.203))

    def __init__(self, amplitude: float | None = None, frequency: float | None = None) -> None:
        super().__init__(amplitude, frequency)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        """Zero: all of the variance is in the line, see `lines`."""
        return np.zeros_like(f)

    def lines(self) -> tuple[tuple[float, float], ...]:
        return ((float(self.frequency), float(self.amplitude)),)

    def haar_variance(self, tau: FloatArray, dt: float) -> FloatArray:
        m, frequency = np.asarray(tau, dtype=float) / dt, self.frequency * dt
        alias = abs(frequency - np.rint(frequency))
        x = np.pi * m * alias
        # sin(x)^2 / (m sin(pi f)), the ratio written through sinc so that f -> 0 stays exact.
        ratio = x * np.sinc(x / np.pi) ** 2 / np.sinc(alias)
        return np.asarray(0.5 * self.amplitude**2 * ratio**2)

    def autocovariance(self, lag: FloatArray, dt: float) -> FloatArray:
        phase = 2.0 * np.pi * self.frequency * dt * np.asarray(lag)
        return 0.5 * self.amplitude**2 * np.cos(phase)

    def state_space(self, dt: float) -> StateSpace:
        angle = 2.0 * np.pi * self.frequency * dt
        rotation = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        names = ("line, in phase", "line, in quadrature")
        return StateSpace.of(names, rotation, initial=0.5 * self.amplitude**2 * np.eye(2))

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        cycles = self.frequency * dt * np.arange(n) + rng.random()
        return self.amplitude * np.cos(2.0 * np.pi * cycles)

    def shape_grid(self, dt: float, n: int) -> list[Shape]:
        # The gain's lobes at coarse levels make many local minima: the grid is finer than they are
        # where the line is seen at all.
        low, high = np.log10(2.0 / (n * dt)), np.log10(0.5 / dt)
        points = max(int(np.ceil((high - low) * _LINES_PER_DECADE)), 2)
        return [(float(frequency),) for frequency in np.logspace(low, high, points)]


def _odd_harmonic(k: FloatArray) -> FloatArray:
    """1 + 1/3 + ... + 1/(2k - 1), continued to real k."""
    return np.asarray(0.5 * (digamma(k + 0.5) - digamma(0.5)))
