"""The report of a validation by navigating: one HTML file with its figures inside."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gmwm
from gmwm.files import written
from gmwm.ins.consistency import Consistency
from gmwm.ins.outage_errors import QUANTITIES
from gmwm.ins.validation import Validation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_GROUPS = ("position", "velocity", "attitude", "sensors")


def write_validation_report(validation: Validation, path: str | os.PathLike[str]) -> Path:
    """Write the report of a validation as one HTML file that needs no network.

    Parameters
    ----------
    validation : Validation
    path : path-like

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("gmwm", "report"), autoescape=True, undefined=StrictUndefined
    )
    study, experiment = validation.study, validation.experiment
    outages = [_outage(validation, i) for i in range(len(study.outages))]
    text = environment.get_template("validation.html").render(
        title=experiment.title,
        version=gmwm.__version__,
        duration=f"{study.truth.duration:g}",
        rate=f"{1.0 / study.truth.dt:g}",
        runs=study[validation.names[0]].runs,
        seed=experiment.seed,
        notes=study.notes,
        names=validation.names,
        sentences=_sentences(validation),
        track=svg(validation.plot_track()),
        growth=svg(validation.plot_growth()) if outages else "",
        outages=outages,
        groups=_GROUPS,
        gnss_on=[(name, _cells(validation.with_gnss(name))) for name in validation.names],
        innovations=[(name, validation.innovations(name)) for name in validation.names],
        models=[(name, models.models) for name, models in experiment.filters.items()],
    )
    with written(path) as stream:
        stream.write(text)
    return Path(path)


def svg(figure: Figure) -> str:
    """A figure as SVG text for a page; the figure is closed."""
    import matplotlib.pyplot as plt

    stream = io.StringIO()
    # Without a date, the same study gives the same file.
    figure.savefig(stream, format="svg", metadata={"Date": None})
    plt.close(figure)
    text = stream.getvalue()
    return text[text.index("<svg") :]


def _outage(validation: Validation, index: int) -> dict[str, Any]:
    outage = validation.study.outages[index]
    rows = []
    for quantity, unit in QUANTITIES.items():
        for name in validation.names:
            rows.append((f"{quantity} [{unit}]", name, validation.spreads(name)[index][quantity]))
    found = {name: validation.at_ends(name)[index] for name in validation.names}
    return {
        "title": f"Outage of {outage.duration:g} s at {outage.start:g} s",
        "errors": svg(validation.plot_errors(index)),
        "rows": rows,
        "nees": [(name, _cells(each)) for name, each in found.items()],
        "coverage": [(name, each.coverage["position"]) for name, each in found.items()],
    }


def _cells(consistency: Consistency) -> list[tuple[str, bool]]:
    """NEES of each group as text, and whether it lies in its band."""
    cells = []
    for group in _GROUPS:
        ratio = consistency.nees.get(group)
        cells.append(("-", True) if ratio is None else (f"{ratio.value:.3g}", ratio.within))
    return cells


def _sentences(validation: Validation) -> list[str]:
    """What came out, filter by filter, against the first one."""
    if not validation.study.outages:
        return []
    first, sentences = validation.names[0], []
    for name in validation.names[1:]:
        d = validation.against_first(name, "horizontal")
        interval = f"95 % interval {d.ratio_lower:.3g} to {d.ratio_upper:.3g}"
        if d.significant:
            word = "larger" if d.value > 0.0 else "smaller"
            sentences.append(
                f"Without GNSS, the horizontal error with {name} is {word} than with {first}: "
                f"{d.ratio:.3g} times the root mean square ({interval})."
            )
        else:
            sentences.append(
                f"Without GNSS, there is no difference to be seen between the horizontal errors "
                f"with {name} and with {first}: {d.ratio:.3g} times the root mean square "
                f"({interval})."
            )
    for name in validation.names:
        ends = validation.at_ends(name)
        values = [each.nees["position"].value for each in ends]
        worst = max(values, key=lambda value: abs(value - 1.0))
        fine = all(each.nees["position"].within for each in ends)
        verdict = "knows how good its position is" if fine else (
            "believes its position to be better than it is" if worst > 1.0
            else "believes its position to be worse than it is"
        )  # fmt: skip
        sentences.append(
            f"At the end of the outages, {name} {verdict} (NEES per degree of freedom "
            + ", ".join(f"{value:.3g}" for value in values)
            + ")."
        )
    return sentences
