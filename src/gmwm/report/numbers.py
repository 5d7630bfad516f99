"""Filter numbers for outages, and the texts to copy."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass, replace

import yaml

from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.export import SENSORS, TARGETS, Axis, ImuFile, Triad, axis_of, imu_of
from gmwm.filter_numbers import HORIZON, usable

SHOWN = HORIZON
"""s: length of outages of all filter numbers on a page."""

_TITLES = {name: each.to_copy for name, each in TARGETS.items() if each.to_copy}
_NOT_VALID = "the fit failed; do not use these numbers"


@dataclass(frozen=True)
class Certified:
    """Filter numbers for outages of `SHOWN`.

    axes: The numbers of each channel for which there are some.
    triads: Gyros and accelerometers, with one value for the axes of each.
    problem: Why a channel has none, if one has none.
    texts: Title -> text for the clipboard: the files that `gmwm.export` writes.
    note: Why there is no text for programs; empty if there is.
    """

    axes: Mapping[str, Axis]
    triads: tuple[Triad, ...]
    problem: str
    texts: Mapping[str, str]
    note: str


def certified(calibration: Calibration) -> Certified:
    """The filter numbers of a calibration."""
    axes: dict[str, Axis] = {}
    problem = ""
    for name, fitted in calibration.items():
        try:
            axes[name] = axis_of(name, usable({name: fitted})[name], float("nan"), fitted)
        except InputError as error:
            problem = f"{name}: {error}"
    fits = {name: calibration[name] for name in axes if calibration[name].wv.quantity in SENSORS}
    triads = tuple(
        triad_of(quantity, own)
        for quantity in SENSORS
        if (own := {name: fit for name, fit in fits.items() if fit.wv.quantity == quantity})
    )
    texts = {}
    try:
        imu = imu_of([replace(calibration, fits=fits)], "N+K", shared=True)
        for name, title in _TITLES.items():
            target = TARGETS[name]
            if isinstance(target, ImuFile):
                texts[title] = target.text(imu if target.shared else imu.by_axis())
        why = ""
    except InputError as error:
        why = str(error)
    texts |= _by_axis(axes, {name for name in axes if not calibration[name].valid})
    return Certified(axes, triads, problem, texts, why)


def triad_of(quantity: str, fits: Mapping[str, Fit]) -> Triad:
    """The axes of a sensor with their numbers, and one value for all of them.

    Raises InputError if an axis has none.
    """
    own, shared = (usable(fits, shared=each) for each in (False, True))
    axes = tuple(axis_of(name, one, own.rate, fits[name]) for name, one in own.items())
    return Triad(quantity, axes, next(iter(shared.values())))


def _by_axis(axes: Mapping[str, Axis], invalid: Set[str]) -> dict[str, str]:
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
        f"filter numbers for outages up to {SHOWN:g} s: N [u/sqrt(Hz)], K [u/s/sqrt(Hz)], sd of "
        "the bias state at\n# the start [u] (add your turn-on bias); u: rad/s, m/s^2"
    )
    marks = {name: f"  # {_NOT_VALID}" if name in invalid else "" for name in values}
    lines = [f"    {name!r}: {each!r},{marks[name]}" for name, each in values.items()]
    as_yaml = yaml.safe_dump(values, sort_keys=False, allow_unicode=True)
    blocks = [f"{line}{marks.get(line[:-1], '')}\n" for line in as_yaml.splitlines()]
    return {
        "YAML, axis by axis": f"# {about}\n{''.join(blocks)}",
        "Python, axis by axis": "\n".join([f"# {about}", "imu_noise = {", *lines, "}", ""]),
    }
