"""Which model: the best of a ranking that the data support."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self, cast

import numpy as np

from gmwm._core import checks
from gmwm._core.distributions import chi2
from gmwm._core.documents import Document
from gmwm._core.jobs import one_blas_thread
from gmwm._core.text import Printed, bullets, frame, html_table, plain_table
from gmwm._core.units import shown_unit
from gmwm.errors import InputError
from gmwm.estimate import Data, Fit, are_several, estimate
from gmwm.estimate.result import dense_curves, fit_joint
from gmwm.issues import notice
from gmwm.process import GaussMarkov, Model, Process, WhiteNoise, as_model
from gmwm.selection import tuning
from gmwm.selection.ranking import (
    MAX_GAUSS_MARKOV,
    Candidate,
    Choices,
    candidate_of,
    rank,
    rank_key,
)
from gmwm.selection.ties import ramp_or_walk, ranges
from gmwm.variance import PooledVariance, WaveletVariance, as_wavelet_variance

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

RULES = ("criterion", "merge")
_SHOWN = 12
_REDUNDANT = (
    "amplitude-bound",
    "search-limit",
    "redundant-term",
    "indistinct-terms",
    "undetermined",
    "confounded",
)
"""Codes of terms that the data do not support."""


@dataclass(frozen=True, repr=False)
class Selection(Document, Printed):
    """Candidate models, best first, and the fit of the chosen one.

    Attributes
    ----------
    ranking : tuple of Candidate
    chosen : Candidate
    fit : Fit
        Of the chosen model.
    """

    SCHEMA: ClassVar[str] = "gmwm.selection"

    ranking: tuple[Candidate, ...]
    chosen: Candidate
    fit: Fit

    @property
    def model(self) -> Model:
        """The chosen model with its estimated values."""
        return self.fit.model

    @property
    def ties(self) -> tuple[Candidate, ...]:
        """Candidates that fit equally well: within 2 of the best criterion.

        Candidates that are compared only may be better still.
        """
        limit = rank_key(self._best) + tuning.TIE
        return tuple(item for item in self.ranking if rank_key(item) <= limit)

    @property
    def surpassed_by(self) -> Candidate | None:
        """The candidate that is compared only, where it fits better than all choices."""
        first = self.ranking[0]
        return first if rank_key(first) + tuning.TIE < rank_key(self._best) else None

    @property
    def _best(self) -> Candidate:
        """The best candidate that may be chosen."""
        return next(item for item in self.ranking if not item.compared_only)

    @cached_property
    def rivals(self) -> tuple[Fit, ...]:
        """Fits of the other candidates that fit equally well, without redundant terms."""
        others = [item for item in self.ties if item is not self.chosen][: tuning.RIVALS]
        fits = [(item, estimate(item.model, self.fit.wv)) for item in others]
        return tuple(
            fit
            for item, fit in fits
            if not _has_redundant_term(fit)
            and not (item.compared_only and fit.goodness.is_excluded)
        )

    def ranges(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Range of each parameter over all models that fit equally well: their intervals joined.

        Gauss-Markov terms of two models belong together by their correlation times, one to one.
        Where another model has no such term, the range of its amplitude begins at zero.

        Parameters
        ----------
        level : float, optional
            Of the intervals that the ranges are made of.

        Returns
        -------
        dict
            Key -> (lower, upper) in SI units, for every estimated parameter of the chosen model;
            `Fit.interval` where no other model fits equally well.
        """
        return ranges(self.fit, self.rivals, checks.share("level", level, 0.95))

    def plot(self, ax: Axes | None = None, *, units: str = "field") -> Axes:
        """`Fit.plot` of the chosen model with the models that fit equally well; returns the axes.

        In data-sheet units (deg/h, ug), or in SI if ``units`` is "si".
        """
        axes = self.fit.plot(ax, units=units)
        factor = shown_unit(self.fit.wv.quantity, self.fit.wv.unit, units)[1]
        for rival in self.rivals:
            tau, curves = dense_curves(rival)
            total = factor * np.sqrt(np.sum([curve**2 for curve in curves.values()], axis=0))
            axes.plot(tau, total, ":k", label=f"fits equally well: {rival.model.title()}")
        axes.legend(fontsize="small")
        return axes

    def __iter__(self) -> Iterator[Candidate]:
        return iter(self.ranking)

    def __len__(self) -> int:
        return len(self.ranking)

    def __getitem__(self, index: int) -> Candidate:
        return self.ranking[index]

    @property
    def _shown(self) -> list[Candidate]:
        """The chosen candidate, then the others, best first."""
        return [self.chosen, *(item for item in self.ranking if item is not self.chosen)]

    def to_frame(self) -> pandas.DataFrame:
        """A table of the candidates, the chosen one first; needs pandas."""
        names = ("criterion", "objective", "chi_square", "n_parameters", "dof", "p_value")
        ties = self.ties
        rows = [
            {"model": item.model.title()}
            | {name: getattr(item, name) for name in names}
            | {"chosen": item is self.chosen, "tie": item in ties}
            | {"compared_only": item.compared_only}
            for item in self._shown
        ]
        return frame(rows, ("model", *names, "chosen", "tie", "compared_only"))

    def content(self) -> dict[str, Any]:
        return super().content() | {"chosen": self.ranking.index(self.chosen)}

    @classmethod
    def from_content(cls, content: Mapping[str, Any]) -> Self:
        ranking, index = content["ranking"], content["chosen"]
        if not isinstance(index, int) or index not in range(len(ranking)):
            raise InputError("the chosen model is not in the ranking: make the selection again")
        found = super().from_content({**content, "chosen": ranking[index]})
        return replace(found, chosen=found.ranking[index])

    def __repr__(self) -> str:
        return f"<Selection of {self.fit.model!r} among {len(self.ranking)}>"

    def _repr_html_(self) -> str:
        return html_table(f"{self.fit.wv.name or 'series'}: {len(self)} models", *self._table())

    def __str__(self) -> str:
        heads, rows, notes = self._table()
        return "\n".join([plain_table(heads, rows), *bullets(notes)])

    def _table(self) -> tuple[Sequence[str], list[Sequence[str]], list[str]]:
        """Heads, rows and notes of the printed table."""
        rows: list[Sequence[str]] = []
        for item in self._shown[:_SHOWN]:
            mark = "chosen" if item is self.chosen else "compared only" * item.compared_only
            mark = mark or "fits equally well" * (item in self.ties)
            numbers = f"{item.criterion - self.ranking[0].criterion:.4g}", f"{item.p_value:.2g}"
            rows.append((item.model.title(), mark, *numbers, str(item.n_parameters)))
        notes = [f"{len(self) - _SHOWN} more models fit less well"] * (len(self) > _SHOWN)
        if any(item.compared_only for item in self.ranking):
            notes.append(
                "flicker noise is compared but not chosen: extra=[BiasInstability()] allows it"
            )
        if self.chosen not in self.ties:
            notes.append("chosen: simpler, or the best whose terms the data support")
        return ("model", "", "difference", "p-value", "parameters"), rows, notes


@one_blas_thread()
def select(
    data: Data | Sequence[Data],
    dt: float | None = None,
    *,
    max_gauss_markov: int = MAX_GAUSS_MARKOV,
    extra: Sequence[Process] = (),
    rule: str = "criterion",
    candidates: Sequence[Process | Model | str] | None = None,
    rate: float | None = None,
) -> Selection:
    """Rank the candidate models of a series and fit the best one.

    Parameters
    ----------
    data : WaveletVariance, Channel or (n,) array_like, or a list of them
        Several recordings have one model; see `gmwm.JointFit`.
    dt, rate : float, optional
        Sampling interval, s, or rate, Hz; one is needed for an array.
    max_gauss_markov : int, optional
        Largest number of Gauss-Markov terms.
    extra : sequence of Process, optional
        Further terms that a model may have, of given shape and open amplitude, such as
        ``Sinusoid(frequency=0.565)`` or ``BiasInstability()``.
    rule : {"criterion", "merge"}, optional
        "merge" is the rule of Stebler et al. (2012): white noise (and ``extra``) with as many
        Gauss-Markov processes as allowed, then one less as long as two do not differ significantly
        or one is redundant. The ranking then has these models, each under its own weights.
    candidates : sequence of Process, Model or str, optional
        Rank only these models, such as ``["N + K", "N + GM"]``.

    Returns
    -------
    Selection

    Raises
    ------
    InputError
        If the data cannot be used, an extra term has an open shape, or the rule is unknown.

    Notes
    -----
    All candidates are compared under the weights of a rich mixture fitted to the wavelet variances,
    by their chi-square with the penalty ``3 p ln ln n`` of Hannan & Quinn (1979, *JRSS B* 41,
    190-195), consistent for moment selection (Andrews 1999, *Econometrica* 67, 543-564). Models
    within 2 of the best fit equally well, and the smallest of them wins. The chosen model is the
    first whose own fit finds all of its terms identifiable and describes every averaging time. For
    the rules of rate ramps, flicker noise and low-passes see docs/method.md, "Which model".
    """
    extra = _listed("extra", extra, "[Sinusoid(frequency=0.5)]")
    listed = _listed("candidates", candidates, '["N + K", "N + GM"]')
    models = [as_model(each) for each in listed]
    choices = Choices(max_gauss_markov, extra, models=tuple(dict.fromkeys(models)))
    if models and (extra or rule != RULES[0]):
        raise InputError("candidates are whole models: leave out extra and rule")
    if rate is not None:
        dt = checks.sampling_interval(dt, rate)
    if are_several(data):
        parts = [as_wavelet_variance(part, dt) for part in cast("Sequence[Data]", data)]
        wv: WaveletVariance = PooledVariance.of(parts)
    else:
        wv = as_wavelet_variance(cast("Data", data), dt)
    if checks.choice("rule", rule, RULES) == "merge":
        return _by_merging(wv, choices)
    ranked, slope = rank(wv, choices.seeing(wv))
    ranking = tuple(ranked)
    may_be_chosen = [item for item in ranking if not item.compared_only]
    chosen, fitted = _choose(may_be_chosen, wv, is_closed=bool(choices.models))
    if chosen not in ranking:
        ranking = tuple(sorted((*ranking, chosen), key=rank_key))
    if slope is not None and not _has_ramp(chosen.model):
        fitted = replace(fitted, notices=(*fitted.notices, ramp_or_walk(fitted, slope)))
    return Selection(ranking, chosen, _of_each(chosen, fitted, wv))


def _listed(name: str, given: Any, example: str) -> tuple[Any, ...]:
    if given is None:
        return ()
    if isinstance(given, str) or not isinstance(given, Iterable) or (name[0] == "c" and not given):
        raise InputError(f"{name} = {checks.shown(given)}: give a list, as in {name}={example}")
    return tuple(given)


def _choose(
    ranking: Sequence[Candidate], wv: WaveletVariance, *, is_closed: bool = False
) -> tuple[Candidate, Fit]:
    """The best of a ranking that the data support, and its fit."""
    limit = rank_key(ranking[0]) + tuning.TIE
    tried: list[tuple[Candidate, Fit]] = []
    found: tuple[Candidate, Fit] | None = None
    for candidate in _simplest_of_ties(ranking)[: tuning.FITS]:
        if found is not None and found[1].valid and rank_key(candidate) > limit:
            break
        fitted = estimate(candidate.model, wv)
        if not _is_supported(fitted):
            tried.append((candidate, fitted))
        elif found is None or found[1].goodness.loses_to(fitted.goodness):
            found = candidate, fitted
        if found is not None and not found[1].goodness.misses_a_level:
            break
    # A term too many does less harm than a level that is missed; without it there is neither.
    for candidate, fitted in tried:
        if found is not None and rank_key(candidate) > limit:
            break
        if found is None or found[1].goodness.loses_to(fitted.goodness):
            smaller = _supported_part(ranking, candidate, fitted, wv)
            if smaller is None or (is_closed and smaller[0] not in ranking):
                continue
            if found is None or found[1].goodness.loses_to(smaller[1].goodness):
                return smaller
    if found is not None:
        return _simplest_by_own_fit(ranking, *found, wv)
    return next((item for item in tried if not item[1].goodness.is_excluded), tried[0])


def _supported_part(
    ranking: Sequence[Candidate], candidate: Candidate, fitted: Fit, wv: WaveletVariance
) -> tuple[Candidate, Fit] | None:
    """A model without the terms that the data do not support; None if that is no better."""
    while (term := _doubtful_term(fitted)) is not None:
        left = list(candidate.model.terms)
        left.remove(next(each for each in left if _fills_in(each, term)))
        if all(each.is_drift or each.is_line for each in left):
            return None
        model = Model(tuple(left))
        fitted = estimate(model, wv)
        known = (item for item in ranking if item.model == model)
        candidate = next(known, replace(candidate_of(fitted), model=model))
    return (candidate, fitted) if _is_supported(fitted) else None


def _doubtful_term(fitted: Fit) -> Process | None:
    """A term that the data do not support."""
    model = fitted.model
    owners = {item.key: model.terms[item.term] for item in model.parameters}
    kinds = {type(term).__name__: term for term in model.terms}
    for each in fitted.notices:
        if each.code in _REDUNDANT:
            return owners[each.where] if each.where else kinds[each.values["process"]]
    return None


def _fills_in(term: Process, fitted: Process) -> bool:
    """Whether a term of a candidate is that of the fit."""
    given = {name: value for name, value in term.values.items() if value is not None}
    return type(term) is type(fitted) and given.items() <= fitted.values.items()


def _is_supported(fitted: Fit) -> bool:
    """Whether the data support all terms of a fit and no averaging time is missed by far."""
    return fitted.valid or not (_has_redundant_term(fitted) or fitted.goodness.is_excluded)


def _by_merging(wv: WaveletVariance, choices: Choices) -> Selection:
    """All Gauss-Markov processes allowed, one fewer while two are alike or one is redundant.

    A term whose removal makes the model miss an averaging time stays. If it is too slow for the
    record to determine its correlation time, that is held.
    """
    base = (WhiteNoise(), *choices.extra)
    sums = [
        (*base, *(GaussMarkov() for _ in range(g))) for g in range(choices.max_gauss_markov + 1)
    ]
    sums = [each for each in sums if each == base or 2 * len(each) - len(base) < wv.tau.size]
    fits: list[Fit] = []
    for terms in reversed(sums):
        fits.append(estimate(Model(terms), wv))
        if not _gauss_markov_is_redundant(fits[-1]):
            break
    ranking = [candidate_of(fitted) for fitted in reversed(fits)]
    if not fits[-1].valid:
        last = len(sums) - len(fits)
        for terms in sums[max(last, 1) : last + 2]:
            held = _with_slowest_held(terms[:-1], wv)
            if held is not None:
                fits.append(held)
                opened = held.model.with_params(dict.fromkeys(held.keys))
                ranking.insert(0, replace(candidate_of(held), model=opened))
                break
    return Selection(tuple(ranking), ranking[0], _of_each(ranking[0], fits[-1], wv))


def _with_slowest_held(others: Sequence[Process], wv: WaveletVariance) -> Fit | None:
    """The best valid fit of a Gauss-Markov term of held time beside others, or None."""
    times = wv.n * wv.dt / 2.0 ** np.arange(tuning.HELD_TIMES)
    models = (Model((*others, GaussMarkov(tau=float(tau)))) for tau in times)
    tried = [(estimate(model, wv), float(tau)) for model, tau in zip(models, times, strict=True)]
    right = [each for each in tried if each[0].valid]
    if not right:
        return None
    best, tau = min(right, key=lambda each: each[0].chi_square)
    most = best.chi_square + float(chi2.isf(2.0 * (1.0 - tuning.HELD_LEVEL), 1))
    # The limit lies between the shortest time that is allowed and the next one, which is not.
    shortest = 0.5 * min(time for fit, time in right if fit.chi_square <= most)
    key = next(i.key for i in best.model.parameters if i.value == tau)
    held = notice("time-held", key, {"tau": tau, "shortest": shortest})
    return replace(best, notices=(*best.notices, held))


def _of_each(chosen: Candidate, fitted: Fit, wv: WaveletVariance) -> Fit:
    """The fit of the chosen model, with the fits to each recording where there are several."""
    if not isinstance(wv, PooledVariance):
        return fitted
    return fit_joint(chosen.model, wv.parts, estimate, fitted)


def _simplest_of_ties(ranking: Sequence[Candidate]) -> list[Candidate]:
    """The ranking with the candidates that fit as well as the best one ordered by size."""
    limit = rank_key(ranking[0]) + tuning.TIE
    tied = [item for item in ranking if rank_key(item) <= limit]
    tied.sort(key=lambda item: item.n_parameters)
    return tied + list(ranking[len(tied) :])


def _simplest_by_own_fit(
    ranking: Sequence[Candidate], best: Candidate, fitted: Fit, wv: WaveletVariance
) -> tuple[Candidate, Fit]:
    """A simpler candidate that fits equally well under its own weights, or the best one."""
    limit = rank_key(best) + tuning.CONTEST
    simpler = [
        item
        for item in ranking
        if item.n_parameters < best.n_parameters
        and rank_key(item) <= limit
        and _has_ramp(item.model) == _has_ramp(best.model)
    ]
    for candidate in simpler[: tuning.COMPARED]:
        other = estimate(candidate.model, wv)
        as_good = _own_criterion(candidate, other) <= _own_criterion(best, fitted) + tuning.TIE
        as_good = as_good and other.discrepancy <= fitted.discrepancy
        if as_good and _is_supported(other) and not other.goodness.loses_to(fitted.goodness):
            return candidate, other
    return best, fitted


def _own_criterion(candidate: Candidate, fitted: Fit) -> float:
    """The criterion with the chi-square of the candidate's own fit."""
    statistic = fitted.chi_square_allowed if fitted.dof > 0 else 0.0
    return candidate.criterion - candidate.chi_square + statistic


def _has_ramp(model: Model) -> bool:
    return any(term.is_drift for term in model.terms)


def _gauss_markov_is_redundant(fitted: Fit) -> bool:
    """Whether two Gauss-Markov terms are alike, or one is not supported by the data."""
    model = fitted.model
    terms = {i for i, term in enumerate(model.terms) if term.ordered_by}
    if any(i.term in terms and i.key in fitted.upper_bounds for i in model.parameters):
        return True
    kind = GaussMarkov.__name__
    return any(
        notice.code == "indistinct-terms" or notice.values.get("process") == kind
        for notice in fitted.notices
    )


def _has_redundant_term(fitted: Fit) -> bool:
    """Whether some term of the model is not supported by the data."""
    return any(notice.code in _REDUNDANT for notice in fitted.notices)
