"""The Haar wavelet variance of a series."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core.distributions import chi2
from gmwm._core.frames import frame
from gmwm._core.notices import Notice
from gmwm._core.text import Printed
from gmwm._core.typing import FloatArray
from gmwm._core.units import shown_unit
from gmwm.process import PSD
from gmwm.variance.covariance.haar import haar_covariance, line_covariance, mean_covariance
from gmwm.variance.gaps import GapEffects
from gmwm.variance.pilot import pilot_psd

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

_LEAST_DOF, _LEAST_QUANTILE = 0.01, 1e-9  # keep intervals that say nothing in numbers


def _complete_levels(n: int, wavelet: str) -> int:
    """Number of levels of a series without gaps."""
    if wavelet == "haar":
        return n.bit_length() - 1
    from gmwm.process import wavelet as known_wavelet

    return known_wavelet(wavelet).levels(n)


@dataclass(frozen=True, eq=False, repr=False)
class WaveletVariance(Printed):
    """Haar MODWT wavelet variance of a series, level by level, with what a fit needs to know.

    Attributes
    ----------
    tau : (J,) ndarray
        Averaging times 2^(j-1) dt, s.
    variance : (J,) ndarray
        Unbiased estimates from the coefficients free of end effects, u^2.
    mean : (J,) ndarray
        Mean of these coefficients, u; R tau/2 under a drift of R.
    blocks : (B,) ndarray
        Means of blocks of samples about the mean of the series, u: what a drift is estimated from;
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
        Of the independent part of the samples, u^4: what makes the variance of noise with heavy
        tails less certain than that of Gaussian noise; 0 where they are not heavier, and for robust
        estimates.
    data_covariance : (J, J) ndarray or None
        Covariance of ``variance`` estimated from the coefficients themselves, u^4, where it was
        asked for.
    """

    tau: FloatArray
    variance: FloatArray
    mean: FloatArray
    blocks: FloatArray
    block: int
    n: int
    dt: float
    confidence: float = 0.95
    name: str = ""
    quantity: str | None = None
    unit: str = "u"
    wavelet: str = "haar"
    efficiency: float = 1.0
    driftless: FloatArray | None = None
    gaps: GapEffects | None = None
    fourth_cumulant: float = 0.0
    data_covariance: FloatArray | None = None

    @property
    def n_all(self) -> int:
        """Number of samples of all recordings."""
        return self.n

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
        """Number of samples that a coefficient is made of, (J,)."""
        if self.wavelet == "haar":
            return 2.0 * self.averaging
        from gmwm.process import wavelet

        kind = wavelet(self.wavelet)
        return np.array([kind.width(j + 1) for j in range(self.tau.size)], dtype=float)

    @property
    def drift_response(self) -> FloatArray:
        """Mean of the coefficients per unit of drift (u/s), s, (J,)."""
        if self.wavelet == "haar":
            return 0.5 * self.tau
        from gmwm.process import wavelet

        moments = wavelet(self.wavelet).vanishing_moments
        return 0.5 * self.tau if moments < 2 else np.zeros_like(self.tau)

    @property
    def allan_variance(self) -> FloatArray:
        """Overlapping Allan variance, twice the wavelet variance, u^2, (J,)."""
        return 2.0 * self.variance

    @property
    def allan_deviation(self) -> FloatArray:
        """Overlapping Allan deviation, u, (J,)."""
        return np.sqrt(self.allan_variance)

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What missing samples took from it."""
        whole = _complete_levels(self.n, self.wavelet)
        lost = whole - self.tau.size
        if self.gaps is None or lost <= 0:
            return ()
        ends, complete = float(self.tau[-1]), self.dt * 2.0 ** (whole - 1)
        text = (
            f"missing samples shorten the curve: it ends at tau = {ends:.3g} s, that of a complete "
            f"record at {complete:.3g} s"
        )
        values = {"levels": lost, "tau": ends, "complete": complete}
        return (Notice("curve-shortened", "warning", self.name, text, values),)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of ``variance``, u^4, (J, J).

        That of a Gaussian series with the smooth spectrum that the wavelet variances themselves
        imply; no model is assumed.
        """
        psd = pilot_psd(self._positive, self.averaging, self.dt)
        return self.covariance_under(psd)

    def covariance_under(self, psd: PSD, lines: Sequence[tuple[float, float]] = ()) -> FloatArray:
        """Covariance of ``variance`` for noise of a given spectrum, u^4, (J, J).

        Gaussian but for its white part, whose fourth cumulant c_4 makes the mean square of n
        samples vary by c_4 / n more. Levels of m samples have 1/(2 m) of that mean square, all of
        them together.

        Parameters
        ----------
        psd : callable
            ``psd(f, dt)``, two-sided, in u^2/Hz.
        lines : sequence of (float, float), optional
            Spectral lines beside it: frequency (Hz), amplitude (u).
        """
        if self.wavelet != "haar":
            covariance = self._of_other_wavelet(psd, lines)
        else:
            covariance = self._with_gaps(haar_covariance(psd, self.n, self.dt))
            if lines:
                covariance = covariance + line_covariance(
                    tuple(lines), psd, self.dt, self.averaging, self.counts
                )
        if self.efficiency < 1.0:
            from gmwm.variance.covariance.robust import robust_covariance

            covariance = robust_covariance(
                psd, self.n, self.dt, self.efficiency, covariance, self.counts
            )
        if self.fourth_cumulant > 0.0:
            share = 0.5 / self.averaging
            covariance = covariance + self.fourth_cumulant / self.counts[0] * np.outer(share, share)
        return covariance

    def _of_other_wavelet(self, psd: PSD, lines: Sequence[tuple[float, float]]) -> FloatArray:
        from gmwm.variance.covariance.daubechies import wavelet_covariance

        levels = self.tau.size
        covariance = wavelet_covariance(psd, self.n, self.dt, self.wavelet, levels, tuple(lines))
        return self._with_gaps(covariance)

    def mean_covariance_under(self, psd: PSD) -> FloatArray:
        """Covariance of ``mean`` at the coarse levels, zero at the others, u^2, (J, J)."""
        if not np.any(self.drift_response):
            return np.zeros((self.tau.size, self.tau.size))  # a drift adds nothing to scale
        return self._with_gaps(mean_covariance(psd, self.n, self.dt))

    def _with_gaps(self, complete: FloatArray) -> FloatArray:
        """A covariance of all levels of a complete record, for those that the series has."""
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

        Exactly; of robust estimates, those less the least-squares line.
        """
        if self.driftless is not None:
            return self.driftless
        step = slope * self.drift_response
        return self.variance - 2.0 * step * self.mean + step**2

    def __repr__(self) -> str:
        size = f"{self.n:,} samples at {1.0 / self.dt:g} Hz"
        return (
            f"<{type(self).__name__} of {self.name or 'a series'}: {size}, {self.tau.size} levels>"
        )

    def __str__(self) -> str:
        head = f"{self.name or 'series'}: {self.n:,} samples at {1.0 / self.dt:g} Hz{self._how()}"
        unit = self.unit or "u"
        lines = [head, f"{'tau [s]':>12} {f'Allan dev. [{unit}]':>22} {'95 % interval':>27}  dof"]
        lines[1] = lines[1].replace("95 %", f"{100 * self.confidence:g} %")
        low, high = np.sqrt(2.0 * self.lower), np.sqrt(2.0 * self.upper)
        for row in zip(self.tau, self.allan_deviation, low, high, self.dof, strict=True):
            tau, dev, a, b, dof = row
            lines.append(f"{tau:12.6g} {dev:22.5g} {f'{a:.5g} .. {b:.5g}':>27} {dof:4.3g}")
        return "\n".join(lines)

    def _how(self) -> str:
        """What differs from the usual, for the head of a table."""
        parts = []
        if self.gaps is not None:
            parts.append(f"{self.gaps.missing:,} of them missing")
        if self.wavelet != "haar":
            parts.append(self.wavelet)
        if self.efficiency < 1.0:
            parts.append(f"robust, efficiency {self.efficiency:g}")
        return "".join(f", {part}" for part in parts)

    def to_dict(self) -> dict[str, Any]:
        """All that is needed to make the object again, in JSON types; see `from_dict`."""
        return {
            "n": self.n,
            "dt": self.dt,
            "name": self.name,
            "quantity": self.quantity,
            "unit": self.unit,
            "confidence": self.confidence,
            "tau": self.tau.tolist(),
            "variance": self.variance.tolist(),
            "mean": self.mean.tolist(),
            "block": self.block,
            "blocks": [None if np.isnan(mean) else mean for mean in self.blocks.tolist()],
            "wavelet": self.wavelet,
            "efficiency": self.efficiency,
            "driftless": None if self.driftless is None else self.driftless.tolist(),
            "gaps": None if self.gaps is None else self.gaps.to_dict(),
            "fourth_cumulant": self.fourth_cumulant,
            "data_covariance": (
                None if self.data_covariance is None else self.data_covariance.tolist()
            ),
        }

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> WaveletVariance:
        """Inverse of `to_dict`.

        Raises
        ------
        InputError
            With the place of the first thing that cannot be used.
        """
        from gmwm.variance.form import WaveletVarianceForm

        content = WaveletVarianceForm.checked(content)
        arrays = {
            k: np.array(content[k], dtype=float) for k in ("tau", "variance", "mean", "blocks")
        }
        found: dict[str, Any] = {**content, **arrays}
        if content.get("gaps") is not None:
            found["gaps"] = GapEffects.from_dict(content["gaps"])
        for name in ("data_covariance", "driftless"):
            if content.get(name) is not None:
                found[name] = np.array(content[name], dtype=float)
        return cls(**found)

    def to_frame(self) -> pandas.DataFrame:
        """A table of the levels, one a row, in SI units; needs pandas."""
        names = ("tau", "variance", "lower", "upper", "allan_deviation", "dof")
        columns = [getattr(self, name) for name in names]
        rows = (dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True))
        return frame(rows, names)

    def plot(self, ax: Axes | None = None, *, units: str = "field") -> Axes:
        """Allan deviation with error bars against averaging time; returns the axes.

        In the units of the field (deg/h, ug), or in SI if ``units`` is "si".
        """
        from gmwm import plotting

        unit, factor = shown_unit(self.quantity, self.unit, units)
        values = (
            factor * np.sqrt(2.0 * curve) for curve in (self.variance, self.lower, self.upper)
        )
        return plotting.deviation(
            self.tau, *values, unit=unit, interval=f"{100 * self.confidence:g} %",
            title=self.name, ax=ax,
        )  # fmt: skip
