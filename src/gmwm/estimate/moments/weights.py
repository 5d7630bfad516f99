"""The weight matrix Omega, and the error allowed to a model that fails the chi-square test.

With a million samples the fine levels are known to a tenth of a per cent, and no sum of textbook
processes is that exact. A fit that follows them misses the long averaging times, which matter to
navigation. So, where the test fails, the covariance of the wavelet variances gains a relative
discrepancy, ``Sigma + delta^2 diag(nu_hat^2)``, with delta such that the weighted sum of squares
equals its degrees of freedom (the moment estimator of a random effect, DerSimonian & Laird 1986,
*Controlled Clinical Trials* 7, 177-188). It stays zero where the model is right.
"""

from dataclasses import dataclass
from typing import Any, Self
from weakref import WeakKeyDictionary

import numpy as np
from scipy.optimize import brentq

from gmwm._core.distributions import chi2
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.moments.design import Design
from gmwm.estimate.problem.moments import Compared, Scales, weight_root
from gmwm.estimate.problem.nonnegative import solve_nonnegative
from gmwm.process import CATALOGUE, Model, Process, Shape
from gmwm.variance import WaveletVariance

WEIGHTS = ("model", "data", "diagonal", "identity")


@dataclass(frozen=True, eq=False)
class Weights:
    """A choice of Omega.

    variance: (J,), wavelet variances of the data, u^2.
    of_data: (J, J) or None, covariance estimated from the coefficients, for "data".
    is_literal: Whether that is taken as it is, eq. (5) of the paper to the letter.
    """

    name: str
    variance: FloatArray
    of_data: FloatArray | None = None
    is_literal: bool = False

    @classmethod
    def of(cls, name: str, wv: WaveletVariance, is_literal: bool = False) -> Self:
        """Weights for these wavelet variances.

        Raises InputError if they are "data" and the variances come without a covariance of their
            own.
        """
        if name == "data" and wv.data_covariance is None:
            raise InputError(
                'weights = "data" needs the covariance estimated from the coefficients: make the '
                'wavelet variance with data_covariance="octave"'
            )
        of_data = wv.data_covariance if name == "data" else None
        return cls(name, wv.variance, of_data, is_literal)

    def root(self, covariance: FloatArray, excess: FloatArray) -> FloatArray:
        """L with L'L the weight matrix, (J, J).

        A level that is low by chance has a small estimated variance too, and would have too much
        weight: the one estimated from the data is brought to the wavelet variances of the model.

        covariance: (J, J), of the moments under the model, u^4.
        excess: (J,), wavelet variances of the model less those of the data, u^2.
        """
        if self.of_data is not None:
            ratio = np.ones_like(excess) if self.is_literal else 1.0 + excess / self.variance
            return weight_root(self.of_data * np.outer(ratio, ratio))
        if self.name == "model":
            return weight_root(covariance)
        variances = np.diag(covariance)
        if self.name == "diagonal":
            return np.diag(1.0 / np.sqrt(variances))
        return np.eye(variances.size) / np.sqrt(np.max(variances))


_SETTLED = 1e-3  # relative change of delta


def suffices(value: float, compared: Compared, dof: int) -> bool:
    """Whether residuals agree with their covariance under a discrepancy of ``value``.

    Without one, the chi-square test decides; with one, the sum of squares must not exceed its
    degrees of freedom. Only levels that are known well enough to show a discrepancy count.
    """
    known, dof = _well_known(compared, dof)
    if value > 0.0:
        return _objective(value, known) <= dof
    if np.any(known.implied <= 0.0) or np.any(known.basis <= 0.0):
        return False
    return bool(chi2.sf(known.chi_square(known.statistical), dof) > tuning.MISFIT_P)


def _well_known(compared: Compared, dof: int) -> tuple[Compared, int]:
    """Levels of small relative error, and the degrees of freedom that they leave.

    The misfit of a coarse level is chance, and allowing for it would loosen the fine levels.
    """
    target = compared.target
    with np.errstate(over="ignore"):  # a level without any variance is not known
        relative = np.sqrt(np.diag(compared.statistical)) / np.maximum(target, 1e-300)
    known = np.flatnonzero(relative < tuning.DISCREPANCY_KNOWN)
    if known.size == 0:
        known = np.array([int(np.argmin(relative))])
    return compared.at(known), max(dof - (target.size - known.size), 1)


def with_discrepancy(covariance: FloatArray, target: FloatArray, value: float) -> FloatArray:
    """Covariance of wavelet variances that may be off by a share of each, u^4, (J, J)."""
    return covariance + np.diag((value * target) ** 2)


def _objective(value: float, compared: Compared) -> float:
    covariance = with_discrepancy(compared.statistical, compared.target, value)
    whitened = weight_root(covariance) @ compared.residual
    return float(whitened @ whitened)


class Discrepancy:
    """The level of discrepancy while a fit is iterated.

    is_overdetermined: Whether there are more levels than parameters, without which it is zero.
    """

    def __init__(self, given: float | None, is_overdetermined: bool) -> None:
        self.value = given or 0.0
        self.given = given
        self._estimated = given is None and is_overdetermined

    def start_at(self, value: float) -> None:
        """Begin with the reference mixture's value, if it is to be estimated and not small.

        A small one may come from the grid of the mixture.
        """
        if self._estimated and value > tuning.DISCREPANCY_NOTABLE:
            self.value = value

    def update(self, compared: Compared, dof: int) -> bool:
        """Estimate anew from residuals and their covariance; returns whether it changed."""
        if not self._estimated or (self.value == 0.0 and suffices(0.0, compared, dof)):
            return False
        before = self.value
        self.value = moment_estimate(compared, dof)
        return abs(self.value - before) > _SETTLED * max(self.value, before, 1e-6)


def moment_estimate(compared: Compared, dof: int) -> float:
    """Discrepancy whose weighted sum of squares equals its degrees of freedom."""
    known, dof = _well_known(compared, dof)

    def excess(log_delta: float) -> float:
        return _objective(float(np.exp(log_delta)), known) - dof

    low, high = np.log(1e-5), np.log(10.0)
    if excess(low) <= 0.0:
        return 0.0
    if excess(high) >= 0.0:
        return float(np.exp(high))
    return float(np.exp(brentq(excess, low, high, rtol=1e-6)))


_BISECTIONS = 14
_LOOSE = 100.0  # times the largest variance: the error of a level that has no weight

TEXTBOOK = tuple(
    kind() for kind in sorted(CATALOGUE, key=lambda kind: not kind.is_white) if kind.is_candidate
)
"""Processes of the mixture, with open parameters, white noise first."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A rich mixture fitted to the wavelet variances: first weights of a fit.

    White, quantization and random-walk noise, a grid of Gauss-Markov processes and the kinds of the
    model together follow almost any wavelet variance. Their fit is a spectrum close enough for
    first weights, whatever model is to be fitted, and no such model can follow the data more
    closely.

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
        return with_discrepancy(self.covariance, target, discrepancy)


_references: WeakKeyDictionary[WaveletVariance, dict[Any, Reference]] = WeakKeyDictionary()
"""Mixtures that were fitted: candidate models ask for the same one repeatedly."""


def dictionary_fit(
    wv: WaveletVariance, target: FloatArray, extra: tuple[Process, ...] = ()
) -> Reference:
    """Non-negative least-squares fit of the textbook processes and the kinds of ``extra``."""
    kinds = _kinds(extra)
    if not all(kind.is_plain for kind in kinds):
        return _mixture(wv, target, kinds)
    known, key = _references.setdefault(wv, {}), (kinds, target.tobytes())
    if key not in known:
        known[key] = _mixture(wv, target, kinds)
    return known[key]


def dictionary(
    scales: Scales, extra: tuple[Process, ...] = ()
) -> tuple[Design, list[tuple[int, Shape]], FloatArray]:
    """Processes whose sums describe almost any wavelet variance.

    Returns: design; atoms, term of the design and its shape; matrix (J, A), wavelet variance of
        each at unit amplitude.
    """
    design = Design(Model(_kinds(extra)), scales)
    atoms, columns = [], []
    for i in design.linear:
        shapes, curves = design.dense_grid(i)
        atoms += [(i, shape) for shape in shapes]
        columns.append(curves)
    return design, atoms, np.concatenate(columns, axis=1)


def _kinds(extra: tuple[Process, ...]) -> tuple[Process, ...]:
    """The processes of the dictionary."""
    # Open lines are left out, as a comb of them follows anything; a line at a given frequency
    # follows one thing only, which no other process can. Simulated processes would take long.
    lines = tuple(p for p in extra if p.is_line and p.values["frequency"] is not None)
    kinds = {type(p): p for p in extra if not p.is_line and p.has_spectrum()}
    more = (p for kind, p in kinds.items() if not kind.is_candidate)
    return (*TEXTBOOK, *more, *(line.with_values(amplitude=None) for line in lines))


def _mixture(wv: WaveletVariance, target: FloatArray, kinds: tuple[Process, ...]) -> Reference:
    """The mixture under weights that belong to it, from the first weights that need less allowance.

    A level of few degrees of freedom that is low by chance looks well known, and under such weights
    it pulls the whole mixture down to it. If no mixture fits, those levels are left out at first.
    """
    design, atoms, matrix = dictionary(Scales.of(wv), kinds)

    def settled(covariance: FloatArray) -> Reference:
        discrepancy = 0.0
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
                    f"{wv.name or 'the series'} is not noise that these processes describe (an "
                    "exact line or a pattern): check the data"
                )
            whole = Model(tuple(mixture))
            covariance = wv.covariance_under(whole.psd, whole.lines())
        return Reference(whole, covariance, matrix @ x, discrepancy)

    found, deviation = settled(wv.covariance), np.sqrt(np.diag(wv.covariance))
    is_known = deviation < tuning.DISCREPANCY_KNOWN * target
    if found.discrepancy == 0.0 or np.all(is_known):
        return found
    inflated = np.where(is_known, 1.0, _LOOSE * np.max(target) / deviation)
    other = settled(wv.covariance * np.outer(inflated, inflated))
    return min(found, other, key=lambda each: each.discrepancy)


def _amplitudes(
    matrix: FloatArray, target: FloatArray, covariance: FloatArray, discrepancy: float
) -> FloatArray:
    root = weight_root(with_discrepancy(covariance, target, discrepancy))
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
        compared = Compared(target, curve, covariance, curve, np.zeros_like(target))
        if suffices(value, compared, max(target.size - int(np.sum(x > 0.0)), 3)):
            if value == 0.0:
                return 0.0
            high = value
        else:
            low = max(value, 1e-4)
        if high < 1.05 * low:
            break
    return high
