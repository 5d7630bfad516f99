"""The classical route: straight lines in the log-log Allan plot (IEEE Std 952-2020, annex C).

Each noise of one parameter has an Allan deviation ``coefficient * tau^slope`` with a slope of its
own. Where one of them prevails the plot is straight, and the parameter is read from a line of that
slope. Where none prevails nothing can be read: that is the limit of this method, which the
generalized method of wavelet moments does not share.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise, product
from numbers import Real
from typing import ClassVar, NamedTuple

import numpy as np

from gmwm._core import checks
from gmwm._core.text import per_cent
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.problem.moments import weight_root
from gmwm.estimate.problem.ramp import ols_slope
from gmwm.estimate.result.estimate import Region, slope_name
from gmwm.estimate.result.fit import Fit
from gmwm.issues import Notice, notice
from gmwm.process import (
    BiasInstability,
    Model,
    Process,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    WhiteNoise,
)
from gmwm.variance import WaveletVariance

# A region is a run of octaves (from one level to the next) that is straight as far as the data
# show: each slope differs from the nominal one, and from that of its neighbours, by no more than
# the tolerance of reading a plot by eye and a share of noise, itself held to that tolerance. Else
# corners would pass for plateaus, the more of them the shorter the record, and one record in three
# of white noise, random walk and ramp would show a slope of +1/2 where there is none. Levels of
# fewer than 30 degrees of freedom, known to no better than 13 %, show no slope.
#
# So of 300 records of one process, none shows a second region; at a corner of white noise and
# random walk one or two in a hundred show a plateau, one in ten where its levels have but a hundred
# degrees of freedom. The broad top of a Gauss-Markov process does pass for a plateau.
#
# The tolerance adds up: eight octaves that are straight by eye may rise by a third, as those of a
# gyro whose white noise has a Gauss-Markov process of 0.1 s beside it. So a region keeps only the
# levels between any two of which the slope is the nominal one to within its standard error and a
# hundredth of the height, half of which counts in the standard error of the parameter.


@dataclass(frozen=True)
class _Line:
    """Allan deviation ``factor * |parameter| * tau^slope``."""

    key: str
    slope: float
    factor: float


_LINES: dict[type[Process], _Line] = {
    QuantizationNoise: _Line("Q", -1.0, np.sqrt(3.0)),
    WhiteNoise: _Line("N", -0.5, 1.0),
    BiasInstability: _Line("B", 0.0, np.sqrt(2.0 * np.log(2.0) / np.pi)),
    RandomWalk: _Line("K", 0.5, np.sqrt(1.0 / 3.0)),
    RateRamp: _Line("R", 1.0, np.sqrt(0.5)),
}

_ROUNDS = 5  # of reweighting, which settles in two


class _Run(NamedTuple):
    """Levels from ``first`` up to ``last``, which is included."""

    first: int
    last: int


@dataclass(frozen=True)
class AllanLines:
    """Straight lines in the Allan plot, ``method="allan"``.

    A region is part of a run of at least three levels whose local slopes agree with the nominal one
    and with each other by eye: the part where they agree to within their errors. Over its levels
    the mean of log(sigma) - slope log(tau) gives the line, hence the parameter: sqrt(3) Q/tau,
    N/sqrt(tau), B sqrt(2 ln 2/pi), K sqrt(tau/3) or abs(R) tau/sqrt(2). The ramp takes the sign of
    the mean slope of the series.

    Parameters
    ----------
    regions : mapping of str to (float, float), optional
        Key -> first and last averaging time (s, both included) of its region. Those of other keys
        are found in the plot, on the side of the given ones where their slope belongs. Where the
        plot does not have the slope in a given region, the fit is not valid.
    regression : {"ols", "irls"}, optional
        Ordinary least squares, as usual, or iteratively reweighted by the covariance of the levels,
        which the paper prefers.

    Raises
    ------
    InputError
        If the regions are not pairs of rising times, or the regression is neither.

    Notes
    -----
    The top of a Gauss-Markov process looks like bias instability, and its flank like a random walk:
    where the sum of the lines misses the data, the fit is not valid. Nothing is subtracted for
    given terms, and standard errors include 0.5 % for what other processes add in the region.

    IEEE Std 952-2020, annex C; Stebler et al. (2012), *Proc. IEEE/ION PLANS*, figure 5.
    """

    regions: Mapping[str, Sequence[float]] | None = None
    regression: str = "ols"

    name: ClassVar[str] = "allan"

    def __post_init__(self) -> None:
        checks.choice("regression", self.regression, ("ols", "irls"))
        if self.regions is None:
            return
        if not isinstance(self.regions, Mapping):
            raise InputError(
                f"regions = {self.regions!r}: give first and last averaging time by key, "
                'e.g. regions={"N": (1, 10)}'
            )
        for key, region in self.regions.items():
            _two_times(key, region)

    def estimate(self, model: Model, wv: WaveletVariance) -> Fit:
        """Read the open parameters of a model from straight regions of the Allan plot."""
        _check_octaves(wv)
        lines = _wanted(model)
        given = _given_runs(model, wv, lines, self.regions or {})
        runs = dict(given)
        searched = [line for key, line in lines.items() if key not in runs]
        runs |= _found_runs(wv, searched, lines, runs)
        if not runs:
            slopes = ", ".join(slope_name(line.slope) for line in lines.values())
            raise InputError(
                f"the Allan plot has no region of slope {slopes}: give the averaging times to read "
                'from, e.g. AllanLines(regions={"N": (1, 10)}), or use method="gmwm"'
            )
        keys = tuple(key for key in lines if key in runs)
        sizes, matrix = _coefficients(wv, [(lines[k], runs[k]) for k in keys], self.regression)
        scale = np.array([1.0 / lines[key].factor for key in keys])
        if "R" in keys and ols_slope(wv).value < 0.0:
            scale[keys.index("R")] *= -1.0
        fitted = _fitted(model, dict(zip(keys, map(float, scale * sizes), strict=True)))
        residual = wv.variance - fitted.wavelet_variance(wv.tau, wv.dt, wv.wavelet)
        whitened = weight_root(wv.covariance) @ residual
        return Fit(
            model=fitted,
            wv=wv,
            keys=keys,
            covariance=matrix * np.outer(scale, scale),
            upper_bounds={},
            objective=float(whitened @ whitened),
            chi_square=float("nan"),
            chi_square_allowed=float("nan"),
            dof=wv.tau.size - len(keys),
            discrepancy=0.0,
            method=self.name,
            weights="",
            notices=(
                *(
                    notice("no-region", key, {"slope": line.slope}, named=slope_name(line.slope))
                    for key, line in lines.items()
                    if key not in runs
                ),
                *_slope_notices(wv, [(lines[key], run) for key, run in given.items()]),
                *_misfit_notices(fitted, wv),
                *wv.notices,
            ),
            regions=tuple(
                Region(
                    key=key,
                    slope=lines[key].slope,
                    tau_min=float(wv.tau[runs[key].first]),
                    tau_max=float(wv.tau[runs[key].last]),
                    coefficient=float(coefficient),
                )
                for key, coefficient in zip(keys, sizes, strict=True)
            ),
        )


def _wanted(model: Model) -> dict[str, _Line]:
    """Lines of the open terms, in the order of the model."""
    for term in model.terms:
        if type(term) not in _LINES:
            raise InputError(
                f"{term!r} has no straight line in the Allan plot: leave it out, or use "
                "method='gmwm' (method='allan' reads quantization noise, white noise, bias "
                "instability, random walk and rate ramp)"
            )
    wanted = [_LINES[type(term)] for term in model.terms if term.is_open]
    return {line.key: line for line in wanted}


def _check_octaves(wv: WaveletVariance) -> None:
    if wv.wavelet != "haar":
        raise InputError(
            f'method = "allan" reads the Allan deviation, which {wv.wavelet!r} does not give: '
            'make the wavelet variance with wavelet="haar"'
        )
    if not np.allclose(np.diff(np.log2(wv.averaging)), 1.0):
        raise InputError(
            'method = "allan" reads octaves: give a curve at 1, 2, 4, ... times the shortest '
            'averaging time, or use method="gmwm"'
        )


def _given_runs(
    model: Model,
    wv: WaveletVariance,
    lines: Mapping[str, _Line],
    regions: Mapping[str, Sequence[float]],
) -> dict[str, _Run]:
    """The user's regions as runs of levels."""
    runs = {}
    for key, region in regions.items():
        if key not in lines:
            raise InputError(
                f"regions: the model {model!r} has no parameter {key!r} to estimate, only "
                f"{', '.join(lines) or 'given ones'}"
            )
        first, last = _two_times(key, region)
        # Averaging times such as 8 * 0.1 s are not the decimal numbers that people write.
        inside = (wv.tau >= first * (1.0 - 1e-9)) & (wv.tau <= last * (1.0 + 1e-9))
        levels = np.flatnonzero(inside & (wv.variance > 0.0))
        if levels.size == 0:
            raise InputError(
                f"regions: no averaging time lies between {first:g} and {last:g} s ({key}): choose "
                f"from {wv.tau[0]:g} to {wv.tau[-1]:g} s, at least a factor of two apart"
            )
        runs[key] = _Run(int(levels[0]), int(levels[-1]))
    return runs


def _two_times(key: str, region: Sequence[float]) -> tuple[float, float]:
    is_pair = isinstance(region, Sequence | np.ndarray) and len(region) == 2
    if is_pair and all(isinstance(end, Real) and np.isfinite(end) for end in region):
        first, last = float(region[0]), float(region[1])
        if 0.0 <= first <= last:
            return first, last
    raise InputError(
        f"regions[{key!r}] = {region!r}: give first and last averaging time in s, two rising "
        "numbers above zero"
    )


def _found_runs(
    wv: WaveletVariance,
    searched: Sequence[_Line],
    lines: Mapping[str, _Line],
    given: Mapping[str, _Run],
) -> dict[str, _Run]:
    """The choice of one run a line, or none, with rising slopes and as many octaves as possible."""
    ordered = sorted(searched, key=lambda line: line.slope)
    candidates: list[list[_Run | None]] = []
    for line in ordered:
        usable = (wv.dof >= tuning.WELL_KNOWN_DOF) & (wv.variance > 0.0)
        for key, run in given.items():
            if line.slope < lines[key].slope:
                usable[run.first + 1 :] = False
            else:
                usable[: run.last] = False
        candidates.append([None, *_straight_runs(wv, line.slope, usable)])
    best, most = {}, -1
    for choice in product(*candidates):
        chosen = {line.key: run for line, run in zip(ordered, choice, strict=True) if run}
        octaves = sum(run.last - run.first for run in chosen.values())
        # Runs of rising slopes follow each other; two may share the level between them.
        is_rising = all(a.last <= b.first for a, b in pairwise(chosen.values()))
        if is_rising and octaves > most:
            best, most = chosen, octaves
    return best


def _straight_runs(wv: WaveletVariance, slope: float, usable: np.ndarray) -> Iterator[_Run]:
    """Maximal runs of levels that are a region of this slope."""
    # A level without variance is not usable, and must not make the others NaN.
    positive = np.maximum(wv.variance, 1e-12 * np.max(wv.variance))
    log_deviation = 0.5 * np.log2(2.0 * positive)
    covariance = wv.covariance / np.outer(positive, positive) / (2.0 * np.log(2.0)) ** 2
    step = np.diff(np.eye(wv.tau.size), axis=0)
    off = np.abs(step @ log_deviation - slope) > _allowance(step, covariance)
    bend = np.diff(step, axis=0)
    bent = np.abs(bend @ log_deviation) > _allowance(bend, covariance)
    first = None
    for i in range(off.size + 1):
        fits = i < off.size and usable[i] and usable[i + 1] and not off[i]
        if first is not None and (not fits or bent[i - 1]):
            if i - first >= tuning.LEAST_OCTAVES:
                best = _within_errors(log_deviation - slope * np.log2(wv.tau), covariance, first, i)
                yield from [best] if best else []
            first = None
        if fits and first is None:
            first = i


def _within_errors(
    height: FloatArray, covariance: FloatArray, first: int, last: int
) -> _Run | None:
    """The best known part of a run whose heights are equal to within their errors, two by two."""
    variance = np.diag(covariance)
    apart = variance[:, None] + variance - 2.0 * covariance
    error = np.sqrt(np.maximum(apart, 0.0))
    allowed = np.log2(1.0 + tuning.HEIGHT_TOLERANCE) + tuning.REGION_SIGMA * error
    off = np.abs(height[:, None] - height) > allowed
    parts = [
        _Run(i, j)
        for i, j in combinations(range(first, last + 1), 2)
        if not np.any(off[i : j + 1, i : j + 1])
    ]
    # Of the slope of each octave; a drift without noise leaves rounding errors.
    known = 1.0 / np.maximum(np.diag(apart, 1), 1e-30)
    return max(parts, key=lambda part: np.sum(known[part.first : part.last]), default=None)


def _allowance(combination: FloatArray, covariance: FloatArray) -> FloatArray:
    """How far combinations (rows) of logarithms of this covariance may be off."""
    square = np.einsum("ij,jk,ik->i", combination, covariance, combination)
    error = np.sqrt(np.maximum(square, 0.0))  # a drift without noise leaves rounding errors
    return np.asarray(
        tuning.SLOPE_TOLERANCE + np.minimum(tuning.SLOPE_SIGMA * error, tuning.SLOPE_TOLERANCE)
    )


def _coefficients(
    wv: WaveletVariance, parts: Sequence[tuple[_Line, _Run]], regression: str
) -> tuple[FloatArray, FloatArray]:
    """Coefficients of the lines by least squares in log-log, and their covariance."""
    gradient = np.zeros((len(parts), wv.tau.size))
    coefficients = np.empty(len(parts))
    for i, (line, run) in enumerate(parts):
        levels = np.arange(run.first, run.last + 1)
        levels = levels[wv.variance[levels] > 0.0]
        heights = np.log(wv.allan_deviation[levels]) - line.slope * np.log(wv.tau[levels])
        weights = np.full(levels.size, 1.0 / levels.size)
        for _ in range(_ROUNDS if regression == "irls" else 0):
            relative = np.exp(2.0 * (heights - weights @ heights)) / wv.variance[levels]
            block = wv.covariance[np.ix_(levels, levels)] * np.outer(relative, relative)
            root = weight_root(block)
            weights = np.sum(root, axis=1) @ root
            weights /= np.sum(weights)
        coefficients[i] = np.exp(weights @ heights)
        gradient[i, levels] = coefficients[i] * weights / (2.0 * wv.variance[levels])
    read = np.diag((0.5 * tuning.HEIGHT_TOLERANCE * coefficients) ** 2)
    return coefficients, gradient @ wv.covariance @ gradient.T + read


def _fitted(model: Model, values: Mapping[str, float]) -> Model:
    """The given terms, and those whose parameter was found."""
    terms = []
    for term in model.terms:
        key = _LINES[type(term)].key
        if not term.is_open:
            terms.append(term)
        elif key in values:
            terms.append(term.with_values(**{key: values[key]}))
    return Model(tuple(terms))


def _slope_notices(wv: WaveletVariance, given: Sequence[tuple[_Line, _Run]]) -> list[Notice]:
    """Regions given by the user whose slope is not that of their line."""
    notices = []
    for line, run in given:
        levels = np.arange(run.first, run.last + 1)
        levels = levels[wv.variance[levels] > 0.0]
        if levels.size < 2:
            continue  # one level has no slope
        positive = wv.variance[levels]
        covariance = wv.covariance[np.ix_(levels, levels)] / np.outer(positive, positive) / 4.0
        x = np.log(wv.tau[levels])
        combination = (x - np.mean(x)) / np.sum((x - np.mean(x)) ** 2)
        slope = float(combination @ np.log(wv.allan_deviation[levels]))
        error = float(np.sqrt(combination @ covariance @ combination))
        if abs(slope - line.slope) > max(tuning.WRONG_SLOPE, tuning.LINES_SIGMA * error):
            words = {"first": wv.tau[run.first], "last": wv.tau[run.last]}
            values = {"slope": slope, "nominal": line.slope}
            named = slope_name(line.slope)
            notices.append(notice("wrong-slope", line.key, values, named=named, **words))
    return notices


def _misfit_notices(model: Model, wv: WaveletVariance) -> list[Notice]:
    """Misfit of the sum of the lines beyond chance."""
    variance = np.diag(wv.covariance)
    implied = model.wavelet_variance(wv.tau, wv.dt, wv.wavelet)
    # In logarithms, as the standard error of a variance is proportional to its estimate: one that
    # happens to be small claims to be exact.
    ratio = np.maximum(wv.variance, 1e-30) / implied
    is_off = np.abs(np.log(ratio)) > tuning.LINES_SIGMA * np.sqrt(2.0 / wv.dof)
    known = 2.0 * wv.variance**2 / np.maximum(variance, 1e-300) > tuning.WELL_KNOWN_DOF
    misfit = np.where(is_off & known, np.abs(np.sqrt(wv.variance / implied) - 1.0), 0.0)
    worst, tau = float(np.max(misfit)), float(wv.tau[int(np.argmax(misfit))])
    if worst <= tuning.POOR_DEVIATION:
        return []
    values = {"misfit": worst, "tau": tau, "discrepancy": 0.0}
    return [notice("misfit", "", values, variant="lines", share=per_cent(worst))]
