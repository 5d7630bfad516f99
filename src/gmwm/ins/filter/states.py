"""Sensor states of a navigation filter: those of the coloured errors of six axes.

Every term of a model is a block of one or two states. Over k samples a block is propagated exactly:
its transition, its noise, the angle or velocity that it adds to the integrals of the sensor, and
the covariance of that with the states. So a correlation time may be shorter than the step of the
covariance, as that of an analogue filter in front of the sampler is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.imu import AXES, SensorModels
from gmwm.process import Model, StateSpace

IntArray = npt.NDArray[np.int64]

_LARGEST_BLOCK = 2
NO_AXIS = -1
"""Axis of a state that adds to no inertial sensor."""


@dataclass(frozen=True, eq=False)
class SensorStates:
    """m states of the six sensors, and what k samples do to them, for k = 0..k_max.

    names: E.g. ``"gyro_x: Gauss-Markov"``.
    axis: (m,) of int, sensor of `AXES` that each state adds to; `NO_AXIS` for none.
    output: (m,), fraction of the state in the error of its sensor.
    partner: (m,) of int, the other state of its block; itself if there is none.
    mean: (m,), before the first sample; zero but for drifts that are known.
    covariance: (m, m).
    phi, phi_off: (k_max + 1, m), ``x_i <- phi_i x_i + phi_off_i x_partner`` over k samples.
    gain: (k_max + 1, m), integral of the sensor's error over k samples per unit of the state, s.
    noise, noise_off: (k_max + 1, m), variance of the noise gathered over k samples, and its
        covariance with the partner.
    cross: (k_max + 1, m), covariance of that noise with the noise in the integral of the sensor's
        error.
    integral: (k_max + 1, 6), variance of the noise in the integral of each sensor's error, white
        noise included.
    """

    names: tuple[str, ...]
    axis: IntArray
    output: FloatArray
    partner: IntArray
    mean: FloatArray
    covariance: FloatArray
    phi: FloatArray
    phi_off: FloatArray
    gain: FloatArray
    noise: FloatArray
    noise_off: FloatArray
    cross: FloatArray
    integral: FloatArray

    @property
    def m(self) -> int:
        """Number of states."""
        return len(self.names)

    @classmethod
    def of(
        cls, sensors: SensorModels, dt: float, k_max: int, drift_known: bool = False
    ) -> SensorStates:
        """States of six models at a sampling interval of ``dt`` (s).

        A drift is a constant slope with a standard deviation of its size: how a sensor drifts
        depends on when it was switched on, and a calibration knows how fast, but not which way.

        drift_known: Whether drifts start at zero and have their slopes exactly, as simulated ones
            do.
        Raises InputError if a term has no state-space form, or one of more than two states.
        """
        given = tuple((sensors.models[axis], sensors.bias_sd[axis]) for axis in AXES)
        return _of(given, dt, k_max, drift_known)

    def with_markov(
        self, names: Sequence[str], sigma: FloatArray, tau: FloatArray | float, dt: float
    ) -> SensorStates:
        """These states, and some first-order Gauss-Markov ones that add to no inertial sensor.

        sigma: Standard deviation of each.
        tau: Correlation times, s.
        dt: Sampling interval, s.
        """
        k = np.arange(len(self.phi))[:, None]
        extra, zeros = len(names), np.zeros((len(self.phi), len(names)))
        decay = np.exp(-k * dt / tau) + zeros
        return SensorStates(
            names=(*self.names, *names),
            axis=np.append(self.axis, np.full(extra, NO_AXIS)),
            output=np.append(self.output, np.zeros(extra)),
            partner=np.append(self.partner, self.m + np.arange(extra)),
            mean=np.append(self.mean, np.zeros(extra)),
            covariance=block_diag(self.covariance, np.diag(np.asarray(sigma, dtype=float) ** 2)),
            phi=np.hstack([self.phi, decay]),
            phi_off=np.hstack([self.phi_off, zeros]),
            gain=np.hstack([self.gain, zeros]),
            noise=np.hstack([self.noise, np.asarray(sigma) ** 2 * (1.0 - decay**2)]),
            noise_off=np.hstack([self.noise_off, zeros]),
            cross=np.hstack([self.cross, zeros]),
            integral=self.integral,
        )


@dataclass(frozen=True, eq=False)
class _Block:
    """A term of a model: one or two states of one sensor."""

    axis: int
    names: tuple[str, ...]
    form: StateSpace


@lru_cache(maxsize=8)
def _of(
    given: tuple[tuple[Model, float], ...], dt: float, k_max: int, drift_known: bool
) -> SensorStates:
    """Of models and standard deviations of biases: faults of a log are looked for with the same."""
    blocks: list[_Block] = []
    white = np.zeros(6)
    for i, (model, bias_sd) in enumerate(given):
        blocks += _of_axis(i, model, bias_sd**2, dt, white, drift_known)
    return _assembled(blocks, white, dt, k_max)


def _of_axis(
    index: int, model: Model, bias: float, dt: float, white: FloatArray, drift_known: bool
) -> list[_Block]:
    """Blocks of one sensor; adds its white noise (variance of a sample) to ``white``."""
    axis, blocks = AXES[index], []
    for term in model.terms:
        form = term.state_space(dt)
        white[index] += form.measurement_noise
        if form.n_states > _LARGEST_BLOCK:
            raise InputError(
                f"{axis}: {term!r} needs {form.n_states} states in a filter, more than two: "
                "approximate it by Gauss-Markov processes"
            )
        if form.n_states == 0:
            continue
        if term.is_walk and bias > 0.0:
            # A constant and a random walk are one state: the walk starts where the constant is.
            form = StateSpace.scalar(form.names[0], 1.0, float(form.process_noise[0, 0]), bias)
            bias = 0.0
        if term.is_drift and not drift_known:
            # A constant and a drift are one block: the drift starts where the constant is.
            spread = np.diag([bias, term.drift_rate() ** 2])
            form = replace(form, initial_mean=np.zeros(2), initial_covariance=spread)
            bias = 0.0
        blocks.append(_Block(index, tuple(f"{axis}: {name}" for name in form.names), form))
    if bias > 0.0:
        blocks.append(_Block(index, (f"{axis}: bias",), StateSpace.scalar("bias", 1.0, 0.0, bias)))
    return blocks


def _assembled(blocks: Sequence[_Block], white: FloatArray, dt: float, k_max: int) -> SensorStates:
    m = sum(block.form.n_states for block in blocks)
    shape = (k_max + 1, m)
    phi, phi_off, gain, noise, noise_off, cross = (np.zeros(shape) for _ in range(6))
    axis, partner = np.zeros(m, dtype=np.int64), np.arange(m)
    output, mean, covariance = np.zeros(m), np.zeros(m), np.zeros((m, m))
    integral = np.arange(k_max + 1)[:, None] * (white * dt**2)
    first = 0
    for block in blocks:
        size = block.form.n_states
        part = slice(first, first + size)
        axis[part] = block.axis
        partner[part] = first + np.arange(size)[::-1]
        output[part], mean[part] = block.form.output, block.form.initial_mean
        covariance[part, part] = block.form.initial_covariance
        transition, added = _carried(block.form, dt, k_max)
        phi[:, part] = np.diagonal(transition, axis1=1, axis2=2)[:, :size]
        gain[:, part] = transition[:, size, :size]
        noise[:, part] = np.diagonal(added, axis1=1, axis2=2)[:, :size]
        cross[:, part] = added[:, size, :size]
        integral[:, block.axis] += added[:, size, size]
        if size == _LARGEST_BLOCK:
            phi_off[:, part] = np.stack([transition[:, 0, 1], transition[:, 1, 0]], axis=1)
            noise_off[:, part] = added[:, :1, 1]
        first += size
    return SensorStates(
        names=tuple(name for block in blocks for name in block.names),
        axis=axis,
        output=output,
        partner=partner,
        mean=mean,
        covariance=covariance,
        phi=phi,
        phi_off=phi_off,
        gain=gain,
        noise=noise,
        noise_off=noise_off,
        cross=cross,
        integral=integral,
    )


def _carried(form: StateSpace, dt: float, k_max: int) -> tuple[FloatArray, FloatArray]:
    """Transition and noise of the states and of the integral of their output, after k samples."""
    size = form.n_states
    one = np.eye(size + 1)
    one[:size, :size] = form.transition
    one[size, :size] = form.output * dt
    added = np.zeros_like(one)
    added[:size, :size] = form.process_noise
    transition, noise = (np.zeros((k_max + 1, *one.shape)) for _ in range(2))
    transition[0] = np.eye(size + 1)
    for k in range(k_max):
        transition[k + 1] = one @ transition[k]
        noise[k + 1] = one @ noise[k] @ one.T + added
    return transition, noise
