"""Candidate models under common weights, ranked by an information criterion."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Annotated

import numpy as np
from annotated_types import Ge, Le

from gmwm._core import checks
from gmwm._core.distributions import chi2
from gmwm._core.documents import NotNegative
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.moments import (
    TEXTBOOK,
    Design,
    Point,
    Profile,
    Reference,
    dictionary_fit,
    search,
)
from gmwm.estimate.problem import (
    Coefficients,
    Moments,
    Scales,
    chi_square,
    gls_slope,
    slope_p_value,
    weight_root,
)
from gmwm.estimate.result import Fit
from gmwm.process import CATALOGUE, Model, Process, Shape
from gmwm.selection import tuning
from gmwm.selection.bandwidth import Bandwidth, sensor_bandwidth
from gmwm.variance import PooledVariance, WaveletVariance

MAX_GAUSS_MARKOV = 5

_RELAXATION = next(kind for kind in TEXTBOOK if kind.ordered_by)
"""The kind that a model may have several times: Gauss-Markov."""

_FLICKER = next(kind() for kind in CATALOGUE if kind.is_flicker)
_RAMP = next(kind() for kind in CATALOGUE if kind.is_drift)


@dataclass(frozen=True)
class Choices:
    """The terms that a model may have.

    extra: Further terms of open amplitude and given shape, each of which a candidate may have.
    bandwidth: The sensor's own low-pass, where the finest levels show one.
    models: The only candidates, where they are given; the other choices do not matter then.
    """

    max_gauss_markov: int = MAX_GAUSS_MARKOV
    extra: tuple[Process, ...] = ()
    bandwidth: Bandwidth | None = None
    models: tuple[Model, ...] = ()

    def __post_init__(self) -> None:
        most = self.max_gauss_markov
        if not checks.is_number(most) or most not in range(MAX_GAUSS_MARKOV + 1):
            raise InputError(
                f"max_gauss_markov = {checks.shown(most)}: give an integer from 0 to "
                f"{MAX_GAUSS_MARKOV}"
            )
        for process in self.extra:
            given = process.values if isinstance(process, Process) else {}
            linear = getattr(process, "linear_parameter", None)
            if linear is None or [k for k, v in given.items() if v is None] != [linear.name]:
                raise InputError(
                    f"extra = {checks.shown(process)}: give processes of fixed shape and free "
                    "amplitude, as in [Sinusoid(frequency=0.5)]"
                )
        if any(all(term.is_drift for term in model.terms) for model in self.models):
            raise InputError('the candidate R has no noise term: add one, as in "N + R"')

    def seeing(self, wv: WaveletVariance) -> Choices:
        """The choices with the sensor's low-pass, if these wavelet variances show one."""
        return replace(self, bandwidth=sensor_bandwidth(wv, self.given, penalty(wv.n)))

    @property
    def given(self) -> tuple[Process, ...]:
        """All terms besides the textbook processes, those of the sensor's low-pass last."""
        own = tuple(term for model in self.noise_models for term in model.terms)
        return (*self.extra, *own, *([] if self.bandwidth is None else [self.bandwidth.given]))

    @property
    def noise_models(self) -> list[Model]:
        """The given models without their ramps."""
        noise = [tuple(t for t in model.terms if not t.is_drift) for model in self.models]
        return [Model(terms) for terms in dict.fromkeys(noise)]

    @property
    def has_ramp(self) -> bool:
        """Whether one of the given models has a ramp."""
        return any(term.is_drift for model in self.models for term in model.terms)

    def among(self, ranking: Iterable[Candidate]) -> list[Candidate]:
        """The candidates that are given, all where none are."""
        terms = [Counter(model.terms) for model in self.models]
        return [item for item in ranking if not terms or Counter(item.model.terms) in terms]

    def opened(self, candidate: Candidate, n: int) -> Candidate:
        """A candidate with the low-pass as it is to be fitted; its shape costs parameters."""
        found = self.bandwidth
        if self.models or found is None or found.given not in candidate.model.terms:
            return candidate
        terms = (found.free if term == found.given else term for term in candidate.model.terms)
        return replace(
            candidate,
            model=Model(tuple(terms)),
            criterion=candidate.criterion + penalty(n) * found.n_shapes,
            n_parameters=candidate.n_parameters + found.n_shapes,
            dof=candidate.dof - found.n_shapes,
        )

    @property
    def with_flicker(self) -> Choices | None:
        """The choices with flicker noise; None if it is one already, or models are given."""
        if self.models or any(process.is_flicker for process in self.extra):
            return None
        return replace(self, extra=(*self.extra, _FLICKER))

    def bases(self) -> Iterator[tuple[Process, ...]]:
        """All sums of the terms whose shape is given, the empty one first.

        A low-pass that was found is in all of them: no sum without it describes the finest levels.
        """
        kinds = (*(kind for kind in TEXTBOOK if not kind.ordered_by), *self.extra)
        always = self.given[len(self.extra) :]
        for chosen in product((False, True), repeat=len(kinds)):
            yield (*(kind for kind, on in zip(kinds, chosen, strict=True) if on), *always)


@dataclass(frozen=True)
class Candidate:
    """A model of the ranking.

    criterion: Chi-square plus ``3 p ln ln n``; less is better.
    objective: Weighted sum of squares under weights common to all candidates.
    chi_square: Sum of squares on cube roots of the wavelet variances, which are close to normal at
        coarse levels too: otherwise a level of few degrees of freedom that is high by chance would
        ask for a term.
    compared_only: Whether it is never chosen: flicker noise, unless it is asked for.
    """

    model: Model
    criterion: float
    objective: NotNegative
    chi_square: NotNegative
    n_parameters: Annotated[int, Ge(1), Le(1_000_000)]
    dof: Annotated[int, Ge(-checks.MOST_SAMPLES), Le(checks.MOST_SAMPLES)]
    compared_only: bool = False

    @property
    def p_value(self) -> float:
        """Probability of a chi-square as large; NaN without degrees of freedom."""
        return float(chi2.sf(self.chi_square, self.dof)) if self.dof > 0 else float("nan")


def rank(wv: WaveletVariance, choices: Choices) -> tuple[list[Candidate], Coefficients | None]:
    """All candidates, best first, and a slope that an unresolved walk explains as well as a ramp.

    wv: Of one recording, or pooled of several; a drift is sought in one recording only, and not
        beside a curve.
    """
    target, reference = wv.variance, dictionary_fit(wv, wv.variance, choices.given)
    for _ in range(tuning.RAMP_ROUNDS if wv.regressors is not None else 0):
        target = Moments.of(wv, reference.mixture).under(reference.mixture).target
        reference = dictionary_fit(wv, target, choices.given)
    allowed = reference.discrepancy
    common = _CommonWeights.of(target, reference, allowed)
    plain = _candidates(wv, common, choices)
    plain.sort(key=lambda item: item[0].criterion)
    flicker = _flicker(wv, common, choices)
    try:
        is_one = not isinstance(wv, PooledVariance) and wv.regressors is None
        slope = _slope_under(plain[0], wv) if is_one else None
    except InputError:  # samples missing all over leave none to be seen
        slope = None
    if slope is None:
        if choices.has_ramp:
            raise InputError(
                "a ramp needs a single recording with enough samples in a row, and no covariates: "
                "leave R out"
            )
        found, rival = ([candidate for candidate, _ in each] for each in (plain, flicker))
        return _with_rival(found, rival), None
    without = slope.value**2 / slope.variance
    ramped: list[Candidate] = []
    ambiguous = None
    if without > tuning.RAMP_PLAUSIBLE or choices.has_ramp:
        target, drift_free, slope = _drift_free(wv, slope, choices)
        if choices.has_ramp or slope_p_value(wv, drift_free.mixture.psd) < tuning.RAMP_P:
            if drift_free.discrepancy < allowed:
                # Both kinds must be compared under the same allowance.
                allowed = drift_free.discrepancy
                common = _CommonWeights.of(wv.variance, reference, allowed)
                plain, flicker = _candidates(wv, common, choices), _flicker(wv, common, choices)
            drifting = _candidates(wv, _CommonWeights.of(target, drift_free, allowed), choices)
            ramped = [  # the slope is a moment of its own: the degrees of freedom stay
                replace(
                    each,
                    model=each.model + _RAMP,
                    criterion=each.criterion + penalty(wv.n),
                    n_parameters=each.n_parameters + 1,
                )
                for each, _ in drifting
            ]
        elif slope.value**2 / slope.variance > penalty(wv.n) + tuning.RAMP_MARGIN:
            ambiguous = slope  # a ramp would have won but for the walk
    ranking = sorted(choices.among(_without_ramp(plain, wv, without) + ramped), key=rank_key)
    return _with_rival(ranking, _without_ramp(flicker, wv, without)), ambiguous


def _with_rival(ranking: list[Candidate], flicker: Sequence[Candidate]) -> list[Candidate]:
    """The ranking with the candidate that is compared only, where it fits equally well."""
    limit = rank_key(ranking[0]) + tuning.TIE
    rivals = [replace(each, compared_only=True) for each in flicker if rank_key(each) <= limit]
    return sorted((*ranking, *rivals), key=rank_key)


def _slope_under(item: tuple[Candidate, Point], wv: WaveletVariance) -> Coefficients:
    """Generalized least-squares slope under the noise of a candidate."""
    candidate, point = item
    design = Design(candidate.model, Scales.of(wv))
    return gls_slope(wv, design.fitted_noise(point.x, point.shapes).psd)


def _drift_free(
    wv: WaveletVariance, slope: Coefficients, choices: Choices
) -> tuple[FloatArray, Reference, Coefficients]:
    """Wavelet variances without the drift, the mixture fitted to them, the slope under it.

    Noise fitted with the drift in it makes the slope look too uncertain, so the slope is estimated
    again under the mixture without it.
    """
    for _ in range(tuning.RAMP_ROUNDS):
        target = wv.detrended(slope.value) + slope.variance * wv.drift_response**2
        reference = dictionary_fit(wv, target, choices.given)
        slope = gls_slope(wv, reference.mixture.psd)
    return target, reference, slope


def _without_ramp(
    plain: list[tuple[Candidate, Point]], wv: WaveletVariance, squared_slope: float
) -> list[Candidate]:
    """Candidates that pay the squared slope over its variance, good ones under their own noise."""
    result = []
    for rank, item in enumerate(sorted(plain, key=lambda item: item[0].criterion)):
        price = squared_slope
        if squared_slope > tuning.RAMP_PLAUSIBLE and rank < tuning.FITS:
            slope = _slope_under(item, wv)
            price = slope.value**2 / slope.variance
        candidate = item[0]
        result.append(
            replace(
                candidate,
                criterion=candidate.criterion + price,
                objective=candidate.objective + price,
                chi_square=candidate.chi_square + price,
            )
        )
    return result


def candidate_of(fitted: Fit) -> Candidate:
    """The candidate of a fit under its own weights.

    Candidates of such fits are less comparable than those of `rank`, whose weights are common.
    """
    p, dof = len(fitted.keys), fitted.dof
    statistic = fitted.chi_square_allowed if dof > 0 else 0.0
    criterion = statistic + penalty(fitted.wv.n) * p
    return Candidate(fitted.model.opened(), criterion, fitted.objective, statistic, p, dof)


def rank_key(candidate: Candidate) -> float:
    ramped = any(term.is_drift for term in candidate.model.terms)
    return candidate.criterion + (tuning.RAMP_MARGIN if ramped else 0.0)


def penalty(n: int) -> float:
    """Price of a parameter: 2 c ln ln n."""
    return 2.0 * tuning.STRICTNESS * float(np.log(np.log(n)))


@dataclass(frozen=True, eq=False)
class _CommonWeights:
    """Moments that all candidates are compared on, and their covariance under the mixture."""

    target: FloatArray
    covariance: FloatArray
    root: FloatArray
    basis: FloatArray

    @classmethod
    def of(cls, target: FloatArray, reference: Reference, discrepancy: float) -> _CommonWeights:
        covariance = reference.weights(target, discrepancy)
        return cls(target, covariance, weight_root(covariance), reference.curve)

    def candidate(self, design: Design, point: Point) -> Candidate:
        implied = design.curves(point.shapes) @ design.amplitudes(point.x)
        statistic = point.objective
        if np.all(implied > 0.0) and np.all(self.basis > 0.0):
            statistic = chi_square(self.target, implied, self.covariance, self.basis)[1]
        return Candidate(
            model=design.model,
            criterion=statistic + penalty(design.scales.n) * design.n_free,
            objective=point.objective,
            chi_square=statistic,
            n_parameters=design.n_free,
            dof=self.target.size - design.n_free,
        )


def _candidates(
    wv: WaveletVariance, common: _CommonWeights, choices: Choices
) -> list[tuple[Candidate, Point]]:
    """The given models, or all sums whose terms come out positive; else white noise."""
    if choices.models:
        return [_at_best(wv, common, model) for model in choices.noise_models]
    found = list(_sums(wv, common, choices, choices.bases()))
    white = next(kind for kind in TEXTBOOK if kind.is_white)
    return found or [_at_best(wv, common, Model((white,)))]


def _flicker(
    wv: WaveletVariance, common: _CommonWeights, choices: Choices
) -> list[tuple[Candidate, Point]]:
    """The best sum with flicker noise, where that is no choice; none if none comes out positive.

    Several Gauss-Markov processes describe a plateau of many decades as far as the data reach, but
    not beyond.
    """
    more = choices.with_flicker
    if more is None:
        return []
    bases = (base for base in more.bases() if any(p.is_flicker for p in base))
    found = sorted(_sums(wv, common, more, bases), key=lambda item: item[0].criterion)
    return found[:1]


def _sums(
    wv: WaveletVariance,
    common: _CommonWeights,
    choices: Choices,
    bases: Iterable[tuple[Process, ...]],
) -> Iterator[tuple[Candidate, Point]]:
    """Sums on each base, each started from the one with one term less."""
    for base in bases:
        shapes: list[Shape | None] = [process.shape_values for process in base]
        before = np.inf
        for g in range(choices.max_gauss_markov + 1):
            if g == 0 and all(process.is_line for process in base):
                continue  # lines are no noise
            model = Model((*base, *(_RELAXATION for _ in range(g))))
            design = Design(model, Scales.of(wv))
            if design.n_free >= wv.tau.size:
                break
            if g:
                shapes.append(None)
            point = search(Profile(design, common.target, common.root), shapes)
            shapes = list(point.shapes)
            if np.any(point.x <= 0.0) or before - point.objective < tuning.USELESS:
                if g:
                    break
                before = point.objective
                continue
            before = point.objective
            yield choices.opened(common.candidate(design, point), wv.n), point


def _at_best(wv: WaveletVariance, common: _CommonWeights, model: Model) -> tuple[Candidate, Point]:
    """A model at its best point."""
    design = Design(model, Scales.of(wv))
    point = search(Profile(design, common.target, common.root))
    return common.candidate(design, point), point
