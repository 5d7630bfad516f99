"""Files to recordings: one module for each kind of file.

A file becomes a `Table` (named columns, not yet read), `roles` decides which column is which
channel, `clock` turns time stamps into a rate. Whatever cannot be used raises
`gmwm.errors.InputError` with one sentence: what is wrong, where, and how to correct it.
"""

from gmwm._core.units import AUXILIARY as AUXILIARY
from gmwm.readers.cells import DATE as DATE, seconds_of as seconds_of
from gmwm.readers.csv_table import CsvTable as CsvTable
from gmwm.readers.formats import is_frame as is_frame, is_text as is_text
from gmwm.readers.missing import Missing as Missing
from gmwm.readers.names import (
    AXES as AXES,
    TIME as TIME,
    bare as bare,
    meaning as meaning,
    stated_seconds as stated_seconds,
)
from gmwm.readers.reader import read as read
from gmwm.readers.recording import (
    READING as READING,
    Channel as Channel,
    Recording as Recording,
    require_recording as require_recording,
)
from gmwm.readers.spool import load_columns as load_columns
from gmwm.readers.table import label as label
from gmwm.readers.text_file import content_size as content_size
from gmwm.readers.turning import (
    block_means as block_means,
    steady_turn as steady_turn,
    turning_gravity as turning_gravity,
)
