"""What every kind of file offers to the reader: columns, not yet read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError

READABLE = (
    "gmwm reads CSV and other delimited text (plain or .gz), NPY and NPZ, ROS bags, PX4 and "
    "ArduPilot logs, MAT, HDF5, Parquet and Feather"
)
"""For messages about files of another kind."""


LARGEST = 1e150
"""Magnitudes from here on are refused like infinities: their squares overflow."""


class Table(Protocol):
    """A file of columns of equal length.

    source: The file's name, for messages.
    names: One for each column, as written in the file; ``""`` where a column has none.
    tentative: Whether the names come from a comment and may be something else.
    rate: Sampling rate that the file itself states, Hz.
    notices: What was noticed while opening it.
    """

    @property
    def source(self) -> str: ...
    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def tentative(self) -> bool: ...
    @property
    def rate(self) -> float | None: ...
    @property
    def notices(self) -> tuple[Notice, ...]: ...

    def load(self, columns: Sequence[int]) -> dict[int, FloatArray]:
        """Read some columns, by their indices, each once.

        Returns: finite values, NaN where a sample is missing.
        """

    def segments(self, columns: Sequence[int], rows: int) -> Iterator[dict[int, FloatArray]]:
        """The same, about ``rows`` at a time."""

    def where(self, row: int) -> str:
        """Say where a row of data is, e.g. ``"line 12"``."""


def label(names: Sequence[str], index: int) -> str:
    """How messages call a column: its name, or its place if it has none."""
    if names[index]:
        return repr(names[index])
    return f"{index} (counted from 0)"


def column_of(table: Table, index: int) -> str:
    """How messages call a column, or the stamps of messages that have no columns of their own."""
    stamps: str = getattr(table, "stamps", "")
    return stamps or f"column {label(table.names, index)}"


def damage_notice(source: str, what: str, is_taken: bool | None) -> Notice:
    """What is to be said of a damaged file of which what is there is taken.

    what: Is wrong with it, and where.
    is_taken: Whether the caller asks for that; None if it cannot be asked for.
    Raises InputError, with the code "damaged" if it can be, unless it is.
    """
    if is_taken is None:
        raise InputError(f"{source} {what}: get a whole copy")
    if not is_taken:
        hint = "get a whole copy, or take what is there, damaged=True"
        raise InputError(f"{source} {what}", "damaged", hint)
    return Notice("damaged", "warning", "", f"the file {what}; what is there is used")


def usable(values: FloatArray) -> bool:
    """Whether every value is missing (NaN) or finite and of sane magnitude."""
    # Without an array as long as the values.
    most, least = np.fmax.reduce(values, initial=0.0), np.fmin.reduce(values, initial=0.0)
    return bool(least > -LARGEST and most < LARGEST)
