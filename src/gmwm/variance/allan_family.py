"""The Allan family of deviations, computed by allantools, with intervals of their own.

They see the same noise through other filters: the modified deviation distinguishes quantization
from white noise, the Hadamard deviation ignores a drift, the total deviation reaches long averaging
times in a short record. Fits use the wavelet variance, half the overlapping Allan variance; these
are for comparison with published figures.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core import checks
from gmwm._core.distributions import chi2
from gmwm._core.tables import cell, plain_table
from gmwm._core.typing import FloatArray
from gmwm._core.units import shown_unit
from gmwm.errors import InputError
from gmwm.readers import Channel
from gmwm.variance import tuning
from gmwm.variance.series import as_channel, checked_samples, where_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The total variance by power law of the spectrum: b T/tau - c degrees of freedom, bias 1 - a tau/T
# (Greenhall, Howe & Percival 1999, IEEE Trans. UFFC 46, 1183-1191).
_TOTAL = {0: (1.5, 0.0, 0.0), -1: (1.17, 0.22, 1.0 / (3.0 * np.log(2.0))), -2: (0.93, 0.36, 0.75)}
_TAUS = {"octave": (1.0,), "decade": (1.0, 2.0, 4.0)}


@dataclass(frozen=True)
class _Kind:
    """How a deviation is computed.

    label: In legends.
    function: Of allantools.
    reach: Averaging times that its filter spans.
    differences: Of the integrated series, that its filter takes.
    modified: Whether the filter averages the integrated series too.
    """

    label: str
    function: str
    reach: int
    differences: int
    modified: bool = False

    def longest(self, n: int) -> int:
        """Longest averaging time, in samples, with at least two terms."""
        return (n - 1) // self.reach


_KINDS = {
    "overlapping": _Kind("overlapping Allan", "oadev", 2, 2),
    "modified": _Kind("modified Allan", "mdev", 3, 2, modified=True),
    "hadamard": _Kind("overlapping Hadamard", "ohdev", 3, 3),
    "total": _Kind("total", "totdev", 2, 2),
}


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
                _KINDS[kind].label: (
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


def _noise_slopes(values: FloatArray, averaging: FloatArray) -> list[int]:
    """Powers of the frequency in the spectrum, -4 to 2, at each averaging time, in samples."""
    slopes: list[int] = []
    for m in averaging.astype(int):
        count = values.size // m
        if count >= tuning.LEAST_FOR_SLOPE or not slopes:
            slopes.append(_noise_slope(values[: count * m].reshape(count, m).mean(axis=1)))
        else:
            slopes.append(slopes[-1])
    return slopes


def deviations(
    data: Channel | FloatArray,
    dt: float | None = None,
    kinds: Sequence[str] = tuple(_KINDS),
    tau: str | Sequence[float] | FloatArray = "octave",
    *,
    confidence: float = 0.95,
    rate: float | None = None,
) -> Deviations:
    """Allan deviation and its relatives, by allantools (``pip install 'gmwm[allan]'``).

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
        If allantools is not installed, a kind or averaging time is not known or too long, or the
        data are not one series of finite numbers.

    Notes
    -----
    Riley (2008), *Handbook of Frequency Stability Analysis*, NIST SP 1065: eqs. (11), (14), (20)
    and (25) for the deviations; equivalent degrees of freedom of Greenhall & Riley (2003), of the
    total deviation by its table 7, for the power law that the lag-1 autocorrelation of the
    averages shows (Riley & Greenhall 2004); with fewer than 100 averages that of the next shorter
    averaging time. The total deviation follows its definition, low by up to 13 % where flicker
    noise dominates and 21 % where a random walk does; its intervals allow for that.

    A million samples take some two seconds for all four kinds.
    """
    try:
        import allantools
        import allantools.ci
    except ImportError:
        raise InputError(
            "these deviations are computed by allantools, which is not installed: install it with "
            "pip install 'gmwm[allan]'"
        ) from None
    channel = as_channel(data, dt, rate)
    values, runs, _ = checked_samples(channel)
    if not runs.is_complete:
        raise InputError(
            f"{where_of(channel)} has {runs.n - runs.present:,} missing samples: cut it to a part "
            "without any, or use gmwm.wavelet_variance, whose Allan deviation copes with gaps"
        )
    confidence = checks.share("confidence", confidence, 0.95)
    chosen = _chosen_kinds(kinds)
    averaging = _averaging(tau, channel)
    slopes = _noise_slopes(values, averaging)
    found: dict[str, list[FloatArray]] = {}
    for name, kind in chosen.items():
        longest = kind.longest(values.size)
        m = averaging[averaging <= longest]
        if not m.size:
            raise InputError(
                f"tau = {averaging[0] * channel.dt:g} s is too long for the {kind.label} deviation "
                f"of {values.size:,} samples: give at most {longest * channel.dt:g} s"
            )
        # Deviations of rates do not depend on the unit of time; at a rate of 1 the averaging times
        # are whole numbers, which no rounding can spoil.
        compute = getattr(allantools, kind.function)
        estimate = np.asarray(compute(values, rate=1.0, data_type="freq", taus=m)[1], dtype=float)
        dof, bias = _distribution(allantools, name, values.size, m, slopes[: m.size])
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


def _chosen_kinds(kinds: Sequence[str]) -> dict[str, _Kind]:
    if not isinstance(kinds, Iterable):
        raise InputError(f"kinds = {kinds!r}: choose from {', '.join(_KINDS)}")
    names = [kinds] if isinstance(kinds, str) else list(kinds)
    for name in names:
        if not isinstance(name, str) or name not in _KINDS:
            raise InputError(f"kind {name!r} is not known: choose from {', '.join(_KINDS)}")
    if not names:
        raise InputError(f"no kind of deviation is given: choose from {', '.join(_KINDS)}")
    return {name: _KINDS[name] for name in names}


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


def _noise_slope(averages: FloatArray) -> int:
    """Riley & Greenhall (2004): from the lag-1 autocorrelation, differenced until it is short."""
    if averages.size < 4:
        return 0
    place = np.linspace(-1.0, 1.0, averages.size)
    series = averages - np.mean(averages)
    series = series - place * (place @ series) / (place @ place)
    for differences in range(3):
        square = series @ series
        # White noise less its mean and slope has a correlation of -2/n on average.
        correlation = series[1:] @ series[:-1] / square if square > 0.0 else 0.0
        correlation += 2.0 / series.size if differences == 0 else 0.0
        fraction = correlation / max(1.0 + correlation, 0.1)
        if fraction < 0.25 or differences == 2:
            break
        series = np.diff(series)
    return int(np.clip(np.rint(-2.0 * (fraction + differences)), -4, 2))


def _distribution(
    allantools: ModuleType, name: str, n: int, m: FloatArray, slopes: Sequence[int]
) -> tuple[FloatArray, FloatArray]:
    """Degrees of freedom (Greenhall & Riley 2003) and bias of the variance by averaging time."""
    kind = _KINDS[name]
    pairs = list(zip(m.astype(int).tolist(), slopes, strict=True))
    order, dof, bias = kind.differences, np.empty(m.size), np.ones(m.size)
    for i, (size, slope) in enumerate(pairs):
        known = max(slope, -order)  # all that allantools has a table for
        few = (n + 1 - size * order) / size <= order
        if known == 2 and few and not kind.modified:
            known = 1  # the paper's sum for 2 is not in allantools
        dof[i] = allantools.ci.edf_greenhall(
            known, order, size, n + 1, overlapping=True, modified=kind.modified
        )
    if name == "total":
        for i, (size, slope) in enumerate(pairs):
            if slope > 0:  # not in the table
                continue
            b, c, a = _TOTAL[max(slope, -2)]
            if size > n / 8:  # at shorter averaging times it is the Allan variance all but exactly
                dof[i] = max(dof[i], b * n / size - c)
            bias[i] -= a * size / n
    return np.maximum(dof, tuning.LEAST_DOF_OF_FAMILY), bias
