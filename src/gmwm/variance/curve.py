"""Allan curves that others made, without samples: arrays, tables, JSON, text of imu_utils."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from gmwm._core import checks
from gmwm._core.documents import NotNegative, read_json
from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT, factor, quantity_of
from gmwm.errors import InputError
from gmwm.process import PSD
from gmwm.readers import (
    AXES,
    TIME,
    Wanted,
    bare,
    load_columns,
    meaning,
    open_tables,
    stated_seconds,
)
from gmwm.variance import tuning
from gmwm.variance.covariance.haar import haar_covariance, line_covariance
from gmwm.variance.wavelet import WaveletVariance

_PER_WAVELET = {"deviation": 0.5, "variance": 0.5, "wavelet": 1.0}
"""Kind of values -> wavelet variance per square of a deviation, or per variance."""
_TAU = re.compile(r"^(averaging[ _]times?|taus?)(?![a-z])", re.IGNORECASE)


@dataclass(frozen=True, eq=False, repr=False)
class Curve(WaveletVariance):
    """Wavelet variances at any averaging times, without samples; made by `curve`.

    error: Standard error of reading a deviation, relative; it adds to that of the estimate. All
        other attributes are as in `WaveletVariance`.
    """

    SCHEMA: ClassVar[str] = "gmwm.curve"

    error: NotNegative = 0.0

    @property
    def extent(self) -> str:
        """Length and rate in words."""
        ends = f"{self.tau[0]:.4g} to {self.tau[-1]:.4g} s"
        return f"curve from {ends} of {super().extent}"

    def covariance_under(self, psd: PSD, lines: Sequence[tuple[float, float]] = ()) -> FloatArray:
        """As that of a series, at any averaging times, with the error of reading."""
        covariance = haar_covariance(psd, self.n, self.dt, averaging=self.averaging)
        covariance[np.diag_indices_from(covariance)] += (2.0 * self.error * self.variance) ** 2
        if lines:
            covariance += line_covariance(lines, psd, self.dt, self.averaging, self.counts)
        return covariance

    def detrended(self, slope: float) -> FloatArray:
        """Raise InputError: a curve does not show the sign of a drift."""
        raise InputError(
            "a curve cannot tell a drift from noise: fit a model without RateRamp, or fit the "
            "samples"
        )

    def check_content(self) -> None:
        m = self.averaging
        if not (m.ndim == 1 and m.size == self.variance.size and np.all(np.isfinite(m))):
            raise ValueError("not one variance an averaging time")
        if not (m[0] >= 1.0 and np.all(np.diff(m) > 0.0) and 2.0 * m[-1] <= self.n):
            raise ValueError("averaging times do not rise from one sample to half the record")
        if not np.all((self.variance > 0.0) & (self.variance <= tuning.LARGEST_VARIANCE)):
            raise ValueError("a variance is not positive, or too large")


def curve(
    tau: Sequence[float] | FloatArray,
    values: Sequence[float] | FloatArray,
    *,
    kind: str = "deviation",
    duration: float | None = None,
    rate: float | None = None,
    error: float = 0.0,
    unit: str = "u",
    name: str = "",
) -> Curve:
    """An Allan curve of another tool, a data sheet or a paper, to fit models to.

    `fit`, `select` and `plot` take it like a wavelet variance, and `bound` and `export` their
    results. Health, drifts and likelihoods need the samples.

    Parameters
    ----------
    tau : (J,) array_like
        Averaging times, s, in any order and at any distances. At most two an octave are kept: more
        would add little.
    values : (J,) array_like
        The curve, in ``unit`` or its square.
    kind : {"deviation", "variance", "wavelet"}, optional
        Overlapping Allan deviation, Allan variance, or Haar wavelet variance.
    duration : float, optional
        Length of the recording, s, which determines how accurate the values are; by default the
        shortest possible, twice the longest averaging time.
    rate : float, optional
        Sampling rate, Hz; by default one sample in the shortest averaging time.
    error : float, optional
        Standard error of reading a deviation, in per cent: 3 or so for a digitised plot.
    unit : str, optional
        Such as "deg/h", "deg/s", "ug", "m/s^2".
    name : str, optional
        Of the axis, such as "gyro_x".

    Returns
    -------
    Curve

    Raises
    ------
    InputError
        If these are not such values, fewer than four remain, or the recording is shorter than twice
        the longest averaging time.

    Examples
    --------
    >>> import gmwm
    >>> tau = [0.01, 0.1, 1.0, 10.0, 100.0, 1000.0]
    >>> found = gmwm.curve(tau, [36.0, 11.4, 3.6, 1.14, 0.37, 0.25], unit="deg/h", error=3.0)
    >>> gmwm.fit("N + K", found).valid
    True
    """
    scale = _PER_WAVELET[checks.choice("kind", kind, tuple(_PER_WAVELET))]
    times, given = _rising(tau, values)
    if checks.plausible("error", error) >= 100.0:
        raise InputError(f"error = {error:g} % of a deviation: give less than 100, such as 3")
    dt = checks.sampling_interval(float(times[0]) if rate is None else None, rate)
    kept = _apart(times / dt)
    times, given = times[kept], given[kept]
    if times.size < tuning.LEAST_TIMES:
        raise InputError(
            f"a curve has {times.size} averaging times between one sample, {dt:g} s, and the "
            f"longest: give at least {tuning.LEAST_TIMES}, half an octave apart"
        )
    m = np.rint(times / dt)
    shortest = 2.0 * m[-1] * dt
    length = shortest if duration is None else checks.positive("duration", duration)
    if length < shortest * (1.0 - tuning.TIME_ROUNDING):
        raise InputError(
            f"duration = {length:g} s is less than twice the longest averaging time, "
            f"{times[-1]:g} s: give the length of the recording"
        )
    quantity, own = None, unit
    if unit != "u":
        quantity = quantity_of(unit)
        own = SI_UNIT[quantity]
        given = given * factor(unit, own) ** (1 if kind == "deviation" else 2)
    variance = scale * (given**2 if kind == "deviation" else given)
    whole = np.abs(times - m * dt) < tuning.TIME_ROUNDING * times
    return Curve(
        tau=np.where(whole, m * dt, times),
        variance=variance,
        mean=np.zeros(times.size),
        blocks=np.array([np.nan]),
        block=1,
        n=checks.samples(max(round(length / dt), int(2.0 * m[-1]))),
        dt=dt,
        name=name,
        quantity=quantity,
        unit=own,
        error=float(error) / 100.0,
    )


def _rising(tau: Any, values: Any) -> tuple[FloatArray, FloatArray]:
    """Averaging times and values in rising order, checked."""
    times, given = (checks.real_numbers(each, "the curve") for each in (tau, values))
    if times.ndim != 1 or times.shape != given.shape:
        raise InputError(
            f"a curve of {given.shape} values at {times.shape} averaging times: give one list of "
            "each, of equal lengths"
        )
    if not np.all((times > 0.0) & np.isfinite(times) & (given > 0.0) & np.isfinite(given)):
        raise InputError("a curve has an averaging time or value that is not positive: remove it")
    order = np.argsort(times)
    times, given = times[order], given[order]
    if np.any((np.diff(times) == 0.0) & (np.abs(np.diff(np.log(given))) > tuning.SAME_VALUE)):
        raise InputError("a curve has two values at one averaging time: leave one of them out")
    return times, given


def _apart(m: FloatArray) -> list[int]:
    """Places of the averaging times, rising, in samples, that are kept."""
    kept: list[int] = []
    for place, each in enumerate(np.rint(m).tolist()):
        if each >= (np.rint(m[kept[-1]]) * tuning.LEAST_RATIO if kept else 1.0):
            kept.append(place)
    return kept


_IMU_UTILS = {"gyr": "deg/h", "acc": "m/s^2"}
"""Sensor in the names of imu_utils' files -> unit that it writes (its ``imu_an.cpp``)."""

Columns = dict[str, FloatArray]


def read_curves(
    path: str | os.PathLike[str],
    *,
    kind: str = "deviation",
    duration: float | None = None,
    rate: float | None = None,
    error: float = 0.0,
    unit: str | Mapping[str, str] | None = None,
) -> dict[str, Curve]:
    """The Allan curves of a file.

    Parameters
    ----------
    path : str or path
        Any table that `gmwm.read` opens (CSV, MAT, NPZ, ...) or JSON, with a column of averaging
        times, ``tau`` [s], and one for each axis, such as ``gyro_x [deg/h]``; or the
        ``data_NAME_gyr_t.txt`` of imu_utils, beside which ``..._x.txt`` and so on stand.
    kind, duration, rate, error : optional
        As in `curve`, for all axes.
    unit : str or mapping, optional
        Of columns whose name gives none, for all or by "gyro" and "accel".

    Returns
    -------
    dict
        Name of the axis -> curve.

    Raises
    ------
    InputError
        If the file cannot be read, a unit is missing, or an axis is not a curve.

    Examples
    --------
    >>> import gmwm, pathlib
    >>> text = "tau,gyro_x [deg/h],gyro_y [deg/h]"
    >>> for k in range(14):
    ...     text += f"\\n{0.01 * 2**k},{36 / 2 ** (k / 2)},{30 / 2 ** (k / 2)}"
    >>> _ = pathlib.Path("curves.csv").write_text(text)
    >>> found = gmwm.read_curves("curves.csv", duration=3600)
    >>> {axis: round(3600 * gmwm.fit("N", each).params["N"], 4) for axis, each in found.items()}
    {'gyro_x': 0.0628, 'gyro_y': 0.0524}
    """
    path = Path(path)
    if path.name.endswith("_t.txt"):
        columns, unit = _of_imu_utils(path, unit)
    elif path.suffix.lower() == ".json":
        columns = _of_json(path)
    else:
        columns = _of_table(path)
    named = {name: _TAU.sub("time", name.strip()) for name in columns}
    roles = {name: meaning(as_time) for name, as_time in named.items()}
    times = [n for n, role in roles.items() if role.role == TIME or named[n] != n.strip()]
    if not times:
        raise InputError(f"{path.name} has no column of averaging times: name one tau")
    if len(times) > 1:
        raise InputError(f"{path.name} has {len(times)} columns of averaging times: split the file")
    tau = columns.pop(times[0]) * (stated_seconds(path.name, named[times[0]]) or 1.0)
    roles.pop(times[0])
    axes = {n: r.role for n, r in roles.items() if r.role and r.role[-1] in AXES} or dict.fromkeys(
        columns
    )
    if not axes:
        raise InputError(f"{path.name} has averaging times only: add a column for each axis")
    found: dict[str, Curve] = {}
    for name, axis in axes.items():
        given = unit.get((axis or "").partition("_")[0]) if isinstance(unit, Mapping) else unit
        stated = roles[name].unit
        own = stated.text if stated else given
        if own is None:
            raise InputError(
                f"{path.name} does not give the unit of {name}: write it as in gyro_x [deg/h], or "
                "give unit='deg/h'"
            )
        if axis and quantity_of(own) != axis.partition("_")[0]:
            raise InputError(f"{path.name}: {own!r} is not a unit of {name}: correct it")
        there = np.isfinite(columns[name])
        label = axis or bare(name)
        try:
            found[label] = curve(
                tau[there],
                columns[name][there],
                kind=kind,
                duration=duration,
                rate=rate,
                error=error,
                unit=own,
                name=label,
            )
        except InputError as wrong:
            raise InputError(f"{path.name}, {name}: {wrong}") from None
    return found


def _of_table(path: Path) -> Columns:
    """Columns of a table by their names."""
    (table,) = open_tables(path, Wanted(by_channel=True))[:1]
    values = load_columns(table, range(len(table.names)))
    columns = {name or str(i): values[i] for i, name in enumerate(table.names)}
    if len(columns) < len(table.names):
        raise InputError(f"{path.name} has two columns of the same name: leave one out")
    return columns


def _of_imu_utils(path: Path, unit: Any) -> tuple[Columns, Any]:
    """Averaging times and axes of one sensor, and its unit."""
    stem = path.name.removesuffix("_t.txt")
    sensor = stem.rpartition("_")[2]
    if sensor not in _IMU_UTILS:
        raise InputError(f"{path.name} must be named data_NAME_gyr_t.txt or data_NAME_acc_t.txt")
    columns: Columns = {}
    for axis in ("t", *AXES):
        file = path.with_name(f"{stem}_{axis}.txt")
        (table,) = open_tables(file, Wanted(by_channel=True))
        columns["tau" if axis == "t" else f"{sensor}_{axis}"] = load_columns(table, [0])[0]
    if len({each.size for each in columns.values()}) > 1:
        raise InputError(f"{path.name} and its x, y and z files differ in length: get whole copies")
    return columns, unit or _IMU_UTILS[sensor]


def _of_json(path: Path) -> Columns:
    """Lists of equal length by their keys."""
    content = read_json(path)
    lists = content if isinstance(content, dict) else {}
    columns = {
        key: checks.real_numbers([np.nan if each is None else each for each in value], path.name)
        for key, value in lists.items()
        if isinstance(value, list)
    }
    if len({each.size for each in columns.values()}) != 1:
        raise InputError(
            f'{path.name} is not an object of lists of one length: write {{"tau": [...], '
            '"gyro_x [deg/h]": [...]}'
        )
    return columns
