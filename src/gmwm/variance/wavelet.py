"""The wavelet variance of a series, with what a fit needs to know of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from annotated_types import Ge, Le

from gmwm._core.distributions import chi2
from gmwm._core.documents import (
    Array,
    Document,
    Fraction,
    Interval,
    NotNegative,
    Samples,
    Text,
    check_covariance,
)
from gmwm._core.text import Printed, frame, html_table, plain_table
from gmwm._core.typing import FloatArray
from gmwm._core.units import shown_unit
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
from gmwm.process import PSD, wavelet as known_wavelet, wavelet_variance as variance_under
from gmwm.variance import tuning
from gmwm.variance.covariance.haar import haar_covariance, line_covariance, mean_covariance
from gmwm.variance.gaps import GapEffects
from gmwm.variance.levels import pilot_psd
from gmwm.variance.periodogram import Periodogram
from gmwm.variance.regressors import Regressors

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


_LEAST_DOF, _LEAST_QUANTILE = 0.01, 1e-9  # keep intervals that say nothing in numbers
_DYADIC = 1e-6  # relative; averaging times are exact but for rounding


@dataclass(frozen=True, eq=False, repr=False)
class WaveletVariance(Printed, Document):
    """MODWT wavelet variance of a series, level by level.

    Attributes
    ----------
    tau : (J,) ndarray
        Averaging times 2^(j-1) dt, s.
    variance : (J,) ndarray
        Unbiased estimates from the coefficients free of end effects, u^2.
    mean : (J,) ndarray
        Mean of these coefficients, u; R tau/2 under a drift of R.
    blocks : (B,) ndarray
        Means of blocks of samples about the mean of the series, u, from which a drift is estimated;
        NaN where samples are missing.
    block : int
        Samples per block.
    n : int
        Number of samples, missing ones included.
    dt : float
        Sampling interval, s.
    confidence : float
        Level of ``lower`` and ``upper``.
    name, quantity, unit : str
        Of the channel, where there is one.
    wavelet : str
        Filter, as PyWavelets names it.
    efficiency : float
        1 for the mean square of the coefficients, less for the robust estimate, see
        `gmwm.variance.robust`.
    driftless : (J,) ndarray or None
        For robust estimates, those of the series less its least-squares line, u^2: they are no
        quadratic function of a drift.
    gaps : GapEffects or None
        What missing samples do to the levels; ``None`` if there are none.
    fourth_cumulant : float
        Of the independent part of the samples, u^4. It makes the variance of heavy-tailed noise
        less certain than that of Gaussian noise; 0 where tails are not heavier, and for robust
        estimates.
    data_covariance : (J, J) ndarray or None
        Covariance of ``variance`` estimated from the coefficients themselves, u^4, where it was
        asked for.
    spectrum : Periodogram or None
        Of the samples, for ``covariance``; ``None`` where no run holds most of them, for robust
        estimates, streams and several recordings.
    regressors : Regressors or None
        Of a curve that is estimated beside the noise.
    """

    LATER = frozenset({"spectrum", "regressors"})

    tau: Array
    variance: Array
    mean: Array
    blocks: Array
    block: Samples
    n: Samples
    dt: Interval
    confidence: Fraction = 0.95
    name: Text = ""
    quantity: Text | None = None
    unit: Text = "u"
    wavelet: Text = "haar"
    efficiency: Annotated[float, Ge(1e-6), Le(1.0)] = 1.0
    driftless: Array | None = None
    gaps: GapEffects | None = None
    fourth_cumulant: Annotated[NotNegative, Le(tuning.LARGEST_VARIANCE**2)] = 0.0
    data_covariance: Array | None = None
    spectrum: Periodogram | None = None
    regressors: Regressors | None = None

    @property
    def n_all(self) -> int:
        """Number of samples of all recordings."""
        return self.n

    @property
    def extent(self) -> str:
        """Length and rate in words."""
        return f"{self.n:,} samples at {1.0 / self.dt:g} Hz"

    @property
    def averaging(self) -> FloatArray:
        """Averaging times in samples, (J,)."""
        return np.rint(self.tau / self.dt)

    @property
    def counts(self) -> FloatArray:
        """Number of coefficients of each level, (J,)."""
        return self.n - self.width + 1.0 if self.gaps is None else self.gaps.counts

    @property
    def width(self) -> FloatArray:
        """Number of samples in a coefficient, (J,)."""
        if self.wavelet == "haar":
            return 2.0 * self.averaging
        kind = known_wavelet(self.wavelet)
        return np.array([kind.width(j + 1) for j in range(self.tau.size)], dtype=float)

    @property
    def drift_response(self) -> FloatArray:
        """Mean of the coefficients per unit of drift (u/s), s, (J,)."""
        if self.wavelet != "haar" and known_wavelet(self.wavelet).vanishing_moments > 1:
            return np.zeros_like(self.tau)
        return 0.5 * self.tau

    @property
    def allan_variance(self) -> FloatArray:
        """Overlapping Allan variance, twice the wavelet variance, u^2, (J,)."""
        return 2.0 * self.variance

    @property
    def allan_deviation(self) -> FloatArray:
        """Overlapping Allan deviation, u, (J,)."""
        return np.sqrt(self.allan_variance)

    @property
    def _complete_levels(self) -> int:
        """Levels of a record of as many samples without gaps."""
        return known_wavelet(self.wavelet).levels(int(self.n))

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Whether missing samples shorten the curve."""
        lost = self._complete_levels - self.tau.size
        if self.gaps is None or lost <= 0:
            return ()
        ends, complete = float(self.tau[-1]), self.dt * 2.0 ** (self._complete_levels - 1)
        values = {"levels": lost, "tau": ends, "complete": complete}
        return (notice("curve-shortened", self.name, values),)

    # -- uncertainty -------------------------------------------------------------------------------

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of ``variance``, u^4, (J, J).

        For a Gaussian series with the smooth spectrum of its samples, about a drift where it has a
        plain one, or with the spectrum that the wavelet variances themselves imply; no model is
        assumed.
        """
        if self.spectrum is None:
            return self.covariance_under(pilot_psd(self._positive, self.averaging, self.dt))
        found = self.covariance_under(self.spectrum.root_square)
        means, response = self.mean_covariance_under(self.spectrum.psd), self.drift_response
        if response[-1] > 0.0 and self.mean[-1] ** 2 > tuning.PLAIN_DRIFT**2 * means[-1, -1]:
            # Means of fine levels are those of a coarser one, but for the response.
            at = np.maximum(np.arange(self.tau.size), int(np.argmax(np.diag(means) > 0.0)))
            drift = response**2 / response[at] * (self.mean[-1] / response[-1])
            return found + 4.0 * np.outer(drift, drift) * means[np.ix_(at, at)]
        implied = variance_under(self.spectrum.psd, (), self.tau, self.dt, self.wavelet)
        scale = self._positive / implied
        return found * np.outer(scale, scale)

    def covariance_under(self, psd: PSD, lines: Sequence[tuple[float, float]] = ()) -> FloatArray:
        """Covariance of ``variance`` for noise of a given spectrum, u^4, (J, J).

        The noise is Gaussian but for its white part, whose fourth cumulant c_4 adds c_4 / n to the
        variance of the mean square of n samples. A level of m samples has 1/(2 m) of that mean
        square, all levels together.

        Parameters
        ----------
        psd : callable
            ``psd(f, dt)``, two-sided, in u^2/Hz.
        lines : sequence of (float, float), optional
            Spectral lines beside it: frequency (Hz), amplitude (u).
        """
        if self.wavelet != "haar":
            from gmwm.variance.covariance.daubechies import wavelet_covariance

            complete = wavelet_covariance(psd, self.n, self.dt, self.wavelet, self.tau.size)
        else:
            complete = haar_covariance(psd, self.n, self.dt)
        covariance = self._with_gaps(complete)
        if lines:
            of_lines = line_covariance(lines, psd, self.dt, self.wavelet, self.counts)
            covariance = covariance + of_lines
        if self.efficiency < 1.0:
            from gmwm.variance.robust import robust_covariance

            covariance = robust_covariance(
                psd, self.n, self.dt, self.efficiency, covariance, self.counts
            )
        if self.fourth_cumulant > 0.0:
            share = 0.5 / self.averaging
            covariance = covariance + self.fourth_cumulant / self.counts[0] * np.outer(share, share)
        return covariance

    def mean_covariance_under(self, psd: PSD) -> FloatArray:
        """Covariance of ``mean`` at the coarse levels, zero at the others, u^2, (J, J)."""
        if not np.any(self.drift_response):
            return np.zeros((self.tau.size, self.tau.size))  # a drift adds nothing to scale
        return self._with_gaps(mean_covariance(psd, self.n, self.dt))

    def _with_gaps(self, complete: FloatArray) -> FloatArray:
        """The covariance of a complete record, for the levels and gaps of this one."""
        if self.gaps is None:
            return complete
        levels = slice(0, self.tau.size)
        return complete[levels, levels] * self.gaps.inflation

    @property
    def _positive(self) -> FloatArray:
        return np.maximum(self.variance, 1e-12 * np.max(self.variance))

    @cached_property
    def dof(self) -> FloatArray:
        """Equivalent degrees of freedom 2 nu^4 / var(nu^2) of each level, (J,)."""
        square = 2.0 * self._positive**2
        # At most one a coefficient; a level without any variance would divide zero by zero.
        least = np.maximum(square / self.counts, np.finfo(float).tiny)
        return np.maximum(square / np.maximum(np.diag(self.covariance), least), _LEAST_DOF)

    @property
    def lower(self) -> FloatArray:
        """Lower end of the chi-square interval at ``confidence``, u^2, (J,)."""
        return self._end(0.5 + 0.5 * self.confidence)

    @property
    def upper(self) -> FloatArray:
        """Upper end of the chi-square interval at ``confidence``, u^2, (J,)."""
        return self._end(0.5 - 0.5 * self.confidence)

    def _end(self, probability: float) -> FloatArray:
        quantile = np.maximum(chi2.ppf(probability, self.dof), _LEAST_QUANTILE)
        return np.asarray(self.dof * self.variance / quantile)

    def detrended(self, slope: float) -> FloatArray:
        """Wavelet variances of the series less a drift of ``slope`` (u/s), u^2, (J,).

        Exact; for robust estimates, those less the least-squares line.
        """
        if self.driftless is not None:
            return self.driftless
        step = slope * self.drift_response
        return self.variance - 2.0 * step * self.mean + step**2

    # -- printed, stored, drawn --------------------------------------------------------------------

    def __repr__(self) -> str:
        name = f"<{type(self).__name__} of {self.name or 'a series'}"
        return f"{name}: {self.extent}, {self.tau.size} levels>"

    def __str__(self) -> str:
        return self.text()

    def _repr_html_(self) -> str:
        return html_table(str(self).partition("\n")[0], *self._table("field"))

    def text(self, units: str = "field") -> str:
        """The text of `print`: Allan deviations in data-sheet units or, with "si", in SI."""
        head = f"{self.name or 'series'}: {self.extent}"
        if self.gaps is not None:
            head += f", {self.gaps.missing:,} of them missing"
        if self.wavelet != "haar":
            head += f", {self.wavelet}"
        if self.efficiency < 1.0:
            head += f", robust, efficiency {self.efficiency:g}"
        return f"{head}\n{plain_table(*self._table(units))}"

    def _table(self, units: str) -> tuple[list[str], list[list[str]]]:
        unit, factor = shown_unit(self.quantity, self.unit, units)
        curves = (factor * np.sqrt(2.0 * each) for each in (self.variance, self.lower, self.upper))
        rows = [
            [f"{tau:.6g}", f"{deviation:.5g}", f"{low:.5g} .. {high:.5g}", f"{dof:.3g}"]
            for tau, deviation, low, high, dof in zip(self.tau, *curves, self.dof, strict=True)
        ]
        interval = f"{100 * self.confidence:g} % interval"
        return ["tau [s]", f"Allan dev. [{unit}]", interval, "dof"], rows

    def check_content(self) -> None:
        size, complete = self.tau.size, self._complete_levels
        if not 1 <= size <= complete or (self.gaps is None and size < complete):
            raise ValueError(f"{size} levels where {self.n:,} samples have {complete}")
        for name in ("tau", "variance", "mean", "driftless"):
            values = getattr(self, name)
            if values is not None and not (values.shape == (size,) and np.all(np.isfinite(values))):
                raise ValueError(f"{name} is not a list of {size} numbers")
        if not np.all((self.variance >= 0.0) & (self.variance <= tuning.LARGEST_VARIANCE)):
            raise ValueError("a variance is negative or too large")
        if not np.allclose(self.tau, self.dt * 2.0 ** np.arange(size), rtol=_DYADIC, atol=0.0):
            raise ValueError("averaging times are not octaves of the sampling interval")
        fits = self.blocks.ndim == 1 and 1 <= self.blocks.size <= tuning.MOST_BLOCKS
        if not fits or self.block * self.blocks.size > self.n:
            raise ValueError("blocks hold more samples than there are, or none")
        if self.gaps is not None:
            self.gaps.check(self.n, size)
        if self.spectrum is not None:
            self.spectrum.check()
        if self.data_covariance is not None:
            check_covariance(self.data_covariance.tolist(), size, "data_covariance")

    def to_frame(self, *, units: str = "field") -> pandas.DataFrame:
        """A table of the levels, one a row; needs pandas.

        ``unit`` is that of the deviation, in data-sheet units or, with "si", in SI.
        """
        unit, factor = shown_unit(self.quantity, self.unit, units)
        powers = {"variance": 2, "lower": 2, "upper": 2, "allan_deviation": 1}
        columns = {"tau": self.tau} | {k: factor**n * getattr(self, k) for k, n in powers.items()}
        columns |= {"dof": self.dof, "unit": np.full(self.tau.size, unit)}
        rows = (dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))
        return frame(rows, tuple(columns))

    def plot(self, ax: Axes | None = None, *, units: str = "field") -> Axes:
        """Allan deviation with error bars against averaging time; returns the axes.

        In data-sheet units (deg/h, ug), or in SI if ``units`` is "si".
        """
        from gmwm import plotting

        unit, factor = shown_unit(self.quantity, self.unit, units)
        curves = (self.variance, self.lower, self.upper)
        return plotting.deviation(
            self.tau,
            *(factor * np.sqrt(2.0 * curve) for curve in curves),
            unit=unit,
            interval=f"{100 * self.confidence:g} %",
            title=self.name,
            ax=ax,
        )


@dataclass(frozen=True, eq=False, repr=False)
class PooledVariance(WaveletVariance):
    """Mean wavelet variance of several recordings, level by level.

    parts: Those of the recordings. All other attributes are as in `WaveletVariance`; there are as
        many levels as the longest recording has, and ``n`` is its length.
    """

    parts: tuple[WaveletVariance, ...] = ()

    @classmethod
    def of(cls, parts: Sequence[WaveletVariance]) -> PooledVariance:
        """Weighted by the equivalent degrees of freedom of each recording at each level.

        Raises InputError if there are none, or they do not belong together.
        """
        if not parts:
            raise InputError("no recordings given: give at least one wavelet variance")
        longest = max(parts, key=lambda part: part.tau.size)
        for part in parts:
            for name in ("dt", "unit", "wavelet", "efficiency"):
                if getattr(part, name) != getattr(longest, name):
                    raise InputError(
                        f"recordings need the same {name}, not {getattr(part, name)!r} and "
                        f"{getattr(longest, name)!r}"
                    )
            if not np.array_equal(part.tau, longest.tau[: part.tau.size]):
                raise InputError("recordings have different averaging times: fit curves one by one")
        shares = _shares(parts, longest.tau.size)

        def mean_of(values: Sequence[FloatArray | None]) -> FloatArray | None:
            """Weighted mean of what all recordings have."""
            total = np.zeros(shares.shape[1])
            for value, share in zip(values, shares, strict=True):
                if value is None:
                    return None
                total[: value.size] += share[: value.size] * value
            return total

        covariances = [part.data_covariance for part in parts if part.data_covariance is not None]
        own = {each.name: getattr(longest, each.name) for each in fields(WaveletVariance)}
        pooled = {
            name: mean_of([getattr(part, name) for part in parts])
            for name in ("variance", "mean", "driftless")
        }
        pooled["data_covariance"] = (
            _combined(covariances, shares) if len(covariances) == len(parts) else None
        )
        curves = [part.regressors for part in parts if part.regressors is not None]
        own["regressors"] = Regressors.pooled(curves, shares, longest.tau) if curves else None
        return cls(
            **{**own, **pooled, "fourth_cumulant": 0.0, "spectrum": None}, parts=tuple(parts)
        )

    @cached_property
    def shares(self) -> FloatArray:
        """Weight of each recording at each level, (parts, J); they sum to one."""
        return _shares(self.parts, self.tau.size)

    @property
    def extent(self) -> str:
        pooled = f"{len(self.parts)} recordings, {self.n_all:,} samples in all"
        return f"{pooled} at {1.0 / self.dt:g} Hz"

    @property
    def n_all(self) -> int:
        """Number of samples of all recordings."""
        return sum(part.n for part in self.parts)

    @property
    def counts(self) -> FloatArray:
        """Number of coefficients of each level in all recordings, (J,)."""
        total = np.zeros(self.tau.size)
        for part in self.parts:
            total[: part.tau.size] += part.counts
        return total

    def covariance_under(self, psd: PSD, lines: Sequence[tuple[float, float]] = ()) -> FloatArray:
        """Covariance of the mean for Gaussian noise of a given spectrum, u^4, (J, J)."""
        return _combined([part.covariance_under(psd, lines) for part in self.parts], self.shares)

    def mean_covariance_under(self, psd: PSD) -> FloatArray:
        """Covariance of ``mean``, u^2, (J, J)."""
        return _combined([part.mean_covariance_under(psd) for part in self.parts], self.shares)

    def content(self) -> dict[str, Any]:
        """As that of one recording."""
        found = super().content()
        del found["parts"]
        return found


def _shares(parts: Sequence[WaveletVariance], levels: int) -> FloatArray:
    shares = np.zeros((len(parts), levels))
    for row, part in zip(shares, parts, strict=True):
        row[: part.tau.size] = part.dof
    return np.asarray(shares / np.sum(shares, axis=0))


def _combined(matrices: Sequence[FloatArray], shares: FloatArray) -> FloatArray:
    """Covariance of the weighted sum of independent vectors."""
    total = np.zeros((shares.shape[1], shares.shape[1]))
    for matrix, share in zip(matrices, shares, strict=True):
        levels = slice(len(matrix))
        total[levels, levels] += np.outer(share[levels], share[levels]) * matrix
    return total
