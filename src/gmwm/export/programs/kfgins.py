"""KF-GINS: the ``imunoise`` block of its configuration.

``src/kf-gins/gi_engine.cpp``: biases are Gauss-Markov processes of one correlation time for all six
axes (``GIEngine::insPropagation``), driven by 2 sd^2/tau (constructor). Units are turned into SI in
``src/kf_gins.cpp``, ``loadConfig``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import sqrt

from gmwm._core.units import factor
from gmwm.export.imu import Axis, Imu
from gmwm.export.target import ImuFile

_MGAL = 1e-5  # m/s^2
_HOUR = 3600.0


def _body(imu: Imu) -> list[str]:
    gyro, accel = (triad.xyz() for triad in imu.triads)
    per_root_hour, per_hour = factor("deg/sqrt(h)", "rad/sqrt(s)"), factor("deg/h", "rad/s")
    return [
        "imunoise:",
        f"  arw: {_list(gyro, lambda axis: axis.N / per_root_hour)}  # deg/sqrt(h)",
        f"  vrw: {_list(accel, lambda axis: axis.N * sqrt(_HOUR))}  # m/s/sqrt(h)",
        f"  gbstd: {_list(gyro, lambda axis: axis.sigma / per_hour)}  # deg/h",
        f"  abstd: {_list(accel, lambda axis: axis.sigma / _MGAL)}  # mGal",
        f"  corrtime: {gyro[0].tau / _HOUR:.6e}  # h",
        f"initbgstd: {_list(gyro, lambda axis: _start(axis) / per_hour)}  # deg/h",
        f"initbastd: {_list(accel, lambda axis: _start(axis) / _MGAL)}  # mGal",
    ]


def _start(axis: Axis) -> float:
    return sqrt(axis.sigma**2 + axis.initial_sd**2)


def _list(axes: Sequence[Axis], value: Callable[[Axis], float]) -> str:
    return f"[{', '.join(f'{value(axis):.6e}' for axis in axes)}]"


KFGINS = ImuFile(
    "kfgins", "KF-GINS", "imunoise of kf-gins.yaml",
    "N and sigma of each axis for the one tau of all six, which is the one that costs least",
    "src/kf-gins/gi_engine.cpp: GIEngine::GIEngine, insPropagation; src/kf_gins.cpp: loadConfig",
    _body, form="N+GM", one_tau=True,
    warnings=("gsstd and asstd, of the scale factors, are not in a static recording: keep yours",),
)  # fmt: skip
