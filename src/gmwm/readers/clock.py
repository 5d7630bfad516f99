"""A column of time stamps: is it a uniform clock, and how fast."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gmwm._typing import FloatArray
from gmwm.errors import InputError

_UNITS = {1.0: "seconds", 1e-3: "milliseconds", 1e-6: "microseconds", 1e-9: "nanoseconds"}
_AGREEMENT = 0.01
_SHORTEST_STEP = 1e-100  # in any unit; shorter ones only leave the range of floating point
_WAY_OUT = "if the samples are evenly spaced all the same, give rate= and time=False"


def agree(rate: float, other: float) -> bool:
    """Whether two rates are the same within 1 %."""
    return abs(rate / other - 1.0) <= _AGREEMENT


@dataclass(frozen=True)
class Clock:
    """Time stamps of a recording.

    Attributes
    ----------
    source, column : str
        File and column, for messages.
    stamps : (n,) ndarray
        In a unit of ``seconds``.
    seconds : float or None
        The unit, if it is known.
    where : callable
        Row -> where that is in the file.
    """

    source: str
    column: str
    stamps: FloatArray
    seconds: float | None
    where: Callable[[int], str]

    @property
    def place(self) -> str:
        """File and column, at the beginning of messages."""
        return f"{self.source}, column {self.column}"

    def rate(self, expected: float | None = None) -> tuple[float, str]:
        """Sampling rate from the first and the last stamp.

        Without a unit, the step decides: below 0.5 it is seconds, 2 to 500 milliseconds, 500 to
        5e5 microseconds, above nanoseconds; 0.5 to 2 may be 1 Hz in seconds or 1 kHz in
        milliseconds and is refused. With an expected rate, the unit is the one that fits it.

        Parameters
        ----------
        expected : float, optional
            Rate that the user or the file states, Hz.

        Returns
        -------
        rate : float
            In Hz; not rounded to what was expected.
        note : str
            One sentence on the clock: its rate, its unit, its jitter.

        Raises
        ------
        InputError
            If the stamps are not increasing or not uniform, or contradict what is expected.
        """
        with np.errstate(all="ignore"):  # extreme stamps end in an InputError, not in a warning
            steps = np.diff(self.stamps)
            self._check_increasing(steps)
            self._check_uniform(steps)
            step = float(self.stamps[-1] - self.stamps[0]) / steps.size
            jitter = float(np.std(steps))
        if not _SHORTEST_STEP < step < 1.0 / _SHORTEST_STEP:
            raise InputError(f"{self.place}: steps of {step:g} are no clock's: {_WAY_OUT}")
        seconds, guessed = self._unit(step, expected)
        rate = 1.0 / (step * seconds)
        if expected is not None and not agree(rate, expected):
            raise InputError(
                f"{self.place}: its stamps give {rate:.6g} Hz, not the {expected:.6g} Hz stated: "
                "leave out the rate to take that of the stamps, or give time=False to ignore them"
            )
        return rate, (
            f"Time stamps (column {self.column}, {_UNITS[seconds]}"
            f"{' as far as the steps tell' if guessed else ''}) give {rate:.6g} Hz; their steps "
            f"vary by {jitter * seconds:.3g} s rms ({jitter / step:.2%} of a step)."
        )

    def _check_increasing(self, steps: FloatArray) -> None:
        bad = np.flatnonzero(~(steps > 0.0))
        if bad.size:
            row = int(bad[0]) + 1
            what = "repeats the one before" if steps[row - 1] == 0.0 else "goes back"
            raise InputError(
                f"{self.place}, {self.where(row)}: time stamp {self.stamps[row]:.15g} {what}: "
                f"take such lines out, or, {_WAY_OUT}"
            )

    def _check_uniform(self, steps: FloatArray) -> None:
        median = float(np.median(steps))
        bad = np.flatnonzero(~(np.abs(steps - median) <= 0.5 * median))
        if bad.size:
            row = int(bad[0]) + 1
            raise InputError(
                f"{self.place}, {self.where(row)}: a step of {steps[row - 1]:.6g} where "
                f"{median:.6g} is usual: use a part of the file without gaps, or, {_WAY_OUT}"
            )

    def _unit(self, step: float, expected: float | None) -> tuple[float, bool]:
        """The unit in seconds, and whether it is a guess."""
        if self.seconds is not None:
            return self.seconds, False
        if expected is not None:
            return min(
                _UNITS, key=lambda unit: abs(math.log(step * unit) + math.log(expected))
            ), True
        if step < 0.5:
            return 1.0, True
        if step < 2.0:
            raise InputError(
                f"{self.place}: a step of {step:.6g} may be seconds or milliseconds: name the "
                "column time_s or time_ms, or give rate="
            )
        return (1e-3 if step < 500.0 else 1e-6 if step < 5e5 else 1e-9), True
