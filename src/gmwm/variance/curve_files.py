"""Files of Allan curves: tables, JSON, and the text files of imu_utils."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm._core.documents import read_json
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import AXES, TIME, Wanted, bare, load_columns, meaning, open_tables
from gmwm.variance.curve import Curve, curve

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
        (table,) = open_tables(path, Wanted(by_channel=True))[:1]
        values = load_columns(table, range(len(table.names)))
        columns = {name or str(i): values[i] for i, name in enumerate(table.names)}
    roles = {name: meaning(name) for name in columns}
    times = next(
        (n for n, role in roles.items() if bare(n).lower().startswith("tau") or role.role == TIME),
        None,
    )
    if times is None:
        raise InputError(f"{path.name} has no column of averaging times: name one tau")
    tau = columns.pop(times) * (roles.pop(times).seconds or 1.0)
    axes = {n: r.role for n, r in roles.items() if r.role and r.role[-1] in AXES} or dict.fromkeys(
        columns
    )
    if not axes:
        raise InputError(f"{path.name} has averaging times only: add a column for each axis")
    found: dict[str, Curve] = {}
    for name, axis in axes.items():
        own = unit.get((axis or "").partition("_")[0]) if isinstance(unit, Mapping) else unit
        own = roles[name].unit or own
        if own is None:
            raise InputError(
                f"{path.name} does not give the unit of {name}: write it as in gyro_x [deg/h], or "
                "give unit='deg/h'"
            )
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


def _of_imu_utils(path: Path, unit: Any) -> tuple[Columns, Any]:
    """Averaging times and axes of one sensor, and its unit."""
    stem = path.name.removesuffix("_t.txt")
    sensor = stem.rpartition("_")[2]
    if sensor not in _IMU_UTILS:
        raise InputError(f"{path.name} is not named data_NAME_gyr_t.txt or data_NAME_acc_t.txt")
    columns: Columns = {}
    for axis in ("t", *AXES):
        file = path.with_name(f"{stem}_{axis}.txt")
        (table,) = open_tables(file, Wanted(by_channel=True))
        columns["tau" if axis == "t" else f"{sensor}_{axis}"] = load_columns(table, [0])[0]
    if len({each.size for each in columns.values()}) > 1:
        raise InputError(f"{path.name} and the files of the axes differ in length")
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
