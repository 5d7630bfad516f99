"""Files to recordings: one module for each kind of file.

A file becomes a `Table` (named columns, not yet read), `roles` decides which column is which
channel, `clock` turns time stamps into a rate. Whatever cannot be used raises
`gmwm.errors.InputError` with one sentence: what is wrong, where, and how to correct it.
"""

from gmwm._core.units import AUXILIARY
from gmwm.readers.at_rest import (
    TurningGravity,
    block_means,
    steady_turn,
    turning_gravity,
)
from gmwm.readers.blocks import notices_of_blocks, read_blocks
from gmwm.readers.cells import DATE, seconds_of
from gmwm.readers.csv_table import CsvTable
from gmwm.readers.formats import is_frame, is_text
from gmwm.readers.names import AXES, TIME, bare, meaning, stated_seconds
from gmwm.readers.reader import read
from gmwm.readers.recording import READING, Channel, Recording
from gmwm.readers.table import label
from gmwm.readers.text_file import content_size

__all__ = [
    "AUXILIARY",
    "AXES",
    "DATE",
    "READING",
    "TIME",
    "Channel",
    "CsvTable",
    "Recording",
    "TurningGravity",
    "bare",
    "block_means",
    "content_size",
    "is_frame",
    "is_text",
    "label",
    "meaning",
    "notices_of_blocks",
    "read",
    "read_blocks",
    "seconds_of",
    "stated_seconds",
    "steady_turn",
    "turning_gravity",
]
