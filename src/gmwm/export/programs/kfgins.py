"""KF-GINS: the ``imunoise`` block of its configuration.

``src/kf-gins/gi_engine.cpp``: biases are Gauss-Markov processes of one correlation time for all six
axes (``GIEngine::insPropagation``), driven by 2 sd^2/tau (constructor). Units are turned into SI in
``src/kf_gins.cpp``, ``loadConfig``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import sqrt

from gmwm.export.imu import Axis, ImuNumbers
from gmwm.export.keys import ARW, DEG_H, MemoryKeys
from gmwm.export.target import ImuFile

_MGAL = 1e-5  # m/s^2
_HOUR = 3600.0


class KfGins(ImuFile):
    """N, sigma and tau in the units of data sheets, and the biases at the start."""

    name = "kfgins"
    title = "KF-GINS"
    file = "imunoise of kf-gins.yaml"
    convention = (
        "N and sigma of each axis for the one tau of all six, which is the one that costs least"
    )
    source = (
        "src/kf-gins/gi_engine.cpp: GIEngine::GIEngine, insPropagation; src/kf_gins.cpp: loadConfig"
    )
    form = "N+GM"
    one_tau = True
    warnings = ("gsstd and asstd, of the scale factors, are not in a static recording: keep yours",)
    file_name = "kf-gins.yaml"
    keys = MemoryKeys(
        ("arw", "gbstd", "corrtime", "vrw", "abstd", "corrtime"),
        (ARW, DEG_H, _HOUR, 1.0 / 60.0, _MGAL, _HOUR),
    )

    def body(self, imu: ImuNumbers) -> list[str]:
        gyro, accel = (triad.xyz() for triad in imu.triads)

        def start(axis: Axis) -> float:
            return sqrt(axis.sigma**2 + axis.initial_sd**2)

        def three(axes: Sequence[Axis], value: Callable[[Axis], float]) -> str:
            return f"[{', '.join(f'{value(axis):.6e}' for axis in axes)}]"

        return [
            "imunoise:",
            f"  arw: {three(gyro, lambda axis: axis.N / ARW)}  # deg/sqrt(h)",
            f"  vrw: {three(accel, lambda axis: axis.N * sqrt(_HOUR))}  # m/s/sqrt(h)",
            f"  gbstd: {three(gyro, lambda axis: axis.sigma / DEG_H)}  # deg/h",
            f"  abstd: {three(accel, lambda axis: axis.sigma / _MGAL)}  # mGal",
            f"  corrtime: {gyro[0].tau / _HOUR:.6e}  # h",
            f"initbgstd: {three(gyro, lambda axis: start(axis) / DEG_H)}  # deg/h",
            f"initbastd: {three(accel, lambda axis: start(axis) / _MGAL)}  # mGal",
        ]
