"""The report of filtered real data: one HTML file with its figures inside."""

from __future__ import annotations

import os
from pathlib import Path

from gmwm._core.files import writable_file
from gmwm._core.pages import page_of
from gmwm._core.text import readable
from gmwm._core.units import SI_UNIT
from gmwm.ins.field import Comparison, Navigated, outage_pictures
from gmwm.report.page import write_page
from gmwm.report.text import duration_text, model_text
from gmwm.report.validation import svg


@page_of(Navigated)
def write_navigated_report(navigated: Navigated, path: str | os.PathLike[str]) -> Path:
    """Write the report of a solution as one HTML file that needs no network.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    path = writable_file(path)
    measured, alignment = navigated.measured, navigated.alignment
    imu, sensors = measured.imu, measured.sensors
    return write_page(
        path,
        "navigated.html",
        n=navigated,
        length=duration_text((imu.n - alignment.epoch) * imu.dt),
        track=svg(navigated.plot_track()),
        outages=[(title, svg(figure)) for title, figure in outage_pictures(navigated)],
        innovations=svg(navigated.plot_innovations()),
        tests=[(kind, navigated.test(kind)) for kind in navigated.kinds],
        models=[
            (
                axis,
                model_text(model, kind := axis.partition("_")[0]),
                readable(sensors.bias_sd[axis], SI_UNIT[kind]),
            )
            for axis, model in sensors.models.items()
        ],
    )


@page_of(Comparison)
def write_comparison_report(comparison: Comparison, path: str | os.PathLike[str]) -> Path:
    """Write the report of a comparison of sensor models as one HTML file.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    path = writable_file(path)
    return write_page(
        path,
        "comparison.html",
        c=comparison,
        length=duration_text(comparison.duration),
        errors=svg(comparison.plot()),
    )
