"""The pictures of docs/real-data.md; ``real_data.py`` writes them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from real_data_recording import (
    ACCELEROMETERS,
    BUMPS,
    CHANNELS,
    NUMBERS,
    PIECES,
    Recorded,
    parts_of,
    peaks_of_pieces,
    shown_unit,
    spectrum_of,
)

from gmwm import Calibration, Fit
from gmwm.plotting.deviation import COMPONENT_COLOURS, SUM_COLOUR, deviation_range

SECONDS_SHOWN = 4.0  # around the shock
MARKERS = ("o", "^", "s", "D")
_LINE_SEGMENT = 1 << 15  # samples: 0.003 Hz resolve the line
_LONGEST_BAR = 5.0  # of the value; the last level has no upper end to speak of


def allan_picture(together: Calibration) -> Figure:
    """Allan deviations of the recordings with the joint model."""
    return _six_panels(together, _draw_deviations)


def residual_picture(together: Calibration) -> Figure:
    """How far the deviations of the recordings are from the joint model, in per cent."""
    return _six_panels(together, _draw_misfits)


def _six_panels(together: Calibration, draw: Callable[[Axes, str, Fit], None]) -> Figure:
    """One panel a channel, gyros above accelerometers."""
    figure, axes = plt.subplots(2, 3, figsize=(9.6, 6.2), layout="constrained", sharex=True)
    for name, ax in zip(CHANNELS, axes.ravel(), strict=True):
        draw(ax, name, together[name])
        ax.set_xscale("log")
        _dress(ax, name)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), fontsize="small")
    for ax in axes[1]:
        ax.set_xlabel("averaging time [s]")
    return figure


def _dress(ax: Axes, title: str) -> None:
    ax.set_title(title, fontsize="medium")
    ax.grid(True, which="major", color="#cccccc", linewidth=0.6)
    ax.set_axisbelow(True)


def _draw_deviations(ax: Axes, name: str, fit: Fit) -> None:
    unit, one = shown_unit(name)
    curve = np.sqrt(2.0 * fit.implied) / one
    ax.plot(fit.wv.tau, curve, color=SUM_COLOUR, linewidth=1.6, label="joint model", zorder=2)
    shown = [curve]
    for number, part, colour, marker in zip(
        NUMBERS, parts_of(fit), COMPONENT_COLOURS, MARKERS, strict=False
    ):
        wv = part.wv
        value, low, high = (np.sqrt(2.0 * v) / one for v in (wv.variance, wv.lower, wv.upper))
        bars = np.abs(
            [value - np.minimum(low, value), np.minimum(high, _LONGEST_BAR * value) - value]
        )
        ax.errorbar(
            wv.tau, value, yerr=bars, fmt=marker, color=colour, markersize=4.0,
            markerfacecolor="none", elinewidth=0.8, label=f"recording {number}", zorder=3,
        )  # fmt: skip
        shown.append(value)
    ax.set_yscale("log")
    ax.set_ylim(*deviation_range(np.concatenate(shown)))
    ax.set_ylabel(f"Allan deviation [{unit}]")


def _draw_misfits(ax: Axes, name: str, fit: Fit) -> None:
    parts = parts_of(fit)
    chance = 100.0 * 1.96 / np.sqrt(2.0 * parts[0].wv.dof)
    ax.fill_between(parts[0].wv.tau, -chance, chance, color="#dddddd", label="95 % of chance")
    for number, part, colour, marker in zip(
        NUMBERS, parts, COMPONENT_COLOURS, MARKERS, strict=False
    ):
        curve = np.sqrt(2.0 * fit.implied[: part.wv.tau.size])
        ax.plot(
            part.wv.tau, 100.0 * (part.wv.allan_deviation / curve - 1.0), marker + "-",
            color=colour, markersize=4.0, linewidth=1.0, markerfacecolor="none",
            label=f"recording {number}",
        )  # fmt: skip
    ax.axhline(0.0, color=SUM_COLOUR, linewidth=0.8)
    ax.set_yscale("symlog", linthresh=10.0, linscale=2.0)
    ax.set_ylim(-100.0, 100.0)
    ticks = (-100, -30, -10, -5, 0, 5, 10, 30, 100)
    ax.set_yticks(ticks, [f"{tick:+d}" if tick else "0" for tick in ticks])
    ax.minorticks_off()
    ax.set_ylabel("data less joint model [%]")


def spectrum_picture(recorded: Sequence[Recorded]) -> Figure:
    """The line of accel_x, the peak of gyro_z, and where both broad peaks are as time goes."""
    figure, (line, peak, course) = plt.subplots(1, 3, figsize=(10.5, 3.7), layout="constrained")
    for r, colour, marker in zip(recorded, COMPONENT_COLOURS, MARKERS, strict=False):
        label = f"recording {r.number}"
        _draw_spectrum(line, r, "accel_x", colour, label, _LINE_SEGMENT)
        _draw_spectrum(peak, r, "gyro_z", colour, label)
        hours = (np.arange(PIECES) + 0.5) / PIECES * r.raw.duration / 3600.0
        gyro, accelerometer = (peaks_of_pieces(r.clean[name], BUMPS[name]) for name in BUMPS)
        course.plot(hours, gyro, marker + "-", color=colour, markersize=4.5)
        course.plot(hours, 2.0 * accelerometer, marker + ":", color=colour, markersize=4.5,
                    markerfacecolor="none")  # fmt: skip
    line.set_xlim(0.4, 0.75)
    line.set_yscale("log")
    line.legend(fontsize="small")
    _dress(line, "accel_x: a line with sidebands")
    peak.set_xlim(5.0, 50.0)
    _dress(peak, "gyro_z: a peak near 20 Hz")
    course.plot([], [], "o-", color=SUM_COLOUR, label="gyro_z")
    course.plot([], [], "o:", color=SUM_COLOUR, markerfacecolor="none", label="twice accel_x")
    course.legend(fontsize="small")
    course.set_xlabel("time [h]")
    course.set_ylabel("frequency of the peak [Hz]")
    _dress(course, "the peak wanders, in both sensors alike")
    return figure


def _draw_spectrum(
    ax: Axes, r: Recorded, name: str, colour: str, label: str, length: int | None = None
) -> None:
    unit, one = shown_unit(name)
    channel = r.clean[name]
    frequency, density = spectrum_of(channel, length) if length else spectrum_of(channel)
    ax.plot(frequency, np.sqrt(density) / one, color=colour, linewidth=0.9, label=label)
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel(f"density [{unit}/sqrt(Hz)]")


def shock_picture(r: Recorded) -> Figure:
    """The largest shock: rates and specific forces less their means, and what is left out."""
    event = r.largest_event("gyro")
    centre = 0.0 if event is None else event.values["time"]
    figure, axes = plt.subplots(2, 1, figsize=(7.0, 4.6), layout="constrained", sharex=True)
    samples = slice(*(round((centre + s * SECONDS_SHOWN / 2.0) / r.raw.dt) for s in (-1.0, 1.0)))
    time = np.arange(samples.start, samples.stop) * r.raw.dt
    for ax, names in zip(axes, (CHANNELS[:3], ACCELEROMETERS), strict=True):
        unit, one = shown_unit(names[0])
        for name, colour in zip(names, COMPONENT_COLOURS, strict=False):
            channel = r.raw[name]
            values = (np.asarray(channel.values, dtype=float) - channel.mean) / one
            ax.plot(time, values[samples], color=colour, linewidth=1.1, label=name)
        out = np.any([np.isnan(r.clean[name].values[samples]) for name in names], axis=0)
        ax.fill_between(time, 0.0, 1.0, where=out, color="#e4e4e4", zorder=0,
                        transform=ax.get_xaxis_transform(),
                        label="left out of one axis or more")  # fmt: skip
        ax.set_ylabel(f"less the mean [{unit}]")
        ax.legend(fontsize="small", loc="lower left")
        _dress(ax, "")
    axes[0].set_title(f"the shock in recording {r.number}", fontsize="medium")
    axes[1].set_xlabel("time [s]")
    return figure
