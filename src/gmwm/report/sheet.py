"""The page of a data sheet: models that agree with it, and numbers for a filter."""

from __future__ import annotations

import os
from pathlib import Path

from gmwm._core.files import writable_file
from gmwm._core.pages import page_of
from gmwm.datasheet import Datasheet
from gmwm.filter_numbers import FilterNumbers
from gmwm.report.navigation import svg
from gmwm.report.page import origin, write_page


@page_of(Datasheet)
def write_sheet_report(
    sheet: Datasheet, path: str | os.PathLike[str], numbers: FilterNumbers, answer: str = ""
) -> Path:
    """Write what a data sheet says as one HTML file that needs no network.

    numbers: Of `Datasheet.numbers`.
    answer: Text about them.

    Raises InputError if the file cannot be written.
    """
    import matplotlib.pyplot as plt

    path = writable_file(path)
    pictures = {}
    for sensor in numbers:
        figure, axes = plt.subplots(figsize=(7.0, 4.6), layout="constrained")
        sheet.plot(sensor, numbers, ax=axes)
        pictures[sensor] = svg(figure)
    known = {"data sheet": sheet.document or sheet.name}
    text = sheet.text(form=numbers.form, horizon=numbers.horizon)
    return write_page(
        path,
        "sheet.html",
        sheet=sheet,
        pictures=pictures,
        text=f"{answer or numbers.text()}\n\n{text}",
        provenance=origin(known, "page of", None),
    )
