"""One file a format: each gives tables of columns that are not read yet."""

from gmwm.readers.formats.joining import Part, has_sensors, joined, shares, with_temperature
from gmwm.readers.formats.kinds import CLOCKS, open_tables

__all__ = [
    "CLOCKS",
    "Part",
    "has_sensors",
    "joined",
    "open_tables",
    "shares",
    "with_temperature",
]
