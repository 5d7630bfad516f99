"""Filter numbers for several outages, and the texts to copy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace

import yaml

from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.export import SENSORS, TARGETS, Axis, ImuFile, ImuNumbers, Triad, axis_of, imu_of
from gmwm.filter_numbers import bound

HORIZONS = (1.0, 10.0, 60.0, 600.0)
"""s: keyframes, a bridge, a tunnel, a long outage."""

SHOWN = 60.0
"""s: the horizon that a page opens with."""

_TITLES = {name: each.to_copy for name, each in TARGETS.items() if each.to_copy}
"""Of the files of programs, by their languages."""

_NOT_VALID = "the fit failed; do not use these numbers"


@dataclass(frozen=True)
class Certified:
    """Filter numbers for one length of outages.

    horizon: s.
    axes: The numbers of each channel for which there are some.
    triads: Gyros and accelerometers, with one value for the axes of each, where both are there.
    problem: Why a channel has none, if one has none.
    texts: Title -> text for the clipboard: the files that `gmwm.export` writes.
    notes: Why there is no text for some program.
    """

    horizon: float
    axes: Mapping[str, Axis]
    triads: tuple[Triad, ...]
    problem: str
    texts: Mapping[str, str]
    notes: tuple[str, ...]


def certified(
    calibration: Calibration, horizons: Sequence[float] | None = None
) -> dict[float, Certified]:
    """The numbers by horizon; a horizon shorter than two samples is left out."""
    longest = max((fit.wv.dt for fit in calibration.values()), default=0.0)
    found: dict[float, Certified] = {}
    imu = None
    for horizon in horizons or HORIZONS:
        if horizon >= 2.0 * longest or horizon == SHOWN:
            found[horizon], imu = _at(calibration, horizon, imu)
    return found


def _at(
    calibration: Calibration, horizon: float, before: ImuNumbers | None
) -> tuple[Certified, ImuNumbers | None]:
    """The numbers for a horizon, and the IMU that they make; ``before`` is that of another."""
    axes: dict[str, Axis] = {}
    problem = ""
    imu, why = _imu(calibration, tuple(calibration), horizon, before)
    if imu is not None:
        axes = {axis.name: axis for triad in imu.triads for axis in triad.axes}
    for name, fitted in calibration.items():
        try:
            if name not in axes:
                axes[name] = axis_of(name, bound(fitted, horizon=horizon), float("nan"), fitted)
        except InputError as error:
            problem = f"{name}: {error}"
    if imu is None and problem:  # without the channels that have none
        imu, why = _imu(calibration, tuple(axes), horizon, before)
    shown = {name: axes[name] for name in calibration if name in axes}
    invalid = {name for name in shown if not calibration[name].valid}
    texts = _by_axis(shown, invalid, horizon)
    if imu is None:
        return Certified(horizon, axes, (), problem, texts, (why,)), None
    for name, title in _TITLES.items():
        target = TARGETS[name]
        if isinstance(target, ImuFile):
            texts[title] = target.text(imu if target.shared else imu.by_axis())
    return Certified(horizon, axes, imu.triads, problem, texts, ()), imu


def _imu(
    calibration: Calibration, names: tuple[str, ...], horizon: float, before: ImuNumbers | None
) -> tuple[ImuNumbers | None, str]:
    """The IMU of some channels, or why there is none."""
    fits = {name: calibration[name] for name in names if calibration[name].wv.quantity in SENSORS}
    outlook = None if before is None else before.outlook
    try:
        given = [replace(calibration, fits=fits)]
        return imu_of(given, "N+K", horizon, horizon, shared=True, outlook=outlook), ""
    except InputError as error:
        return None, str(error)


def _by_axis(axes: Mapping[str, Axis], invalid: Set[str], horizon: float) -> dict[str, str]:
    """Plain numbers of each axis, for a filter of one's own; a comment where they are not valid."""
    if not axes:
        return {}
    values = {
        name: {
            key: float(f"{value:.6e}")
            for key, value in (("N", each.N), ("K", each.K), ("initial_sd", each.initial_sd))
        }
        for name, each in axes.items()
    }
    about = (
        f"filter numbers for outages up to {horizon:g} s: N [u/sqrt(Hz)], K [u/s/sqrt(Hz)], sd of "
        "the bias state at\n# the start [u] (add your turn-on bias); u: rad/s, m/s^2"
    )
    marks = {name: f"  # {_NOT_VALID}" if name in invalid else "" for name in values}
    lines = [f"    {name!r}: {each!r},{marks[name]}" for name, each in values.items()]
    blocks = [
        yaml.safe_dump({name: each}, sort_keys=False, allow_unicode=True).replace(
            "\n", f"{marks[name]}\n", 1
        )
        for name, each in values.items()
    ]
    return {
        "YAML, axis by axis": f"# {about}\n{''.join(blocks)}",
        "Python, axis by axis": "\n".join([f"# {about}", "imu_noise = {", *lines, "}", ""]),
    }
