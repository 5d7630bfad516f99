"""The unit of time stamps that state none: known where it makes them those of a sensor."""

from __future__ import annotations

import math

from gmwm.errors import InputError
from gmwm.readers import tuning

UNITS = {
    86400.0: "days",
    3600.0: "hours",
    60.0: "minutes",
    1.0: "seconds",
    1e-3: "milliseconds",
    1e-6: "microseconds",
    1e-9: "nanoseconds",
}
"""Names of units, by their seconds."""

_SHORT = dict(zip(UNITS, ("days", "h", "min", "s", "ms", "us", "ns"), strict=True))


def without_unit(
    source: str, column: str, step: float, expected: float | None = None
) -> InputError | None:
    """What stamps without a unit may be, if that is not known: seconds of a sensor are.

    source, column: For the message, ``"column 't'"``.
    step: That is usual.
    expected: Rate that is stated but fits no unit, Hz.
    """
    if tuning.LEAST_STEP <= step < tuning.LARGEST_STEP or not step > 0.0:
        return None
    slowest, fastest = tuning.RATES_OF_SENSORS
    rates = {unit: 1.0 / (step * unit) for unit in UNITS}
    likely = sorted(
        (unit for unit, rate in rates.items() if slowest <= rate <= fastest),
        key=lambda unit: abs(math.log(rates[unit]) - 0.5 * math.log(slowest * fastest)),
    )
    each = [f"{rates[unit]:.6g} Hz if they are {UNITS[unit]}" for unit in likely]
    each += [] if expected is None else [f"not the {expected:.6g} Hz stated"]
    text = ", ".join([f"{source}, {column}: steps of {step:.6g} without a unit", *each])
    name = column[8:-1] if column.endswith(("'", '"')) else "time"
    rate, called = (
        (rates[likely[0]], repr(f"{name} [{_SHORT[likely[0]]}]"))
        if likely
        else (100.0, "by its unit")
    )
    hint = f"name the column {called}, or give the sampling rate, rate={rate:.6g}"
    return InputError(text, "time-unit", hint, {"rate": rate, "column": called})
