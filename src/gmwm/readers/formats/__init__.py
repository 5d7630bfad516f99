"""One file a format: each gives tables of columns that are not read yet."""

from gmwm.readers.formats.frame import is_frame
from gmwm.readers.formats.joining import Part, has_sensors, joined, shares, with_temperature
from gmwm.readers.formats.kinds import is_text, open_tables

__all__ = [
    "Part",
    "has_sensors",
    "is_frame",
    "is_text",
    "joined",
    "open_tables",
    "shares",
    "with_temperature",
]
