"""The page of noise in motion: curves, factors over rest, coherence, vibration, and numbers."""

import os
from collections.abc import Iterator
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.files import writable_file
from gmwm._core.pages import page_of
from gmwm._core.text import brief
from gmwm._core.units import customary_unit
from gmwm.issues import worst_first
from gmwm.motion import HORIZON, INTERVAL, InMotion
from gmwm.plotting import COMPONENT_COLOURS, DATA_COLOUR
from gmwm.report.navigation import svg
from gmwm.report.page import origin, write_page

_SIZE = (4.4, 3.4)  # in, of a picture; two or three stand side by side


@page_of(InMotion)
def write_motion_report(found: InMotion, path: str | os.PathLike[str]) -> Path:
    """Write noise in motion as one HTML file that needs no network.

    Raises InputError if the file cannot be written.
    """
    path = writable_file(path)
    channels = dict.fromkeys(each.channel for each in found.curves)
    shown = found.curves[0].tau[-1] >= HORIZON
    return write_page(
        path,
        "motion.html",
        found=found,
        text=str(found),
        curves={channel: _curves(found, channel) for channel in channels},
        factors=_ranges(found, "factor", "in motion over at rest", 10.0, "times ten"),
        coherence=_ranges(found, "coherence", "coherence", 0.5, "") if len(found.imus) > 2 else {},
        vibration=_vibration(found) if found.classes else "",
        rows=list(_rows(found)) if shown else [],
        purpose=f"updates every {INTERVAL:g} s, outages up to {HORIZON:g} s",
        notices=worst_first(list(found.notices)),
        provenance=origin({}, "page of", None),
    )


def _axes(value: str, title: str) -> tuple[Any, Any]:
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=_SIZE, layout="constrained")
    ax.set(xlabel="averaging time [s]", ylabel=value, title=title, xscale="log", yscale="log")
    ax.grid(True, which="major", color="#dddddd", linewidth=0.6)
    return figure, ax


def _curves(found: InMotion, channel: str) -> str:
    """Deviations of a channel of each IMU with their 95 % bands, and the one at rest."""
    quantity = channel.partition("_")[0]
    unit, scale = customary_unit("u", quantity, "u")
    figure, ax = _axes(f"Allan deviation [{unit}]", channel)
    own = [found.curve(imu, channel) for imu in found.imus]
    for each, colour in zip(own, cycle(COMPONENT_COLOURS), strict=False):
        seen = (each.variance > 0.0) & (each.lower > 0.0)
        low, mid, high = (scale * np.sqrt(v[seen]) for v in (each.lower, each.variance, each.upper))
        ax.fill_between(each.tau[seen], low, high, color=colour, alpha=0.25, linewidth=0.0)
        ax.plot(each.tau[seen], mid, color=colour, marker="o", markersize=3.0, label=each.imu)
    if np.any(np.isfinite(own[0].static)):
        rest = scale * np.sqrt(own[0].static)
        ax.plot(own[0].tau, rest, color=DATA_COLOUR, linestyle="--", label="at rest")
    ax.legend(fontsize="small", framealpha=0.9)
    return svg(figure)


def _ranges(found: InMotion, name: str, value: str, level: float, text: str) -> dict[str, str]:
    """By sensor, the median and range over IMUs and axes of what curves have, and a level."""
    tau, pictures = found.curves[0].tau, {}
    for sensor in found.sensors:
        rows = np.array([getattr(c, name) for c in found.curves if c.quantity == sensor])
        known = np.any(np.isfinite(rows), axis=0)
        if not np.any(known):
            continue
        low, mid, high = (np.nanquantile(rows[:, known], q, axis=0) for q in (0.0, 0.5, 1.0))
        figure, ax = _axes(value, sensor)
        ax.fill_between(tau[known], low, high, color=COMPONENT_COLOURS[0], alpha=0.25, linewidth=0)
        ax.plot(tau[known], mid, color=COMPONENT_COLOURS[0], marker="o", markersize=3.0)
        ax.axhline(level, color=DATA_COLOUR, linestyle="--", linewidth=1.0)
        ax.annotate(text, (tau[0], level), (2, 3), textcoords="offset points", fontsize="small")
        if name == "coherence":
            ax.set(yscale="linear", ylim=(min(0.0, low.min()), 1.0))
        pictures[sensor] = svg(figure)
    return pictures


def _vibration(found: InMotion) -> str:
    """Vibration of the seconds of all flights, one after the other, by class."""
    import matplotlib.pyplot as plt

    flight, _, level = found.vibration.T
    figure, ax = plt.subplots(figsize=(3.0 * _SIZE[0], _SIZE[1]), layout="constrained")
    second = np.arange(len(level))
    for k, each in enumerate(found.classes):
        own = (level >= each.low) & (level <= each.high)
        label = f"{each.name}, {each.low:.2g} to {each.high:.2g} m/s²"
        ax.plot(second[own], level[own], ".", color=COMPONENT_COLOURS[k], label=label)
        ax.axhline(each.high, color=DATA_COLOUR, linestyle=":", linewidth=0.8)
    for start in np.flatnonzero(np.diff(flight)):
        ax.axvline(start + 0.5, color=DATA_COLOUR, linewidth=0.6)
    ax.set(xlabel="flights one after the other [s]", ylabel="vibration, 20 to 60 Hz [m/s²]")
    ax.set_ylim(0.0, None)
    ax.legend(fontsize="small", framealpha=0.9)
    return svg(figure)


def _rows(found: InMotion) -> Iterator[tuple[str, list[str]]]:
    """Largest N and K of axes and IMUs in motion, at each class of vibration, and at rest."""
    names = ["", *(each.name for each in found.classes), "rest"]
    for name in names:
        if name == "rest" and not found.is_known_at_rest:
            continue
        numbers = (found.at(name) if name else found).numbers()
        cells = []
        for sensor in found.sensors:
            own = [model.params for key, model in numbers.items() if key.startswith(sensor)]
            for letter, unit in (("N", "u/sqrt(Hz)"), ("K", "u/s/sqrt(Hz)")):
                value = max(each[letter] or 0.0 for each in own)
                field, scale = customary_unit(unit, sensor, "u")
                cells.append(f"{value:.2e} SI, {brief(value * scale, 2)} {field}")
        where = f"{name} vibration" if name else "all of it"
        yield "at rest" if name == "rest" else where, cells
