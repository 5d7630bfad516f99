"""The Allan family of deviations.

They see the same noise through other filters: the modified deviation distinguishes quantization
from white noise, the Hadamard deviation ignores a drift, the total deviation reaches long averaging
times in a short record. Fits use the wavelet variance, half the overlapping Allan variance; these
are for comparison with published figures.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
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
from gmwm.variance.covariance.allan import AllanFilter, allan_dof
from gmwm.variance.kernels import cumulative
from gmwm.variance.periodogram import Periodogram
from gmwm.variance.series import as_channel, checked_samples, where_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TAUS = {"octave": (1.0,), "decade": (1.0, 2.0, 4.0)}


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
