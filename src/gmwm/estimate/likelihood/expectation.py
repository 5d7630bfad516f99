"""The E step: second moments of the states given all samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.estimate.likelihood.kalman import smooth
from gmwm.estimate.likelihood.likelihood import Columns, Regression, started
from gmwm.process import StateSpace


@dataclass(frozen=True, eq=False)
class Expectation:
    """What the M step needs.

    later, cross, earlier: (p, p), sums over k of E x[k+1] x[k+1]', E x[k+1] x[k]' and E x[k] x[k]'.
    first: (p, p), e x[0] x[0]'.
    start, later_sum, earlier_sum: (p,), e x[0] and the sums of E x[k+1] and E x[k].
    steps: Number of transitions, n - 1.
    residual: Sum of the expected squares of the measurement noise.
    count: Number of samples that are not missing.
    log_likelihood: Of the parameters that the expectation was taken under.
    """

    later: FloatArray
    cross: FloatArray
    earlier: FloatArray
    first: FloatArray
    start: FloatArray
    later_sum: FloatArray
    earlier_sum: FloatArray
    steps: int
    residual: float
    count: int
    log_likelihood: float
    regression: Regression


def expect(
    columns: Columns,
    space: StateSpace,
    initial: FloatArray | None = None,
    drive: FloatArray | None = None,
) -> Expectation:
    """Smooth the series under a state space, with the regressors' coefficients integrated out.

    initial, drive: (p,), mean of the first state and constant input of each step; zero by default.
    """
    y, p = columns.matrix, space.n_states
    n, m = y.shape
    starts, inputs = np.zeros((m, p)), np.zeros((m, p))
    if initial is not None:
        starts[0] = initial
    if drive is not None:
        inputs[0] = drive
    x, c, d, v, s = smooth(
        space.transition,
        space.process_noise,
        space.output,
        space.measurement_noise,
        started(space),
        y,
        starts,
        inputs,
    )
    present = np.isfinite(s)
    innovations = v[present] / np.sqrt(s[present])[:, None]
    regression = Regression.of(innovations.T @ innovations)
    weights = np.concatenate([[1.0], -regression.beta])
    mean = np.einsum("c,kci->ki", weights, x)
    # What is not known of the coefficients adds to the covariance of the states.
    root = np.linalg.cholesky(regression.covariance) if m > 1 else np.zeros((0, 0))
    spread = np.einsum("kci,ce->kei", x[:, 1:], root)

    def second(a: slice, b: slice, covariance: FloatArray) -> FloatArray:
        total = mean[a].T @ mean[b] + covariance.sum(axis=0)
        return np.asarray(total + np.tensordot(spread[a], spread[b], axes=([0, 1], [0, 1])))

    last, first = slice(1, None), slice(None, -1)
    h = space.output
    seen = y[present]
    residual = seen @ weights - mean[present] @ h
    unknown = seen[:, 1:] @ root - spread[present] @ h
    of_states = np.einsum("i,kij,j->", h, c[present], h)
    count = int(np.sum(present))
    free = count - regression.beta.size
    return Expectation(
        later=second(last, last, c[1:]),
        cross=second(last, first, d),
        earlier=second(first, first, c[:-1]),
        first=second(slice(0, 1), slice(0, 1), c[:1]),
        start=mean[0],
        later_sum=mean[1:].sum(axis=0),
        earlier_sum=mean[:-1].sum(axis=0),
        steps=n - 1,
        residual=float(residual @ residual + np.sum(unknown**2) + of_states),
        count=count,
        log_likelihood=-0.5
        * (
            free * np.log(2.0 * np.pi)
            + float(np.sum(np.log(s[present])))
            + regression.log_determinant
            + regression.residual
        ),
        regression=regression,
    )
