"""Sensor states of a navigation filter: the coloured errors of six axes.

Every term of a model is a block of one or two states, propagated exactly over k samples, so that a
correlation time may be shorter than the step of the covariance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.filter.records import SensorTable
from gmwm.ins.sensors import AXES, SensorModels
from gmwm.process import GaussMarkov, Model, StateSpace

_LARGEST_BLOCK = 2
_NO_AXIS = -1  # of a state that adds to no inertial sensor


@dataclass(frozen=True, eq=False)
class SensorStates:
    """The m states of six sensors before the first sample, and what samples do to them.

    names: E.g. ``"gyro_x: Gauss-Markov"``.
    mean: (m,), zero except for drifts that are known.
    covariance: (m, m).
    table: See `SensorTable`.
    """

    names: tuple[str, ...]
    mean: FloatArray
    covariance: FloatArray
    table: SensorTable

    @property
    def m(self) -> int:
        """Number of states."""
        return len(self.names)

    @property
    def sums(self) -> FloatArray:
        """Matrix (6, m) that adds up the states of each sensor."""
        return np.where(self.table.axis == np.arange(6)[:, None], self.table.output, 0.0)

    @classmethod
    def of(
        cls,
        sensors: SensorModels,
        dt: float,
        k_max: int,
        drift_known: bool = False,
        slow: tuple[tuple[str, float, float], ...] = (),
    ) -> SensorStates:
        """States of six models at a sampling interval of ``dt`` (s).

        A drift is a constant slope with a standard deviation of its size: how a sensor drifts
        depends on when it was switched on, and a calibration knows how fast, but not which way.

        drift_known: Whether drifts start at zero and have their slopes exactly, as simulated ones
            do.
        slow: First-order Gauss-Markov states that add to no inertial sensor, after the others:
            name, standard deviation and correlation time (s); constants where the first is zero.
        Raises InputError if a term has no state-space form, or one of more than two states.
        """
        given = tuple((sensors.models[axis], sensors.bias_sd[axis]) for axis in AXES)
        return _states(given, dt, k_max, drift_known, slow)


@lru_cache(maxsize=8)
def _states(
    given: tuple[tuple[Model, float], ...],
    dt: float,
    k_max: int,
    drift_known: bool,
    slow: tuple[tuple[str, float, float], ...],
) -> SensorStates:
    """States of models and standard deviations of biases; kept, since logs are filtered often."""
    blocks: list[tuple[int, StateSpace]] = []
    white = np.zeros(6)
    for i, (model, bias_sd) in enumerate(given):
        forms, white[i] = _blocks(AXES[i], model, bias_sd**2, dt, drift_known)
        blocks += [(i, form) for form in forms]
    for name, sigma, tau in slow:
        constant = StateSpace.scalar(name, 1.0, 0.0, 0.0)
        blocks.append((_NO_AXIS, GaussMarkov(sigma, tau).state_space(dt) if sigma else constant))
    m = sum(form.n_states for _, form in blocks)
    phi, phi_off, gain, noise, noise_off, cross = (np.zeros((k_max + 1, m)) for _ in range(6))
    axis, partner = np.zeros(m, dtype=np.int64), np.arange(m)
    output, mean, covariance = np.zeros(m), np.zeros(m), np.zeros((m, m))
    integral = np.arange(k_max + 1)[:, None] * (white * dt**2)
    first = 0
    for sensor, form in blocks:
        size = form.n_states
        part = slice(first, first + size)
        axis[part] = sensor
        partner[part] = first + np.arange(size)[::-1]
        mean[part], covariance[part, part] = form.initial_mean, form.initial_covariance
        transition, added = _after_samples(form, dt, k_max)
        phi[:, part] = np.diagonal(transition, axis1=1, axis2=2)[:, :size]
        noise[:, part] = np.diagonal(added, axis1=1, axis2=2)[:, :size]
        if size == _LARGEST_BLOCK:
            phi_off[:, part] = np.stack([transition[:, 0, 1], transition[:, 1, 0]], axis=1)
            noise_off[:, part] = added[:, :1, 1]
        if sensor != _NO_AXIS:
            output[part], gain[:, part] = form.output, transition[:, size, :size]
            cross[:, part] = added[:, size, :size]
            integral[:, sensor] += added[:, size, size]
        first += size
    paired = bool(np.any(partner != np.arange(m)))
    steps = (phi, phi_off, gain, noise, noise_off, cross, integral)
    names = [f"{AXES[i]}: {name}" for i, form in blocks if i >= 0 for name in form.names]
    names += [name for name, _, _ in slow]
    return SensorStates(
        tuple(names), mean, covariance, SensorTable(paired, axis, output, partner, *steps)
    )


def _blocks(
    axis: str, model: Model, bias: float, dt: float, drift_known: bool
) -> tuple[list[StateSpace], float]:
    """Terms with states, a constant of variance ``bias`` too, and variance of the white noise."""
    blocks, white = [], 0.0
    for term in model.terms:
        form = term.state_space(dt)
        white += form.measurement_noise
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
        blocks.append(form)
    if bias > 0.0:
        blocks.append(StateSpace.scalar("bias", 1.0, 0.0, bias))
    return blocks, white


def _after_samples(form: StateSpace, dt: float, k_max: int) -> tuple[FloatArray, FloatArray]:
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
