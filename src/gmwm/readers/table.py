"""A file as columns that are not read yet: what every format gives to the reader."""

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from types import ModuleType

import numpy as np

from gmwm._core import memory
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
from gmwm.readers import tuning
from gmwm.readers.names import Meaning, meaning

LARGEST = 1e150  # magnitudes from here on are rejected like infinities: their squares overflow
Columns = dict[int, FloatArray]  # index of a column -> its values, NaN where a sample is missing


@dataclass(frozen=True, eq=False, kw_only=True)
class Table(ABC):
    """Columns of equal length."""

    source: str  # name of the file, for messages
    # One for each column, as written in the file; ``""`` where a column has none.
    names: tuple[str, ...]
    rate: float | None = None  # sampling rate that the file states, Hz
    rows: float = 0.0  # number of rows expected before the file is read; 0 if unknown
    tentative: bool = False  # whether the names come from a comment and may be something else
    # What was noticed while opening and reading the file.
    notices: list[Notice] = field(default_factory=list)
    # Column of time stamps -> what was subtracted from them, so that they keep their digits.
    origins: dict[int, int] = field(default_factory=dict)
    stamps: str = ""  # what messages call the time stamps, where they are no column of the file
    imu: str = ""  # of a log of several IMUs, the one whose sensors these are
    origin: str = "the names of the columns"  # what says the units, for messages

    @cached_property
    def meanings(self) -> tuple[Meaning, ...]:
        """What the name of each column says."""
        return tuple(map(meaning, self.names))

    @abstractmethod
    def segments(self, columns: Sequence[int], rows: int) -> Iterator[Columns]:
        """Columns by their indices, about ``rows`` rows at a time, or one whole column at a time.

        Raises InputError if a column cannot be read, or holds anything but usable numbers.
        """

    def where(self, row: int) -> str:
        """The place of a row of data, e.g. ``"line 12"``."""
        return f"row {row} (counted from 0)"

    def column(self, index: int) -> str:
        """How messages call a column."""
        return self.stamps or f"column {label(self.names, index)}"

    def load(self, columns: Sequence[int]) -> Columns:
        """Read some columns, each once, into memory; rejected with "memory" if it is too small."""
        samples, held = self.rows * len(columns), 0
        memory.require(tuning.BYTES_PER_SAMPLE * samples, self.source)
        allowed = memory.budget()
        parts: dict[int, list[FloatArray]] = {column: [] for column in columns}
        for block in self.segments(columns, tuning.ROWS_OF_BLOCK):
            for column, values in block.items():
                parts[column].append(values)
                held += values.size
            if tuning.BYTES_PER_SAMPLE * held > allowed:
                memory.require(tuning.BYTES_PER_SAMPLE * max(samples, held), self.source)

        def joined(some: list[FloatArray]) -> FloatArray:
            return some[0] if len(some) == 1 else np.concatenate([np.zeros(0), *some])

        return {column: joined(parts.pop(column)) for column in columns}

    def check_usable(self, column: int, values: FloatArray, first: int) -> None:
        """Reject infinite values and those too large for use; ``first`` is the row of the first."""
        if not usable(values):
            rows = np.flatnonzero(np.abs(values) >= LARGEST)
            place = f"column {label(self.names, column)}, {self.where(first + int(rows[0]))}"
            raise InputError(
                f"{self.source}, {place}: {values[rows[0]]} is not a usable number"
                f"{more_such(rows.size)}: cut the file before that row, or save NaN if the sample "
                "is missing"
            )


def label(names: Sequence[str], index: int) -> str:
    """How messages call a column: its name, or its place if it has none."""
    return repr(names[index]) if names[index] else f"{index} (counted from 0)"


def more_such(count: int) -> str:
    """How messages count what they name the first of."""
    return f", and {count - 1:,} more such" if count > 1 else ""


def usable(values: FloatArray) -> bool:
    """Whether every value is missing (NaN) or finite and of sane magnitude."""
    # Without an array as long as the values.
    most, least = np.fmax.reduce(values, initial=0.0), np.fmin.reduce(values, initial=0.0)
    return bool(least > -LARGEST and most < LARGEST)


def damage_notice(source: str, what: str, is_taken: bool | None) -> Notice:
    """Notice about a damaged file whose rest is used (``is_taken``); it is rejected otherwise."""
    if is_taken is None:
        raise InputError(f"{source} {what}: get a whole copy")
    if not is_taken:
        hint = "get a whole copy, or read the rest with damaged=True"
        raise InputError(f"{source} {what}", "damaged", hint)
    return notice("damaged", what=what)


@contextmanager
def damage_named(
    source: str, say: str | Callable[[Exception], str] = "is damaged or cut off: save it again"
) -> Iterator[None]:
    """Turn whatever a library raises about a file into one sentence, which ends as ``say``."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy's, about headers of old versions
            yield
    except InputError:
        raise
    except MemoryError as error:
        raise InputError(f"{source}: {memory.OUT_OF_MEMORY}", "memory") from error
    except PermissionError as error:
        raise InputError(f"{source} cannot be read: check its permissions") from error
    except Exception as error:  # libraries raise a dozen types for damaged bytes
        if isinstance(error, ValueError) and "object" in str(error).lower():
            text = f"{source} holds Python objects, which are not loaded"
            raise InputError(f"{text}: save arrays of numbers") from error
        raise InputError(f"{source} {say if isinstance(say, str) else say(error)}") from error


def library(module: str, extra: str, source: str) -> ModuleType:
    """Import a library of an extra of this package, which a file needs."""
    try:
        return import_module(module)
    except ImportError as error:
        text = f"{source} needs {module.partition('.')[0]}, which is not installed"
        raise InputError(f"{text}: pip install 'gmwm[{extra}]'", "extra") from error
