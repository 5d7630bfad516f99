"""An ARMA process as a sum of Gauss-Markov processes, where it is one (Section IV-C of the paper).

A sum of p first-order Gauss-Markov processes is an ARMA(p, p - 1); with white noise beside them, an
ARMA(p, p) (Granger & Morris 1976, *JRSS A* 139, 246-257). Backwards, the roots r of the
autoregression are the correlations from one sample to the next, r = exp(-dt / tau), and the
partial fractions of the autocovariance, ``gamma(k) = sum c_i r_i^k``, the variances. An ARMA
process is such a sum only if its roots are real and between 0 and 1, and all c_i positive.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gmwm._core.text import plain_table, wrapped
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.result.estimate import confidence_interval
from gmwm.estimate.result.fit import Fit
from gmwm.process import ARMA, GaussMarkov, Model, Process, WhiteNoise

_TINY_STEP = 1e-30  # of complex differences, which have no rounding error


@dataclass(frozen=True, eq=False)
class GaussMarkovForm:
    """An ARMA process as a sum of Gauss-Markov processes, from `gmwm.to_gauss_markov`.

    Attributes
    ----------
    roots : (p,) ndarray of complex
        Of the autoregression, by falling size: correlations from one sample to the next.
    model : Model or None
        The sum; ``None`` where there is none.
    jacobian : (d, d) ndarray
        Derivatives of the logarithms of ``model``'s parameters by the ARMA's, in their orders.
    stderr : dict
        Standard errors by the delta method, SI; empty where it does not hold, or none are known.
    reason : str
        Why there is no model, or no standard error; else empty.
    """

    roots: npt.NDArray[np.complex128]
    model: Model | None
    jacobian: FloatArray
    stderr: dict[str, float]
    reason: str

    @property
    def params(self) -> dict[str, float]:
        """Parameters of the sum, SI; empty where there is none."""
        values = {} if self.model is None else self.model.params
        return {key: float(value or 0.0) for key, value in values.items()}

    def interval(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Confidence intervals of the parameters that have a standard error, SI."""
        items = () if self.model is None else self.model.parameters
        return {
            p.key: confidence_interval(p.parameter, float(p.value or 0.0), error, level)
            for p in items
            if (error := self.stderr.get(p.key)) is not None
        }

    def __str__(self) -> str:
        roots = ", ".join(f"{root:.6g}" for root in np.real_if_close(self.roots))
        condition = ""
        if self.jacobian.size:
            condition = f"; condition number of the Jacobian {np.linalg.cond(self.jacobian):.3g}"
        rows = [
            (key, f"{value:.5g}", f"{self.stderr[key]:.2g}" if key in self.stderr else "")
            for key, value in self.params.items()
        ]
        table = [plain_table(("key", "estimate", "std. error"), rows)] if rows else []
        head = wrapped(f"roots {roots}{condition}")
        return "\n".join([*head, *table, *(wrapped(self.reason) if self.reason else [])])


def to_gauss_markov(arma: Fit | Process, dt: float | None = None) -> GaussMarkovForm:
    """The sum of Gauss-Markov processes that an ARMA process is, with errors by the delta method.

    Parameters
    ----------
    arma : Fit or ARMA
        A fit of ``ARMA(p, p - 1)``, or ``ARMA(p, p)`` for a sum with white noise, all of it open;
        or such a process with its values, which has no standard errors.
    dt : float, optional
        Sampling interval, s, of a process; a fit has its own.

    Returns
    -------
    GaussMarkovForm

    Raises
    ------
    InputError
        If it is no ARMA process of these orders, or ``dt`` is missing.

    Examples
    --------
    >>> import gmwm
    >>> form = gmwm.to_gauss_markov(gmwm.ARMA([1.4, -0.45], [-0.7], 1.0), dt=1.0)
    >>> [round(value, 3) for value in form.params.values()]
    [0.888, 1.443, 1.331, 9.491]
    """
    process: Process = arma.model.terms[0] if isinstance(arma, Fit) else arma
    step = arma.wv.dt if isinstance(arma, Fit) else dt
    is_alone = not isinstance(arma, Fit) or len(arma.model.terms) == 1
    if not isinstance(process, ARMA) or not is_alone or step is None:
        raise InputError(f"{arma!r}: give a fit of one ARMA, or an ARMA with values and dt=...")
    p, q = process.orders
    if p < 1 or q not in (p - 1, p):
        raise InputError(
            f"{process!r} is not a sum of Gauss-Markov processes: give an ARMA(p, p - 1), or an "
            "ARMA(p, p), which has white noise too"
        )
    ar, ma = (np.array(each, dtype=float) for each in (process.ar, process.ma))
    roots = np.roots([1.0, *-ar]).astype(complex)
    roots = roots[np.argsort(-np.abs(roots), kind="stable")]
    nothing = np.zeros((0, 0))
    if np.any(roots.imag != 0.0):
        return GaussMarkovForm(roots, None, nothing, {}, "two roots are complex: a resonance")
    if np.any((roots.real <= 0.0) | (roots.real >= 1.0)):
        return GaussMarkovForm(roots, None, nothing, {}, "a root is not between 0 and 1")
    found = _variances(roots, ma.astype(complex), complex(process.sigma2)).real
    if np.any(found <= 0.0):
        return GaussMarkovForm(roots, None, nothing, {}, "a variance of the sum is not positive")
    tau = -step / np.log(roots.real)
    terms: list[Process] = [WhiteNoise(float(np.sqrt(found[p] * step)))] if q == p else []
    terms += [GaussMarkov(float(np.sqrt(c)), float(t)) for c, t in zip(found, tau, strict=False)]
    model = Model(tuple(terms))
    jacobian = _jacobian(roots.real, ma, process.sigma2, found)
    if not isinstance(arma, Fit):
        return GaussMarkovForm(roots, model, jacobian, {}, "")
    if len(arma.keys) != jacobian.shape[1]:
        reason = "the ARMA has no covariance of all of its parameters"
        return GaussMarkovForm(roots, model, jacobian, {}, reason)
    relative = np.sqrt(np.diag(jacobian @ arma.covariance @ jacobian.T))
    if not np.all(relative < tuning.UNDETERMINED):
        reason = "the delta method does not hold: a parameter is less certain than a factor e"
        return GaussMarkovForm(roots, model, jacobian, {}, reason)
    errors = {
        k: float(v or 0.0) * e for (k, v), e in zip(model.params.items(), relative, strict=True)
    }
    return GaussMarkovForm(roots, model, jacobian, errors, "")


def _variances(
    roots: npt.NDArray[np.complex128], ma: npt.NDArray[np.complex128], sigma2: complex
) -> npt.NDArray[np.complex128]:
    """Variances of the Gauss-Markov processes, and that of white noise if there are p roots of ma.

    Residues of ``sigma2 theta(z) theta(1/z) / phi(z) phi(1/z) z^(k-1)`` at the roots; at zero, for
    k = 0, where the orders are equal.
    """
    powers = np.arange(ma.size + 1)
    theta = np.concatenate([[1.0], ma])
    found = []
    for i, root in enumerate(roots):
        others = np.delete(roots, i)
        below = np.prod(1.0 - roots * root) * np.prod(1.0 - others / root)
        found.append(sigma2 * (theta @ root**powers) * (theta @ root ** (-powers)) / below)
    if ma.size == roots.size:
        found.append(sigma2 * ma[-1] / np.prod(-roots))
    return np.array(found)


def _jacobian(
    roots: FloatArray, ma: Sequence[float] | FloatArray, sigma2: float, variances: FloatArray
) -> FloatArray:
    """Derivatives of log N, sigma and tau, in the order of the model, by the ARMA's; roots (p,)."""
    p, q = roots.size, len(ma)
    inner = np.concatenate([roots, ma, [sigma2]]).astype(complex)
    by_inner = np.empty((variances.size, inner.size))
    for k in range(inner.size):
        moved = inner.copy()
        moved[k] += _TINY_STEP * 1j
        slopes = _variances(moved[:p], moved[p : p + q], complex(moved[-1])).imag / _TINY_STEP
        by_inner[:, k] = 0.5 * slopes / variances
    # A root of z^p - ar_1 z^(p-1) - ... moves by z^(p-k) over the product of its distances.
    outer = np.eye(inner.size)
    for i, root in enumerate(roots):
        outer[i, :p] = root ** np.arange(p - 1, -1, -1) / np.prod(root - np.delete(roots, i))
    times = np.zeros((p, inner.size))
    times[:, :p] = np.diag(-1.0 / (roots * np.log(roots)))
    rows = [by_inner[p]] if variances.size > p else []
    for i in reversed(range(p)):
        rows += [by_inner[i], times[i]]
    return np.array(rows) @ outer
