"""Damaged text is read to what it says, by either parser; `fuzz` damages every kind of file."""

from __future__ import annotations

import random
import re

import numpy as np
import pytest

import fuzz
from gmwm.errors import InputError
from gmwm.readers import csv_table, read
from gmwm.readers.names import CANONICAL
from reading import SI

CASES = 48


def damaged(case: int) -> bytes:
    """A text of seven columns with a few things done to it."""
    rng = random.Random(case)
    rows = np.column_stack([0.01 * np.arange(70), fuzz.noise(70)])
    names = rng.choice((f"time_s,{fuzz.AXES}", f"# time_s,{fuzz.AXES}", ""))
    data = fuzz.table(rng, names, rows)
    if rng.random() < 0.3 and (b";" in data or b"\t" in data):
        data = data.replace(b".", b",")
    return fuzz.mutated_text(rng, data)


def attempt(path, **options):
    """A recording, or the message."""
    try:
        return read(path, rate=100, units=SI, time=False, **options)
    except InputError as error:
        return str(error)


def _value(cell: str) -> float:
    return np.nan if cell.lower() in ("", "na", "n/a", "#n/a", "null", "none") else float(cell)


def naive(data: bytes, delimiter: str | None, comments: str) -> np.ndarray | None:
    """The last six of seven columns by nothing but split and float.

    comments: Marks of lines before the first row that are none; below a header such a line may be a
        row, of which the column with the mark is not read.
    """
    text = data.decode("utf-8", "replace").removeprefix("\ufeff")
    rows: list[list[float]] = []
    for line in re.split("\r\n|\r|\n", text):
        if not line.strip(" \t") or (not rows and line.lstrip(" ")[0] in comments):
            continue
        if delimiter:  # between quotes it parts nothing
            line = re.sub('"[^"]*"', lambda quoted: quoted[0].replace(delimiter, "?"), line)
        # Not split(None), to which more than blanks and tabs is blank.
        fields = line.split(delimiter) if delimiter else re.split("[ \t]+", line.strip(" \t"))
        cells = [cell.strip(' \t"') for cell in fields]
        if delimiter != ",":
            cells = [cell.replace(",", ".") for cell in cells]
        try:
            # A line of words before the header has other widths.
            rows.append([_value(cell) for cell in (cells if len(cells) < 7 else cells[1:7])][-6:])
        except ValueError:
            if any(len(row) == 6 for row in rows):
                return None
            rows = []  # a line of numbers before the header
    return np.array(rows) if all(len(row) == 6 for row in rows) else None


def same_but_for(rows, found, named):
    """Whether all numbers are those of the file, but for so many that a notice takes as missing."""
    if rows is None or rows.shape != found.shape:
        return False
    gone = np.isnan(found) & ~np.isnan(rows)
    return gone.sum() == named and np.array_equal(found[~gone], rows[~gone], equal_nan=True)


def test_what_is_accepted_is_what_the_file_says(tmp_path):
    path = tmp_path / "d.csv"
    channels = {name: i for i, name in enumerate(CANONICAL, start=1)}
    accepted = 0
    for case in range(CASES):
        data = damaged(case)
        path.write_bytes(data)
        outcome = attempt(path, channels=channels)
        if isinstance(outcome, str):
            continue
        accepted += 1
        found = np.column_stack([channel.values for channel in outcome.values()])
        said = [naive(data, mark, note) for mark in (";", "\t", ",", None) for note in ("#%", "")]
        named = sum(each.values["count"] for each in outcome.notices if each.code == "sentinel")
        assert any(same_but_for(rows, found, named) for rows in said), case
    assert accepted > CASES / 4


def test_both_ways_to_parse_agree(tmp_path):
    path = tmp_path / "e.csv"
    for case in range(CASES):
        path.write_bytes(damaged(case))
        fast = attempt(path)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(csv_table, "_parse_with_arrow", lambda *_: None)
            careful = attempt(path)
        if isinstance(fast, str) or isinstance(careful, str):
            assert fast == careful, case
        else:
            assert fast.names == careful.names
            for name in fast.names:
                np.testing.assert_array_equal(fast[name].values, careful[name].values, str(case))
