"""Pages of navigation: validations, filtered logs and their comparisons, with figures inside."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core.files import writable_file
from gmwm._core.pages import page_of
from gmwm._core.text import readable
from gmwm._core.units import SI_UNIT, customary_unit
from gmwm.ins.logs import Comparison, Navigated
from gmwm.ins.simulation import QUANTITIES, Ratio, Validation
from gmwm.process import Model
from gmwm.report.page import write_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CONTRADICTED = 0.01  # probability below which a filter is reported to misjudge itself
_WIDEST_BAND = 2.0  # width of a band of NEES beyond which it decides nothing
_GROUPS = ("horizontal", "vertical", "position", "velocity", "attitude", "sensors")
_COVERED = ("horizontal", "vertical")


@page_of(Validation)
def write_validation_report(validation: Validation, path: str | os.PathLike[str]) -> Path:
    """Write the report of a validation as one HTML file that needs no network.

    Raises InputError if the file cannot be written.
    """
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


def svg(figure: Figure) -> str:
    """A figure as SVG text for a page; the figure is closed."""
    import matplotlib.pyplot as plt

    stream = io.StringIO()
    # Without a date and with a salt of its own, the same study gives the same file.
    with plt.rc_context({"svg.hashsalt": "gmwm", "svg.fonttype": "none"}):
        figure.savefig(stream, format="svg", metadata={"Date": None}, transparent=True)
    plt.close(figure)
    text = stream.getvalue()
    return text[text.index("<svg") :]


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
    """Write the report of a solution as one HTML file that needs no network.

    Raises InputError if the file cannot be written.
    """
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
    """Write the report of a comparison of sensor models as one HTML file.

    Raises InputError if the file cannot be written.
    """
    path = writable_file(path)
    return write_page(path, "comparison.html", c=comparison, errors=svg(comparison.plot()))
