"""The reference mixture: first weights of a fit, and the discrepancy that any model needs.

White, quantization and random-walk noise, a grid of Gauss-Markov processes and the kinds of the
model together follow almost any wavelet variance. Their fit is a spectrum close enough for first
weights, whatever model is to be fitted, and no such model can follow the data more closely.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.moments.design import Design
from gmwm.estimate.moments.weights import suffices
from gmwm.estimate.problem import Scales, is_plain, solve_nonnegative, weight_root
from gmwm.process import CATALOGUE, Model, Process, Shape
from gmwm.variance import WaveletVariance

_BISECTIONS = 14

TEXTBOOK = tuple(
    kind() for kind in sorted(CATALOGUE, key=lambda kind: not kind.is_white) if kind.is_candidate
)
"""Processes of which the mixture is made, with open parameters, white noise first."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A rich mixture fitted to the wavelet variances.

    covariance: (J, J), of the wavelet variances under it, u^4.
    curve: (J,), its wavelet variances, u^2.
    discrepancy: Relative error that even this mixture needs, see `gmwm.estimate.moments.weights`.
    """

    mixture: Model
    covariance: FloatArray
    curve: FloatArray
    discrepancy: float

    def weights(self, target: FloatArray, discrepancy: float) -> FloatArray:
        """Covariance of the wavelet variances with a discrepancy, u^4, (J, J)."""
        return self.covariance + np.diag((discrepancy * target) ** 2)


_references: WeakKeyDictionary[WaveletVariance, dict[Any, Reference]] = WeakKeyDictionary()
"""Mixtures that were fitted: candidate models ask for the same one repeatedly."""


def dictionary_fit(
    wv: WaveletVariance, target: FloatArray, extra: tuple[Process, ...] = ()
) -> Reference:
    """Non-negative least-squares fit of the textbook processes and the kinds of ``extra``."""
    kinds = _kinds(extra)
    if not all(is_plain(kind) for kind in kinds):
        return _mixture(wv, target, kinds)
    known, key = _references.setdefault(wv, {}), (kinds, target.tobytes())
    if key not in known:
        known[key] = _mixture(wv, target, kinds)
    return known[key]


def dictionary(
    scales: Scales, extra: tuple[Process, ...] = ()
) -> tuple[Design, list[tuple[int, Shape]], FloatArray]:
    """Processes of which almost any wavelet variance is a sum.

    Returns: design; atoms, term of the design and its shape; matrix (J, A), wavelet variance of
        each at unit amplitude.
    """
    return _dictionary(scales, _kinds(extra))


def _kinds(extra: tuple[Process, ...]) -> tuple[Process, ...]:
    """The processes of the dictionary."""
    # Open lines are left out, as a comb of them follows anything; a line at a given frequency
    # follows one thing only, which no other process can. Simulated processes would take long.
    lines = tuple(p for p in extra if p.is_line and p.values["frequency"] is not None)
    kinds = {type(p): p for p in extra if not p.is_line and p.has_spectrum()}
    more = (p for kind, p in kinds.items() if not kind.is_candidate)
    return (*TEXTBOOK, *more, *(line.with_values(amplitude=None) for line in lines))


def _dictionary(
    scales: Scales, kinds: tuple[Process, ...]
) -> tuple[Design, list[tuple[int, Shape]], FloatArray]:
    design = Design(Model(kinds), scales)
    atoms, columns = [], []
    for i in design.linear:
        shapes, curves = design.dense_grid(i)
        atoms += [(i, shape) for shape in shapes]
        columns.append(curves)
    return design, atoms, np.concatenate(columns, axis=1)


def _mixture(wv: WaveletVariance, target: FloatArray, kinds: tuple[Process, ...]) -> Reference:
    design, atoms, matrix = _dictionary(Scales.of(wv), kinds)
    covariance, discrepancy = wv.covariance, 0.0
    for _ in range(tuning.REWEIGHTINGS):
        discrepancy = _needed(matrix, target, covariance)
        x = _amplitudes(matrix, target, covariance, discrepancy)
        mixture = [
            design.at_shape(i, shape).with_amplitude(float(value))
            for (i, shape), value in zip(atoms, x, strict=True)
            if value > 0.0
        ]
        if all(process.is_line for process in mixture):
            raise InputError(
                f"{wv.name or 'the series'} is not noise that these processes describe (an exact "
                "line or a pattern): check the data"
            )
        whole = Model(tuple(mixture))
        covariance = wv.covariance_under(whole.psd, whole.lines())
    return Reference(whole, covariance, matrix @ x, discrepancy)


def _amplitudes(
    matrix: FloatArray, target: FloatArray, covariance: FloatArray, discrepancy: float
) -> FloatArray:
    root = weight_root(covariance + np.diag((discrepancy * target) ** 2))
    return solve_nonnegative(root @ matrix, root @ target)[0]


def _needed(matrix: FloatArray, target: FloatArray, covariance: FloatArray) -> float:
    """Smallest discrepancy that passes the chi-square test.

    The mixture is fitted anew for each value tried: with more allowance it follows the fine
    levels less closely, and residuals of a loose fit would ask for ever more.
    """
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        value = low if high == 1.0 and low == 0.0 else float(np.sqrt(max(low, 1e-4) * high))
        x = _amplitudes(matrix, target, covariance, value)
        curve = matrix @ x
        dof = max(target.size - int(np.sum(x > 0.0)), 3)
        if suffices(value, target - curve, covariance, target, curve, dof):
            if value == 0.0:
                return 0.0
            high = value
        else:
            low = max(value, 1e-4)
        if high < 1.05 * low:
            break
    return high
