"""One sensor as the paper shows it: Figures 1, 5 and 6, Tables V and VI.

A gyro and an accelerometer are simulated from Table VI for 4.5 hours, as long as the paper's
recording; real recordings may take their place, or stand beside them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm import filter_numbers
from gmwm._core.files import write_text
from gmwm._core.text import plain_table, wrapped
from gmwm._core.typing import Progress
from gmwm._core.units import field_units, shown_unit
from gmwm.calibration import Calibration, calibrate
from gmwm.errors import InputError
from gmwm.estimate.result import Fit
from gmwm.plotting import DATA_COLOUR
from gmwm.process import Model
from gmwm.readers import Recording
from gmwm.study.navigation import TABLE_5, TABLE_6, Calibrated, static_recording
from gmwm.study.summary import saved

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SENSORS = ("fig1", "fig5", "fig6", "table5", "table6")

_SHOWN = ("gyro_x", "accel_z")  # of the paper's Figures 5 and 6
_HORIZON = 60.0  # s, of the paper's outage
_POINTS = 2000  # of a signal that is drawn
_STEPS = (
    "1, the signal",
    "2, its wavelet variance $\\hat\\nu^2$, half the Allan variance",
    "3 and 4, $\\nu^2(\\theta)$ calibrated to it",
)
"""Steps of the paper's Figure 1."""
_NOTES = {
    "table5": "paper: tuned by hand until the filter worked. Others: gmwm.reduce to the same form, "
    "for outages of 60 s.",
    "table6": "paper: beta is 1/tau. simulated: 4.5 h of the paper's model, its form given. "
    "selected: the same record, the form chosen by gmwm.calibrate, as for recordings.",
}


def reproduce_sensor(
    experiment: str,
    folder: Path,
    *,
    seed: int,
    recordings: Sequence[Recording] = (),
    progress: Progress | None = None,
) -> tuple[str, list[Path]]:
    """Make one of the paper's Figures 1, 5 and 6 and Tables V and VI.

    recordings: Figures are of the first, by default of a simulated sensor; tables have all of them
        beside it.
    Returns: what to print, and the files that were written.
    Raises InputError if a recording has neither gyro_x nor accel_z.
    """
    parts, stem = [_part(each) for each in recordings], folder / experiment
    is_table, forms = experiment in _NOTES, {axis: TABLE_6.models[axis].opened() for axis in _SHOWN}
    tell, total = progress or (lambda *_: None), len(parts) + 1 if is_table else 1
    tell(0, total, "")
    if not is_table:
        part = parts[0] if parts else _part(static_recording(seed))
        found = Calibrated.of(calibrate(part, None if parts else forms))
        fits = found.lines if experiment == "fig5" else found.gmwm.fits
        figure = _flow(part, fits) if experiment == "fig1" else _plots(fits)
        text = "\n\n".join(map(str, fits.values()))
        paths = saved(figure, stem)
    else:
        simulated = _part(static_recording(seed))
        columns = {"simulated": calibrate(simulated, forms)}
        if experiment == "table6":
            columns["selected"] = calibrate(simulated)
        for i, part in enumerate(parts, 1):
            tell(i, total, part.source)
            columns[part.source] = calibrate(part)
        text = _table(experiment, columns)
        paths = []
    tell(total, total, "")
    return text, [write_text(stem.with_suffix(".txt"), text), *paths]


def _part(recording: Recording) -> Recording:
    """The channels that the paper shows."""
    names = [name for name in _SHOWN if name in recording.names]
    if not names:
        raise InputError(
            f"{recording.source}: channels {' and '.join(_SHOWN)} are missing: give one of them"
        )
    return replace(recording, channels=tuple(recording[name] for name in names))


def _table(experiment: str, columns: Mapping[str, Calibration]) -> str:
    """Parameters of the paper beside those that were found, a table a sensor."""
    paper = TABLE_5 if experiment == "table5" else TABLE_6
    title = "Table V: tuned for a filter" if experiment == "table5" else "Table VI: GMWM"
    parts = [title]
    for axis in _SHOWN:
        cells = {"paper": _values(axis, paper.models[axis])}
        for name, each in columns.items():
            if axis in each.fits:
                fit = each[axis]
                cells[name] = _reduced(axis, each) if experiment == "table5" else _fitted(axis, fit)
        keys = sorted({key for column in cells.values() for key in column}, key=_place)
        rows = [[*key, *(column.get(key, "-") for column in cells.values())] for key in keys]
        parts.append(f"{axis}\n{plain_table(('', 'unit', *cells), rows)}")
    return "\n\n".join([*parts, "\n".join(wrapped(_NOTES[experiment]))])


_Column = dict[tuple[str, str], str]
"""Parameter and unit -> cell."""


def _place(row: tuple[str, str]) -> tuple[bool, str, str]:
    """White noise first, and sigma and tau of each Gauss-Markov process together."""
    name, _, number = row[0].partition("_")
    return name != "N", number or "~", name


def _values(axis: str, model: Model, stderr: Mapping[str, float] | None = None) -> _Column:
    """Cells of a model, in the units of the paper."""
    cells = {}
    for item in model.parameters:
        units = field_units(item.parameter.unit, axis.split("_")[0]) or (
            (item.parameter.unit, 1.0),
        )
        unit, scale = next((each for each in units if "Hz" in each[0]), units[0])
        error = (stderr or {}).get(item.key, np.nan)
        text = f"{(item.value or 0.0) * scale:.4g}"
        key = item.key if "_" in item.key or item.key in "NBKQR" else f"{item.key}_1"
        cells[key, unit] = text + (f" +-{error * scale:.2g}" if np.isfinite(error) else "")
    return cells


def _fitted(axis: str, fit: Fit) -> _Column:
    return _values(axis, fit.model, fit.stderr) | {("valid", ""): "yes" if fit.valid else "no"}


def _reduced(axis: str, calibration: Calibration) -> _Column:
    numbers = filter_numbers.reduce(calibration[axis], "N+GM", [_HORIZON])
    return _values(axis, numbers.model)


def _flow(part: Recording, fits: Mapping[str, Fit]) -> Figure:
    """Figure 1: from a signal by its wavelet variance to the model that implies it."""
    figure, axes = _grid(len(fits), 3, (14.4, 4.4))
    for row, (axis, fit) in zip(axes, fits.items(), strict=True):
        values, dt = part[axis].values, part.dt
        every = max(values.size // _POINTS, 1)
        means = np.nanmean(values[: values.size // every * every].reshape(-1, every), axis=1)
        unit, scale = shown_unit(fit.wv.quantity, fit.wv.unit, "field")
        row[0].plot(np.arange(means.size) * every * dt, means * scale, color=DATA_COLOUR, lw=0.7)
        row[0].set(xlabel="time [s]", ylabel=f"{axis}, means of {every * dt:.3g} s [{unit}]")
        fit.wv.plot(row[1])
        fit.plot(row[2])
        for ax, title in zip(row, _STEPS, strict=True):
            ax.set_title(f"{axis}: {title}", fontsize="medium")
    return figure


def _plots(fits: Mapping[str, Fit]) -> Figure:
    """Each fit in its Allan plot, one above the other, as in the paper."""
    figure, axes = _grid(len(fits), 1, (7.4, 5.0))
    for ax, fit in zip(axes[:, 0], fits.values(), strict=True):
        fit.plot(ax)
    return figure


def _grid(rows: int, columns: int, size: tuple[float, float]) -> tuple[Figure, Any]:
    """A figure of rows of a size in inches, and its axes."""
    import matplotlib.pyplot as plt

    size = size[0], size[1] * rows
    return plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False)
