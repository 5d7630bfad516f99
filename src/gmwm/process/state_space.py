"""Linear state-space form of an error process, as a Kalman filter wants it."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray

_BLOCK = 100_000  # samples: the noise of more would fill the memory


@dataclass(frozen=True, eq=False)
class StateSpace:
    """``x[k+1] = F x[k] + w[k]``, ``y[k] = h' x[k] + v[k]`` at a fixed sampling interval.

    Attributes
    ----------
    transition : (p, p) ndarray
        F.
    process_noise : (p, p) ndarray
        Covariance of w.
    output : (p,) ndarray
        h.
    measurement_noise : float
        Variance of v (white noise of the channel), in u^2.
    initial_mean : (p,) ndarray
        Mean of x[0]; not zero only for a rate ramp.
    initial_covariance : (p, p) ndarray
        Stationary covariance of the stationary states; zero for a random walk and a rate ramp,
        which start at zero.
    names : tuple of str
        One name per state.
    """

    transition: FloatArray
    process_noise: FloatArray
    output: FloatArray
    measurement_noise: float
    initial_mean: FloatArray
    initial_covariance: FloatArray
    names: tuple[str, ...]

    @property
    def n_states(self) -> int:
        """Number of states p."""
        return len(self.names)

    @classmethod
    def of(
        cls,
        names: Sequence[str],
        transition: FloatArray,
        noise: FloatArray | None = None,
        initial: FloatArray | None = None,
        *,
        output: Sequence[float] | FloatArray | None = None,
        mean: Sequence[float] | None = None,
        measurement_noise: float = 0.0,
    ) -> Self:
        """States without noise that start at zero, and whose output is the first, but as given."""
        p = len(names)
        return cls(
            np.reshape(np.asarray(transition, dtype=float), (p, p)),
            np.zeros((p, p)) if noise is None else np.reshape(noise, (p, p)),
            np.eye(1, p)[0] if output is None else np.asarray(output, dtype=float),
            measurement_noise,
            np.zeros(p) if mean is None else np.asarray(mean, dtype=float),
            np.zeros((p, p)) if initial is None else np.reshape(initial, (p, p)),
            tuple(names),
        )

    @classmethod
    def white(cls, variance: float) -> Self:
        """No states, measurement noise only."""
        return cls.of((), np.zeros(0), output=(), measurement_noise=variance)

    @classmethod
    def scalar(cls, name: str, phi: float, q: float, p0: float) -> Self:
        """One state with transition ``phi``, driving variance ``q``, initial variance ``p0``."""
        return cls.of((name,), np.array([phi]), np.array([q]), np.array([p0]))

    @classmethod
    def stack(cls, parts: Sequence[Self]) -> Self:
        """The state space of a sum of independent processes."""
        return cls(
            block_diagonal([part.transition for part in parts]),
            block_diagonal([part.process_noise for part in parts]),
            np.concatenate([part.output for part in parts]),
            float(sum(part.measurement_noise for part in parts)),
            np.concatenate([part.initial_mean for part in parts]),
            block_diagonal([part.initial_covariance for part in parts]),
            tuple(numbered_names([name for part in parts for name in part.names])),
        )

    def output_variance(self, n: int) -> FloatArray:
        """Variance of ``y[0..n-1]`` about its mean, shape (n,), in u^2."""
        covariance = self.initial_covariance.copy()
        variance = np.empty(n)
        for k in range(n):
            variance[k] = self.output @ covariance @ self.output + self.measurement_noise
            covariance = self.transition @ covariance @ self.transition.T + self.process_noise
        return variance


def block_diagonal(blocks: Sequence[FloatArray]) -> FloatArray:
    """Square blocks on the diagonal, zeros elsewhere; a tenth of the time of scipy's."""
    size = sum(len(block) for block in blocks)
    result = np.zeros((size, size))
    start = 0
    for block in blocks:
        end = start + len(block)
        result[start:end, start:end] = block
        start = end
    return result


def numbered_names(names: Sequence[str], joint: str = " ") -> list[str]:
    """Names that occur more than once get a number, in order."""
    seen: Counter[str] = Counter()
    total = Counter(names)
    result = []
    for name in names:
        seen[name] += 1
        result.append(f"{name}{joint}{seen[name]}" if total[name] > 1 else name)
    return result


@compiled()
def first_order(innovation: FloatArray, phi: float, scale: float, start: float) -> None:
    """In place: x[0] = start * e[0], x[k] = phi x[k-1] + scale * e[k]."""
    state = start * innovation[0]
    innovation[0] = state
    for k in range(1, innovation.size):
        state = phi * state + scale * innovation[k]
        innovation[k] = state


@compiled()
def _propagate(
    transition: FloatArray,
    noise_root: FloatArray,
    output: FloatArray,
    state: FloatArray,
    noise: FloatArray,
    series: FloatArray,
) -> None:
    p = state.size
    following = np.empty(p)
    for k in range(series.size):
        total = 0.0
        for i in range(p):
            total += output[i] * state[i]
        series[k] = total
        for i in range(p):
            value = 0.0
            for j in range(p):
                value += transition[i, j] * state[j] + noise_root[i, j] * noise[k, j]
            following[i] = value
        for i in range(p):
            state[i] = following[i]


def _root(covariance: FloatArray) -> FloatArray:
    """A square root of a positive semi-definite matrix."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def from_state_space(form: StateSpace, n: int, rng: np.random.Generator) -> FloatArray:
    """A series of the model ``form``."""
    state = form.initial_mean + _root(form.initial_covariance) @ rng.standard_normal(form.n_states)
    root = _root(form.process_noise)
    series = np.empty(n)
    for start in range(0, n, _BLOCK):
        part = series[start : start + _BLOCK]
        noise = rng.standard_normal((part.size, form.n_states))
        _propagate(form.transition, root, form.output, state, noise, part)
    if form.measurement_noise > 0.0:
        series += np.sqrt(form.measurement_noise) * rng.standard_normal(n)
    return series
