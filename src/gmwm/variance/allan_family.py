"""The Allan family of deviations.

They see the same noise through other filters: the modified deviation distinguishes quantization
from white noise, the Hadamard deviation ignores a drift, the total deviation reaches long averaging
times in a short record. Fits use the wavelet variance, half the overlapping Allan variance; these
are for comparison with published figures.

Each is a mean of squares of filtered samples, a quadratic form. With M terms, transfer function H
and spectrum S its variance is 2/M int |H|^4 S^2 df. At long averaging times, where few terms and
the ends of the series matter, this is multiplied by a ratio of sums over means of blocks.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core import checks
from gmwm._core.distributions import chi2
from gmwm._core.text import cell, plain_table
from gmwm._core.typing import FloatArray
from gmwm._core.units import shown_unit
from gmwm.errors import InputError
from gmwm.readers import Channel
from gmwm.variance import tuning
from gmwm.variance.covariance.lags import LagGrid, block_spectrum
from gmwm.variance.kernels import cumulative
from gmwm.variance.periodogram import Periodogram
from gmwm.variance.series import as_channel, checked_samples, where_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_TAUS = {"octave": (1.0,), "decade": (1.0, 2.0, 4.0)}


@dataclass(frozen=True)
class AllanFilter:
    """The filter of a deviation of the family.

    differences: Of means over the averaging time, one after the other.
    modified: Whether the differences are averaged over as long again.
    reflected: Whether the series is continued by its reflection at both ends.
    """

    differences: int = 1
    modified: bool = False
    reflected: bool = False

    @property
    def reach(self) -> int:
        """Averaging times that the filter spans."""
        return 1 + self.differences + self.modified

    def gain(self, m: float, f: FloatArray, power: int = 1) -> FloatArray:
        """Squared gain to a power; beyond `tuning.LOBES` lobes their mean.

        f: (K,), cycles per sample.
        """
        means = 2 * (1 + self.modified)  # powers of the sine of means
        sines = power * (self.differences + 1 + self.modified)
        resolved = np.sin(np.pi * m * f) ** (2 * sines)
        lobes = np.where(m * f < tuning.LOBES, resolved, comb(2 * sines, sines) / 4.0**sines)
        scale = 4.0**self.differences / comb(2 * self.differences, self.differences)
        return np.asarray(scale**power * lobes / (m * np.sin(np.pi * f)) ** (means * power))

    def applied(self, series: FloatArray, m: int) -> FloatArray:
        """Its values along the first axis of a series or several, (M, ...)."""

        def means(values: FloatArray) -> FloatArray:
            total = np.cumsum(np.concatenate([np.zeros_like(values[:1]), values]), axis=0)
            return (total[m:] - total[:-m]) / m

        if self.reflected:
            series = np.concatenate([series[: m - 1][::-1], series, series[::-1][: m - 1]])
        found = means(series)
        for _ in range(self.differences):
            found = found[m:] - found[:-m]
        found = means(found) if self.modified else found
        return np.asarray(found / np.sqrt(comb(2 * self.differences, self.differences)))


_KINDS = {
    "overlapping": ("overlapping Allan", AllanFilter()),
    "modified": ("modified Allan", AllanFilter(modified=True)),
    "hadamard": ("overlapping Hadamard", AllanFilter(differences=2)),
    "total": ("total", AllanFilter(reflected=True)),
}
"""Kind -> its label in legends and its filter."""


@dataclass(frozen=True, eq=False)
class Deviations:
    """Deviations of several kinds of one series.

    Attributes
    ----------
    tau : dict of str to (J,) ndarray
        Kind -> averaging times, s; kinds reach differently far.
    deviation, lower, upper : dict of str to (J,) ndarray
        Kind -> deviations and the ends of their intervals, u.
    n : int
        Number of samples.
    dt : float
        Sampling interval, s.
    confidence : float
        Level of ``lower`` and ``upper``.
    name, quantity, unit : str
        Of the channel, where there is one.
    """

    tau: dict[str, FloatArray]
    deviation: dict[str, FloatArray]
    lower: dict[str, FloatArray]
    upper: dict[str, FloatArray]
    n: int
    dt: float
    confidence: float
    name: str = ""
    quantity: str | None = None
    unit: str = "u"

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds there are."""
        return tuple(self.tau)

    def __str__(self) -> str:
        columns = [
            dict(zip(self.tau[kind].tolist(), self.deviation[kind].tolist(), strict=True))
            for kind in self.kinds
        ]
        rows = [
            [f"{tau:.6g}", *(cell(column.get(tau), 5) for column in columns)]
            for tau in sorted(set().union(*columns))
        ]
        head = f"{self.name or 'series'}: {self.n:,} samples at {1.0 / self.dt:g} Hz"
        table = plain_table(["tau [s]", *self.kinds], rows)
        return f"{head}, deviations in {self.unit}\n{table}"

    def to_dict(self) -> dict[str, Any]:
        """Everything in JSON types, SI units."""
        parts = ("tau", "deviation", "lower", "upper")
        own = ("n", "dt", "name", "quantity", "unit", "confidence")
        return {name: getattr(self, name) for name in own} | {
            "kinds": {
                kind: {part: getattr(self, part)[kind].tolist() for part in parts}
                for kind in self.kinds
            }
        }

    def plot(self, ax: Axes | None = None, *, units: str = "field") -> Axes:
        """All kinds against averaging time; returns the axes.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            E.g. those of ``wavelet_variance(...).plot()``, which has the overlapping Allan
            deviation already; by default new ones.
        units : {"field", "si"}, optional
            deg/h and ug, or SI.
        """
        from gmwm import plotting

        unit, factor = shown_unit(self.quantity, self.unit, units)

        return plotting.deviations(
            {
                _KINDS[kind][0]: (
                    self.tau[kind],
                    factor * self.deviation[kind],
                    factor * self.lower[kind],
                    factor * self.upper[kind],
                )
                for kind in self.kinds
            },
            unit=unit,
            places=[list(_KINDS).index(kind) for kind in self.kinds],
            interval=f"{100 * self.confidence:g} %",
            title=self.name,
            ax=ax,
        )


def deviations(
    data: Channel | FloatArray,
    dt: float | None = None,
    kinds: Sequence[str] = tuple(_KINDS),
    tau: str | Sequence[float] | FloatArray = "octave",
    *,
    confidence: float = 0.95,
    rate: float | None = None,
) -> Deviations:
    """Allan deviation and its relatives.

    Parameters
    ----------
    data : Channel or (n,) array_like
        At least 8 samples, none missing.
    dt, rate : float, optional
        Sampling interval, s, or rate, Hz; one is needed for an array.
    kinds : sequence of {"overlapping", "modified", "hadamard", "total"}, optional
        Overlapping Allan, modified Allan, overlapping Hadamard and total deviation.
    tau : {"octave", "decade"} or sequence of float, optional
        Averaging times: 1, 2, 4, 8 ... or 1, 2, 4, 10, 20, 40 ... sampling intervals, or times in
        seconds, of which the nearest whole number of sampling intervals is taken. Those that are
        too long for a kind are left out.
    confidence : float, optional
        Level of the chi-square intervals.

    Raises
    ------
    InputError
        If a kind or averaging time is not known or too long, or the data are not one series of
        finite numbers.

    Notes
    -----
    Riley (2008), *Handbook of Frequency Stability Analysis*, NIST SP 1065: eqs. (11), (14), (20)
    and (25) for the deviations. Their equivalent degrees of freedom are those under the spectrum
    of the series, a multitaper periodogram smoothed by power laws and bins, so that they do not
    depend on which averaging times are asked for. The total deviation follows its definition, low
    by up to 13 % where flicker noise dominates and 21 % where a random walk does; its intervals
    allow for that.

    A million samples take some two seconds for all four kinds.
    """
    channel = as_channel(data, dt, rate)
    values, runs, mean = checked_samples(channel)
    if not runs.is_complete:
        raise InputError(
            f"{where_of(channel)} has {runs.n - runs.present:,} missing samples: cut it to a part "
            "without any, or use gmwm.wavelet_variance, whose Allan deviation copes with gaps"
        )
    confidence = checks.share("confidence", confidence, 0.95)
    averaging = _averaging(tau, channel)
    centred = values - mean
    spectrum = Periodogram.of(centred, cumulative(centred, 0.0))
    found: dict[str, list[FloatArray]] = {}
    for name in _chosen_kinds(kinds):
        label, kind = _KINDS[name]
        longest = (values.size - 1) // kind.reach  # with at least two terms
        m = averaging[averaging <= longest]
        if not m.size:
            raise InputError(
                f"tau = {averaging[0] * channel.dt:g} s is too long for the {label} deviation "
                f"of {values.size:,} samples: give at most {longest * channel.dt:g} s"
            )
        sizes = m.astype(int).tolist()
        squares = [np.mean(kind.applied(centred, each) ** 2) for each in sizes]
        estimate = np.sqrt(squares)
        found_dof = [allan_dof(kind, spectrum, values.size, each) for each in sizes]
        dof, bias = np.maximum(np.array(found_dof).T, tuning.LEAST_DOF_OF_FAMILY)
        found[name] = [m * channel.dt, estimate]
        for probability in (0.5 + 0.5 * confidence, 0.5 - 0.5 * confidence):
            found[name].append(estimate * np.sqrt(dof / bias / chi2.ppf(probability, dof)))
    times, deviation, lower, upper = (
        {name: parts[i] for name, parts in found.items()} for i in range(4)
    )
    return Deviations(
        times,
        deviation,
        lower,
        upper,
        n=values.size,
        dt=channel.dt,
        confidence=confidence,
        name=channel.name,
        quantity=channel.quantity,
        unit=channel.unit or "u",
    )


def _chosen_kinds(kinds: Sequence[str]) -> list[str]:
    if not isinstance(kinds, Iterable):
        raise InputError(f"kinds = {kinds!r}: choose from {', '.join(_KINDS)}")
    names = [kinds] if isinstance(kinds, str) else list(kinds)
    for name in names:
        if not isinstance(name, str) or name not in _KINDS:
            raise InputError(f"kind {name!r} is not known: choose from {', '.join(_KINDS)}")
    if not names:
        raise InputError(f"no kind of deviation is given: choose from {', '.join(_KINDS)}")
    return list(dict.fromkeys(names))


def _averaging(tau: str | Sequence[float] | FloatArray, channel: Channel) -> FloatArray:
    """Averaging times in samples: whole numbers, rising, each once."""
    if isinstance(tau, str):
        if tau not in _TAUS:
            raise InputError(f"tau = {tau!r}: give octave, decade or averaging times in seconds")
        base = 2.0 if tau == "octave" else 10.0
        powers = base ** np.arange(int(np.log(channel.n) / np.log(base)) + 1)
        m = np.outer(powers, _TAUS[tau]).ravel()
        return np.unique(m[m < channel.n])
    try:
        times = np.atleast_1d(np.asarray(tau, dtype=float))
    except (TypeError, ValueError):
        raise InputError(f"tau = {tau!r}: give averaging times in seconds") from None
    if times.ndim != 1 or not times.size or not np.all((times > 0.0) & np.isfinite(times)):
        raise InputError("tau: give positive averaging times in seconds, in one sequence")
    return np.unique(np.maximum(np.rint(times / channel.dt), 1.0))


def allan_dof(kind: AllanFilter, spectrum: Periodogram, n: int, m: int) -> tuple[float, float]:
    """Equivalent degrees of freedom 2 E^2 / Var of an estimate, and its relative bias.

    n, m: Samples of the series, and in an averaging time.
    Returns: the second is the mean over that of the filter without reflection.
    """
    f, weight = _nodes(m)
    mean = weight @ (kind.gain(m, f) * spectrum.psd(f, 1.0))
    square = weight @ (kind.gain(m, f, 2) * spectrum.root_square(f, 1.0) ** 2)
    part = min(n, tuning.FEW_AVERAGES * m)
    bias, share, added = _of_blocks(kind, spectrum, part, m)
    bias, share = (1.0 + (each - 1.0) * part / n for each in (bias, share))  # ends are 1/n of it
    half = square * share / (n - kind.reach * m + 1) + added * (part / n) ** 2
    return float((bias * mean) ** 2 / half), bias


@lru_cache(maxsize=64)
def _nodes(m: int) -> tuple[FloatArray, FloatArray]:
    """Frequencies and weights of a spectral integral, both signs; steps within a lobe are equal."""
    end, count = min(tuning.LOBES / m, 0.5), tuning.NODES_OF_FAMILY
    edges = np.append(np.linspace(0.0, end, count), np.geomspace(end, 0.5, count))
    return 0.5 * (edges[1:] + edges[:-1]), 2.0 * np.diff(edges)


def _of_blocks(
    kind: AllanFilter, spectrum: Periodogram, n: int, m: int
) -> tuple[float, float, float]:
    """What the ends do: factor of the mean; half the variance relative; variance added, u^4."""
    block = max(m // tuning.BLOCKS_OF_FAMILY, 1)
    size, average = round(n / block), round(m / block)
    grid = LagGrid.holding(3 * size, block)
    density = block_spectrum(spectrum.psd, 1.0, grid)
    weight = np.full(density.size, 2.0 / grid.size)
    weight[[0, -1]] *= 0.5
    square = weight @ (kind.gain(average, grid.frequency) * density) ** 2
    lag = np.arange(size)
    # A level common to all samples does not matter; at zero frequency only its bend is left.
    bend = 0.5 * (2.0 * np.pi * grid.frequency[0] * lag) ** 2 * density[0] / grid.size
    density[0] = 0.0
    covariance = (grid.transform(density)[:size] - bend)[np.abs(np.subtract.outer(lag, lag))]

    def moments(kind: AllanFilter) -> tuple[float, float]:
        rows = kind.applied(np.eye(size), average)
        found = rows @ covariance @ rows.T
        return float(np.mean(np.diag(found))), float(np.mean(found**2))

    mean, half = moments(replace(kind, reflected=False))
    own = moments(kind) if kind.reflected else (mean, half)
    share = half * (size - kind.reach * average + 1) / square
    return own[0] / mean, float(share), own[1] - half
