"""Departures from stationary noise: steps, transients after switching on, slow periods.

No sum of noises has them, but a random walk or a slow Gauss-Markov process follows them, so that
the chi-square test of a fit passes. They are looked for in means of blocks of samples, whose
differences are stationary whatever the noise, with covariance known from the spectrum. The noise
that was fitted has followed what is looked for. So it is not taken as it is: the part of its
spectrum above the flat floor is scaled, and a random walk is added, by all factors that matter,
both without the departure and beside it. The evidence for a departure is the ratio of the two
probabilities of the block means, one averaged over sizes, places and noises, the other over noises
(a Bayes factor; Zellner's g prior for the size, averaged over g). Where a random walk does as well
it is about one. By Markov's inequality stationary noise has an evidence of 100 in at most one of
100 records, whatever the number of places that are looked at.

Kass & Raftery (1995), *JASA* 90, 773-795; Liang et al. (2008), *JASA* 103, 410-423.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky
from scipy.linalg.lapack import dpotri
from scipy.sparse import csr_array
from scipy.special import logsumexp

from gmwm._core.distributions import norm
from gmwm._core.typing import FloatArray, IntArray
from gmwm.calibration import tuning
from gmwm.calibration.stationarity.means import Means
from gmwm.calibration.stationarity.shapes import Family, families
from gmwm.estimate import Fit
from gmwm.estimate.problem import Scales
from gmwm.process import PSD, Model, RandomWalk
from gmwm.variance import WaveletVariance

DEPARTURES = ("step", "transient", "drift-at-start", "slow-period")
"""Of departures: the codes of their notices."""

WIDE = float(norm.isf(0.025))
"""Standard errors of half a 95 % interval."""


@dataclass(frozen=True)
class Departure:
    """Something that stationary noise does not have.

    kind: Code of its notice: "step", "transient", "drift-at-start" or "slow-period".
    time: When the step is, the time constant, the end of the drift or the period, and the ends of
        its 95 % interval, s.
    size: Height of the step; of the transient or the drift at the start of the record; amplitude of
        the period; and the ends of its 95 % interval, u.
    evidence: Ratio of the probability of the data with it to that without.
    share: Largest fraction of the wavelet variance of the model that it accounts for; of a pulse,
        that both its steps do.
    phase: Of a period, ``size cos(2 pi t / time - phase)``, rad.
    """

    kind: str
    time: tuple[float, float, float]
    size: tuple[float, float, float]
    evidence: float
    share: float
    phase: float = 0.0

    @property
    def is_evident(self) -> bool:
        """Whether noise has such an evidence in one of a hundred records at most."""
        return self.evidence >= tuning.EVIDENT

    def curve(self, time: FloatArray) -> FloatArray:
        """At unit size, at times from the start of the record, s."""
        length = self.time[0]
        if self.kind == "step":
            return np.asarray(time > length, dtype=float)
        if self.kind == "transient":
            return np.exp(-time / length)
        if self.kind == "drift-at-start":
            return np.maximum(1.0 - time / length, 0.0)
        return np.cos(2.0 * np.pi * time / length - self.phase)


def departures(fitted: Fit, wv: WaveletVariance | None = None) -> tuple[Departure, ...]:
    """What a recording has that stationary noise does not have.

    wv: The recording, where the fit is one of several.
    Returns: most evident first, each beside the others; the last one may be one that noise explains
        about as well (`Departure.is_evident`).
    """
    noise = tuple(term for term in fitted.model.terms if not term.is_drift)
    means = Means.of(wv or fitted.wv, tuning.MOST_MEANS)
    if not noise or means.first.size < tuning.FEWEST_DIFFERENCES:
        return ()
    psd = Scales.of(fitted.wv).spectrum(Model(noise))
    floor = means.floor(psd)
    if floor == 0.0:
        return ()  # periodic lines alone have no noise
    noises = _noises(psd, floor, means)
    kinds = families(means.blocks.size, means.step)
    known = np.empty((0, means.first.size))
    if len(noise) < len(fitted.model.terms):
        known = means.differences(means.step * np.arange(float(means.blocks.size))[None, :])
    found, straight = _found(kinds, means, noises, known)
    places = [(*each, *place) for each in found for place in each[1].places(kinds[0])]
    departed = []
    # Each was found with those after it in the data.
    for i, (evidence, whole, family, _) in enumerate(places):
        others = [means.differences(near) for k, (*_, near) in enumerate(places) if k != i]
        known = _basis([straight, *others])
        beside = _beside(noises, known)
        if not beside:
            continue
        test = _Test.of(family, means, beside)
        curve = test.curve
        if whole.family.is_pulse and not family.is_pulse:
            curve, evidence = whole.curve, min(evidence, _evidence([test]))
        if evidence < tuning.POSSIBLE:
            continue  # what came back was no step
        share = _share(curve, means.step, fitted)
        departed += [
            Departure(family.kind, time, size, evidence, share, test.phase)
            for time, size in zip(test.times, test.sizes, strict=True)
        ]
    return tuple(departed)


def _found(
    kinds: Sequence[Family], means: Means, noises: list[_Noise], known: FloatArray
) -> tuple[list[tuple[float, _Test]], FloatArray]:
    """Departures with their evidence, each beside those before it, and the known straight drift.

    known: (k, D), of the model.
    """
    found, straight = list[tuple[float, _Test]](), known
    for _ in range(tuning.MOST_DEPARTURES):
        beside = _beside(noises, known)
        if not beside:
            break
        tests = [_Test.of(family, means, beside) for family in kinds]
        evidence = _evidence(tests)
        best = max(tests, key=lambda test: test.log_evidence)
        if evidence < tuning.POSSIBLE:
            break
        near = means.differences(best.neighbours)
        known = _basis([known, near])
        # A drift of the whole record has a test of its own (slope_p_value): here it competes only.
        if best.family.kind == "drift":
            straight = _basis([straight, near])
            continue
        found.append((evidence, best))
        if evidence < tuning.EVIDENT:
            break
    return found, straight


@dataclass(frozen=True, eq=False)
class _Noise:
    """One of the noises.

    log_weight: Logarithm of its probability beforehand over the root of the determinant of its
        covariance.
    inverse: (D, D), of the covariance of the differences; without what known curves explain.
    """

    log_weight: float
    inverse: FloatArray

    def beside(self, known: FloatArray) -> _Noise:
        """The same for what is orthogonal to known curves, (k, D)."""
        if not known.size:
            return self
        solved = self.inverse @ known.T
        information = known @ solved
        return _Noise(
            self.log_weight - 0.5 * float(np.linalg.slogdet(information)[1]),
            self.inverse - solved @ np.linalg.solve(information, solved.T),
        )


def _beside(noises: list[_Noise], known: FloatArray) -> list[_Noise]:
    """Noises for what is orthogonal to known curves, but for those that leave nothing there."""
    found = [noise.beside(known) for noise in noises]
    return [each for each in found if np.isfinite(each.log_weight + np.sum(each.inverse))]


def _noises(psd: PSD, floor: float, means: Means) -> list[_Noise]:
    """The fitted noise with its part above the floor scaled, and a random walk beside it."""
    # K^2 that equals the floor at that averaging time.
    walk = 3.0 * floor / (tuning.WALK_AT * means.length) ** 2

    flat = floor * means.covariance(lambda f, _: np.ones_like(f))
    slow = means.covariance(psd) - flat
    unit = walk * means.covariance(RandomWalk(1.0).psd)
    parts, weights = np.array(tuning.SLOW_PARTS), np.gradient(np.log(tuning.SLOW_PARTS))
    if np.max(np.abs(slow)) < tuning.NO_SLOW_PART * np.max(np.abs(flat)):
        parts, weights = parts[:1], np.sum(weights, keepdims=True)  # all the same noise
    found = []
    for part, weight in zip(parts, weights, strict=True):
        for more in tuning.WALKS:
            total = flat + part * slow + more * unit
            total += tuning.NO_INFORMATION * np.mean(np.diag(total)) * np.eye(len(total))
            factor = cholesky(total, lower=True)
            inverse = dpotri(factor, lower=True)[0]  # its lower triangle, above it zeros
            inverse = inverse + np.tril(inverse, -1).T
            half_log_determinant = float(np.sum(np.log(np.diag(factor))))
            found.append(_Noise(float(np.log(weight)) - half_log_determinant, inverse))
    return found


@dataclass(frozen=True, eq=False)
class _Test:
    """A family of departures beside those that are known.

    evidence: (G,), logarithm of the evidence of each member.
    weight: (C,), probability of each noise that counts, beside the most evident member.
    estimates, variances: (C, r), of the sizes of that member's curves under each noise.
    """

    family: Family
    evidence: FloatArray
    weight: FloatArray
    estimates: FloatArray
    variances: FloatArray

    @classmethod
    def of(cls, family: Family, means: Means, noises: list[_Noise]) -> _Test:
        data = means.differences(means.blocks)
        curves: FloatArray | csr_array = means.differences(family.curves)
        few = csr_array(curves)  # of a step, two differences
        if few.nnz < tuning.FEW * curves.size:
            curves = few
        whole = np.array([float(data @ each.inverse @ data) for each in noises])
        alone = np.array([each.log_weight for each in noises]) - 0.5 * whole
        posterior = alone - logsumexp(alone)
        squares = np.array([_squares(family, curves, each, data) for each in noises])
        # Rounding errors of a noise that is hardly one go beyond what there is to be taken away.
        squares = np.clip(np.nan_to_num(squares), 0.0, np.maximum(whole, 0.0)[:, None])
        most = posterior + _gain(np.max(squares, axis=1), family.rank)
        some = np.flatnonzero(most >= np.max(most) - tuning.NO_EVIDENCE)
        beside = posterior[some, None] + _gain(squares[some], family.rank)
        evidence = np.asarray(logsumexp(beside, axis=0))
        best = int(np.argmax(evidence))
        weight = np.asarray(np.exp(beside[:, best] - evidence[best]), dtype=float)
        rows = means.differences(family.curves[family.members[best]])
        solved = np.array([rows @ noises[i].inverse for i in some])
        variances = np.linalg.pinv(solved @ rows.T)
        estimates = (variances @ (solved @ data)[..., None])[..., 0]
        return cls(family, evidence, weight, estimates, np.diagonal(variances, axis1=1, axis2=2))

    @property
    def log_evidence(self) -> float:
        """Averaged over the members."""
        return float(logsumexp(self.evidence) - np.log(self.evidence.size))

    @property
    def best(self) -> int:
        """The most evident member."""
        return int(np.argmax(self.evidence))

    @property
    def curve(self) -> FloatArray:
        """The most evident member with its size, u, (B,)."""
        shape = self.family.curves[self.family.members[self.best]]
        return np.asarray((self.weight @ self.estimates) @ shape)

    @property
    def neighbours(self) -> FloatArray:
        """The curves about those of the most evident member; one between them is their sum."""
        return self._near(self.family.members[self.best])

    def places(self, steps: Family) -> list[tuple[Family, FloatArray]]:
        """What the most evident member is sought in again, and the curves about it.

        The steps of a pulse one by one, finer and of any sizes, where the pulse may have them; but
        not where they are so near that the curves about one are those about the other.
        """
        ends = self.family.members[self.best]
        if self.family.is_pulse and np.ptp(ends) > 2 * tuning.NEAR:
            spans = [(low, high) for _, low, high in self.times]
            near = [self._near(end) for end in ends]
            return [(steps.within(*span), each) for span, each in zip(spans, near, strict=True)]
        return [(self.family, self.neighbours)]

    def _near(self, curves: IntArray) -> FloatArray:
        of = self.family.curves
        apart = 2 if self.family.has_phase else 1
        near = curves.reshape(-1, 1) + apart * np.arange(-tuning.NEAR, tuning.NEAR + 1)
        return of[np.unique(near[(near >= 0) & (near < len(of))])]

    @property
    def sizes(self) -> list[tuple[float, float, float]]:
        """Of each departure of the most evident member, and its 95 % interval.

        An amplitude if it has phases.
        """
        each = self.weight @ self.estimates
        variance = self.weight @ (self.variances + (self.estimates - each) ** 2)
        if self.family.has_phase:
            value = float(np.hypot(*each))
            error = float(np.sqrt(each**2 @ variance)) / value
            return [(value, max(value - WIDE * error, 0.0), value + WIDE * error)]
        half = WIDE * np.sqrt(variance)
        ends = ((each - half).tolist(), (each + half).tolist())
        return list(zip(each.tolist(), *ends, strict=True))

    @property
    def phase(self) -> float:
        """Of the most evident member, rad; 0 if it has none."""
        each = self.weight @ self.estimates
        return float(np.arctan2(each[1], each[0])) if self.family.has_phase else 0.0

    @property
    def times(self) -> list[tuple[float, float, float]]:
        """Of each departure of the most evident member, and what holds 95 % of the evidence, s."""
        share = np.exp(self.evidence - logsumexp(self.evidence))
        return [_time(each, share, float(each[self.best])) for each in self.family.times.T]


def _time(times: FloatArray, share: FloatArray, best: float) -> tuple[float, float, float]:
    """One of them, and the ends of the middle 95 %."""
    different, which = np.unique(times, return_inverse=True)
    middles = 0.5 * (different[1:] + different[:-1])
    edges = np.concatenate([different[:1], middles, different[-1:]])
    sums = np.cumsum(np.bincount(which, share))
    low, high = np.searchsorted(sums, [0.025, 0.975])
    return best, float(edges[low]), float(edges[min(high, different.size - 1) + 1])


def _squares(
    family: Family, curves: FloatArray | csr_array, noise: _Noise, data: FloatArray
) -> FloatArray:
    """Chi-square that each member takes away, (G,): a pulse with one size, up and back.

    curves: (M, D), differences of those of the family.
    """
    solved = np.asarray(curves @ noise.inverse)
    scores = solved @ data
    information = np.asarray((curves * solved).sum(axis=1))
    # A curve that known ones explain has none.
    least = tuning.NO_INFORMATION * np.max(information)
    first = family.members[:, 0]
    a, s = information[first] + least, scores[first]
    if family.members.shape[1] == 1:
        return np.asarray(s**2 / a)
    second = family.members[:, 1]
    b, c, t = np.asarray(curves @ solved.T)[first, second], information[second], scores[second]
    if family.is_pulse:
        return np.asarray((s - t) ** 2 / (a + c - 2.0 * b))
    c = c + least
    return np.asarray((c * s**2 - 2.0 * b * s * t + a * t**2) / (a * c - b**2))


def _gain(square: FloatArray, rank: int) -> FloatArray:
    """Logarithm of a Bayes factor, averaged over g, from the chi-square of so many curves.

    Nearly a half of it: what it is less is read from a table, to 0.01.
    """
    table = np.linspace(0.0, np.max(square), tuning.TABLE)
    g = tuning.PRIOR_SIZES[:, None]
    less = -0.5 * rank * np.log1p(g) - 0.5 * table / (1.0 + g)
    place = np.multiply(square, 1.0 / max(table[1], 1.0 / tuning.TABLE)).astype(np.int32)
    averaged = logsumexp(less, axis=0) - np.log(g.size)
    return np.asarray(averaged[np.minimum(place, tuning.TABLE - 1)] + 0.5 * square)


def _evidence(tests: Sequence[_Test]) -> float:
    """Averaged over kinds, each of which is as likely beforehand."""
    found = float(logsumexp([test.log_evidence for test in tests])) - np.log(len(tests))
    return float(np.exp(min(found, tuning.LARGEST_LOG_EVIDENCE)))


def _basis(curves: Sequence[FloatArray]) -> FloatArray:
    """Orthonormal rows that span the same as differences of curves, each (k, D)."""
    rows = np.vstack(curves)
    norms = np.linalg.norm(rows, axis=1)[:, None]
    # A step before the first block that exists has no differences.
    _, sizes, basis = np.linalg.svd((rows / np.where(norms > 0.0, norms, 1.0)), full_matrices=False)
    return np.asarray(basis[sizes > tuning.SPANNED * np.max(sizes, initial=0.0)])


def _share(curve: FloatArray, step: float, fitted: Fit) -> float:
    """Largest fraction of the model's wavelet variance that a curve of block means has."""
    tau = fitted.wv.tau
    edges = step * np.arange(curve.size + 1)
    integral = np.concatenate([[0.0], np.cumsum(curve)]) * step
    shares = [0.0]
    for each, implied in zip(tau, fitted.implied, strict=True):
        if step <= each <= 0.5 * edges[-1] and implied > 0.0:
            begin = np.linspace(0.0, edges[-1] - 2.0 * each, tuning.SHARE_POINTS)
            parts = [np.interp(begin + k * each, edges, integral) for k in range(3)]
            coefficient = (parts[2] - 2.0 * parts[1] + parts[0]) / (2.0 * each)
            shares.append(float(np.mean(coefficient**2) / implied))
    return max(shares)
