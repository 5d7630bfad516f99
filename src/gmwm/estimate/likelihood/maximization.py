"""The M step: parameters of each process in closed form, from second moments of its state.

Every function takes the process as it stands and returns it with its open parameters replaced;
given ones stay. For a Gauss-Markov process the stationary first state takes part, so that the
iteration climbs the exact likelihood; its maximum is the root of a cubic (Beach & MacKinnon 1978,
*Econometrica* 46, 51-58). For an autoregression of higher order the first state is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import singledispatch

import numpy as np
from numpy.polynomial import Polynomial
from scipy.linalg import solve_discrete_lyapunov

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process import ARIMA, GaussMarkov, Process, RandomWalk, StateSpace

_FASTEST, _SLOWEST = 1.0 - 1e-12, 1e-12  # of 1 - phi


@dataclass(frozen=True, eq=False)
class StateMoments:
    """Second moments of the state of one process, see `gmwm.estimate.likelihood.expectation`."""

    later: FloatArray
    cross: FloatArray
    earlier: FloatArray
    first: FloatArray
    steps: int


def check_supported(process: Process) -> None:
    """Raise where EM has no closed form for the process.

    Raises InputError.
    """
    if process.is_white:
        return
    known = updated.dispatch(type(process)) is not updated.dispatch(Process)
    if not known or (isinstance(process, ARIMA) and not process.is_autoregression):
        raise InputError(
            f'method = "em" does not know {process!r}: it takes WhiteNoise, RandomWalk, RateRamp, '
            'GaussMarkov and AR; "mle" takes the others, "gmwm" a Sinusoid too'
        )


@singledispatch
def em_space(process: Process, dt: float) -> StateSpace:
    """State space whose state holds past values, so that a regression gives the coefficients."""
    return process.state_space(dt)


@em_space.register
def _(process: ARIMA, dt: float) -> StateSpace:
    p = process.orders[0]
    transition = np.eye(p, k=-1)
    transition[0] = process.ar
    noise = np.zeros((p, p))
    noise[0, 0] = process.sigma2
    return StateSpace(
        transition,
        noise,
        np.eye(p)[0],
        0.0,
        np.zeros(p),
        solve_discrete_lyapunov(transition, noise),
        tuple(f"lag {i}" for i in range(p)),
    )


@singledispatch
def updated(process: Process, like: Process, moments: StateMoments, dt: float) -> Process:
    """``process`` with the parameters that are open in ``like`` set to the M step's."""
    raise AssertionError(f"{process!r} has passed check_supported")


def white(process: Process, like: Process, residual: float, count: int, dt: float) -> Process:
    """White noise from the sum of ``count`` expected squares."""
    if like.values["N"] is not None:
        return process
    return process.with_values(N=float(np.sqrt(residual / count * dt)))


@updated.register
def _(process: RandomWalk, like: Process, m: StateMoments, dt: float) -> Process:
    if like.values["K"] is not None:
        return process
    squares = float((m.later - 2.0 * m.cross + m.earlier)[0, 0])
    return process.with_values(K=float(np.sqrt(squares / m.steps / dt)))


@updated.register
def _(process: GaussMarkov, like: Process, m: StateMoments, dt: float) -> Process:
    later, cross, earlier, first = (float(a[0, 0]) for a in (m.later, m.cross, m.earlier, m.first))
    n = m.steps + 1
    phi = float(np.exp(-dt / process.tau))
    drift = Polynomial([1.0, -1.0])  # phi in terms of 1 - phi, whose digits matter
    loss = Polynomial([0.0, 2.0, -1.0])  # 1 - phi^2
    squares = later - 2.0 * cross * drift + earlier * drift**2
    sigma = like.values["sigma"]
    if like.values["tau"] is None:
        if sigma is None:
            total = squares + first * loss
            slope = total.deriv()
            condition = n * slope * loss - total * loss.deriv()

            def log_likelihood(delta: float) -> float:
                return float(-0.5 * (n * np.log(total(delta)) - np.log(loss(delta))))
        else:
            variance = sigma**2
            condition = (
                m.steps * variance * loss.deriv() * loss
                + squares.deriv() * loss
                - squares * loss.deriv()
            )

            def log_likelihood(delta: float) -> float:
                size = float(loss(delta))
                return -0.5 * (m.steps * np.log(size) + float(squares(delta)) / variance / size)

        delta = _best_root(condition, log_likelihood, min(1.0 - phi, _FASTEST))
        process = process.with_values(tau=float(-dt / np.log1p(-delta)))
    else:
        delta = 1.0 - phi
    if sigma is None:
        variance = (float(squares(delta)) / float(loss(delta)) + first) / n
        process = process.with_values(sigma=float(np.sqrt(variance)))
    return process


def _best_root(
    condition: Polynomial, log_likelihood: Callable[[float], float], present: float
) -> float:
    """The root between 0 and 1 of highest likelihood; the present value where there is none."""
    roots = condition.roots()
    inside = [
        float(root.real)
        for root in np.atleast_1d(roots)
        if abs(root.imag) < 1e-9 * max(abs(root), 1e-300) and _SLOWEST < root.real < _FASTEST
    ]
    return max([*inside, present], key=log_likelihood)


@updated.register
def _(process: ARIMA, like: Process, m: StateMoments, dt: float) -> Process:
    values = process.values
    p = m.earlier.shape[0]
    names = [f"ar_{i + 1}" for i in range(p)]
    current = np.array([values[name] for name in names], dtype=float)
    if like.values[names[0]] is None:
        coefficients = np.linalg.solve(m.earlier, m.cross[0])
        try:
            process = process.with_values(**dict(zip(names, map(float, coefficients), strict=True)))
        except InputError:  # not stationary: keep what there is
            coefficients = current
    else:
        coefficients = current
    if like.values["sigma2"] is None:
        rest = m.later[0, 0] - 2.0 * coefficients @ m.cross[0]
        rest += coefficients @ m.earlier @ coefficients
        process = process.with_values(sigma2=float(rest) / m.steps)
    return process
