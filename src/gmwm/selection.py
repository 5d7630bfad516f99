"""Which model: sums of white, quantization and random-walk noise, a rate ramp, and up to five
Gauss-Markov processes, ranked by an information criterion on the GMWM objective.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.design import Design
from gmwm.estimate.fit import Fit
from gmwm.estimate.methods import fit
from gmwm.estimate.profile import Point, Profile, weight_root
from gmwm.estimate.ramp import Slope, bias_of_detrending, gls_slope
from gmwm.estimate.scales import Scales
from gmwm.estimate.start import Reference, dictionary_fit, search
from gmwm.process import (
    GaussMarkov,
    Model,
    Process,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    WhiteNoise,
)
from gmwm.recording import Channel
from gmwm.variance.analysis import as_wavelet_variance
from gmwm.variance.wavelet import WaveletVariance

MAX_GAUSS_MARKOV = 5

_USELESS = 1.0  # a Gauss-Markov that lowers the objective by less ends the search for more
_STRICTNESS = 1.5  # c of Hannan & Quinn; consistent above 1
_RAMP_MARGIN = 6.0  # a straight line passes through any slow drift that is seen only once
_RAMP_PLAUSIBLE = 2.0  # squared slope over its variance, below which no ramp is tried
_RAMP_ROUNDS = 3
_TIE = 2.0
_FITS = 5  # candidates that are fitted in full before the best one is taken as it is


@dataclass(frozen=True)
class Candidate:
    """A model of the ranking.

    Attributes
    ----------
    model : Model
        With open parameters.
    criterion : float
        Objective plus ``3 p ln ln n``; less is better.
    objective : float
        Weighted sum of squares under weights common to all candidates.
    n_parameters : int
    """

    model: Model
    criterion: float
    objective: float
    n_parameters: int


@dataclass(frozen=True)
class Selection:
    """Candidate models, best first, and the fit of the best one.

    Attributes
    ----------
    ranking : tuple of Candidate
    fit : Fit
        Of the chosen model.
    """

    ranking: tuple[Candidate, ...]
    fit: Fit

    @property
    def model(self) -> Model:
        """The chosen model with its estimated values."""
        return self.fit.model

    def __iter__(self) -> Iterator[Candidate]:
        return iter(self.ranking)

    def __len__(self) -> int:
        return len(self.ranking)

    def __getitem__(self, index: int) -> Candidate:
        return self.ranking[index]

    def __str__(self) -> str:
        best = self.ranking[0].criterion
        chosen = self.fit.model.opened()
        lines = [f"{'':2}{'difference':>10} {'objective':>10} {'parameters':>10}  model"]
        for item in self.ranking[:12]:
            mark = "> " if item.model == chosen else "  "
            lines.append(
                f"{mark}{item.criterion - best:>10.4g} {item.objective:>10.4g} "
                f"{item.n_parameters:>10}  {describe(item.model)}"
            )
        if len(self.ranking) > 12:
            lines.append(f"  and {len(self.ranking) - 12} more")
        return "\n".join(lines)


def describe(model: Model) -> str:
    """A model's terms in a few words: ``white noise + 2 Gauss-Markov``."""
    titles = [term.title() for term in model.terms]
    counts = {title: titles.count(title) for title in titles}
    return " + ".join(f"{n} {title}" if n > 1 else title for title, n in counts.items())


def select(
    data: WaveletVariance | Channel | FloatArray,
    dt: float | None = None,
    *,
    max_gauss_markov: int = MAX_GAUSS_MARKOV,
) -> Selection:
    """Rank the candidate models of a series and fit the best one.

    Parameters
    ----------
    data : WaveletVariance, Channel or (n,) array_like
    dt : float, optional
        Sampling interval, s; needed for an array.
    max_gauss_markov : int, optional
        Largest number of Gauss-Markov terms.

    Returns
    -------
    Selection

    Raises
    ------
    InputError
        If the data cannot be used.

    Notes
    -----
    All candidates are compared under the same weights, those of a rich mixture fitted to the
    wavelet variances, with the discrepancy that this mixture shows. The criterion is the objective
    with the penalty ``2 c p ln ln n``, c = 1.5, of Hannan & Quinn (1979, *JRSS B* 41, 190-195),
    consistent for moment selection (Andrews 1999, *Econometrica* 67, 543-564). A rate ramp adds one
    moment, its slope, so a model without one pays the squared slope over its variance; it must win
    by a margin of 6, for a straight line passes through any slow drift that is seen only once.
    Terms that come out as zero make a model equal to a smaller one, and it is left out of the
    ranking. Models within 2 of the best are a tie, in which the smaller one wins. Of the best
    candidates the first one is chosen whose own fit finds all of its terms identifiable.
    """
    wv = as_wavelet_variance(data, dt)
    if not 0 <= max_gauss_markov <= MAX_GAUSS_MARKOV:
        raise InputError(
            f"max_gauss_markov = {max_gauss_markov!r}: give a number from 0 to {MAX_GAUSS_MARKOV}"
        )
    ranking = _rank(wv, max_gauss_markov)
    fits = []
    for candidate in _simplest_of_ties(ranking)[:_FITS]:
        fitted = fit(candidate.model, wv)
        if fitted.valid or not _term_is_idle(fitted):
            return Selection(tuple(ranking), fitted)
        fits.append(fitted)
    return Selection(tuple(ranking), fits[0])


def _simplest_of_ties(ranking: list[Candidate]) -> list[Candidate]:
    """The ranking with the candidates that tie with the best one ordered by size."""
    limit = _rank_key(ranking[0]) + _TIE
    tied = [item for item in ranking if _rank_key(item) <= limit]
    tied.sort(key=lambda item: item.n_parameters)
    return tied + ranking[len(tied) :]


def _term_is_idle(fitted: Fit) -> bool:
    """Whether some term of the model is not supported by the data."""
    return any("identifiable" in remark or "use one less" in remark for remark in fitted.remarks)


def _rank(wv: WaveletVariance, max_gauss_markov: int) -> list[Candidate]:
    reference = dictionary_fit(wv, wv.variance)
    allowed = reference.discrepancy
    plain = _candidates(wv, wv.variance, reference.weights(wv.variance, allowed), max_gauss_markov)
    plain.sort(key=lambda item: item[0].criterion)
    slope = _slope_under(plain[0], wv)
    without = slope.value**2 / slope.variance
    ramped: list[Candidate] = []
    if without > _RAMP_PLAUSIBLE:
        target, drift_free = _drift_free(wv, slope)
        if drift_free.discrepancy < allowed:
            # Both kinds must be compared under the same allowance.
            allowed = drift_free.discrepancy
            weights = reference.weights(wv.variance, allowed)
            plain = _candidates(wv, wv.variance, weights, max_gauss_markov)
        found = _candidates(wv, target, drift_free.weights(target, allowed), max_gauss_markov)
        ramped = [_with_ramp(candidate, _penalty(wv.n)) for candidate, _ in found]
    return sorted(_without_ramp(plain, wv, without) + ramped, key=_rank_key)


def _slope_under(item: tuple[Candidate, Point], wv: WaveletVariance) -> Slope:
    """Generalized least-squares slope under the noise of a candidate."""
    candidate, point = item
    design = Design(candidate.model, Scales.of(wv))
    return gls_slope(wv, design.fitted_noise(point.x, point.shapes).psd)


def _drift_free(wv: WaveletVariance, slope: Slope) -> tuple[FloatArray, Reference]:
    """Wavelet variances without the drift, and the mixture fitted to them.

    Noise fitted with the drift in it makes the slope more uncertain than it is, so the slope is
    estimated again under the mixture that is left.
    """
    for _ in range(_RAMP_ROUNDS):
        target = wv.detrended(slope.value) + bias_of_detrending(wv, slope)
        reference = dictionary_fit(wv, target)
        slope = gls_slope(wv, reference.mixture.psd)
    return target, reference


def _with_ramp(candidate: Candidate, penalty: float) -> Candidate:
    return Candidate(
        candidate.model + RateRamp(),
        candidate.criterion + penalty,
        candidate.objective,
        candidate.n_parameters + 1,
    )


def _without_ramp(
    plain: list[tuple[Candidate, Point]], wv: WaveletVariance, squared_slope: float
) -> list[Candidate]:
    """Candidates that pay the squared slope over its variance: under their own noise, if good."""
    result = []
    for rank, item in enumerate(sorted(plain, key=lambda item: item[0].criterion)):
        price = squared_slope
        if squared_slope > _RAMP_PLAUSIBLE and rank < _FITS:
            slope = _slope_under(item, wv)
            price = slope.value**2 / slope.variance
        candidate = item[0]
        result.append(
            replace(
                candidate,
                criterion=candidate.criterion + price,
                objective=candidate.objective + price,
            )
        )
    return result


def _rank_key(candidate: Candidate) -> float:
    ramped = any(isinstance(term, RateRamp) for term in candidate.model.terms)
    return candidate.criterion + (_RAMP_MARGIN if ramped else 0.0)


def _penalty(n: int) -> float:
    """Price of a parameter: 2 c ln ln n."""
    return 2.0 * _STRICTNESS * float(np.log(np.log(n)))


def _candidates(
    wv: WaveletVariance, target: FloatArray, weights: FloatArray, max_gauss_markov: int
) -> list[tuple[Candidate, Point]]:
    """All sums whose terms come out positive, each started from the one with one term less."""
    root = weight_root(weights)
    penalty = _penalty(wv.n)
    found = []
    kinds = (WhiteNoise(), QuantizationNoise(), RandomWalk())
    for chosen in product((False, True), repeat=len(kinds)):
        base: tuple[Process, ...] = tuple(k for k, on in zip(kinds, chosen, strict=True) if on)
        shapes: list[tuple[float, ...] | None] = [() for _ in base]
        before = np.inf
        for g in range(max_gauss_markov + 1):
            if not base and g == 0:
                continue
            model = Model((*base, *(GaussMarkov() for _ in range(g))))
            design = Design(model, Scales.of(wv))
            if design.n_free >= wv.tau.size:
                break
            if g:
                shapes.append(None)
            point = search(Profile(design, target, root), shapes)
            shapes = list(point.shapes)
            if np.any(point.x <= 0.0) or before - point.objective < _USELESS:
                if g:
                    break
                before = point.objective
                continue
            before = point.objective
            criterion = point.objective + penalty * design.n_free
            candidate = Candidate(model, criterion, point.objective, design.n_free)
            found.append((candidate, point))
    return found or [_fallback(wv, target, root)]


def _fallback(wv: WaveletVariance, target: FloatArray, root: FloatArray) -> tuple[Candidate, Point]:
    """White noise alone, for records too short for anything else."""
    model = Model((WhiteNoise(),))
    design = Design(model, Scales.of(wv))
    point = search(Profile(design, target, root))
    criterion = point.objective + _penalty(wv.n)
    return Candidate(model, criterion, point.objective, 1), point
