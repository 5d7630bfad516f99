"""Pages of motion and navigation: noise in motion, validations, filtered and compared logs."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.files import writable_file
from gmwm._core.pages import page_of
from gmwm._core.text import brief, readable
from gmwm._core.units import SI_UNIT, customary_unit
from gmwm.ins.logs import Comparison, Navigated
from gmwm.ins.simulation import QUANTITIES, Ratio, Validation
from gmwm.issues import worst_first
from gmwm.motion import USES, InMotion
from gmwm.plotting import COMPONENT_COLOURS, DATA_COLOUR
from gmwm.process import Model
from gmwm.report.page import origin, svg, write_page

_CONTRADICTED = 0.01  # probability below which a filter is reported to misjudge itself
_WIDEST_BAND = 2.0  # width of a band of NEES beyond which it decides nothing
_GROUPS = ("horizontal", "vertical", "position", "velocity", "attitude", "sensors")
_COVERED = ("horizontal", "vertical")


@page_of(Validation)
def write_validation_report(validation: Validation, path: str | os.PathLike[str]) -> Path:
    """Write the report of a validation as one HTML file that needs no network."""
    path = writable_file(path)
    study, experiment = validation.study, validation.experiment
    outages = [_outage(validation, i) for i in range(len(study.outages))]
    return write_page(
        path,
        "validation.html",
        title=experiment.title,
        duration=f"{study.truth.duration:g}",
        rate=f"{1.0 / study.truth.dt:g}",
        runs=study[validation.names[0]].runs,
        seed=experiment.seed,
        notes=validation.notices,
        sentences=_sentences(validation),
        track=svg(validation.plot_track()),
        growth=svg(validation.plot_growth()) if outages else "",
        outages=outages,
        groups=_GROUPS,
        gnss_on=[(name, validation.with_gnss(name)) for name in validation.names],
        innovations=[(name, validation.innovations(name)) for name in validation.names],
        models=[(name, _models(each.models)) for name, each in experiment.filters.items()],
    )


def _models(models: Mapping[str, Model]) -> list[tuple[str, str]]:
    """Axis, and its terms with their parameters in the first unit of the field."""
    found = []
    for axis, model in models.items():
        terms: dict[int, list[str]] = {}
        for item in model.parameters:
            unit, scale = customary_unit(item.parameter.unit, axis.partition("_")[0], "u")
            text = f"{item.parameter.name} {float(item.value or 0.0) * scale:.4g} {unit}".rstrip()
            terms.setdefault(item.term, []).append(text)
        labels = model.term_labels()
        found.append((axis, "; ".join(f"{labels[i]} {', '.join(t)}" for i, t in terms.items())))
    return found


def _outage(validation: Validation, index: int) -> dict[str, Any]:
    outage = validation.study.outages[index]
    rows = [
        (f"{quantity} [{unit}]", name, validation.spreads(name)[index][quantity])
        for quantity, unit in QUANTITIES.items()
        for name in validation.reached
    ]
    found = {name: validation.at_ends(name)[index] for name in validation.names}
    return {
        "title": f"Outage of {outage.duration:g} s at {outage.start:g} s",
        "errors": svg(validation.plot_errors(index)),
        "rows": rows,
        "nees": list(found.items()),
        "coverage": [
            (part, name, each.coverage[part]) for part in _COVERED for name, each in found.items()
        ],
    }


def _sentences(validation: Validation) -> list[str]:
    """What came out, filter by filter, against the first one."""
    sentences = []
    if validation.study.outages:
        reached = validation.reached
        first = validation.names[0]
        if first in reached:
            others = [name for name in reached if name != first]
            sentences += [_compared(validation, name, first) for name in others]
        for name in reached:
            found = [each.nees["position"] for each in validation.at_ends(name)]
            end = "the outage" if len(found) == 1 else "the outages"
            sentences.append(f"At the end of {end}, {name} {_judged(found)}.")
    for name in validation.names:
        found = [validation.with_gnss(name).nees["position"]]
        if np.isfinite(found[0].value):
            sentences.append(f"With GNSS, {name} {_judged(found)}.")
    return sentences


def _compared(validation: Validation, name: str, first: str) -> str:
    d = validation.against_first(name, "horizontal")
    word, unit = ("larger than" if d.value > 0.0 else "smaller than"), " in RMS"
    if not d.significant:
        word, unit = "the same as", ""
    return (
        f"Without GNSS, the horizontal error with {name} is {word} with {first}: {d.ratio:.3g} "
        f"times{unit} (95 % interval {d.ratio_lower:.3g} to {d.ratio_upper:.3g})."
    )


def _judged(found: Sequence[Ratio]) -> str:
    """Whether a filter knows how good its position is, from its NEES at some times."""
    worst = max(found, key=lambda ratio: abs(np.log(ratio.value)))
    if any(ratio.p_value < _CONTRADICTED / len(found) for ratio in found):
        verdict = f"is {'overconfident' if worst.value > 1.0 else 'conservative'} in position"
    elif not all(ratio.upper - ratio.lower < _WIDEST_BAND for ratio in found):
        verdict = "has too few runs for a verdict"
    else:
        verdict = "is consistent in position"
    values = ", ".join(f"{ratio.value:.3g}" for ratio in found)
    return f"{verdict} (NEES per degree of freedom {values})"


@page_of(Navigated)
def write_navigated_report(navigated: Navigated, path: str | os.PathLike[str]) -> Path:
    """Write the report of a solution as one HTML file that needs no network."""
    path = writable_file(path)
    measured, alignment = navigated.measured, navigated.alignment
    imu, sensors = measured.imu, measured.sensors
    return write_page(
        path,
        "navigated.html",
        n=navigated,
        length=(imu.n - alignment.epoch) * imu.dt,
        track=svg(navigated.plot_track()),
        innovations=svg(navigated.plot_innovations()),
        tests=[(kind, navigated.test(kind)) for kind in navigated.kinds],
        models=[
            (axis, text, readable(sensors.bias_sd[axis], SI_UNIT[axis.partition("_")[0]]))
            for axis, text in _models(sensors.models)
        ],
    )


@page_of(Comparison)
def write_comparison_report(comparison: Comparison, path: str | os.PathLike[str]) -> Path:
    """Write the report of a comparison of sensor models as one HTML file."""
    path = writable_file(path)
    return write_page(path, "comparison.html", c=comparison, errors=svg(comparison.plot()))


_SIZE = (4.4, 3.4)  # in, of a picture; two or three stand side by side


@page_of(InMotion)
def write_motion_report(found: InMotion, path: str | os.PathLike[str]) -> Path:
    """Write noise in motion as one HTML file that needs no network."""
    path = writable_file(path)
    channels = dict.fromkeys(each.channel for each in found.curves)
    return write_page(
        path,
        "motion.html",
        found=found,
        text=str(found),
        curves={channel: _curves(found, channel) for channel in channels},
        factors=_ranges(found, "factor", "in motion over at rest", 10.0, "times ten"),
        coherence=_ranges(found, "coherence", "coherence", 0.5, "") if len(found.imus) > 2 else {},
        vibration=_vibration(found) if found.classes else "",
        rows=list(_rows(found)),
        purpose="updates every {:g} s and outages up to {:g} s".format(*USES[0]),
        notices=worst_first(list(found.notices)),
        provenance=origin({}, "page of", None),
    )


def _curves(found: InMotion, channel: str) -> str:
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=_SIZE, layout="constrained")
    found.plot(channel, ax=ax)
    return svg(figure)


def _ranges(found: InMotion, name: str, value: str, level: float, text: str) -> dict[str, str]:
    """By sensor, the median and range over IMUs and axes of what curves have, and a level."""
    import matplotlib.pyplot as plt

    tau, pictures = found.curves[0].tau, {}
    for sensor in found.sensors:
        rows = np.array([getattr(c, name) for c in found.curves if c.quantity == sensor])
        known = np.any(np.isfinite(rows), axis=0)
        if not np.any(known):
            continue
        low, mid, high = (np.nanquantile(rows[:, known], q, axis=0) for q in (0.0, 0.5, 1.0))
        figure, ax = plt.subplots(figsize=_SIZE, layout="constrained")
        ax.set(xlabel="averaging time [s]", ylabel=value, title=sensor, xscale="log", yscale="log")
        ax.grid(True, which="major", color="#dddddd", linewidth=0.6)
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
    rest = ["rest"] * found.is_known_at_rest
    names = [*([""] * len(USES)), *(each.name for each in found.classes), *rest]
    for name, use in zip(names, [*USES, *(USES[:1] * len(names))], strict=False):
        if not found.shows(*use):
            continue
        numbers = (found.at(name) if name else found).numbers(*use)
        cells = []
        for sensor in found.sensors:
            own = [model.params for key, model in numbers.items() if key.startswith(sensor)]
            for letter, unit in (("N", "u/sqrt(Hz)"), ("K", "u/s/sqrt(Hz)")):
                value = max(each[letter] or 0.0 for each in own)
                field, scale = customary_unit(unit, sensor, "u")
                cells.append(f"{value:.2e} SI, {brief(value * scale, 2)} {field}")
        where = f"{name} vibration" if name else "all of it"
        where = "at rest" if name == "rest" else where
        other = f"; updates every {use[0]:g} s, outages up to {use[1]:g} s" * (use != USES[0])
        yield where + other, cells
